//! Structures: build, validate, gate; what passes is timed, counted and drawn.

use super::cost::{Cost, Work};
use super::device_trees;
use super::error::RunError;
use super::measurement::{Measurement, Through};
use super::session::{End, Session};
use super::structure_times::{draw_heat_maps, time_all};
use super::twins::of_recorded_rays;
use super::units::Unit;
use super::world::World;
use crate::memory::peak_bytes;
use crate::ray_sets::fault_of_passes;
use raystone_accel::tracer::kernel_hash;
use raystone_accel::{AccelError, BuildLog, BuiltAccel, Traced};
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_core::params::Variant;
use raystone_gpu::{Gpu, GpuError, fault_of_sort, wait_for};
use raystone_record::fault_text;
use raystone_record::{Body, GateVerdict, Key, Line, Ran, RayClass, StructureRecord};
use raystone_stats::statistics::median;
use raystone_verify::gate::gate;
use raystone_verify::ray_classes;
use raystone_verify::self_test::unseen_hit;
use raystone_verify::twin_work::{self, TwinWork};
use std::sync::Arc;
use std::time::Instant;

/// Build, gate and speed of structures.
pub(super) struct Structures;

impl Measurement for Structures {
    fn name(&self) -> &'static str {
        "structure"
    }

    fn plural(&self) -> &'static str {
        "structures"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.structures.clone()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let e = experiment;
        format!(
            "{:?}",
            (image_settings(e), &e.gate, &e.timing, &e.coherence)
        )
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        cost.gate(cell) + cost.timed(Work::rays(cost.experiment.timing.rays)) * cost.ray_classes()
    }
}

/// The settings that an image depends on, in all measurements that render or record rays.
pub(super) fn image_settings(experiment: &Experiment) -> impl std::fmt::Debug + use<> {
    let e = experiment;
    (e.run.seed, e.camera, e.run.resolution, e.run.runtime_checks)
}

/// A structure that passed its gate.
pub(super) struct Gated {
    pub cell: Cell,
    pub traced: Traced,
    /// Whether its timed kernels run with the driver's checks.
    pub runtime_checks: bool,
    /// Million primary and bounce rays per second, for choosing the fastest.
    pub speed: f64,
    pub record: Line<StructureRecord>,
    /// Counted cost of every pixel's primary ray.
    pub costs: Vec<f32>,
}

/// A structure on its way. What failed is not on the device, and its record says why.
#[derive(Clone)]
pub(super) struct Candidate {
    cell: Cell,
    pub traced: Option<Traced>,
    /// What `validate` says.
    structural: Option<String>,
    /// Work of some recorded rays as its twin counts it; empty without a twin.
    work: Arc<Vec<TwinWork>>,
    pub record: Line<StructureRecord>,
}

impl Candidate {
    fn failed(mut self, reason: impl ToString) -> Self {
        self.record.body.failure = Some(reason.to_string());
        self.traced = None;
        self
    }
}

/// Builds, validates, uploads and gates one structure.
pub(super) fn build_and_gate(
    session: &mut Session,
    world: &World,
    cell: &Cell,
) -> Result<Candidate, RunError> {
    let built = build(session, world, cell);
    gate_with(session, world, built, cell)
}

/// Builds, validates and uploads: what does not depend on kernels.
fn build(session: &mut Session, world: &World, cell: &Cell) -> Candidate {
    let accel = &cell[Axis::Accel];
    let mut candidate = Candidate {
        cell: cell.clone(),
        traced: None,
        structural: None,
        work: Arc::default(),
        record: empty_record(cell, session.experiment.run.runtime_checks),
    };
    let kind = match session.registries.accel.named("structure", &accel.name) {
        Ok(kind) => kind,
        Err(reason) => return candidate.failed(reason),
    };
    let record = &mut candidate.record.body;
    let mut log = BuildLog::with_gpu(world.gpu).noting_quality();
    let (built, peak) = session.clock.time("build", || {
        peak_bytes(|| kind.build(&world.soup, &accel.params, &mut log))
    });
    record.build_peak_bytes = peak;
    record.build_ms = log.total_ms();
    record.build = log.phases;
    let updated = built.and_then(|mut built| {
        let update = || update_ms(&mut *built, world);
        record.update_ms = session.clock.time("build", update)?;
        Ok(built)
    });
    let built = match updated {
        Ok(built) => built,
        Err(error) => return candidate.failed(error),
    };
    record.space = built.space();
    record.stats = built.stats();
    record.figures = (session.registries.figures).of_structure(&*built, &world.soup);
    let valid = (session.clock).time("gate", || built.validate(&world.soup));
    let on_device = built.on_device();
    let held = on_device.iter().map(|(_, buffer)| buffer.size());
    let held = built.buffers().bytes() + held.sum::<u64>();
    let bytes = candidate.record.body.stats.bytes;
    let other = (bytes != held).then(|| format!("it has {held} bytes, and says {bytes}"));
    let of_device = || device_trees::fault(world, kind, accel);
    let other = other.or_else(|| (session.clock).time("gate", of_device));
    candidate.structural = valid.err().map(|e| e.to_string()).or(other);
    // One that is not sound fails, and may lead its twin in circles.
    if candidate.structural.is_none() {
        let work = || {
            let exact = world.probe.is_exact();
            TwinWork::of_structure(&*built, &world.soup, &world.reference, exact)
        };
        candidate.work = Arc::new(session.clock.time("gate", work));
    }
    match Traced::upload(world.gpu, &*built) {
        Ok(traced) => candidate.traced = Some(traced),
        Err(error) => return candidate.failed(error),
    }
    candidate
}

/// Gates what was built with the kernels of a cell.
fn gate_with(
    session: &mut Session,
    world: &World,
    mut candidate: Candidate,
    cell: &Cell,
) -> Result<Candidate, RunError> {
    candidate.cell = cell.clone();
    candidate.record.key = Key::from(cell);
    let Some(traced) = candidate.traced.clone() else {
        return Ok(candidate);
    };
    let gpu = world.device.of(&cell[Axis::Kernels])?;
    let traced = match as_configured(session, gpu, cell, traced) {
        Ok(traced) => traced,
        Err(reason) => return Ok(candidate.failed(reason)),
    };
    candidate.traced = Some(traced.clone());
    let checks = session.experiment.run.runtime_checks;
    prove_gate(session, world)?;
    prove_sort(session, gpu)?;
    let gated = session.clock.time("gate", || {
        let mut verdict = gate_twice(checks, world, gpu, &traced)?;
        if verdict.passed {
            verdict.work = work_fault(world, gpu, (&cell[Axis::Accel], &traced), &candidate.work)?;
            verdict.passed = verdict.work.is_none();
        }
        let hash = kernel_hash(gpu, &world.buffers.triangles, &traced)?;
        Ok::<_, GpuError>((verdict, hash))
    });
    let (mut verdict, hash) = match gated {
        Ok(gated) => gated,
        Err(error) => {
            candidate.record.body.refused = error.is_refusal();
            return Ok(candidate.failed(error));
        }
    };
    candidate.record.ran.kernel_hash = hash;
    candidate.record.body.load = Some(if traced.texels { "texture" } else { "buffer" }.to_owned());
    verdict.passed &= candidate.structural.is_none();
    verdict.structural.clone_from(&candidate.structural);
    if verdict.passed {
        verdict.elsewhere =
            super::trial::fault(session, world, gpu, cell).unwrap_or_else(|e| Some(e.to_string()));
        verdict.passed = verdict.elsewhere.is_none();
    }
    let fault = (!verdict.passed).then(|| fault_text(&verdict));
    candidate.record.body.gate = Some(verdict);
    Ok(match fault {
        Some(fault) => candidate.failed(fault),
        None => candidate,
    })
}

/// A structure in the workgroups and by the load path of a cell.
fn as_configured(
    session: &Session,
    gpu: &Gpu,
    cell: &Cell,
    traced: Traced,
) -> Result<Traced, String> {
    let (workgroup, load) = (
        session.registries.workgroup(cell)?,
        session.registries.load(cell)?,
    );
    let traced = traced.in_workgroups(gpu, &workgroup);
    let traced = traced.and_then(|traced| traced.loading(gpu, &load));
    traced.map_err(|error| error.to_string())
}

/// Ends the run if its rays are not those of their classes, or the gate does not see what is planted into its own data, once per
/// run.
fn prove_gate(session: &mut Session, world: &World) -> Result<(), RunError> {
    if std::mem::replace(&mut session.checked.gate_is_proven, true) {
        return Ok(());
    }
    let (scene, soup) = (&world.scene, &world.soup);
    let (settings, sets) = (&session.experiment.gate, &world.reference.sets);
    let classes = || ray_classes::fault(scene, soup, world.camera, settings, sets);
    if let Some(fault) = session.clock.time("gate", classes) {
        return Err(RunError::Wrong(format!(
            "the recorded rays are not what they should be: {fault}; no figure of them would mean anything"
        )));
    }
    let plant = || unseen_hit(scene, soup, &world.reference, world.probe.is_exact());
    match session.clock.time("gate", plant) {
        None => Ok(()),
        Some(fault) => Err(RunError::Wrong(format!(
            "the gate is blind: of faults planted into its own data it does not see {fault}; nothing that it passes is proven"
        ))),
    }
}

/// Ends the run if the device sorts known keys otherwise than they should be, once per run. Of an adapter that cannot sort, those
/// who need it tell.
fn prove_sort(session: &mut Session, gpu: &Gpu) -> Result<(), RunError> {
    if std::mem::replace(&mut session.checked.sort_is_proven, true) {
        return Ok(());
    }
    let found = session.clock.time("gate", || fault_of_sort(gpu));
    match found.ok().flatten() {
        None => Ok(()),
        Some(fault) => Err(RunError::Wrong(format!(
            "{fault}: what is built or rendered in that order is slower than it should be, or wrong"
        ))),
    }
}

/// What is wrong with the work that kernels count. Kernels of a folder that traverse otherwise may
/// count otherwise.
fn work_fault(
    world: &World,
    gpu: &Gpu,
    (accel, traced): (&Variant, &Traced),
    expected: &[TwinWork],
) -> Result<Option<String>, GpuError> {
    let overridden = gpu.kernels.overridden();
    if overridden.iter().any(|name| name.starts_with("accel/")) {
        return Ok(None);
    }
    let triangles = &world.buffers.triangles;
    let found = wait_for(twin_work::fault_of_kernels(
        gpu, triangles, traced, expected,
    ))?;
    let mut sets = world.reference.of(traced.space).sets.iter();
    match sets.find(|set| set.class == RayClass::Bounce) {
        Some(set) if found.is_none() => {
            let exact = world.probe.is_exact() && world.soup.intersection.triangle.is_exact();
            let on_device = (triangles, traced);
            fault_of_passes(gpu, on_device, (&world.soup, accel), set, exact)
        }
        _ => Ok(found),
    }
}

/// Updates of which the median is taken.
const UPDATES: usize = 5;

/// Milliseconds of wall time to take the transforms of the scene's instances over once more, as if all
/// had moved; the gate then judges what an update leaves. `None` for structures without updates.
fn update_ms(built: &mut dyn BuiltAccel, world: &World) -> Result<Option<f64>, AccelError> {
    let mut samples = Vec::new();
    if world.soup.placed.is_none() {
        return Ok(None);
    }
    for _ in 0..UPDATES {
        let start = Instant::now();
        match built.update(&world.soup) {
            None => return Ok(None),
            Some(updated) => updated?,
        }
        samples.push(start.elapsed().as_secs_f64() * 1e3);
    }
    Ok(median(&samples))
}

/// The gate with the driver's checks; without them only if that passed.
fn gate_twice(
    runtime_checks: bool,
    world: &World,
    gpu: &Gpu,
    traced: &Traced,
) -> Result<GateVerdict, GpuError> {
    let run = |checks| {
        gate(
            gpu,
            &world.buffers.triangles,
            &world.soup,
            traced,
            &world.reference,
            &world.probe,
            checks,
        )
    };
    let checked = run(true)?;
    if runtime_checks || !checked.passed {
        Ok(checked)
    } else {
        run(false)
    }
}

fn empty_record(cell: &Cell, runtime_checks: bool) -> Line<StructureRecord> {
    let ran = Ran {
        unchecked: !runtime_checks,
        ..Ran::default()
    };
    Line::new(Key::from(cell), ran, StructureRecord::default())
}

/// Everything about the structures of a world; returns those that may be used further.
pub(super) fn run(session: &mut Session, world: &World) -> Result<Vec<Gated>, RunError> {
    let cells = session.plan.structures.iter();
    let mut cells: Vec<Cell> = cells.filter(|c| c.is_on(&world.cell)).cloned().collect();
    // What nothing else serves comes last, so that it is known whether it is needed.
    cells.sort_by_key(|cell| !is_needed(session, world, cell));
    let mut gated: Vec<Gated> = Vec::new();
    // The last structure that was built: it serves all workgroups and kernels.
    let mut last: Option<Candidate> = None;
    for cell in cells {
        let name = cell.to_string();
        let is_wanted = is_needed(session, world, &cell) || carries(session, world, &cell, &gated);
        if session.ledger.is_unusable(&name) || !is_wanted {
            continue;
        }
        // What was judged so far is still timed.
        if session.go_on().is_err() {
            break;
        }
        session.say(format!("{cell}: build and gate"));
        session.lose_device_on_request(world.gpu, &name);
        // What cannot serve goes before the next is built.
        let same = (last.take()).filter(|other| other.cell[Axis::Accel] == cell[Axis::Accel]);
        let built = same.unwrap_or_else(|| build(session, world, &cell));
        let outcome = gate_with(session, world, built.clone(), &cell)?;
        session.recorder.note_kernels(&name);
        last = Some(built);
        match outcome.traced {
            Some(traced) => gated.push(Gated {
                runtime_checks: !outcome.record.ran.unchecked,
                traced,
                speed: 0.0,
                record: outcome.record,
                cell,
                costs: Vec::new(),
            }),
            None if session.ledger.is_done(&name) => {}
            None => write_failed(session, world, &cell, outcome.record)?,
        }
        session
            .progress
            .add(session.cost.gate(&world.cell).seconds());
        if world.gpu.lost().is_some() {
            return Ok(Vec::new());
        }
    }
    drop(last);
    // Those whose record is there serve others, and are not timed again.
    let is_open = |g: &Gated| session.ledger.is_open(&Structures, &g.cell);
    let (open, mut usable): (Vec<_>, Vec<_>) = gated.into_iter().partition(is_open);
    let timed = time_all(session, world, open)?;
    let mut timed = draw_heat_maps(session, world, timed)?;
    model_coherence(session, world, &mut timed);
    for structure in &timed {
        conclude(
            session,
            world,
            &structure.cell,
            structure.record.clone(),
            None,
        )?;
    }
    usable.append(&mut timed);
    Ok(usable)
}

/// Models the coherence of the recorded rays through each structure, where the experiment asks for it.
fn model_coherence(session: &mut Session, world: &World, timed: &mut [Gated]) {
    if let Some(settings) = session.experiment.coherence.clone() {
        for structure in timed {
            let of = (&structure.cell, structure.traced.space);
            let modelled = of_recorded_rays(session, world, of, &settings);
            // Why there is none is told of its cells.
            structure.record.body.coherence = modelled.ok();
        }
    }
}

/// Whether something that is not measured yet is of this structure.
fn is_needed(session: &Session, world: &World, cell: &Cell) -> bool {
    let mut open = session
        .ledger
        .open_units()
        .filter(|unit| unit.cell.is_on(&world.cell));
    open.any(|unit| unit.measurement.through() == Through::Own && unit.cell.is_on(cell))
}

/// Whether a sampler that is not measured yet has nothing else to be rendered through. Hits are equal to the bit in
/// every structure, so that any will do.
fn carries(session: &Session, world: &World, cell: &Cell, gated: &[Gated]) -> bool {
    let kernels = &cell[Axis::Kernels];
    let serves = |g: &Gated| g.cell[Axis::Kernels] == *kernels && g.traced.is_inline();
    let mut open = session
        .ledger
        .open_units()
        .filter(|unit| unit.cell.is_on(&world.cell));
    let needs = |unit: &Unit| {
        unit.measurement.through() == Through::Any && unit.cell[Axis::Kernels] == *kernels
    };
    !gated.iter().any(serves) && open.any(needs)
}

fn conclude(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    record: Line<StructureRecord>,
    failure: Option<String>,
) -> Result<(), RunError> {
    let end = End {
        failure,
        scene: &world.scene.hash,
        ..End::default()
    };
    session.conclude(&cell.to_string(), record.with_body(Body::Structure), end)
}

pub(super) fn write_failed(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    record: Line<StructureRecord>,
) -> Result<(), RunError> {
    let reason = record.body.failure.clone().unwrap_or_default();
    if record.body.refused {
        return session.write_refused(cell.to_string(), reason);
    }
    conclude(session, world, cell, record, Some(reason))
}
