//! Runs the experiment of a table, unless its records are there, and judges what it expects.

use raystone_bench::run::{Existing, Registries, RunError, RunOptions, run};
use raystone_config::{ConfigError, Plan};
use raystone_record::PARTIAL;
use raystone_report::repro::Source;
use raystone_report::repro::table::{
    Reproduced, Settings, TableError, is_done, is_of, judged, prepare,
};
use raystone_report::{ReportError, write_report};
use thiserror::Error;

/// Why a table has no verdicts.
#[derive(Debug, Error)]
pub enum ReproError {
    /// Its file or its records are wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// Its plan is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// It could not be run.
    #[error(transparent)]
    Run(#[from] RunError),
    /// Its report cannot be written.
    #[error(transparent)]
    Report(#[from] ReportError),
}

/// Runs a table unless its records are there, and judges it.
///
/// # Errors
/// A fault of its file, or a run that ends early.
pub fn reproduce(
    source: &Source,
    settings: &Settings,
    registries: &Registries,
    options: &RunOptions,
) -> Result<Reproduced, ReproError> {
    let prepared = prepare(source, settings, &registries.catalogue())?;
    let out = settings.out.join(source.name);
    if settings.force || !is_done(&out, &prepared.experiment.text) {
        let experiment = &prepared.experiment;
        let randomised = |s: &_, d: &_| registries.is_randomised(s, d);
        let plan = Plan::new(experiment, &[], randomised)?;
        let mut options = options.clone();
        options.out = out.clone();
        options.existing = if !settings.force && is_of(&out.join(PARTIAL), &experiment.text) {
            Existing::Resume
        } else {
            Existing::Replace
        };
        run(experiment, &plan, registries, &options)?;
        write_report(&out)?;
    }
    Ok(judged(source.name, settings.quick, prepared, &out)?)
}
