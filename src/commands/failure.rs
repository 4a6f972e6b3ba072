//! Failure of a command: one sentence on standard error and an exit code.

use super::output::tell_marked;
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
    let code = match error.downcast::<GpuError>() {
        Ok(error) => RunError::from(error).exit_code(),
        Err(error) => error.downcast_ref().map_or(BAD_INPUT, RunError::exit_code),
    };
    ExitCode::from(code)
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
