//! Inputs of all mutants, made once: scenes with rays and answers, and reference images.

use crate::plan::open;
use crate::soups::{lattice_reference, lattice_scene};
use crate::{CheckError, Mutant, Options, Plant, Subject, checks};
use glam::Vec3;
use raystone::accel::TriangleSoup;
use raystone::config::Gate;
use raystone::geometry::{Camera, Triangle};
use raystone::gpu::KernelLibrary;
use raystone::image::Image;
use raystone::measure::gate::{Checks, ReferenceTracer};
use raystone::measure::strained_copies::strained_copies;
use raystone::params::ParamValue;
use raystone::scene::{LoadOptions, LoadReport, Material, SceneData, builtin_scenes, load};

/// Seeds of the integer-grid soups.
const SOUPS: [u64; 3] = [40, 41, 42];

/// Scenes of the gate: walls that meet in edges, a closed mesh, copies that are moved and turned, and the first of its
/// further scenes.
const SCENES: &[(&str, &[(&str, i64)])] = &[
    ("cornell-box", &[]),
    ("displaced-sphere", &[("triangles", 800)]),
    ("instances", &[("count", 12), ("detail", 80)]),
    ("far-corners", &[]),
];

const GATE: Gate = Gate {
    rays: 1600,
    brute_force_tests: 4_000_000,
    oracle_rays: 64,
    ao_length: 0.0,
    offset: 0.0,
    shadow_orders: false,
};

/// A scene with rays and answers.
pub struct Case {
    pub stage: Stage,
    pub reference: ReferenceTracer,
}

/// A scene on the host.
pub struct Stage {
    pub scene: SceneData,
    pub soup: TriangleSoup,
    pub camera: Camera,
}

impl Stage {
    /// A scene made here.
    pub fn new(scene: SceneData) -> Self {
        Self {
            soup: TriangleSoup::new(&scene),
            camera: scene.view(1.0),
            scene,
        }
    }

    /// A built-in scene.
    pub fn builtin(name: &str, changes: &[(&str, ParamValue)]) -> Result<Self, CheckError> {
        let entries = builtin_scenes();
        let found = entries.iter().find(|e| e.name == name);
        let unknown = || CheckError::Stale(format!("there is no scene `{name}`"));
        let mut variant = found.ok_or_else(unknown)?.default_variant();
        for (key, value) in changes {
            variant.params.0.insert((*key).to_owned(), value.clone());
        }
        let scene = load(&variant, &LoadOptions::default());
        Ok(Self::new(
            scene.map_err(|e| CheckError::Other(e.to_string()))?,
        ))
    }
}

/// Everything that is made once.
pub struct World {
    /// Integer-grid soups, checked against brute force.
    pub soups: Vec<Case>,
    /// Built-in scenes, checked against the gate's reference tracer.
    pub scenes: Vec<Case>,
    /// Images of the Cornell box by plain path tracing; empty if no check needs them.
    pub reference: Vec<Image>,
    /// The adapter's name.
    pub adapter: String,
}

impl World {
    /// Makes the inputs that the checks of these mutants need.
    pub fn new(options: &Options, mutants: &[Mutant]) -> Result<Self, CheckError> {
        let has = |wanted: fn(&Subject) -> bool| mutants.iter().any(|m| wanted(&m.subject));
        let (gpu, exact) = open(options, KernelLibrary::default())?;
        let mut world = Self {
            soups: Vec::new(),
            scenes: Vec::new(),
            reference: Vec::new(),
            adapter: gpu.info.name.clone(),
        };
        if has(|s| matches!(s, Subject::Structure { .. })) {
            world.soups = SOUPS.map(soup).into();
            let scenes: Result<_, CheckError> = SCENES.iter().map(scene).collect();
            world.scenes = scenes?;
            let strained = strained_copies().map_err(|e| CheckError::Other(e.to_string()))?;
            world.scenes.push(judged(Stage::new(strained))?);
        }
        if has(|s| matches!(s, Subject::Integrators)) {
            let folder = options.folder.join("reference");
            let library = checks::plain_path_tracing(&folder)?;
            let (gpu, _) = open(options, library)?;
            let bench = checks::Bench::new(&gpu, exact, &world, &Plant::Nothing);
            let images = checks::cornell_images(&bench, checks::REFERENCE)?;
            world.reference = images;
        }
        Ok(world)
    }
}

/// A scene of these triangles, one grey, under a white sky.
pub fn plain_scene(name: String, triangles: Vec<Triangle>) -> SceneData {
    SceneData {
        name,
        material_ids: vec![0; triangles.len()],
        triangles,
        uvs: Vec::new(),
        normals: Vec::new(),
        mirrored: Vec::new(),
        colors: Vec::new(),
        materials: vec![Material::diffuse("grey", Vec3::splat(0.5))],
        textures: Vec::new(),
        assembly: None,
        camera: None,
        environment: Vec3::ONE,
        lights: Vec::new(),
        daylight: None,
        media: Vec::new(),
        framing: None,
        hash: String::new(),
        report: LoadReport::default(),
    }
}

fn soup(seed: u64) -> Case {
    let stage = Stage::new(lattice_scene(seed));
    let reference = lattice_reference(&stage.soup, seed);
    Case { stage, reference }
}

fn scene((name, changes): &(&str, &[(&str, i64)])) -> Result<Case, CheckError> {
    let changes: Vec<_> = changes
        .iter()
        .map(|&(key, value)| (key, ParamValue::Integer(value)))
        .collect();
    judged(Stage::builtin(name, &changes)?)
}

/// A scene with the gate's rays.
fn judged(stage: Stage) -> Result<Case, CheckError> {
    let reference = ReferenceTracer::new(
        &stage.scene,
        &stage.soup,
        stage.camera,
        &GATE,
        1,
        Checks::Repeated,
    )?;
    if reference.is_sound() {
        return Ok(Case { stage, reference });
    }
    let wrong = reference.first_wrong().unwrap_or_default();
    Err(CheckError::Other(format!(
        "the reference tracer is wrong: {wrong}"
    )))
}
