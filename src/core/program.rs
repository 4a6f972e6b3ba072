//! Identity of the measuring program.

/// Version and commit of a program, as stored in records and files.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Program {
    /// Package version.
    pub version: &'static str,
    /// Commit it was built from, if known.
    pub commit: Option<&'static str>,
    /// True if the working tree had uncommitted changes at build time.
    pub dirty: Option<bool>,
}

/// The library alone, from an unknown commit; programs supply their own.
impl Default for Program {
    fn default() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: None,
            dirty: None,
        }
    }
}
