//! Correctness check of integrators before rendering: single paths against the image oracle.

use super::error::{Fault, RunError};
use super::offsets;
use super::path_orders;
use super::rasterised;
use super::registries::Registries;
use super::session::Session;
use super::world::World;
use raystone_config::{Axis, Cell};
use raystone_core::geometry::Camera;
use raystone_core::params::{ParamValue, Params, Variant};
use raystone_gpu::{Gpu, GpuError};
use raystone_record::{Body, Key, Line, PathsRecord, Ran};
use raystone_render::{
    BLOCK_SAMPLES, ConfiguredIntegrator, RayOffset, RenderJob, Renderer, Stage, Traced,
};
use raystone_sampling::{Coordinate, Sampler};
use raystone_scene::SceneData;
use raystone_verify::image_gate::{Choice, Frame, Pixels, answers, judge, sums};
use raystone_verify::path_oracle::{Estimator, PathOracle, View};
use raystone_verify::ray_counts;
use raystone_verify::self_test::unseen_pixel;
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

/// At the start of a run: 494 paths.
const RUN: Frame = Frame {
    size: SIZE,
    choice: Choice::Every(4),
    samples: 4,
    summed: BLOCK_SAMPLES + 2,
    view: 1.0,
};
/// On a trial scene by `verify`: 1976 paths, since a material may cover a twentieth of the image.
pub(super) const TRIAL: Frame = Frame {
    choice: Choice::Every(1),
    ..RUN
};
/// By `verify`: 3952 paths.
const VERIFY: Frame = Frame {
    samples: 8,
    ..TRIAL
};

/// The frame, an image of the run's own size, and one with many pixels.
fn frames(session: &Session, frame: Frame) -> Vec<Frame> {
    let own = Frame {
        size: session.experiment.run.resolution,
        choice: Choice::Borders,
        samples: 2,
        summed: 2,
        view: 1.0,
    };
    let pixels = |frame: &Frame| frame.size[0] * frame.size[1];
    let large = Some(Frame::LARGE).filter(|large| pixels(&own) <= pixels(large));
    [frame, own].into_iter().chain(large).collect()
}

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
            let mut record = judge_and_record(session, world, traced, cell, VERIFY)?;
            if record.fault.is_none() {
                let counts = miscounted(session, world, traced, cell);
                record.fault = counts.unwrap_or_else(Some);
            }
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
    frame: Frame,
) -> Result<PathsRecord, RunError> {
    session.say(format!("{cell}: paths"));
    let (record, ran) = match made(session, world, traced, cell, frame) {
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
        session.tell_warning(&format!("{cell}: paths are not checked: {reason}"));
    }
    let blank = Line::new(Key::from(cell), ran, ());
    let hash = blank.content_hash(&world.scene.hash, &[]);
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

pub(super) struct Subject<'a> {
    pub stage: &'a Stage,
    pub gpu: &'a Gpu,
    traced: &'a Traced,
    pub camera: Camera,
    pub cell: &'a Cell,
    offset: RayOffset,
    /// True if the adapter rounds as the host does.
    pub is_exact: bool,
}

/// What is checked of a cell on its scene, or why nothing can be.
pub(super) fn subject<'a>(
    session: &Session,
    world: &'a World,
    traced: &'a Traced,
    cell: &'a Cell,
) -> Result<(Subject<'a>, ConfiguredIntegrator), String> {
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
        is_exact: world.probe.is_exact(),
    };
    Ok((subject, integrator))
}

/// The verdict and its kernels, or why there is none. Trial scenes supplement what the scene may
/// not show; in `verify` all of them may, once per integrator and kernels.
fn made(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    frame: Frame,
) -> Result<(PathsRecord, Ran), String> {
    if let Some(record) = rasterised::judged(session, world, traced, cell)? {
        return Ok((record, Ran::default()));
    }
    let (subject, integrator) = subject(session, world, traced, cell)?;
    let frames = frames(session, frame);
    let (mut record, ran) = judged(session, &subject, &integrator, &frames)?;
    if let Some(short) = with_short_queues(session, cell)? {
        record = record.and(judged(session, &subject, &short, &Frame::FULL)?.0);
    }
    let of = [Axis::Offset, Axis::Kernels];
    let all = format!("trial scenes, {}, {}", cell.on(&of), integrator.kind.name());
    let kinds = &session.registries.kinds;
    // What trial scenes show of shading is the same in every organisation.
    let on_all = session.checked.on_all_trials && !cell.is_unusual(Axis::Organisation);
    let trials = match on_all {
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

/// The integrator of a cell whose organisation has queues, with so few slots that they are full and
/// paths wait.
fn with_short_queues(
    session: &Session,
    cell: &Cell,
) -> Result<Option<ConfiguredIntegrator>, String> {
    let mut organisation = cell[Axis::Organisation].clone();
    let Some(capacity) = organisation.params.0.get_mut("capacity") else {
        return Ok(None);
    };
    *capacity = ParamValue::Integer(Frame::SLOTS.into());
    let short = cell.clone().with(Axis::Organisation, &organisation);
    session.registries.integrator(&short).map(Some)
}

/// Compares counted rays with those of the path oracle, once per integrator, organisation and
/// kernels. Returns what is wrong; `None` also where the oracle has no formula for something.
///
/// # Errors
/// A kernel does not compile or raised its error word, or the device is lost.
pub(super) fn miscounted(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
) -> Result<Option<String>, String> {
    let key = format!("counts, {}", key(world, cell));
    if let Some(known) = session.checked.integrators.get(&key) {
        return Ok(known.clone());
    }
    let Ok((subject, integrator)) = subject(session, world, traced, cell) else {
        return Ok(None);
    };
    let kinds = &session.registries.kinds;
    let Ok(oracle) = PathOracle::knowing(&subject.stage.scene, kinds) else {
        return Ok(None);
    };
    let frame = Frame {
        samples: 1,
        ..TRIAL
    };
    let (sampler, pixels) = drawn(session, &subject, &integrator, &frame)?;
    let view = subject.view(&integrator, &sampler, &pixels)?;
    let found = session.clock.time("judge", || {
        let renderer = subject.renderer(&integrator, &sampler, &pixels, true)?;
        ray_counts::fault(&renderer, &oracle, &view, &pixels)
    });
    let found = found.map_err(|e| e.to_string())?;
    session.checked.integrators.insert(key, found.clone());
    Ok(found)
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
    let (stage, traced) = subject.stage_of(registries, &trial.scene)?;
    let on_trial = subject.on(&stage, &traced);
    let frame = if session.checked.on_all_trials {
        TRIAL
    } else {
        RUN
    };
    for integrator in integrators {
        let (mut record, _) = judged(session, &on_trial, integrator, &[frame])?;
        let told = |fault: String| format!("on the trial scene `{}`: {fault}", trial.scene.name);
        record.fault = record.fault.map(told);
        all = all.and(record);
        if all.fault.is_some() {
            break;
        }
    }
    Ok(all)
}

/// Checks an integrator in frames, up to the first with a fault.
fn judged(
    session: &mut Session,
    subject: &Subject,
    integrator: &ConfiguredIntegrator,
    frames: &[Frame],
) -> Result<(PathsRecord, Ran), String> {
    let kinds = &session.registries.kinds;
    let oracle = || PathOracle::knowing(&subject.stage.scene, kinds);
    let oracle = session.clock.time("judge", oracle)?;
    let (mut all, mut ran) = (PathsRecord::default(), Ran::default());
    for frame in frames {
        let subject = &Subject {
            camera: frame.camera(subject.camera),
            ..*subject
        };
        let (sampler, pixels) = drawn(session, subject, integrator, frame)?;
        let view = subject.view(integrator, &sampler, &pixels)?;
        let job = subject.job(integrator, &sampler, &pixels);
        let fault = match offsets::fault(session, subject, &job)? {
            None => path_orders::fault(session, subject, subject.traced, &job)?,
            found => found,
        };
        if let Some(fault) = fault {
            return Ok((all.and(PathsRecord::wrong(fault)), ran));
        }
        let limit = sampler.demand.samples.unwrap_or(u32::MAX);
        let rendered = session.clock.time("gate", || {
            let renderer = subject.renderer(integrator, &sampler, &pixels, false)?;
            ran = Ran::kernel(renderer.kernel_hash());
            let sums = match frame.summed {
                0 => None,
                summed => sums(&renderer, &pixels, summed.min(limit))?,
            };
            Ok((answers(&renderer, &pixels)?, sums))
        });
        let (answers, sums) = match rendered {
            Ok(rendered) => rendered,
            // The renderer hands out no such image.
            Err(e @ (GpuError::Samples { .. } | GpuError::Kernels(_))) => {
                return Ok((all.and(PathsRecord::wrong(e.to_string())), ran));
            }
            Err(e) => return Err(e.to_string()),
        };
        let mut record = session
            .clock
            .time("judge", || judge(&oracle, &view, &answers));
        record.fault = record.fault.or(sums);
        if !session.checked.image_gate_is_proven {
            session.checked.image_gate_is_proven = true;
            let unseen = || unseen_pixel(&oracle, &view, &answers);
            let unseen = session.clock.time("judge", unseen).map(|fault| {
                format!("the check of images is blind: of pixels made wrong on purpose it does not see {fault}")
            });
            record.fault = record.fault.or(unseen);
        }
        all = all.and(record);
        if all.fault.is_some() {
            break;
        }
    }
    Ok((all, ran))
}

/// The paths of a frame, and what they draw: the sampler of the experiment's samples, and of as many
/// as are summed if it has them.
pub(super) fn drawn(
    session: &Session,
    subject: &Subject,
    integrator: &ConfiguredIntegrator,
    frame: &Frame,
) -> Result<(Sampler, Pixels), String> {
    let spp = session.experiment.run.spp.max();
    let cell = subject.cell;
    let (sequence, decorrelation) = (&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
    let sampler = |samples: u32| {
        let demand = integrator.demand(samples, frame.size[0]);
        let samplers = &session.registries.samplers;
        samplers.sampler(sequence, decorrelation, &demand)
    };
    let made = sampler(spp.max(frame.summed)).or_else(|_| sampler(spp));
    let made = made.map_err(|e| e.to_string())?;
    let seed = session.experiment.seeds().replicates.first().copied();
    let seed = seed.unwrap_or_default();
    let limit = made.demand.samples.unwrap_or(frame.summed).max(spp);
    let pixels = if !subject.stage.scene.media.is_empty() && shares_numbers(&made, seed) {
        Pixels {
            samples: inner_samples(frame.samples, limit),
            ..frame.pixels(spp, seed)
        }
    } else {
        frame.pixels(spp, seed)
    };
    Ok((made, pixels))
}

/// True if all pixels draw the same numbers, as they do of many sequences without a decorrelation.
///
/// The first samples of these are 0, 1/2, 1/4 and 3/4 in most dimensions. In a medium that is many borders at once, which
/// f64 alone can tell apart: flights of length 0 end where the medium begins, 1/2 divides two equal lights, and 1/4 and
/// 3/4 are the probabilities with which a path goes on. There, other samples are looked at.
fn shares_numbers(sampler: &Sampler, seed: u32) -> bool {
    let number = |pixel, dimension| {
        sampler.sample_u32(Coordinate {
            pixel,
            sample: 0,
            dimension,
            seed,
        })
    };
    (0..4).all(|dimension| number(0, dimension) == number(77, dimension))
}

/// So many samples below a limit, evenly between its ends: of 258 four, 51, 103, 154 and 206.
fn inner_samples(count: u32, limit: u32) -> Vec<u32> {
    let part = |k: u32| u64::from(limit) * u64::from(k) / u64::from(count + 1);
    let mut samples: Vec<u32> = (1..=count).map(|k| part(k) as u32).collect();
    samples.dedup();
    samples
}

impl<'a> Subject<'a> {
    /// A trial scene on the device, with a structure.
    pub(super) fn stage_of(
        &self,
        registries: &Registries,
        scene: &SceneData,
    ) -> Result<(Stage, Traced), String> {
        let tests = self.stage.soup.intersection;
        let stage = Stage::new(self.gpu, scene.clone(), tests).map_err(|e| e.to_string())?;
        let traced = stage.structure(&registries.accel, STRUCTURE);
        let traced = traced.map_err(|e| e.to_string())?;
        Ok((stage, traced))
    }

    /// The same there.
    pub(super) fn on<'s>(&self, stage: &'s Stage, traced: &'s Traced) -> Subject<'s>
    where
        'a: 's,
    {
        Subject {
            stage,
            traced,
            camera: stage.scene.view(1.0),
            ..*self
        }
    }

    fn view<'s>(
        &self,
        integrator: &ConfiguredIntegrator,
        sampler: &'s Sampler,
        pixels: &Pixels,
    ) -> Result<View<'s>, String> {
        Ok(View {
            estimator: Estimator::of(integrator)?,
            camera: self.camera,
            size: pixels.size,
            sampler,
        })
    }

    fn job<'s>(
        &self,
        integrator: &'s ConfiguredIntegrator,
        sampler: &'s Sampler,
        pixels: &Pixels,
    ) -> RenderJob<'s> {
        RenderJob {
            size: pixels.size,
            camera: self.camera,
            sampler,
            integrator,
            offset: self.offset,
            runtime_checks: true,
        }
    }

    pub(super) fn renderer(
        &self,
        integrator: &ConfiguredIntegrator,
        sampler: &Sampler,
        pixels: &Pixels,
        ray_counts: bool,
    ) -> Result<Renderer<'_>, GpuError> {
        let job = self.job(integrator, sampler, pixels);
        Renderer::new(self.gpu, &self.stage.buffers, self.traced, &job, ray_counts)
    }
}
