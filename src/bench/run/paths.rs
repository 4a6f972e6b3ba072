//! Correctness check of integrators before rendering: single paths against the image oracle.

use super::error::{Fault, RunError};
use super::session::{Session, content_hash};
use super::world::World;
use raystone_config::{Axis, Cell};
use raystone_core::geometry::Camera;
use raystone_core::params::{Params, Variant};
use raystone_gpu::Gpu;
use raystone_record::{Body, Key, Line, PathsRecord, Ran};
use raystone_render::{ConfiguredIntegrator, RayOffset, RenderJob, Renderer, Stage, Traced};
use raystone_sampling::Sampler;
use raystone_verify::image_gate::{Answer, Pixels, answers, judge, sums};
use raystone_verify::path_oracle::{Estimator, PathOracle, View};
use raystone_verify::trial_scenes::{TrialScene, trial_scenes_of, trials_of};

/// Size of the checked frame: not square, and not a multiple of a workgroup.
const SIZE: [u32; 2] = [26, 19];

const STRUCTURE: &str = "bvh";

/// Axes besides the world that affect the outcome: the first sampler of each suffices.
const AXES: [Axis; 4] = [
    Axis::Integrator,
    Axis::Offset,
    Axis::Organisation,
    Axis::Kernels,
];

/// Number of paths checked.
#[derive(Debug, Clone, Copy)]
struct Extent {
    /// Number of sample indices, spread over the experiment's.
    samples: u32,
    /// One pixel in `every` is checked.
    every: u32,
}

/// At the start of a run: 494 paths.
const RUN: Extent = Extent {
    samples: 4,
    every: 4,
};
/// On a trial scene by `verify`: 1976 paths, since a material may cover a twentieth of the image.
const TRIAL: Extent = Extent {
    samples: 4,
    every: 1,
};
/// By `verify`: 3952 paths.
const VERIFY: Extent = Extent {
    samples: 8,
    every: 1,
};

/// Checks a cell's integrator, unless already done.
///
/// # Errors
/// It failed, now or earlier.
pub(super) fn check(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
) -> Result<(), Fault> {
    let fault = match session.checked.integrators.get(&key(world, cell)) {
        Some(known) => known.clone(),
        None => judge_and_record(session, world, traced, cell, RUN)?.fault,
    };
    match fault {
        Some(fault) => Err(format!("its integrator failed the gate: {fault}").into()),
        None => Ok(()),
    }
}

/// Checks all unchecked integrators of a plan on a world, with a cell's structure and kernels.
pub(super) fn verify(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    structure: &Cell,
) -> Result<Vec<(Cell, PathsRecord)>, RunError> {
    let mut judged = Vec::new();
    let reorganised = session.plan.times.iter();
    let reorganised = reorganised.filter(|cell| cell.is_unusual(Axis::Organisation));
    for cell in session.plan.samplers.iter().chain(reorganised) {
        let is_its = cell.is_on(&world.cell) && cell[Axis::Kernels] == structure[Axis::Kernels];
        if is_its && !session.checked.integrators.contains_key(&key(world, cell)) {
            let record = judge_and_record(session, world, traced, cell, VERIFY)?;
            judged.push((cell.clone(), record));
        }
    }
    Ok(judged)
}

pub(super) fn key(world: &World, cell: &Cell) -> String {
    format!("{}, {}", world.cell, cell.on(&AXES))
}

fn judge_and_record(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    extent: Extent,
) -> Result<PathsRecord, RunError> {
    session.say(format!("{cell}: paths"));
    let (record, ran) = match made(session, world, traced, cell, extent) {
        Ok(judged) => judged,
        Err(reason) => (PathsRecord::not_judged(reason), Ran::default()),
    };
    if world.gpu.lost().is_some() {
        // Checked again on the next device.
        return Ok(record);
    }
    session
        .checked
        .integrators
        .insert(key(world, cell), record.fault.clone());
    if let Some(reason) = &record.not_judged {
        session.tell_warning(&format!("{cell}: paths are not judged: {reason}"));
    }
    let blank = Line::new(Key::from(cell), ran, ());
    let hash = content_hash(&blank, &world.scene.hash, &[]);
    let paths = record.clone();
    session
        .checked
        .integrator_lines
        .insert(key(world, cell), hash.clone());
    session
        .recorder
        .write(&blank.hashed(&hash).with_body(|()| Body::Paths(paths)))?;
    Ok(record)
}

struct Subject<'a> {
    stage: &'a Stage,
    gpu: &'a Gpu,
    traced: &'a Traced,
    camera: Camera,
    cell: &'a Cell,
    offset: RayOffset,
}

/// The verdict and its kernels, or why there is none. Trial scenes supplement what the scene may
/// not show; in `verify` all of them may, once per integrator and kernels.
fn made(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    extent: Extent,
) -> Result<(PathsRecord, Ran), String> {
    let registries = session.registries;
    let integrator = registries.integrator(cell)?;
    Estimator::of(&integrator)?;
    let offset = registries.offset(cell)?;
    if !offset.is_unbiased {
        return Err(format!("rays that start by offset `{}`", offset.name));
    }
    if let Some(reason) = integrator.refusal(traced) {
        return Err(reason);
    }
    let gpu = world.device.of(&cell[Axis::Kernels]);
    let subject = Subject {
        stage: &world.stage,
        gpu: gpu.map_err(|e| e.to_string())?,
        traced,
        camera: world.camera,
        cell,
        offset,
    };
    let (mut record, ran) = judged(session, &subject, &integrator, extent)?;
    let of = [Axis::Offset, Axis::Organisation, Axis::Kernels];
    let all = format!("trial scenes, {}, {}", cell.on(&of), integrator.kind.name());
    let kinds = &session.registries.kinds;
    let trials = match session.checked.on_all_trials {
        true if session.checked.integrators.insert(all, None).is_none() => trial_scenes_of(kinds),
        true => Ok(Vec::new()),
        false => trials_of(kinds, &world.scene, &integrator),
    };
    for trial in trials.map_err(|e| e.to_string())? {
        if record.fault.is_none() {
            record = record.and(of_trial(session, &subject, &integrator, &trial)?);
        }
    }
    Ok((record, ran))
}

/// Checks this integrator's trials on a trial scene, or itself if the scene lists none.
fn of_trial(
    session: &mut Session,
    subject: &Subject,
    integrator: &ConfiguredIntegrator,
    trial: &TrialScene,
) -> Result<PathsRecord, String> {
    let registries = session.registries;
    let name = integrator.kind.name();
    let listed = trial.trials.iter().filter(|(of, _)| *of == name);
    let listed = listed.map(|(_, changes)| {
        let changes = changes.iter().map(|(k, v)| ((*k).to_owned(), v.clone()));
        let variant = Variant {
            name: name.to_owned(),
            params: Params(changes.collect()),
            ..Variant::default()
        };
        registries.integrator(&subject.cell.clone().with(Axis::Integrator, &variant))
    });
    let listed: Result<Vec<_>, _> = listed.collect();
    let listed = listed.map_err(|e| e.to_string())?;
    let own = [integrator];
    let integrators: Vec<&ConfiguredIntegrator> = if trial.trials.is_empty() {
        own.to_vec()
    } else {
        listed.iter().collect()
    };
    let mut all = PathsRecord::default();
    if integrators.is_empty() {
        return Ok(all);
    }
    let tests = subject.stage.soup.intersection;
    let stage = Stage::new(subject.gpu, trial.scene.clone(), tests).map_err(|e| e.to_string())?;
    let traced = stage.structure(&registries.accel, STRUCTURE);
    let on_trial = Subject {
        stage: &stage,
        traced: &traced.map_err(|e| e.to_string())?,
        camera: trial.scene.view(1.0),
        ..*subject
    };
    for integrator in integrators {
        let extent = if session.checked.on_all_trials {
            TRIAL
        } else {
            RUN
        };
        let (mut record, _) = judged(session, &on_trial, integrator, extent)?;
        let told = |fault: String| format!("on the trial scene `{}`: {fault}", trial.scene.name);
        record.fault = record.fault.map(told);
        all = all.and(record);
        if all.fault.is_some() {
            break;
        }
    }
    Ok(all)
}

fn judged(
    session: &mut Session,
    subject: &Subject,
    integrator: &ConfiguredIntegrator,
    extent: Extent,
) -> Result<(PathsRecord, Ran), String> {
    let cell = subject.cell;
    let kinds = &session.registries.kinds;
    let oracle = || PathOracle::knowing(&subject.stage.scene, kinds);
    let oracle = session.clock.time("judge", oracle)?;
    let spp = session.experiment.run.spp.max();
    let demand = integrator.demand(spp, SIZE[0]);
    let (sequence, decorrelation) = (&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
    let samplers = &session.registries.samplers;
    let sampler = samplers.sampler(sequence, decorrelation, &demand);
    let sampler = sampler.map_err(|e| e.to_string())?;
    let view = View {
        estimator: Estimator::of(integrator)?,
        camera: subject.camera,
        size: SIZE,
        sampler: &sampler,
    };
    let seed = session.experiment.seeds().replicates.first().copied();
    let pixels = Pixels {
        size: SIZE,
        every: extent.every,
        samples: spread(spp, extent.samples),
        seed: seed.unwrap_or_default(),
    };
    let (answers, sums, ran) =
        (session.clock).time("gate", || render(subject, (integrator, &sampler), &pixels))?;
    let mut record = session
        .clock
        .time("judge", || judge(&oracle, &view, &answers));
    record.fault = record.fault.or(sums);
    Ok((record, ran))
}

/// `count` indices below `spp`, including the first and the last.
fn spread(spp: u32, count: u32) -> Vec<u32> {
    let last = u64::from(spp.max(1) - 1);
    let steps = u64::from(count.max(2) - 1);
    let mut indices: Vec<u32> = (0..=steps).map(|i| (i * last / steps) as u32).collect();
    indices.dedup();
    indices
}

/// The kernels' answers, and errors in their sums.
fn render(
    subject: &Subject,
    (integrator, sampler): (&ConfiguredIntegrator, &Sampler),
    pixels: &Pixels,
) -> Result<(Vec<Answer>, Option<String>, Ran), String> {
    let job = RenderJob {
        size: pixels.size,
        camera: subject.camera,
        sampler,
        integrator,
        offset: subject.offset,
        runtime_checks: true,
    };
    let buffers = &subject.stage.buffers;
    let renderer = Renderer::new(subject.gpu, buffers, subject.traced, &job, false);
    let renderer = renderer.map_err(|e| e.to_string())?;
    let ran = Ran::kernel(renderer.kernel_hash());
    let answers = answers(&renderer, pixels).map_err(|e| e.to_string())?;
    let sums = sums(&renderer, pixels).map_err(|e| e.to_string())?;
    Ok((answers, sums, ran))
}
