//! Arguments that several commands share.

use clap::Args;
use raystone::config::{Catalogue, Variant};
use raystone::gpu::AdapterChoice;
use raystone::run::RunOptions;
use raystone::scene::SceneError;
use std::io::IsTerminal as _;
use std::path::PathBuf;

/// Where kernels come from and run.
#[derive(Args)]
pub struct DeviceArguments {
    /// Adapter, by its number in `raystone list adapter` or a part of its name [default: discrete
    /// before integrated before virtual before software]
    #[arg(long, value_name = "INDEX|NAME")]
    pub adapter: Option<AdapterChoice>,
    /// Folder of kernels (*.wesl) that replace or join the embedded ones
    #[arg(long, value_name = "DIR")]
    pub kernels: Option<PathBuf>,
}

impl DeviceArguments {
    /// Options of the library; a progress bar needs a terminal.
    pub fn options(&self, out: PathBuf, quiet: bool) -> RunOptions {
        RunOptions {
            out,
            adapter: self.adapter.clone().unwrap_or_default(),
            kernels: self.kernels.clone(),
            warn: Some(super::output::warn),
            progress: !quiet && std::io::stderr().is_terminal(),
            ..RunOptions::default()
        }
    }
}

/// Changes of an experiment.
#[derive(Args)]
pub struct ExperimentArguments {
    /// Value laid over the file: `--set run.replicates=16`, `--set axes.accel=bvh,roped-bvh`; the
    /// last one of a key counts
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Keep the cells that fit: `--only 'accel=*bvh,sequence=sobol'`; patterns of one axis are
    /// alternatives
    #[arg(long, value_name = "AXIS=PATTERN,…")]
    pub only: Vec<String>,
    /// Let glTF models name files outside their folder, and OBJ models absolute paths
    #[arg(long)]
    pub allow_outside: bool,
}

/// An override `key=value` whose value is this text, whatever characters are in it.
pub fn text_override(key: &str, value: &str) -> String {
    format!("{key}={}", toml::Value::from(value))
}

/// An override `key=value` whose value is the list of these texts.
pub fn list_override(key: &str, values: &[String]) -> String {
    format!("{key}={}", toml::Value::from(values.to_vec()))
}

/// Checks that the models among the scenes can be opened, before minutes are spent on other cells.
///
/// # Errors
/// The first model that cannot be read.
pub fn check_models(scenes: &[Variant], catalogue: &Catalogue) -> Result<(), SceneError> {
    for scene in scenes {
        if catalogue.scene.iter().any(|entry| entry.name == scene.name) {
            continue;
        }
        if let Err(source) = std::fs::File::open(&scene.name) {
            let path = PathBuf::from(&scene.name);
            return Err(SceneError::Read { path, source });
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn overrides_keep_quotes_and_commas_of_a_text() {
        let text = text_override("axes.scene", r#"a,"b".obj"#);
        let value: toml::Table = text.parse().unwrap();
        assert_eq!(value["axes"]["scene"].as_str(), Some(r#"a,"b".obj"#));
    }
}
