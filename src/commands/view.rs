//! `raystone view`.

use anyhow::{Context as _, Result, bail};
use clap::Args;
use std::env::consts::EXE_SUFFIX;
use std::ffi::OsString;
use std::io::ErrorKind;
use std::path::PathBuf;
use std::process::{Command, ExitCode};

/// The program of the window, which nothing else is built with.
const PROGRAM: &str = "raystone-view";

/// Open a window onto structures and samplers at work
#[derive(Args)]
#[command(disable_help_flag = true)]
pub struct View {
    /// Arguments of `raystone-view`; `--help` lists them
    #[arg(trailing_var_arg = true, allow_hyphen_values = true)]
    arguments: Vec<OsString>,
}

impl View {
    pub fn execute(self) -> Result<ExitCode> {
        let program = beside().unwrap_or_else(|| PROGRAM.into());
        let ended = match Command::new(program).args(&self.arguments).status() {
            Err(error) if error.kind() == ErrorKind::NotFound => bail!(
                "`{PROGRAM}` is neither beside this program nor on the PATH; in a clone of Raystone, `scripts/view` builds and opens it"
            ),
            ended => ended.with_context(|| format!("cannot start {PROGRAM}"))?,
        };
        // Without a code, a signal ended it.
        let code = ended.code().and_then(|code| u8::try_from(code).ok());
        Ok(ExitCode::from(code.unwrap_or(1)))
    }
}

/// Returns the program beside this one, if it is there.
fn beside() -> Option<PathBuf> {
    let file = std::env::current_exe()
        .ok()?
        .with_file_name(format!("{PROGRAM}{EXE_SUFFIX}"));
    file.is_file().then_some(file)
}
