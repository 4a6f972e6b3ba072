//! Second scene of the correctness check: small, but exercises code that otherwise only large or
//! deep scenes reach. Every structure of a run is tested on it once.

use super::session::Session;
use super::world::World;
use raystone_accel::{AccelError, Intersection, TriangleSoup};
use raystone_config::{Axis, Cell, Gate};
use raystone_gpu::{Gpu, GpuError};
use raystone_record::fault_text;
use raystone_render::{Stage, StageError};
use raystone_scene::{LoadOptions, SceneData, builtin_scenes, load};
use raystone_verify::gate::{Checks, ReferenceTracer, gate};
use std::collections::BTreeMap;
use std::sync::Arc;

const SCENE: &str = "far-corners";
/// Its rays: per class, against brute force, and in double precision (besides hard ones).
const GATE: Gate = Gate {
    rays: 1024,
    brute_force_tests: 1,
    oracle_rays: 512,
    ao_length: 0.0,
    offset: 0.0,
    shadow_orders: false,
};
/// Brute force checks one ray in this many.
const EVERY: usize = 8;

/// The scene with its reference tracers, prepared once per run, and its results.
#[derive(Default)]
pub(super) struct Trial {
    /// By the tests used for checking.
    scenes: BTreeMap<String, Arc<CheckedScene>>,
    outcomes: BTreeMap<String, Option<String>>,
}

struct CheckedScene {
    scene: Arc<SceneData>,
    reference: ReferenceTracer,
}

impl CheckedScene {
    fn new(intersection: Intersection) -> Result<Self, String> {
        let entry = builtin_scenes().into_iter().find(|e| e.name == SCENE);
        let variant = entry.ok_or("it is not registered")?.default_variant();
        let scene = load(&variant, &LoadOptions::default()).map_err(|e| e.to_string())?;
        let soup = TriangleSoup::new(&scene).intersecting(intersection);
        let camera = scene.view(1.0);
        let reference = ReferenceTracer::new(&scene, &soup, camera, &GATE, 1, Checks::Kept)
            .map_err(|e| e.to_string())?;
        let scene = Arc::new(scene);
        Ok(Self { scene, reference })
    }
}

/// The error of a structure on the second scene; `None` if there is none, if the run's scene is the
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
    if world.cell[Axis::Scene].name == SCENE || !tests.bears_hard_rays() {
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
    let key = format!("{:?}", cell.on(&parts));
    if let Some(known) = session.checked.trial.outcomes.get(&key) {
        return Ok(known.clone());
    }
    let of_tests = format!("{tests:?}");
    let judged = match session.checked.trial.scenes.get(&of_tests) {
        Some(judged) => Arc::clone(judged),
        None => {
            let made = session.clock.time("judge", || CheckedScene::new(tests));
            match made {
                Ok(judged) => Arc::new(judged),
                Err(reason) => return Ok(Some(format!("{SCENE}: {reason}"))),
            }
        }
    };
    (session.checked.trial.scenes).insert(of_tests, Arc::clone(&judged));
    let found = session.clock.time("gate", || {
        judged.fault_of(session.registries, world, gpu, cell)
    })?;
    let found = found.map(|fault| format!("{SCENE}: {fault}"));
    session.checked.trial.outcomes.insert(key, found.clone());
    Ok(found)
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
        let workgroup = registries.workgroup(cell).map_err(GpuError::Kernel)?;
        let load = registries.load(cell).map_err(GpuError::Kernel)?;
        let traced = traced.in_workgroups(gpu, &workgroup)?.loading(gpu, &load)?;
        let thinned = (accel.name == "brute-force").then(|| self.reference.thinned(EVERY));
        let reference = thinned.as_ref().unwrap_or(&self.reference);
        let (triangles, probe) = (&stage.buffers.triangles, &world.probe);
        let verdict = gate(gpu, triangles, &stage.soup, &traced, reference, probe, true)?;
        Ok((!verdict.passed).then(|| fault_text(&verdict)))
    }
}
