//! Origins of rays at known points, by the device: images look the same with offsets that are too small or too large by far,
//! and self-shadowing shows on few surfaces.

use super::position_error;
use crate::slice::{Slice, job_uniform};
use crate::{RenderJob, SceneBuffers};
use glam::DVec3;
use raystone_core::random::Pcg32;
use raystone_gpu::{Bindings, Composition, Gpu, GpuError, Recording, groups_for};

/// First corner, edges from it, point and unit normal.
type Point = [[f32; 3]; 5];
const COUNT: u32 = 256;
/// Relative difference from the host's where the adapter rounds otherwise: a few roundings.
const ROUNDING: f32 = 1e-6;

/// What is wrong with the offset of a job on this scene: bounds and origins are not those of the host, or a ray begins
/// within the bound. `None` if nothing is.
///
/// # Errors
/// The kernel does not compile, or the device is lost or hangs.
pub fn fault_of_offset(
    gpu: &Gpu,
    scene: &SceneBuffers,
    job: &RenderJob,
    is_exact: bool,
) -> Result<Option<String>, GpuError> {
    let points = points();
    let found = on_device(gpu, scene, job, &points)?;
    let wrong = points.iter().zip(&found).find_map(|(point, found)| {
        let [v0, e1, e2, p, n] = *point;
        let error = position_error(v0, e1, e2, &scene.transform_error);
        let expected = [error, (job.offset.offset_point)(p, n, error)];
        let agrees = (expected.as_flattened().iter().zip(found.as_flattened())).all(|(a, b)| {
            let is_near = (a - b).abs() <= ROUNDING * a.abs();
            a.to_bits() == b.to_bits() || is_near && !is_exact
        });
        let inside = job.offset.is_unbiased && !leaves(*point, *found);
        (!agrees || inside).then(|| {
            let why = if agrees { ", which is within it" } else { "" };
            format!(
                "the offset `{}` of a ray at {p:?} along {n:?}, on the triangle {v0:?}, {e1:?}, {e2:?}, has the bound and origin \
                 {found:?}{why}, and should have {expected:?}",
                job.offset.name
            )
        })
    });
    Ok(wrong)
}

/// Whether the origin is out of the box of the bound around the point, along the normal.
fn leaves([.., p, n]: Point, [error, origin]: [[f32; 3]; 2]) -> bool {
    let [p, n, error, origin] = [p, n, error, origin].map(|v| DVec3::from(v.map(f64::from)));
    let moved = (origin - p).dot(n);
    let least = n.abs().dot(error.abs()) * (1.0 - 1e-6);
    // An origin is rounded to the digits of its point; away from it only where it is moved.
    moved >= least - 1e-7 * p.abs().dot(n.abs())
}

/// Far and near ones, some with coordinates or components that are 0, on large and small triangles.
fn points() -> Vec<Point> {
    let mut random = Pcg32::new(71);
    let mut along = |size: f64| {
        let keep = random.below(8) as u32;
        let v = random.in_cube() * size;
        let axis = |axis: u32, x: f64| if keep >> axis == 1 { 0.0 } else { x as f32 };
        [axis(0, v.x), axis(1, v.y), axis(2, v.z)]
    };
    (0..COUNT as i32)
        .map(|k| {
            let size = 10.0_f64.powi(k % 7 - 3);
            let [v0, e1, e2, n] = [
                along(30.0 * size),
                along(size),
                along(4.0 * size),
                along(1.0),
            ];
            let normal = DVec3::from(n.map(f64::from)).normalize_or(DVec3::Z);
            let p = [0, 1, 2].map(|a| v0[a] - 0.25 * e1[a] + 0.5 * e2[a]);
            [v0, e1, e2, p, normal.as_vec3().to_array()]
        })
        .collect()
}

fn on_device(
    gpu: &Gpu,
    scene: &SceneBuffers,
    job: &RenderJob,
    points: &[Point],
) -> Result<Vec<[[f32; 3]; 2]>, GpuError> {
    let kernel = Composition::new("integrator/known_offsets")
        .feature("transforms", scene.features.transforms);
    let pipeline = gpu.pipeline(&job.offset.activate(kernel), true)?;
    let wide = |v: [f32; 3]| [v[0], v[1], v[2], 0.0];
    let words: Vec<[[f32; 4]; 5]> = points.iter().map(|point| point.map(wide)).collect();
    let origins = gpu.zeroed("origins", u64::from(COUNT) * 32)?;
    let mut bindings = Bindings::new();
    bindings
        .uniform("frame", Slice::default().uniform(&job_uniform(job, scene)))
        .buffer("points", &gpu.storage("points", words.as_flattened())?)
        .buffer("origins", &origins);
    let mut recording = Recording::new();
    recording
        .run("known offsets", &pipeline, &bindings, groups_for(COUNT))
        .download("origins", &origins);
    let found: Vec<[[f32; 4]; 2]> = gpu.play(&recording)?.download("origins")?;
    let narrow = |[x, y, z, _]: [f32; 4]| [x, y, z];
    Ok(found.into_iter().map(|one| one.map(narrow)).collect())
}
