//! The gate of integrators: single paths against the oracle for images, before anything is rendered with them.

use super::session::{Session, content_hash};
use super::world::World;
use super::{Fault, RunError};
use crate::config::{Axis, Cell};
use crate::integrator::{ConfiguredIntegrator, RayOffset, RenderJob, Renderer, Traced};
use crate::measure::image_gate::{Answer, Pixels, answers, judge};
use crate::measure::path_oracle::{Estimator, PathOracle, View};
use crate::measure::record::{Body, Key, Line, PathsRecord, Ran};
use crate::sampling::Sampler;

/// Of the frame that is judged: no square, and no multiple of a workgroup.
const SIZE: [u32; 2] = [26, 19];

/// What an outcome depends on beside the world: the first sampler of each does.
const AXES: [Axis; 3] = [Axis::Integrator, Axis::Offset, Axis::Kernels];

/// How many paths are judged.
#[derive(Debug, Clone, Copy)]
struct Extent {
    /// Indices of samples, spread over those of the experiment.
    samples: u32,
    /// Of so many pixels one.
    every: u32,
}

/// At the start of a run: 494 paths.
const RUN: Extent = Extent {
    samples: 4,
    every: 4,
};
/// By `verify`: 3952 paths.
const VERIFY: Extent = Extent {
    samples: 8,
    every: 1,
};

/// Judges the integrator of a cell, unless that was done before.
///
/// # Errors
/// It failed, now or then.
pub(super) fn check(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
) -> Result<(), Fault> {
    let fault = match session.judged.get(&key(world, cell)) {
        Some(known) => known.clone(),
        None => judge_and_record(session, world, traced, cell, RUN)?.fault,
    };
    match fault {
        Some(fault) => Err(format!("its integrator failed the gate: {fault}").into()),
        None => Ok(()),
    }
}

/// Judges all integrators of a plan on a world through the structure of a cell, with its kernels, that were not judged before.
pub(super) fn verify(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    structure: &Cell,
) -> Result<Vec<(Cell, PathsRecord)>, RunError> {
    let mut judged = Vec::new();
    for cell in &session.plan.samplers {
        let is_its = cell.is_on(&world.cell) && cell[Axis::Kernels] == structure[Axis::Kernels];
        if is_its && !session.judged.contains_key(&key(world, cell)) {
            let record = judge_and_record(session, world, traced, cell, VERIFY)?;
            judged.push((cell.clone(), record));
        }
    }
    Ok(judged)
}

fn key(world: &World, cell: &Cell) -> String {
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
        // Judged again on the next device.
        return Ok(record);
    }
    session
        .judged
        .insert(key(world, cell), record.fault.clone());
    if let Some(reason) = &record.not_judged {
        session.tell_warning(&format!("{cell}: paths are not judged: {reason}"));
    }
    let blank = Line::new(Key::from(cell), ran, ());
    let hash = content_hash(&blank, &world.scene.hash, &[]);
    let paths = record.clone();
    session.write(&blank.hashed(&hash).with_body(|()| Body::Paths(paths)))?;
    Ok(record)
}

/// The verdict and the kernels that it is on, or why there is none.
fn made(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    extent: Extent,
) -> Result<(PathsRecord, Ran), String> {
    let registries = session.registries;
    let integrator = registries.integrators.configured(&cell[Axis::Integrator]);
    let integrator = integrator.map_err(|e| e.to_string())?;
    let estimator = Estimator::of(&integrator)?;
    let offset = registries.offset(cell)?;
    if !offset.is_unbiased {
        return Err(format!("rays that start by offset `{}`", offset.name));
    }
    if let Some(reason) = integrator.refusal(traced) {
        return Err(reason);
    }
    let oracle = (session.clock).time("judge", || PathOracle::new(&world.scene))?;
    let spp = session.experiment.spp.max();
    let demand = integrator.demand(spp, SIZE[0]);
    let (sequence, decorrelation) = (&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
    let sampler = registries
        .samplers
        .sampler(sequence, decorrelation, &demand);
    let sampler = sampler.map_err(|e| e.to_string())?;
    let view = View {
        estimator,
        camera: world.camera,
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
    let (answers, ran) = session.clock.time("gate", || {
        render(
            world,
            traced,
            cell,
            (&integrator, offset, &sampler),
            &pixels,
        )
    })?;
    let record = session
        .clock
        .time("judge", || judge(&oracle, &view, &answers));
    Ok((record, ran))
}

/// So many of the indices below `spp`, the first and the last among them.
fn spread(spp: u32, count: u32) -> Vec<u32> {
    let last = u64::from(spp.max(1) - 1);
    let steps = u64::from(count.max(2) - 1);
    let mut indices: Vec<u32> = (0..=steps).map(|i| (i * last / steps) as u32).collect();
    indices.dedup();
    indices
}

/// What the kernels answer.
fn render(
    world: &World,
    traced: &Traced,
    cell: &Cell,
    (integrator, offset, sampler): (&ConfiguredIntegrator, RayOffset, &Sampler),
    pixels: &Pixels,
) -> Result<(Vec<Answer>, Ran), String> {
    let gpu = world
        .device
        .of(&cell[Axis::Kernels])
        .map_err(|e| e.to_string())?;
    let job = RenderJob {
        size: pixels.size,
        camera: world.camera,
        sampler,
        integrator,
        offset,
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &world.buffers, traced, &job, false);
    let renderer = renderer.map_err(|e| e.to_string())?;
    let ran = Ran::kernel(renderer.kernel_hash());
    let answers = answers(&renderer, pixels).map_err(|e| e.to_string())?;
    Ok((answers, ran))
}
