//! Correctness check of paths that begin at rasterised triangles: against those that begin with rays through the centres of pixels,
//! which the image oracle judges.

use super::paths::{Subject, TRIAL, drawn, subject};
use super::session::Session;
use super::world::World;
use glam::{Vec3, vec3};
use raystone_config::{Axis, Cell};
use raystone_core::geometry::Camera;
use raystone_core::params::ParamValue;
use raystone_gpu::GpuError;
use raystone_image::Image;
use raystone_record::PathsRecord;
use raystone_render::{ConfiguredIntegrator, Traced};
use raystone_sampling::Sampler;
use raystone_verify::image_gate::{Frame, Pixels};
use raystone_verify::trial_scenes::trial_scenes_of;

/// Not a multiple of the 64 words that a row is padded to.
const FRAME: Frame = Frame {
    size: [101, 75],
    ..TRIAL
};
/// One pixel in this many may have another value, since rasterisers move vertices by fractions of a pixel. Measured: one in 500.
const MOVED: usize = 200;
/// The trial scene with holes.
const HOLES: &str = "fences";

/// The verdict on a cell whose first hits are rasterised, on its scene and on one with holes; `None` for another cell.
///
/// # Errors
/// A kernel does not compile, or the device is lost.
pub(super) fn judged(
    session: &Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
) -> Result<Option<PathsRecord>, String> {
    let integrator = session.registries.integrator(cell)?;
    if !integrator.facts.is_rasterised {
        return Ok(None);
    }
    if let Some(reason) = integrator.refusal(traced) {
        return Err(reason);
    }
    let mut centred = cell[Axis::Integrator].clone();
    let centre = ParamValue::Name("centre".to_owned());
    centred.params.0.insert("primary".to_owned(), centre);
    let centred = cell.clone().with(Axis::Integrator, &centred);
    let (subject, centred) = subject(session, world, traced, &centred)?;
    let both = [&integrator, &centred];
    let mut record = compared(session, &subject, both)?;
    let trials = trial_scenes_of(&session.registries.kinds).map_err(|e| e.to_string())?;
    for trial in trials.iter().filter(|trial| trial.scene.name == HOLES) {
        let (stage, traced) = subject.stage_of(session.registries, &trial.scene)?;
        record = record.and(compared(session, &subject.on(&stage, &traced), both)?);
    }
    Ok(Some(record))
}

/// Compares images from two places.
fn compared(
    session: &Session,
    subject: &Subject,
    [rasterised, centred]: [&ConfiguredIntegrator; 2],
) -> Result<PathsRecord, String> {
    let (sampler, pixels) = drawn(session, subject, rasterised, &FRAME)?;
    let images = |integrator| images(subject, integrator, &sampler, &pixels);
    let images = images(rasterised).and_then(|found| Ok([found, images(centred)?]));
    let [found, wanted] = images.map_err(|e| e.to_string())?;
    let pairs = found.iter().zip(&wanted);
    let pairs: Vec<_> = pairs
        .flat_map(|(a, b)| a.pixels.iter().zip(&b.pixels))
        .collect();
    let bits = |colour: &[f32; 3]| colour.map(f32::to_bits);
    let other = pairs.iter().filter(|(a, b)| bits(a) != bits(b)).count();
    let most = pairs.len() / MOVED;
    Ok(PathsRecord {
        paths: pairs.len(),
        fault: (other > most).then(|| format!("{other} of {} pixels that begin at rasterised triangles have another value than with rays through their centres; edges of triangles explain {most}", pairs.len())),
        ..PathsRecord::default()
    })
}

/// By the camera, and from within the scene: then some of it lies behind the eye.
fn images(
    subject: &Subject,
    integrator: &ConfiguredIntegrator,
    sampler: &Sampler,
    pixels: &Pixels,
) -> Result<Vec<Image>, GpuError> {
    let bounds = subject.stage.soup.bounds();
    let [low, high] = [bounds.min, bounds.max].map(Vec3::from);
    let eye = low + (high - low) * vec3(0.5, 0.7, 0.3);
    let within = Camera {
        eye,
        target: eye + (subject.camera.target - subject.camera.eye),
        ..subject.camera
    };
    let mut renderer = subject.renderer(integrator, sampler, pixels, false)?;
    let cameras = [subject.camera, within].into_iter();
    let images = cameras.map(|camera| {
        renderer.look(camera)?;
        Ok(renderer.render(&[1], pixels.seed)?.remove(0).image)
    });
    images.collect()
}
