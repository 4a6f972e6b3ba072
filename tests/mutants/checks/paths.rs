//! Single paths against the oracle for images, on the trial scenes.

use super::{Bench, Finding};
use crate::subject::{build, sampler};
use crate::{CheckError, Plant};
use raystone::accel::{Traced, TriangleSoup};
use raystone::integrator::{
    BLOCK_SAMPLES, IntegratorRegistry, RayOffset, RenderJob, Renderer, SceneBuffers,
};
use raystone::measure::image_gate::{Choice, Pixels, answers, judge, sums};
use raystone::measure::path_oracle::{Estimator, PathOracle, View};
use raystone::measure::trial_scenes::{Trial, TrialScene, trial_scenes};
use raystone::params::{Params, Variant};
use raystone::sampling::Demand;

/// No multiple of a workgroup.
const SIZE: [u32; 2] = [22, 17];
const SAMPLES: [u32; 2] = [1, 70_000];
const SEED: u32 = 123_457;

/// The first fault on a trial scene, if there is one.
pub fn paths(bench: &Bench) -> Finding {
    let mut scenes = trial_scenes().map_err(|e| CheckError::Other(e.to_string()))?;
    // No other trial of primary visibility has a lamp in sight.
    let lamps = scenes.iter_mut().find(|s| s.scene.name == "lamps");
    let lamps = lamps.ok_or_else(|| CheckError::Stale("no trial scene of lamps".to_owned()))?;
    lamps.trials.push(("primary", Vec::new()));
    scenes.retain(|s| s.scene.media.is_empty());
    first_fault(bench, &scenes)
}

/// The same on the trial scenes with a medium.
pub fn media(bench: &Bench) -> Finding {
    let mut scenes = trial_scenes().map_err(|e| CheckError::Other(e.to_string()))?;
    scenes.retain(|s| !s.scene.media.is_empty());
    if scenes.is_empty() {
        return Err(CheckError::Stale("no trial scene has a medium".to_owned()));
    }
    first_fault(bench, &scenes)
}

fn first_fault(bench: &Bench, scenes: &[TrialScene]) -> Finding {
    for scene in scenes {
        if let Some(found) = of_scene(bench, scene)? {
            return Ok(Some(format!("{}: {found}", scene.scene.name)));
        }
    }
    Ok(None)
}

fn of_scene(bench: &Bench, trial: &TrialScene) -> Finding {
    let soup = TriangleSoup::new(&trial.scene);
    let built = build("bvh", &[], &soup)?;
    let traced = Traced::upload(bench.gpu, &*built)?;
    let buffers = SceneBuffers::upload(bench.gpu, &trial.scene, &soup)?;
    let oracle = PathOracle::new(&trial.scene).map_err(CheckError::Stale)?;
    for what in &trial.trials {
        let found = of_integrator(bench, trial, (&buffers, &traced), &oracle, what)?;
        if let Some(found) = found {
            return Ok(Some(format!("{}: {found}", what.0)));
        }
    }
    Ok(None)
}

fn of_integrator(
    bench: &Bench,
    trial: &TrialScene,
    (buffers, traced): (&SceneBuffers, &Traced),
    oracle: &PathOracle,
    (name, changes): &Trial,
) -> Finding {
    let changes = changes.iter().cloned();
    let variant = Variant {
        name: (*name).to_owned(),
        params: Params(
            changes
                .map(|(key, value)| (key.to_owned(), value))
                .collect(),
        ),
        ..Variant::default()
    };
    let integrator = IntegratorRegistry::default().configured(&variant);
    let integrator = integrator.map_err(|e| CheckError::Stale(e.to_string()))?;
    let demand = Demand {
        samples: None,
        dimensions: integrator.facts.dimensions,
        width: Some(SIZE[0]),
    };
    let sampler = sampler(("pixel-hash", &[]), "none", &demand, &Plant::Nothing)?;
    let camera = trial.scene.view(1.0);
    let job = RenderJob {
        size: SIZE,
        camera,
        sampler: &sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(bench.gpu, buffers, traced, &job, false)?;
    let pixels = Pixels {
        size: SIZE,
        choice: Choice::Every(1),
        samples: SAMPLES.to_vec(),
        seed: SEED,
    };
    let view = View {
        estimator: Estimator::of(&integrator).map_err(CheckError::Stale)?,
        camera,
        size: SIZE,
        sampler: &sampler,
    };
    let found = judge(oracle, &view, &answers(&renderer, &pixels)?).fault;
    Ok(found.or(sums(&renderer, &pixels, 2 * BLOCK_SAMPLES)?))
}
