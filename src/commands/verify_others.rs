//! What `raystone verify` checks without a file beside structures, integrators and samplers at their defaults: kernels that
//! parameters choose, and those of measurements without a scene.

use super::arguments::plan;
use super::verify::faults;
use anyhow::Result;
use raystone::config::{Experiment, Plan};
use raystone::run::{
    Registries, RunOptions, Verified, VerifiedMeasurement, verify, verify_measurements,
};
use serde_json::{Value, json};

/// Experiments of structures, tests and paths, with their names in messages.
const GATED: [(&str, &str); 4] = [
    (
        "kernels of structures",
        include_str!("verify_others/structures.toml"),
    ),
    (
        "tests of triangles and boxes",
        include_str!("verify_others/tests.toml"),
    ),
    (
        "triangles with masks",
        include_str!("verify_others/masks.toml"),
    ),
    (
        "organisations of paths",
        include_str!("verify_others/paths.toml"),
    ),
];
/// The experiment of measurements without a scene.
const MEASURED: (&str, &str) = (
    "measurements without a scene",
    include_str!("verify_others/measurements.toml"),
);

/// Verdicts on all of them.
#[derive(Default)]
pub struct Others {
    /// Structures, and the integrators through them.
    pub gated: Vec<Verified>,
    /// Cells of measurements.
    pub measured: Vec<VerifiedMeasurement>,
}

impl Others {
    /// What is wrong, with the cell in question.
    pub fn faults(&self) -> Vec<String> {
        let gated = self.gated.iter().filter(|one| !one.refused);
        let of_gate = gated.clone().flat_map(|one| {
            let faults = faults(&one.verdict).into_iter();
            faults.map(move |fault| format!("{}: {fault}", one.cell))
        });
        let paths = gated.flat_map(|one| &one.paths);
        let of_paths = paths.filter_map(|(cell, p)| Some(format!("{cell}: {}", p.fault.as_ref()?)));
        let measured = self.measured.iter();
        let of_measured =
            measured.filter_map(|m| Some(format!("{}: {}", m.name, m.fault.as_ref()?)));
        of_gate.chain(of_paths).chain(of_measured).collect()
    }

    /// Faults, a line each, then how much was checked; empty if nothing was.
    pub fn text(&self) -> String {
        if self.gated.is_empty() && self.measured.is_empty() {
            return String::new();
        }
        let mut lines = self.faults();
        let paths: usize = self.gated.iter().map(|one| one.paths.len()).sum();
        lines.push(format!(
            "beside the defaults {} structures, {paths} integrators and {} cells of measurements were checked: {}",
            self.gated.len(),
            self.measured.len(),
            match lines.len() {
                0 => "nothing is wrong".to_owned(),
                count => format!("faults: {count}"),
            }
        ));
        lines.join("\n") + "\n"
    }

    /// How many were checked, and the faults.
    pub fn as_json(&self) -> Value {
        let paths: usize = self.gated.iter().map(|one| one.paths.len()).sum();
        json!({
            "structures": self.gated.len(),
            "integrators": paths,
            "measurements": self.measured.len(),
            "faults": self.faults(),
        })
    }
}

/// Checks them; `set` are values laid over each experiment, such as a folder of kernels.
///
/// # Errors
/// No adapter, or kernels that cannot be read.
pub fn verify_others(
    set: &[String],
    registries: &Registries,
    options: &RunOptions,
) -> Result<Others> {
    let mut others = Others::default();
    for of in GATED {
        let (experiment, plan) = planned(of, set, registries)?;
        let rays = experiment.gate.rays;
        let gated = verify(&experiment, &plan, registries, options, rays, false)?;
        others.gated.extend(gated);
    }
    let (experiment, plan) = planned(MEASURED, set, registries)?;
    others.measured = verify_measurements(&experiment, &plan, registries, options)?;
    Ok(others)
}

fn planned(
    (name, text): (&str, &str),
    set: &[String],
    registries: &Registries,
) -> Result<(Experiment, Plan)> {
    let experiment = Experiment::parse(text, name, set, &registries.catalogue())?;
    let plan = plan(&experiment, &[], registries)?;
    Ok((experiment, plan))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_of_them_can_be_planned() {
        let registries = raystone::registries();
        for of in GATED {
            let (_, plan) = planned(of, &[], &registries).unwrap();
            let least = if of.0.contains("paths") || of.0.contains("masks") {
                1
            } else {
                4
            };
            assert!(plan.structures.len() >= least, "{of:?}");
        }
        let (experiment, plan) = planned(MEASURED, &[], &registries).unwrap();
        let names = registries.measurements.iter();
        let cells: usize = names.map(|m| m.cells(&experiment, &plan).len()).sum();
        assert!(cells > 70, "{cells} cells");
    }
}
