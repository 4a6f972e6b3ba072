//! Which program measures.

/// Version and commit of a program, as records and files keep them.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Program {
    /// Version of the package.
    pub version: &'static str,
    /// Commit that it was built from, when known.
    pub commit: Option<&'static str>,
    /// Whether the working tree had uncommitted changes when it was built.
    pub dirty: Option<bool>,
}

/// The library alone, built from who knows which commit: programs give their own.
impl Default for Program {
    fn default() -> Self {
        Self {
            version: env!("CARGO_PKG_VERSION"),
            commit: None,
            dirty: None,
        }
    }
}
