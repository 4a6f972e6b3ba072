//! A loaded, uploaded scene with its reference tracer.

use super::device::Device;
use super::error::{Fault, RunError};
use super::known_scenes;
use super::options::RunOptions;
use super::session::Session;
use raystone_config::{Axis, Cell};
use raystone_core::geometry::Camera;
use raystone_core::params::Variant;
use raystone_gpu::{ArithmeticProbe, Gpu};
use raystone_record::{Body, Key, Line, Ran};
use raystone_render::Stage;
use raystone_scene::{self as scene, LoadOptions, SceneData};
use raystone_verify::gate::{Checks, ReferenceTracer};
use raystone_verify::scene_record::scene_record;
use std::sync::Arc;
use std::time::Instant;

pub(super) struct Loaded {
    scene: Arc<SceneData>,
    camera: Camera,
}

/// A scene with its triangle and box tests, and everything its cells share.
pub(super) struct World<'a> {
    pub device: &'a Device,
    /// The device with the embedded kernels.
    pub gpu: &'a Gpu,
    pub probe: ArithmeticProbe,
    /// Common part of this world's cells: see [`Cell::WORLD`].
    pub cell: Cell,
    pub stage: Stage,
    pub camera: Camera,
    pub reference: ReferenceTracer,
}

impl std::ops::Deref for World<'_> {
    type Target = Stage;

    fn deref(&self) -> &Stage {
        &self.stage
    }
}

pub(super) enum NoWorld {
    /// The scene is invalid.
    BadInput(String),
    /// The adapter does not support what the experiment requires: its cells are skipped.
    NotKept(String),
}

impl From<NoWorld> for RunError {
    fn from(absent: NoWorld) -> Self {
        let (NoWorld::BadInput(reason) | NoWorld::NotKept(reason)) = absent;
        Self::Input(reason)
    }
}

impl From<String> for NoWorld {
    fn from(reason: String) -> Self {
        Self::BadInput(reason)
    }
}

/// Bytes that an adapter can bind for a scene's tables.
pub fn table_bytes(limits: &wgpu::Limits) -> u64 {
    let binding = limits.max_storage_buffer_binding_size;
    binding.min(limits.max_buffer_size)
}

/// Scene loading options for an adapter with this binding limit.
pub fn load_options(options: &RunOptions, table_bytes: u64) -> LoadOptions {
    LoadOptions {
        allow_outside: options.allow_outside,
        table_bytes,
        ..LoadOptions::default()
    }
}

impl Loaded {
    /// Loads a scene for a device and records it.
    pub(super) fn new(session: &mut Session, gpu: &Gpu, variant: &Variant) -> Result<Self, Fault> {
        session.say(format!("{variant}: loading"));
        let start = Instant::now();
        let options = load_options(session.options, table_bytes(&gpu.limits));
        let loaded = session
            .clock
            .time("load", || scene::load(variant, &options));
        let scene = loaded.map_err(|e| e.to_string())?;
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        if let Some(fault) = known_scenes::fault(variant, &scene) {
            return Err(RunError::Wrong(fault).into());
        }
        let own = || scene.view(session.experiment.aspect());
        let camera = session.experiment.camera.unwrap_or_else(own);
        raystone_scene::check_camera(&camera).map_err(|e| e.to_string())?;
        session.recorder.note_scene(variant, &scene.hash);
        let cell = format!("scene {variant}");
        if !session.ledger.is_done(&cell) {
            for line in scene.report.lines() {
                session.tell_warning(&format!("{variant}: {line}"));
            }
            let key = Key::from(&Cell::default().with(Axis::Scene, variant));
            let record = Body::Scene(scene_record(&scene, camera, load_ms));
            session
                .recorder
                .write(&Line::new(key, Ran::default(), record).hashed(&scene.hash))?;
            session.ledger.finish(cell);
        }
        Ok(Self {
            scene: Arc::new(scene),
            camera,
        })
    }
}

impl<'a> World<'a> {
    /// Uploads a scene and checks the reference tracer with a cell's tests.
    pub(super) fn new(
        session: &mut Session,
        device: &'a Device,
        loaded: &Loaded,
        cell: &Cell,
    ) -> Result<Self, NoWorld> {
        let gpu = &device.gpu;
        session.say(format!("{cell}: checking the reference tracer"));
        let tests = session.registries.intersection(cell)?;
        let probe = match session.options.arithmetic {
            Some(known) => known,
            None => (session.clock)
                .time("gate", || raystone_gpu::probe_arithmetic(gpu))
                .map_err(|e| e.to_string())?,
        };
        tests.kept_by(&probe).map_err(NoWorld::NotKept)?;
        let stage = session
            .clock
            .time("load", || Stage::new(gpu, Arc::clone(&loaded.scene), tests))
            .map_err(|e| e.to_string())?;
        let experiment = session.experiment;
        let mut settings = experiment.gate;
        settings.rays = settings.rays.max(experiment.timing.rays);
        let reference = session.clock.time("judge", || {
            let seed = u64::from(experiment.run.seed);
            ReferenceTracer::new(
                &stage.scene,
                &stage.soup,
                loaded.camera,
                &settings,
                seed,
                Checks::Kept,
            )
        });
        Ok(Self {
            device,
            gpu,
            probe,
            cell: cell.clone(),
            stage,
            camera: loaded.camera,
            reference: reference.map_err(|e| e.to_string())?,
        })
    }
}
