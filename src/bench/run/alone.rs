//! Measurements without a scene, prepared and checked but not timed, for `raystone verify`.

use super::built_in::{Run, run_of};
use super::error::RunError;
use super::kernels::Kernels;
use super::measurement::{Absent, At};
use super::options::RunOptions;
use super::progress::Progress;
use super::registries::Registries;
use raystone_config::{Axis, Experiment, Plan};

/// Verdict on a cell of a measurement, for `raystone verify`.
#[derive(Debug, Clone)]
pub struct VerifiedMeasurement {
    /// Name of the cell.
    pub name: String,
    /// What is wrong.
    pub fault: Option<String>,
}

/// Prepares every cell without a scene that the plan's measurements have: each is checked as before it is timed, against the host
/// or what is known of it. What the adapter refuses is left out.
///
/// # Errors
/// No adapter, or kernels that cannot be read.
pub fn verify_measurements(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<Vec<VerifiedMeasurement>, RunError> {
    let device = Kernels::load(&plan.kernels, registries)?.open(options)?;
    let at = At {
        experiment,
        registries,
        stage: None,
        device: &device,
        traced: Vec::new(),
        refused: Vec::new(),
        progress: Progress::new(options),
    };
    let mut verified = Vec::new();
    let all = registries.measurements.iter();
    for measurement in all.filter(|m| matches!(run_of(*m), Run::CellByCell)) {
        let mut cells = measurement.cells(experiment, plan);
        cells.retain(|cell| cell.get(Axis::Scene).is_none());
        for group in cells.chunk_by(|a, b| measurement.group(a) == measurement.group(b)) {
            let mut preparation = measurement.prepare(&at, group);
            for cell in group {
                let fault = match preparation.next() {
                    Some(Err(Absent::Refused(_))) => continue,
                    Some(Err(Absent::Failed(fault))) => Some(fault),
                    Some(Ok(_)) => None,
                    None => Some("nothing was prepared of it".to_owned()),
                };
                let name = measurement.unit_name(cell);
                verified.push(VerifiedMeasurement { name, fault });
            }
        }
    }
    at.progress.bar.finish_and_clear();
    Ok(verified)
}
