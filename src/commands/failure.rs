//! How a command fails: one sentence on standard error and an exit code.

use super::output::tell;
use raystone::config::ConfigError;
use raystone::gpu::GpuError;
use raystone::report::ReportError;
use raystone::run::RunError;
use raystone::scene::SceneError;
use std::process::ExitCode;

/// A gate or a cell failed; everything else was done.
pub const FAILED: u8 = 1;
/// Bad usage or input.
pub const BAD_INPUT: u8 = 2;

/// No usable adapter.
pub const NO_ADAPTER: u8 = 3;

/// Why a command could not do its work, and the exit code that says so.
pub struct Failure {
    code: u8,
    cause: anyhow::Error,
}

impl Failure {
    /// Bad usage or input.
    pub fn input(cause: impl Into<anyhow::Error>) -> Self {
        Self {
            code: BAD_INPUT,
            cause: cause.into(),
        }
    }

    /// An adapter that does not do what every command needs.
    pub fn no_adapter(cause: impl Into<anyhow::Error>) -> Self {
        Self {
            code: NO_ADAPTER,
            cause: cause.into(),
        }
    }

    /// Writes `error: …` to standard error; the exit code to end with.
    pub fn tell(self) -> ExitCode {
        tell(&format!("error: {}", sentence(&self.cause)));
        ExitCode::from(self.code)
    }
}

/// The chain of causes behind colons, without those that the sentence already holds: many messages
/// quote their cause themselves.
fn sentence(cause: &anyhow::Error) -> String {
    let mut text = String::new();
    for part in cause.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = part;
        } else if !text.contains(&part) {
            text = format!("{text}: {part}");
        }
    }
    text
}

impl From<RunError> for Failure {
    fn from(error: RunError) -> Self {
        Self {
            code: error.exit_code(),
            cause: error.into(),
        }
    }
}

impl From<GpuError> for Failure {
    fn from(error: GpuError) -> Self {
        RunError::from(error).into()
    }
}

impl From<ConfigError> for Failure {
    fn from(error: ConfigError) -> Self {
        Self::input(error)
    }
}

impl From<SceneError> for Failure {
    fn from(error: SceneError) -> Self {
        Self::input(error)
    }
}

impl From<ReportError> for Failure {
    fn from(error: ReportError) -> Self {
        Self::input(error)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use anyhow::Context as _;

    #[test]
    fn a_cause_that_its_message_quotes_is_said_once() {
        let source = std::io::Error::from(std::io::ErrorKind::NotFound);
        let quoted = source.to_string();
        let error = ConfigError::Read {
            path: "a.toml".into(),
            source,
        };
        let text = sentence(&error.into());
        assert_eq!(text.matches(&quoted).count(), 1, "{text}");
    }

    #[test]
    fn a_cause_that_its_message_leaves_out_is_added() {
        let error: anyhow::Result<()> = Err(anyhow::anyhow!("disk full"));
        let text = sentence(&error.context("cannot save").unwrap_err());
        assert_eq!(text, "cannot save: disk full");
    }
}
