//! Renders one picture, for `raystone render`. Nothing is checked on the device or recorded, so
//! that the first picture appears at once; the structure is validated on the host.

use super::error::RunError;
use super::images::{Estimator, attributes};
use super::kernels::Kernels;
use super::options::RunOptions;
use super::registries::Registries;
use super::session::Session;
use super::uniform;
use super::world::{load_options, table_bytes};
use indicatif::ProgressStyle;
use raystone_accel::{AccelError, TriangleSoup};
use raystone_config::{Axis, Cell, Experiment, Plan};
use raystone_core::geometry::Camera;
use raystone_core::params::Variant;
use raystone_gpu::{Gpu, probe_arithmetic};
use raystone_image::{Attribute, FileFormat, Image, ImageError};
use raystone_render::{
    InOrder, Order, PartRenderer, Renderer, Stage, StageError, TRACED_CLASSES, Traced,
};
use raystone_scene::{self as scene, LoadReport, SceneData};
use std::path::Path;
use std::time::{Duration, Instant};

/// Target duration between progress updates.
const STEP: Duration = Duration::from_millis(500);
/// Minimum time between writes of an unfinished picture.
const REFRESH: Duration = Duration::from_secs(2);

/// Summary of a rendering.
#[derive(Debug, Clone)]
pub struct Rendering {
    /// Triangles of the scene.
    pub triangles: usize,
    /// Samples per pixel.
    pub spp: u32,
    /// Seconds from the start until the first picture was written.
    pub first_picture_s: f64,
    /// Seconds for the samples, without kernel compilation.
    pub samples_s: f64,
    /// Seconds from start to end.
    pub total_s: f64,
    /// Rays of all classes.
    pub rays: u64,
    /// Dropped and approximated content.
    pub report: LoadReport,
    /// Number of NaN or infinite pixels: a renderer bug.
    pub non_finite_pixels: usize,
    /// The likely reason, in words, if all pixels have the same value.
    pub uniform: Option<String>,
    /// Times of rendering in an order of passes.
    pub in_order: Option<InOrder>,
}

impl Rendering {
    /// Nothing rendered yet.
    fn blank(scene: &SceneData, spp: u32) -> Self {
        Self {
            triangles: scene.triangles.len(),
            spp,
            first_picture_s: 0.0,
            samples_s: 0.0,
            total_s: 0.0,
            rays: 0,
            report: scene.report.clone(),
            non_finite_pixels: 0,
            uniform: None,
            in_order: None,
        }
    }
}

/// Output files and pixel order.
#[derive(Debug, Clone, Copy)]
pub struct Pictures<'a> {
    /// The picture, in the format of its extension.
    pub file: &'a Path,
    /// Passes, each over a part of the pixels; `None` renders whole samples.
    pub order: Option<Order>,
    /// File for the first complete picture of an order; `None`: the main file.
    pub preview: Option<&'a Path>,
}

impl Pictures<'_> {
    /// Refuses an unknown ending before anything is rendered.
    fn check_formats(&self) -> Result<(), RunError> {
        for file in [Some(self.file), self.preview].into_iter().flatten() {
            FileFormat::of(file).map_err(input)?;
        }
        Ok(())
    }
}

fn write_picture(image: &Image, file: &Path, about: &[Attribute<'_>]) -> Result<(), RunError> {
    let format = FileFormat::of(file).map_err(input)?;
    let written = format.write(file, image, about);
    written.map_err(|error| match error {
        ImageError::Altered { .. } => RunError::Wrong(error.to_string()),
        _ => input(error),
    })
}

/// Renders the first scene, structure, sampler and integrator of the axes at
/// `experiment.run.spp.max()` samples into a file, whose extension selects the format. The file
/// exists after the first sample, or with an order as soon as every pixel has a colour, and is
/// rewritten as samples are added.
///
/// # Errors
/// An unknown extension, no adapter, a scene that does not load, a structure that cannot be built
/// or is invalid, a file that cannot be written, or an invalid image: see [`Renderer::image`].
pub fn render(
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
    pictures: &Pictures,
) -> Result<Rendering, RunError> {
    let start = Instant::now();
    pictures.check_formats()?;
    let cell = plan
        .times
        .first()
        .ok_or_else(|| RunError::Input("there is nothing to render".to_owned()))?;
    let kernels = Kernels::load(&plan.kernels, registries)?;
    let session = Session::unrecorded(experiment, plan, registries, options);
    let device = kernels.open(options)?;
    let gpu = device.of(&cell[Axis::Kernels])?;
    let (stage, traced, camera) = staged(&session, gpu, cell)?;
    session.say("compiling the kernel");
    let spp = experiment.run.spp.max();
    let estimator = Estimator::new(&session, cell, spp);
    let estimator = estimator.map_err(RunError::Input)?;
    if let Some(reason) = estimator.integrator.refusal(&traced) {
        return Err(RunError::Input(format!("{}: {reason}", cell[Axis::Accel])));
    }
    let job = estimator.job(&session, camera, true);
    let mut rendering = Rendering::blank(&stage.scene, spp);
    let mut show = |image: &Image, done: u32, file: &Path| {
        if rendering.first_picture_s == 0.0 {
            rendering.first_picture_s = start.elapsed().as_secs_f64();
        }
        let sampler = estimator.sampler.label();
        let about = attributes(&options.program, cell, &sampler, done, experiment.run.seed);
        write_picture(image, file, &about)
    };
    let compiled;
    let image = if let Some(order) = pictures.order {
        let renderer = PartRenderer::new(gpu, &stage.buffers, &traced, &job)?;
        compiled = Instant::now();
        let first = pictures.preview.unwrap_or(pictures.file);
        let samples = (spp, experiment.run.seed);
        let spent = renderer.render(order, samples, |renderer| match renderer.preview()? {
            Some(preview) => show(&preview, 1, first),
            None => Ok(()),
        })?;
        let image = renderer.image(spp)?;
        show(&image, spp, pictures.file)?;
        rendering.in_order = Some(spent);
        image
    } else {
        let renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, true)?;
        compiled = Instant::now();
        let image = add_all_samples(&session, &renderer, spp, |image, done| {
            show(image, done, pictures.file)
        })?;
        rendering.rays = renderer.ray_counts()?[..TRACED_CLASSES].iter().sum();
        image
    };
    rendering.samples_s = compiled.elapsed().as_secs_f64();
    rendering.non_finite_pixels = image.non_finite_pixels();
    // The stage's own triangles were given up for the memory of the rendering.
    let soup = || TriangleSoup::new(&stage.scene).intersecting(stage.soup.intersection);
    rendering.uniform = uniform::remark(&image, &stage.scene, soup, camera);
    rendering.total_s = start.elapsed().as_secs_f64();
    session.progress.bar.finish_and_clear();
    Ok(rendering)
}

fn input(error: impl ToString) -> RunError {
    RunError::Input(error.to_string())
}

/// The scene of a cell with its structure, and the camera: that of the experiment, of the scene, or one that frames the scene.
fn staged(session: &Session, gpu: &Gpu, cell: &Cell) -> Result<(Stage, Traced, Camera), RunError> {
    let (scene, accel) = (&cell[Axis::Scene], &cell[Axis::Accel]);
    session.say(format!("{scene}: loading"));
    let load = load_options(session.options, table_bytes(&gpu.limits));
    let scene_data = scene::load(scene, &load).map_err(input)?;
    let own = || scene_data.view(session.experiment.aspect());
    let camera = session.experiment.camera.unwrap_or_else(own);
    scene::check_camera(&camera).map_err(input)?;
    let tests = session.registries.intersection(cell);
    let tests = tests.map_err(RunError::Input)?;
    let kept = tests.kept_by(&probe_arithmetic(gpu)?);
    kept.map_err(RunError::Input)?;
    let mut stage = Stage::new(gpu, scene_data, tests)?;
    session.say(format!("{scene}: building {accel}"));
    let traced = build(session, &stage, accel)?;
    stage.soup = TriangleSoup::default().intersecting(tests);
    Ok((stage, traced, camera))
}

/// The structure of an experiment over the stage's scene.
fn build(session: &Session, stage: &Stage, accel: &Variant) -> Result<Traced, RunError> {
    let kind = session.registries.accel.get(&accel.name);
    let kind = kind.ok_or_else(|| RunError::Input(format!("no structure is called {accel}")))?;
    stage.traced(kind, &accel.params).map_err(|e| match e {
        StageError::Gpu(error) => error.into(),
        StageError::Accel(AccelError::Invalid(fault)) => {
            RunError::Wrong(format!("{accel} is not valid: {fault}"))
        }
        error => input(error),
    })
}

/// Adds `spp` samples in steps of about [`STEP`]. Calls `show` with the image and its samples after
/// the first, whenever the samples have doubled and [`REFRESH`] has passed, and at the end.
fn add_all_samples(
    session: &Session,
    renderer: &Renderer,
    spp: u32,
    mut show: impl FnMut(&Image, u32) -> Result<(), RunError>,
) -> Result<Image, RunError> {
    let seed = session.experiment.run.seed;
    let style =
        ProgressStyle::with_template("{bar:32} {pos}/{len} spp · {elapsed} · about {eta} left");
    if let Ok(style) = style {
        session.progress.bar.set_style(style);
    }
    session.progress.bar.set_length(u64::from(spp));
    renderer.reset()?;
    let start = Instant::now();
    let (mut done, mut shown, mut last) = (0, 0, start);
    loop {
        let speed = f64::from(done) / start.elapsed().as_secs_f64().max(1e-6);
        let step = (speed * STEP.as_secs_f64()).max(1.0) as u32;
        let step = step.min(spp - done);
        renderer.add_samples(done, step, seed)?;
        done += step;
        session.progress.bar.set_position(u64::from(done));
        let due = done >= 2 * shown && last.elapsed() >= REFRESH;
        if shown == 0 || due || done == spp {
            let image = renderer.image()?;
            show(&image, done)?;
            (shown, last) = (done, Instant::now());
            if done == spp {
                return Ok(image);
            }
        }
    }
}
