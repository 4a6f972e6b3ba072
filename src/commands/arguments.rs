//! Arguments that several commands share.

use anyhow::Result;
use clap::Args;
use raystone::config::{Axis, Experiment, Plan};
use raystone::gpu::{self, AdapterChoice, Gpu, KernelLibrary};
use raystone::run::{Registries, RunOptions, kernel_library};
use raystone::scene::{SceneData, check_model};
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};

/// Where kernels come from and run.
#[derive(Args)]
pub struct DeviceArguments {
    /// Adapter, by its number in `raystone list adapter` or a part of its name [default: discrete
    /// before integrated before virtual before software]
    #[arg(long, value_name = "INDEX|NAME")]
    pub adapter: Option<AdapterChoice>,
    /// Folder of kernels (*.wesl) that replace or join the embedded ones; in an experiment short for
    /// `--set axes.kernels=["DIR"]`
    #[arg(long, value_name = "DIR")]
    pub kernels: Option<PathBuf>,
}

impl DeviceArguments {
    /// Options of the library; a progress bar needs a terminal.
    pub fn options(&self, out: PathBuf, values: &ValueArguments, quiet: bool) -> RunOptions {
        RunOptions {
            program: raystone::PROGRAM,
            out,
            allow_outside: values.allow_outside,
            adapter: self.adapter.clone().unwrap_or_default(),
            warn: Some(super::output::warn),
            tell: (!quiet).then_some(super::output::tell as fn(&str)),
            progress: !quiet && std::io::stderr().is_terminal(),
            ..RunOptions::default()
        }
    }

    /// The folder of kernels as an override of an experiment.
    pub fn kernels_override(&self) -> Option<String> {
        let folder = self.kernels.as_ref()?.display().to_string();
        Some(list_override("axes.kernels", &[folder]))
    }

    /// Opens the adapter with the kernels.
    ///
    /// # Errors
    /// No adapter, or kernels that cannot be read.
    pub fn open(&self, registries: &Registries) -> Result<Gpu> {
        let kernels = match &self.kernels {
            Some(folder) => kernel_library(folder, registries)?,
            None => KernelLibrary::default(),
        };
        Ok(gpu::open(
            &self.adapter.clone().unwrap_or_default(),
            kernels,
        )?)
    }
}

/// Values laid over those of an experiment.
#[derive(Args)]
pub struct ValueArguments {
    /// Value laid over the file or the defaults: `--set run.replicates=16`, `--set axes.accel=bvh,roped-bvh`,
    /// `--set camera.eye=[0,1,5]`; the last one of a key counts
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Let glTF models name files outside their folder, and OBJ models absolute paths
    #[arg(long)]
    pub allow_outside: bool,
}

/// Changes of an experiment.
#[derive(Args)]
pub struct ExperimentArguments {
    #[command(flatten)]
    pub values: ValueArguments,
    /// Keep the cells that fit: `--only 'accel=*bvh,uniform-grid,sequence=sobol'`; patterns of one axis are
    /// alternatives
    #[arg(long, value_name = "AXIS=PATTERN,…")]
    pub only: Vec<String>,
}

/// An override `key=value` whose value is the list of these texts, whatever characters are in them.
pub fn list_override(key: &str, values: &[String]) -> String {
    format!("{key}={}", toml::Value::from(values.to_vec()))
}

/// The plan of an experiment whose models look like models: told before minutes are spent on other cells.
///
/// # Errors
/// Cells that do not fit together, and the first model that is none.
pub fn plan(experiment: &Experiment, only: &[String], registries: &Registries) -> Result<Plan> {
    let plan = Plan::new(experiment, only, |s, d| registries.is_randomised(s, d))?;
    let catalogue = registries.catalogue();
    let is_model = |name: &str| {
        catalogue[Axis::Scene]
            .iter()
            .all(|entry| entry.name != name)
    };
    for scene in plan.scenes.iter().filter(|scene| is_model(&scene.name)) {
        check_model(Path::new(&scene.name))?;
    }
    Ok(plan)
}

/// Warns of everything that makes a scene differ from its file.
pub fn warn_of(scene: &SceneData) {
    for line in scene.report.lines() {
        super::output::warn(&format!("{}: {line}", scene.name));
    }
}
