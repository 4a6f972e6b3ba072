//! What there is to measure: the experiment of the page.

use raystone_bench::run::Registries;
use raystone_config::{Experiment, Plan};

/// The experiment, embedded.
pub const EXPERIMENT: &str = include_str!("../../experiments/web.toml");
/// Its name in records.
pub const FILE: &str = "experiments/web.toml";

/// The experiment with `overrides` (`section.key=value`), and its cells among those that `only` (`axis=pattern`) names.
///
/// # Errors
/// An override or a filter is wrong.
pub fn plan(
    registries: &Registries,
    overrides: &[String],
    only: &[String],
) -> Result<(Experiment, Plan), String> {
    let experiment = Experiment::parse(EXPERIMENT, FILE, overrides, &registries.catalogue());
    let experiment = experiment.map_err(|e| e.to_string())?;
    let plan = Plan::new(&experiment, only, |s, d| registries.is_randomised(s, d));
    Ok((experiment, plan.map_err(|e| e.to_string())?))
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_config::{Axis, Cell};

    #[test]
    fn the_page_measures_every_structure_on_some_scene_and_renders_nothing() {
        let registries = Registries::default();
        let (experiment, plan) = plan(&registries, &[], &[]).unwrap();
        assert_eq!(experiment.name, "web");
        // Those that answer rays together have no traversal that a kernel can import, and `auto` is one of the others.
        let left_out = ["ray-hierarchy", "divide-and-conquer", "auto"];
        let measured = registries.accel.iter();
        for kind in measured.filter(|kind| !left_out.contains(&kind.name())) {
            let on = |cell: &&Cell| cell[Axis::Accel].name == kind.name();
            assert!(
                plan.structures.iter().any(|cell| on(&cell)),
                "{}",
                kind.name()
            );
        }
        assert!(plan.samplers.is_empty() && plan.times.is_empty() && plan.streams.is_empty());
    }
}
