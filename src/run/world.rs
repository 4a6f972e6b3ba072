//! A scene made ready: loaded, uploaded, judged.

use super::RunError;
use super::kernels::Device;
use super::session::Session;
use crate::accel::Intersection;
use crate::config::Experiment;
use crate::geometry::Camera;
use crate::gpu::{ArithmeticProbe, Gpu};
use crate::integrator::{RayOffset, Stage};
use crate::measure::gate::{Checks, Judge};
use crate::measure::record::{Body, Key, Line, Ran, SceneRecord, axis};
use crate::params::Variant;
use crate::scene::{self, LoadOptions, SceneData};
use std::time::Instant;

/// A scene with everything that its cells share.
pub(super) struct World<'a> {
    pub device: &'a Device,
    /// The device with the embedded kernels.
    pub gpu: &'a Gpu,
    pub probe: ArithmeticProbe,
    pub variant: &'a Variant,
    pub stage: Stage,
    pub camera: Camera,
    pub judge: Judge,
}

impl std::ops::Deref for World<'_> {
    type Target = Stage;

    fn deref(&self) -> &Stage {
        &self.stage
    }
}

/// Why there is no world.
pub(super) enum Absent {
    /// The scene is at fault.
    BadInput(String),
    /// The adapter does not keep what the experiment asks for: its cells are left out.
    NotKept(String),
}

impl From<Absent> for RunError {
    fn from(absent: Absent) -> Self {
        let (Absent::BadInput(reason) | Absent::NotKept(reason)) = absent;
        Self::Input(reason)
    }
}

impl From<String> for Absent {
    fn from(reason: String) -> Self {
        Self::BadInput(reason)
    }
}

impl<'a> World<'a> {
    /// Loads, uploads and judges a scene. The inner error concerns this scene alone.
    pub fn new(
        session: &mut Session,
        device: &'a Device,
        variant: &'a Variant,
    ) -> Result<Result<Self, Absent>, RunError> {
        let gpu = &device.gpu;
        session.say(format!("{variant}: loading"));
        let start = Instant::now();
        let options = LoadOptions {
            allow_outside: session.options.allow_outside,
            ..LoadOptions::default()
        };
        let loaded = session
            .clock
            .time("load", || scene::load(variant, &options));
        let scene = match loaded {
            Ok(scene) => scene,
            Err(error) => return Ok(Err(Absent::BadInput(error.to_string()))),
        };
        let load_ms = start.elapsed().as_secs_f64() * 1e3;
        let camera = session
            .experiment
            .camera
            .unwrap_or_else(|| scene.view(session.experiment.aspect()));
        if let Err(error) = camera.validate() {
            return Ok(Err(Absent::BadInput(error.to_string())));
        }
        let cell = format!("scene {variant}");
        if !session.is_done(&cell) {
            for line in scene.report.lines() {
                session.tell_warning(&format!("{variant}: {line}"));
            }
            let key = Key::default().with_variant(axis::SCENE, variant);
            let record = Body::Scene(scene_record(&scene, camera, load_ms));
            session.write(&Line::new(key, Ran::default(), record).hashed(&scene.hash))?;
            session.finish(cell);
        }
        session.say(format!("{variant}: checking the judge"));
        let probe = match session.options.arithmetic {
            Some(known) => Ok(known),
            None => session
                .clock
                .time("gate", || crate::gpu::probe_arithmetic(gpu)),
        };
        let fault = |reason: String| Ok(Err(Absent::BadInput(reason)));
        let probe = match probe {
            Ok(probe) => probe,
            Err(error) => return fault(error.to_string()),
        };
        let (intersection, offset) = match chosen_tests(session.experiment, &probe) {
            Ok(chosen) => chosen,
            Err(absent) => return Ok(Err(absent)),
        };
        let staged = session
            .clock
            .time("load", || Stage::new(gpu, scene, intersection));
        let mut stage = match staged {
            Ok(stage) => stage,
            Err(error) => return fault(error.to_string()),
        };
        stage.buffers.offset = offset;
        let experiment = session.experiment;
        let mut settings = experiment.gate;
        settings.rays = settings.rays.max(experiment.timing.rays);
        let judged = session.clock.time("judge", || {
            let seed = u64::from(experiment.seed);
            Judge::new(
                &stage.scene,
                &stage.soup,
                camera,
                &settings,
                seed,
                Checks::Kept,
            )
        });
        Ok((|| {
            let judge = judged.map_err(|e| e.to_string())?;
            Ok(Self {
                device,
                gpu,
                probe,
                variant,
                stage,
                camera,
                judge,
            })
        })())
    }

    /// What everything on this scene has in common, with these kernels.
    pub fn key(&self, kernels: &Variant) -> Key {
        let tests = self.soup.intersection;
        Key::with_kernels(kernels)
            .with_variant(axis::SCENE, self.variant)
            .with(axis::TRIANGLE, tests.triangle.name())
            .with(axis::BOX_TEST, tests.box_test.name())
            .with(axis::OFFSET, self.buffers.offset.name())
    }
}

/// How rays meet triangles and leave surfaces in an experiment, on an adapter of this arithmetic.
pub(super) fn chosen_tests(
    experiment: &Experiment,
    probe: &ArithmeticProbe,
) -> Result<(Intersection, RayOffset), Absent> {
    let tests = experiment.tests;
    let chosen = Intersection::named(tests.triangle, tests.box_test)?;
    let offset = RayOffset::named(tests.offset)
        .ok_or_else(|| format!("no ray offset is called {}", tests.offset))?;
    chosen.kept_by(probe).map_err(Absent::NotKept)?;
    Ok((chosen, offset))
}

fn scene_record(scene: &SceneData, camera: Camera, load_ms: f64) -> SceneRecord {
    let bounds = scene.bounds();
    SceneRecord {
        triangles: scene.triangles.len(),
        bounds_min: bounds.min.to_array(),
        bounds_max: bounds.max.to_array(),
        load_ms,
        bytes: scene.bytes() as u64,
        materials: scene.materials.len(),
        textures: scene.textures.len(),
        emitters: scene.emitters().len(),
        camera,
        report: scene.report.clone(),
        scene_hash: scene.hash.clone(),
    }
}
