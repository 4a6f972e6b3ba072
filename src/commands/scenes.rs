//! `raystone scenes`.

use super::output::{OutputArguments, print, print_json};
use anyhow::Result;
use clap::Args;
use raystone::repro::scenes::{MODELS, directory};
use serde_json::{Value, json};
use std::path::PathBuf;
use std::process::ExitCode;

/// List the models that experiments of theses use: what is there, what is missing, licence and source
#[derive(Args)]
pub struct Scenes {
    /// Folder of models [default: ../shared/scenes if it is there, else raystone/scenes in the user's data]
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

impl Scenes {
    pub fn execute(self) -> Result<ExitCode> {
        let directory = directory(self.scenes.as_deref());
        let is_there = |path: &str| directory.join(path).is_file();
        if self.output.json {
            let models = MODELS.iter().map(|model| {
                json!({
                    "path": model.path,
                    "there": is_there(model.path),
                    "triangles": model.triangles,
                    "licence": model.licence,
                    "from": model.from,
                })
            });
            let models: Vec<Value> = models.collect();
            print_json(
                "scenes",
                json!({ "directory": directory, "models": models }),
            )?;
            return Ok(ExitCode::SUCCESS);
        }
        let mut text = format!("scene directory: {}\n", directory.display());
        for model in &MODELS {
            text += &format!(
                "  {:8} {}  {} triangles\n             licence: {}\n             from:    {}\n",
                if is_there(model.path) {
                    "there"
                } else {
                    "missing"
                },
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
