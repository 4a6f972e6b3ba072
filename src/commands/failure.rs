//! Failure of a command: one sentence on standard error and an exit code.

use super::output::{tell, tell_marked};
use raystone::gpu::GpuError;
use raystone::run::RunError;
use std::process::ExitCode;

/// A gate or a cell failed; everything else was done.
pub const FAILED: u8 = 1;
/// Bad usage or input: every error but those of a run and of the device, which have codes of their own.
pub const BAD_INPUT: u8 = 2;
/// No usable adapter.
pub const NO_ADAPTER: u8 = 3;

/// Returns the exit code of a completed command; `well` if it found nothing wrong.
pub fn ended(well: bool) -> ExitCode {
    if well {
        ExitCode::SUCCESS
    } else {
        ExitCode::from(FAILED)
    }
}

/// Writes `error: …` to standard error.
pub fn tell_error(error: &anyhow::Error) {
    tell_marked("error:", 31, &sentence(error));
}

/// Writes an error; returns the exit code.
pub fn end(error: anyhow::Error) -> ExitCode {
    tell_error(&error);
    if error.chain().any(is_no_adapter) {
        let asked = std::env::var(BACKEND).unwrap_or_default();
        narrowed(&asked).iter().for_each(|hint| tell(hint));
    }
    let code = match error.downcast::<GpuError>() {
        Ok(error) => RunError::from(error).exit_code(),
        Err(error) => error.downcast_ref().map_or(BAD_INPUT, RunError::exit_code),
    };
    ExitCode::from(code)
}

/// The variable that leaves out all other backends.
const BACKEND: &str = "WGPU_BACKEND";

fn is_no_adapter(cause: &(dyn std::error::Error + 'static)) -> bool {
    let of_run = match cause.downcast_ref() {
        Some(RunError::Gpu(error)) => Some(error),
        _ => None,
    };
    matches!(cause.downcast_ref().or(of_run), Some(GpuError::NoAdapter))
}

/// Returns the line that says that another backend was asked for.
fn narrowed(asked: &str) -> Option<String> {
    let line = format!(
        "{BACKEND}={asked} leaves out all other backends (there are vulkan, gl, metal and dx12): try without it"
    );
    (!asked.is_empty()).then_some(line)
}

/// Joins the chain of causes by colons, without those that the sentence already holds: many messages quote their
/// cause themselves.
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_backend_that_was_asked_for_is_named_where_no_adapter_answers() {
        assert_eq!(narrowed(""), None);
        let hint = narrowed("vulcan").unwrap_or_default();
        assert!(hint.starts_with("WGPU_BACKEND=vulcan "), "{hint}");
        let run = anyhow::Error::from(RunError::from(GpuError::NoAdapter));
        assert!(run.chain().any(is_no_adapter));
        assert!(
            anyhow::Error::from(GpuError::NoAdapter)
                .chain()
                .any(is_no_adapter)
        );
        assert!(!anyhow::anyhow!("another").chain().any(is_no_adapter));
    }
}
