//! `raystone stress`.

use super::arguments::{DeviceArguments, ValueArguments, as_typed, listed, on_axis, plan, warn_of};
use super::faults::plant_faults;
use super::output::OutputArguments;
use super::run::carry_out;
use anyhow::{Result, anyhow, bail};
use clap::Args;
use raystone::config::expect::Thesis;
use raystone::config::{Axis, Experiment, STRESS};
use raystone::run::Existing;
use raystone::scene::named;
use raystone::stress::{EXPERIMENT, family_names};
use raystone::text::did_you_mean_or_known;
use std::path::PathBuf;
use std::process::ExitCode;

/// Run the numerical stress suite: every triangle test and structure on what rounding makes hard
///
/// Short for `raystone run experiments/stress.toml`, which is built in: writes records and a page, prints tables and targets,
/// and ends with 1 if the default configuration misses one.
#[derive(Args)]
pub struct Stress {
    /// Few rungs and shots: a minute at most
    #[arg(long)]
    quick: bool,
    /// Triangle tests, such as `watertight,integer`; may be given many times [default: all]
    #[arg(long)]
    triangle: Vec<String>,
    /// Structures, such as `bvh,cwbvh`; may be given many times; brute force always takes part [default: all]
    #[arg(long)]
    accel: Vec<String>,
    /// Families, such as `edges,shots`; may be given many times [default: all]
    #[arg(long)]
    family: Vec<String>,
    /// Rays per case [default: 512, quick 128]
    #[arg(long, value_name = "N")]
    rays: Option<u32>,
    /// Shots at each closed mesh, 0 for none [default: 1000000, quick 16384]
    #[arg(long, value_name = "N")]
    shots: Option<u32>,
    /// Seed of everything random
    #[arg(
        long,
        value_name = "N",
        default_value_t = 1,
        allow_negative_numbers = true
    )]
    seed: u32,
    /// A model to shoot at from inside, its holes closed [default: none]
    #[arg(long, value_name = "FILE")]
    model: Option<PathBuf>,
    /// In a checkout, run the planted faults instead: each must turn a check red; takes --out and --adapter
    #[arg(long)]
    mutants: bool,
    /// Folder for the records and the page
    #[arg(long, short, value_name = "DIR", default_value = "results/stress")]
    out: PathBuf,
    #[command(flatten)]
    device: DeviceArguments,
    #[command(flatten)]
    output: OutputArguments,
}

/// Always included: the others are compared with it.
const BRUTE_FORCE: &str = "brute-force";
/// The experiment's name in messages.
const FILE: &str = "experiments/stress.toml";

/// Returns the families of a flag.
///
/// # Errors
/// A name that no family has.
fn families(named: &[String]) -> Result<Vec<String>> {
    let known: Vec<&str> = family_names().collect();
    let checked = listed(named).map(|name| {
        if !known.contains(&name) {
            bail!(
                "--family: unknown family `{name}`{}",
                did_you_mean_or_known(name, &known)
            );
        }
        Ok(name.to_owned())
    });
    checked.collect()
}

impl Stress {
    pub fn execute(self) -> Result<ExitCode> {
        if self.mutants {
            return plant_faults(&self.out, self.device.adapter.as_ref());
        }
        if let Some(model) = &self.model {
            // A requested model must exist; the default one may be missing.
            warn_of(&named(&model.to_string_lossy())?);
        }
        let registries = raystone::registries();
        let overrides = self.overrides()?;
        let catalogue = registries.catalogue();
        let experiment = Experiment::parse(EXPERIMENT, FILE, &overrides, &catalogue)
            .map_err(|error| anyhow!(as_typed(error.to_string(), &overrides)))?;
        let plan = plan(&experiment, &[], &registries)?;
        let values = ValueArguments {
            set: Vec::new(),
            allow_outside: false,
        };
        let mut options = self.device.options(self.out, &values, false);
        options.existing = Existing::Replace;
        carry_out(
            "stress",
            &experiment,
            &plan,
            &registries,
            &options,
            &self.output,
            false,
        )
    }

    /// Returns the options, laid over the experiment.
    fn overrides(&self) -> Result<Vec<String>> {
        let mut overrides = Vec::from_iter(self.device.kernels_override());
        if self.quick {
            overrides.extend(Thesis::parse(EXPERIMENT, FILE)?.unwrap_or_default().quick);
        }
        overrides.extend(on_axis(Axis::Triangle, listed(&self.triangle)));
        if !self.accel.is_empty() {
            let others = listed(&self.accel).filter(|name| *name != BRUTE_FORCE);
            overrides.extend(on_axis(
                Axis::Accel,
                [BRUTE_FORCE].into_iter().chain(others),
            ));
        }
        if !self.family.is_empty() {
            let shots = self
                .shots
                .filter(|shots| *shots > 0)
                .map(|_| "shots".to_owned());
            let parts = families(&self.family)?.into_iter().chain(shots);
            let parts = parts.map(|part| format!("{STRESS}{part}"));
            overrides.extend(on_axis(Axis::Integrator, parts));
        }
        overrides.extend(self.rays.map(|rays| format!("stress.rays={rays}")));
        overrides.extend(self.shots.map(|shots| format!("stress.shots={shots}")));
        overrides.push(format!("run.seed={}", self.seed));
        if let Some(model) = &self.model {
            let model = toml::Value::from(model.display().to_string());
            overrides.push(format!("stress.model={model}"));
        }
        Ok(overrides)
    }
}
