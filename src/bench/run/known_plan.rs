//! The plan of a known experiment, made anew before any is carried out: what a plan forgets is missing from every figure, and
//! nothing fails.

use super::registries::Registries;
use super::{adaptive, known_scenes, known_settings, known_turns};
use crate::{animation, coherence, ray_sets};
use raystone_config::{Axis, Cell, Experiment, Plan, split_outside_brackets};

/// Two excludes leave a decorrelation to each sequence, one a structure to a scene, one a sequence to a structure.
const TEXT: &str = r#"
    [run]
    name = "known"
    resolution = [80, 60]
    replicates = 3
    seed = 7
    spp = { pow2 = [1, 3] }
    [axes]
    scene = ["cornell-box", "displaced-sphere"]
    accel = ["bvh", "cwbvh", "kd-tree"]
    sequence = ["pixel-hash", "sobol"]
    decorrelation = ["none", "cranley-patterson"]
    integrator = ["path"]
    [[exclude]]
    sequence = "pixel-hash"
    decorrelation = "cranley-patterson"
    [[exclude]]
    sequence = "sobol"
    decorrelation = "none"
    [[exclude]]
    scene = "!cornell-box"
    accel = "kd-tree"
    [[exclude]]
    accel = "!cwbvh"
    sequence = "sobol"
    [reference]
    spp = 800
    seed = 5
    [timing]
    rounds = 7
    rays = 2048
"#;
const OVERRIDE: &str = "run.replicates=4";
/// Two names, of which each has a list and another parameter.
const NAMES: &str = "bvh(a=[1, 2], b=3),kd-tree(c=4, d=[(5, 6), 7])";

/// By hand; the first seed of the reference is that of PCG's output function (Jarzynski and Olano 2020) of 5. Of 2 · 3 · 2 · 2 = 24 cells the excludes name 2 · 3, 2 · 3,
/// 4, of which 2 are out already, and 2 · 2 · 2, of which 5 are; 7 are left.
const EXPECTED: &str = "\
80 × 60, spp [2, 4, 8], seeds [7, 8, 9, 10], 8 others from 2161170183, 7 rounds of 2048 rays, reference 800
structures: cornell-box bvh, cornell-box cwbvh, cornell-box kd-tree, displaced-sphere bvh, displaced-sphere cwbvh
samplers: cornell-box pixel-hash none 4, cornell-box sobol cranley-patterson 4, \
displaced-sphere pixel-hash none 4, displaced-sphere sobol cranley-patterson 4
times: cornell-box bvh pixel-hash, cornell-box cwbvh pixel-hash, cornell-box cwbvh sobol, cornell-box kd-tree pixel-hash, \
displaced-sphere bvh pixel-hash, displaced-sphere cwbvh pixel-hash, displaced-sphere cwbvh sobol
streams: pixel-hash none, sobol cranley-patterson
renders: 16 of 28
left out: 6, 6, 2, 3";

/// Makes the plan.
///
/// # Errors
/// It is not what it should be: the first line that is another. Or tiles are ended otherwise, turns reported wrongly, figures
/// kept that do not hold, scenes moved or rays set off otherwise.
pub fn check() -> Result<(), String> {
    adaptive::check()?;
    known_turns::check()?;
    known_scenes::check()?;
    known_settings::check()?;
    animation::check_known()?;
    coherence::check_origins()?;
    ray_sets::readings::check_known()?;
    raystone_gpu::check_sizes()?;
    raystone_gpu::check_span()?;
    let names = split_outside_brackets(NAMES, ',').count();
    if names != 2 {
        return Err(format!(
            "`{NAMES}` is {names} names, and should be two: this program chooses other cells than it is asked for; build it anew, and \
             report what stays wrong"
        ));
    }
    let found = planned(TEXT)?;
    let mut pairs = found.lines().zip(EXPECTED.lines());
    match pairs.find(|(found, expected)| found != expected) {
        None => Ok(()),
        Some((found, expected)) => Err(format!(
            "the plan of a known experiment has `{found}` in place of `{expected}`: this program measures something else than \
             it is asked for; build it anew, and report what stays wrong"
        )),
    }
}

fn planned(text: &str) -> Result<String, String> {
    let registries = Registries::default();
    let catalogue = registries.catalogue();
    let experiment = Experiment::parse(
        text,
        "a known experiment",
        &[OVERRIDE.to_owned()],
        &catalogue,
    );
    let experiment = experiment.map_err(|e| e.to_string())?;
    let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
    let plan = plan.map_err(|e| e.to_string())?;
    let names = |cells: &[Cell], axes: &[Axis], further: &dyn Fn(&Cell) -> String| {
        let name = |cell: &Cell| {
            let names: Vec<&str> = axes.iter().map(|axis| cell[*axis].name.as_str()).collect();
            names.join(" ") + &further(cell)
        };
        cells.iter().map(name).collect::<Vec<_>>().join(", ")
    };
    let nothing = |_: &Cell| String::new();
    let (scene, accel, sequence) = (Axis::Scene, Axis::Accel, Axis::Sequence);
    let samplers = [scene, sequence, Axis::Decorrelation];
    let replicates = |cell: &Cell| format!(" {}", plan.renders(cell));
    let (run, seeds) = (&experiment.run, experiment.seeds());
    let left_out: Vec<String> = plan.skipped.iter().map(|s| s.cells.to_string()).collect();
    let lines = [
        format!(
            "{} × {}, spp {:?}, seeds {:?}, {} others from {}, {} rounds of {} rays, reference {}",
            run.resolution[0],
            run.resolution[1],
            run.spp.counts().collect::<Vec<u32>>(),
            seeds.replicates,
            seeds.reference_parts.len(),
            seeds.reference_parts.first().copied().unwrap_or_default(),
            experiment.timing.rounds,
            experiment.timing.rays,
            experiment.reference.spp
        ),
        format!(
            "structures: {}",
            names(&plan.structures, &[scene, accel], &nothing)
        ),
        format!(
            "samplers: {}",
            names(&plan.samplers, &samplers, &replicates)
        ),
        format!(
            "times: {}",
            names(&plan.times, &[scene, accel, sequence], &nothing)
        ),
        format!(
            "streams: {}",
            names(&plan.streams, &samplers[1..], &nothing)
        ),
        format!(
            "renders: {} of {}",
            plan.renders_planned(),
            plan.renders_full_product()
        ),
        format!("left out: {}", left_out.join(", ")),
    ];
    Ok(lines.join("\n"))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_known_plan_is_as_by_hand_and_another_is_another() {
        assert_eq!(check(), Ok(()));
        for (from, to) in [
            ("[1, 3]", "[1, 2]"),
            ("\"!cornell-box\"", "\"cornell-box\""),
            ("seed = 7", "seed = 8"),
            (", \"kd-tree\"]", "]"),
            ("rounds = 7", "rounds = 8"),
        ] {
            let text = TEXT.replacen(from, to, 1);
            assert_ne!(text, TEXT, "{from}");
            // An exclude that excludes nothing is refused.
            assert_ne!(planned(&text).as_deref(), Ok(EXPECTED), "{from}");
        }
    }
}
