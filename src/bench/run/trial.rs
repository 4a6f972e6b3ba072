//! Further scenes of the correctness check: small, but exercise code that otherwise only large, deep or
//! distorted scenes reach, and a full stack. Every structure of a run is tested on them once.

use super::session::Session;
use super::world::World;
use raystone_accel::{AccelError, Intersection, Traced, TriangleSoup};
use raystone_config::{Axis, Cell, Gate};
use raystone_gpu::{Gpu, GpuError};
use raystone_record::fault_text;
use raystone_render::{Stage, StageError};
use raystone_scene::{LoadOptions, SceneData, builtin_scenes, load};
use raystone_verify::full_stacks::FullStack;
use raystone_verify::gate::{Checks, ReferenceTracer, gate};
use raystone_verify::strained_copies::strained_copies;
use std::collections::BTreeMap;
use std::sync::Arc;

/// What loads a scene.
type Load = fn() -> Result<SceneData, String>;

const SCENES: [(&str, Load); 2] = [
    ("far-corners", || {
        let entry = builtin_scenes()
            .into_iter()
            .find(|e| e.name == "far-corners");
        let variant = entry.ok_or("it is not registered")?.default_variant();
        load(&variant, &LoadOptions::default()).map_err(|e| e.to_string())
    }),
    ("strained-copies", || {
        strained_copies().map_err(|e| e.to_string())
    }),
];
/// Their rays: per class, against brute force, and in double precision (besides hard ones).
const GATE: Gate = Gate {
    rays: 1024,
    brute_force_tests: 1,
    oracle_rays: 512,
    ao_length: 0.0,
    offset: 0.0,
    shadow_orders: false,
};
/// Of rays through structures that test most triangles here, one in this many is checked: brute force, and a
/// grid of equal cells, one of which has all that is small.
const EVERY: usize = 8;
const SLOW: [&str; 2] = ["brute-force", "uniform-grid"];

/// The scenes with their reference tracers, prepared once per run, and their results.
#[derive(Default)]
pub(super) struct Trial {
    /// By name and the tests used for checking.
    scenes: BTreeMap<String, Arc<CheckedScene>>,
    outcomes: BTreeMap<String, Option<String>>,
}

struct CheckedScene {
    scene: Arc<SceneData>,
    reference: ReferenceTracer,
}

impl CheckedScene {
    fn new(load: Load, intersection: Intersection) -> Result<Self, String> {
        let scene = load()?;
        let soup = TriangleSoup::new(&scene).intersecting(intersection);
        let camera = scene.view(1.0);
        let reference = ReferenceTracer::new(&scene, &soup, camera, &GATE, 1, Checks::Kept)
            .map_err(|e| e.to_string())?;
        let scene = Arc::new(scene);
        Ok(Self { scene, reference })
    }
}

/// The error of a structure on the further scenes; `None` if there is none, if the run's scene is the
/// same, or with tests that do not promise hard rays.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub(super) fn fault(
    session: &mut Session,
    world: &World,
    gpu: &Gpu,
    cell: &Cell,
) -> Result<Option<String>, GpuError> {
    let tests = world.soup.intersection;
    if !tests.bears_hard_rays() {
        return Ok(None);
    }
    // Structures with equal parameters, tests, workgroups, load paths and kernels are the same.
    let parts = [
        Axis::Accel,
        Axis::Triangle,
        Axis::BoxTest,
        Axis::Workgroup,
        Axis::Load,
        Axis::Kernels,
    ];
    let of_cell = format!("{:?}", cell.on(&parts));
    for (name, load) in SCENES {
        if world.cell[Axis::Scene].name == name {
            continue;
        }
        let found = remembered(session, (name, &of_cell), |session| {
            let judged = match prepared(session, (name, load), tests) {
                Ok(judged) => judged,
                Err(reason) => return Ok(Some(reason)),
            };
            let judge = || judged.fault_of(session.registries, world, gpu, cell);
            session.clock.time("gate", judge)
        })?;
        if found.is_some() {
            return Ok(found);
        }
    }
    remembered(session, ("full-stack", &of_cell), |session| {
        let judge = || of_full_stack(session.registries, world, gpu, cell);
        session.clock.time("gate", judge)
    })
}

/// What `judge` finds by this name for the parts of a cell that matter, once per run.
fn remembered(
    session: &mut Session,
    (name, of_cell): (&str, &str),
    judge: impl FnOnce(&mut Session) -> Result<Option<String>, GpuError>,
) -> Result<Option<String>, GpuError> {
    let key = format!("{name}, {of_cell}");
    if let Some(known) = session.checked.trial.outcomes.get(&key) {
        return Ok(known.clone());
    }
    let found = judge(session)?.map(|fault| format!("{name}: {fault}"));
    session.checked.trial.outcomes.insert(key, found.clone());
    Ok(found)
}

/// The error of a structure whose stack is as full as it becomes.
fn of_full_stack(
    registries: &super::Registries,
    world: &World,
    gpu: &Gpu,
    cell: &Cell,
) -> Result<Option<String>, GpuError> {
    let accel = &cell[Axis::Accel];
    let tests = world.soup.intersection;
    let kind = registries.accel.get(&accel.name);
    let Some(full) = kind.and_then(|kind| FullStack::of(kind, &accel.params, tests)) else {
        return Ok(None);
    };
    let traced = Traced::upload(gpu, &*full.built)?;
    let traced = as_in(registries, gpu, cell, traced)?;
    full.fault(gpu, &traced, &world.probe)
}

/// The same in the workgroups and by the load path of a cell.
fn as_in(
    registries: &super::Registries,
    gpu: &Gpu,
    cell: &Cell,
    traced: Traced,
) -> Result<Traced, GpuError> {
    let workgroup = registries.workgroup(cell).map_err(GpuError::Kernel)?;
    let load = registries.load(cell).map_err(GpuError::Kernel)?;
    traced.in_workgroups(gpu, &workgroup)?.loading(gpu, &load)
}

/// A scene with its reference tracers.
fn prepared(
    session: &mut Session,
    (name, load): (&str, Load),
    tests: Intersection,
) -> Result<Arc<CheckedScene>, String> {
    let key = format!("{name}, {tests:?}");
    if let Some(judged) = session.checked.trial.scenes.get(&key) {
        return Ok(Arc::clone(judged));
    }
    let made = session
        .clock
        .time("judge", || CheckedScene::new(load, tests));
    let judged = Arc::new(made?);
    session
        .checked
        .trial
        .scenes
        .insert(key, Arc::clone(&judged));
    Ok(judged)
}

impl CheckedScene {
    fn fault_of(
        &self,
        registries: &super::Registries,
        world: &World,
        gpu: &Gpu,
        cell: &Cell,
    ) -> Result<Option<String>, GpuError> {
        let accel = &cell[Axis::Accel];
        let Some(kind) = registries.accel.get(&accel.name) else {
            return Ok(None);
        };
        let tests = world.soup.intersection;
        let stage = Stage::new(gpu, Arc::clone(&self.scene), tests)?;
        let traced = match stage.traced(kind, &accel.params) {
            Ok(traced) => traced,
            Err(StageError::Gpu(error)) => return Err(error),
            // Parameters chosen for the run's scene may be too small or too large for this one.
            Err(StageError::Accel(AccelError::Invalid(fault))) => return Ok(Some(fault)),
            Err(_) => return Ok(None),
        };
        let traced = as_in(registries, gpu, cell, traced)?;
        let is_slow = SLOW.contains(&&*accel.name);
        let thinned = is_slow.then(|| self.reference.thinned(EVERY));
        let reference = thinned.as_ref().unwrap_or(&self.reference);
        let (triangles, probe) = (&stage.buffers.triangles, &world.probe);
        let verdict = gate(gpu, triangles, &stage.soup, &traced, reference, probe, true)?;
        Ok((!verdict.passed).then(|| fault_text(&verdict)))
    }
}
