//! Standard output and standard error.

use anyhow::{Context as _, Result};
use std::io::{ErrorKind, Write as _};

/// Writes `text` to standard output.
///
/// A reader that went away (`raystone list | head`) has what it wanted: that is no failure, and the
/// exit code still tells how the command ended.
pub fn print(text: &str) -> Result<()> {
    let mut output = std::io::stdout().lock();
    match output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush())
    {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
    .context("cannot write to standard output")
}

/// Writes a line to standard error. A terminal that went away is no reason to end: what is measured
/// counts.
pub fn tell(text: &str) {
    let _ = writeln!(std::io::stderr().lock(), "{text}");
}

/// Writes `warning: …` to standard error.
pub fn warn(text: &str) {
    tell(&format!("warning: {text}"));
}
