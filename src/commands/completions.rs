//! `raystone completions` and `raystone man`.

use super::CommandLine;
use super::output::{print, tell};
use anyhow::{Context as _, Result};
use clap::{Args, CommandFactory as _};
use clap_complete::Shell;
use std::path::PathBuf;
use std::process::ExitCode;

/// Print what makes a shell complete the commands and flags of raystone
#[derive(Args)]
pub struct Completions {
    /// Shell: `source <(raystone completions bash)`
    shell: Shell,
}

impl Completions {
    pub fn execute(self) -> Result<ExitCode> {
        let mut script = Vec::new();
        clap_complete::generate(
            self.shell,
            &mut CommandLine::command(),
            "raystone",
            &mut script,
        );
        print(&String::from_utf8_lossy(&script))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// Write manual pages: raystone.1 and one for each command
#[derive(Args)]
pub struct Man {
    /// Folder to write into; made if it is missing
    dir: PathBuf,
}

impl Man {
    pub fn execute(self) -> Result<ExitCode> {
        let folder = self.dir.display().to_string();
        std::fs::create_dir_all(&self.dir).with_context(|| format!("cannot make {folder}"))?;
        clap_mangen::generate_to(CommandLine::command(), &self.dir)
            .with_context(|| format!("cannot write into {folder}"))?;
        tell(&format!("manual pages in {folder}"));
        Ok(ExitCode::SUCCESS)
    }
}
