//! Registered structures on real models, checked as in a run. With RAYSTONE_REAL_RAYS every model
//! of the list is used, with that many rays in each of the five classes (200,000 make a million
//! rays per model), and in a full run with a few thousand; otherwise one of three models.

use crate::support;
use crate::support::*;
use raystone::accel::{AccelError, AccelKind};
use raystone::gpu::GpuError;
use raystone::integrator::Traced;
use raystone::measure::gate::{Checks, ReferenceTracer};
use std::path::{Path, PathBuf};

/// Models below `../shared/scenes`; a run that is not full uses one of the first ones.
const MODELS: [&str; 12] = [
    "utah-teapot/teapot.obj",
    "cornell-box/CornellBox-Water.obj",
    "sponza-crytek/sponza.obj",
    "stanford-dragon/dragon_100k.obj",
    "stanford-bunny/stanford-bunny.obj",
    "sponza-dabrovic/sponza_dabrovic.obj",
    "country-kitchen/kitchen.glb",
    "fireplace-room/fireplace_room.glb",
    "dream-apartment/dream_apartment.glb",
    "nefertiti/nefertiti.obj",
    "glass-caustics/caustics.obj",
    "lego-bulldozer/lego.glb",
];
const SMALL_ONES: usize = 3;
const FEW_RAYS: u32 = 4096;
/// With more ray-triangle tests than this, brute force takes a minute on two cores.
const MOST_TESTS: u64 = 2_000_000_000;

fn rays_by_flag() -> Option<u32> {
    let text = std::env::var("RAYSTONE_REAL_RAYS").ok()?;
    Some(text.parse().expect("RAYSTONE_REAL_RAYS is a number"))
}

fn models() -> Vec<PathBuf> {
    let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/scenes");
    let taken = if rays_by_flag().is_some() || is_full() {
        MODELS.to_vec()
    } else {
        in_turn("real models", MODELS[..SMALL_ONES].iter().copied())
    };
    taken.iter().map(|m| folder.join(m)).collect()
}

enum Outcome {
    Passed,
    /// The model exceeds a limit of the structure or the adapter.
    TooLarge(String),
    Wrong(String),
}

fn outcome(stage: &Stage, kind: &dyn AccelKind, reference: &ReferenceTracer) -> Outcome {
    let built = match stage.build(kind) {
        Ok(built) => built,
        Err(error @ AccelError::Limit { .. }) => return Outcome::TooLarge(error.to_string()),
        Err(error) => return Outcome::Wrong(error.to_string()),
    };
    if let Err(error) = built.validate(&stage.soup) {
        return Outcome::Wrong(error.to_string());
    }
    let traced = match Traced::upload(gpu(), &*built) {
        Ok(traced) => traced,
        Err(error @ GpuError::TooLarge { .. }) => return Outcome::TooLarge(error.to_string()),
        Err(error) => return Outcome::Wrong(error.to_string()),
    };
    match stage.verdict(gpu(), &traced, reference) {
        Ok(verdict) if verdict.passed => Outcome::Passed,
        Ok(verdict) => Outcome::Wrong(format!("{verdict:?}")),
        Err(error) => Outcome::Wrong(error.to_string()),
    }
}

#[test]
fn every_structure_passes_the_gate_on_real_models() {
    let mut faults = Vec::new();
    for path in models() {
        if !path.exists() {
            support::needs::skip("files", format!("{} is not there", path.display()));
            continue;
        }
        let stage = Stage::new(gpu(), from_file(&path));
        let rays = rays_by_flag().unwrap_or(FEW_RAYS);
        let reference = stage.judge(Checks::Repeated, [rays, 500_000_000, 512]);
        assert!(
            reference.is_sound(),
            "{}: {:?}",
            path.display(),
            reference.first_wrong()
        );
        let (mut asked, mut passed) = (0, 0);
        for kind in in_turn("structures on real models", structures()) {
            let tests = 5 * u64::from(rays) * stage.scene.triangles.len() as u64;
            if kind.name() == "brute-force" && tests > MOST_TESTS {
                continue;
            }
            asked += 1;
            let what = format!("{}: {}", path.display(), kind.name());
            match outcome(&stage, kind, &reference) {
                Outcome::Passed => passed += 1,
                Outcome::TooLarge(why) => println!("{what}: too large: {why}"),
                Outcome::Wrong(why) => faults.push(format!("{what}: {why}")),
            }
        }
        println!("{}: {passed} of {asked} pass", path.display());
        assert!(
            2 * passed > asked,
            "{}: {passed} of {asked}",
            path.display()
        );
    }
    assert!(faults.is_empty(), "{}", faults.join("\n"));
}
