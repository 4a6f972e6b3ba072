//! `raystone help`: pages of the command line, and files for other programs.

use super::CommandLine;
use super::arguments::unknown;
use super::output::{print, tell};
use anyhow::{Context as _, Result, anyhow};
use clap::{Args, Command, CommandFactory as _};
use clap_complete::Shell;
use raystone::export::record_schema;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Print this page or that of a command; completions for a shell, manual pages, the JSON Schema of records
#[derive(Args)]
#[group(multiple = false)]
pub struct Help {
    /// Command
    command: Option<String>,
    /// Print what makes a shell complete commands and flags: `source <(raystone help --completions bash)`
    #[arg(long, value_name = "SHELL")]
    completions: Option<Shell>,
    /// Write raystone.1 and a manual page for each command into this folder; made if it is missing
    #[arg(long, value_name = "DIR")]
    man: Option<PathBuf>,
    /// Print the JSON Schema of the records of a run
    #[arg(long)]
    schema: bool,
}

impl Help {
    pub fn execute(self) -> Result<ExitCode> {
        let mut program = CommandLine::command();
        program.build();
        if let Some(folder) = &self.man {
            write_pages(program, folder)?;
        } else if self.schema {
            print(&format!("{:#}\n", record_schema()))?;
        } else if let Some(shell) = self.completions {
            let mut script = Vec::new();
            clap_complete::generate(shell, &mut program, "raystone", &mut script);
            print(&String::from_utf8_lossy(&script))?;
        } else if let Some(name) = &self.command {
            let known = || program.get_subcommands().map(Command::get_name);
            let refusal = unknown(name, known());
            let command = program.find_subcommand_mut(name);
            let command = command.ok_or_else(|| anyhow!("{refusal}"))?;
            print(&command.render_long_help().to_string())?;
        } else {
            print(&program.render_long_help().to_string())?;
        }
        Ok(ExitCode::SUCCESS)
    }
}

fn write_pages(program: Command, folder: &Path) -> Result<()> {
    let name = folder.display();
    std::fs::create_dir_all(folder).with_context(|| format!("cannot make {name}"))?;
    clap_mangen::generate_to(program, folder)
        .with_context(|| format!("cannot write into {name}"))?;
    tell(&format!("manual pages in {name}"));
    Ok(())
}
