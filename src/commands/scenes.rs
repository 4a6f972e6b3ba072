//! `raystone scenes`.

use super::output::print;
use anyhow::Result;
use clap::Args;
use raystone::repro::scenes::{MODELS, directory};
use std::path::PathBuf;
use std::process::ExitCode;

/// List the models that experiments of theses use: what is there, what is missing, licence and source
#[derive(Args)]
pub struct Scenes {
    /// Folder of models [default: ../shared/scenes if it is there, else raystone/scenes in the user's data]
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
}

impl Scenes {
    pub fn execute(self) -> Result<ExitCode> {
        let directory = directory(self.scenes.as_deref());
        let mut text = format!("scene directory: {}\n", directory.display());
        for model in &MODELS {
            let there = directory.join(model.path).is_file();
            text += &format!(
                "  {:8} {}  {} triangles\n             licence: {}\n             from:    {}\n",
                if there { "there" } else { "missing" },
                model.path,
                model.triangles,
                model.licence,
                model.from
            );
        }
        print(&text)?;
        Ok(ExitCode::SUCCESS)
    }
}
