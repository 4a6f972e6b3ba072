//! Checks of integrators: images whose pixels are known, and the Cornell box against plain path tracing.

use super::{Bench, Finding};
use crate::CheckError;
use crate::plant::Plant;
use crate::subject::{build, sampler};
use crate::world::Stage;
use crate::world::plain_scene;
use glam::Vec3;
use raystone::geometry::{Camera, Triangle};
use raystone::gpu::KernelLibrary;
use raystone::image::Image;
use raystone::integrator::RayOffset;
use raystone::integrator::{IntegratorRegistry, RenderJob, Renderer, SceneBuffers, Traced};
use raystone::measure::bias::{BiasOptions, BiasVerdict, check_bias};
use raystone::measure::statistics::{mean, variance};
use raystone::params::{ParamValue, Params, Variant};
use raystone::sampling::{Demand, Sampler, dimensions};
use raystone::scene::Material;
use std::path::Path;

const SIZE: u32 = 16;
/// Bounces of every path: beyond the first that may end by roulette.
const MAX_DEPTH: i64 = 6;
/// A difference of more standard errors than this is no accident (5 · 10⁻⁵ for 24 replicates).
const STANDARD_ERRORS: f64 = 5.0;
/// Relative error of f32 sums.
const ROUNDING: f64 = 1e-5;

/// Replicates and samples per pixel of each, and the first seed.
#[derive(Clone, Copy)]
pub struct Replicates {
    count: u32,
    spp: u32,
    seed: u32,
}

/// Of the reference.
pub const REFERENCE: Replicates = Replicates {
    count: 12,
    spp: 192,
    seed: 500_000,
};
const CORNELL: Replicates = Replicates {
    count: 16,
    spp: 32,
    seed: 1000,
};
const BOX: Replicates = Replicates {
    count: 24,
    spp: 4,
    seed: 2000,
};
const ONE: Replicates = Replicates {
    count: 1,
    spp: 16,
    seed: 3,
};

/// Kernels without next-event estimation: the simplest estimator of the same image.
pub fn plain_path_tracing(folder: &Path) -> Result<KernelLibrary, CheckError> {
    let text = "@if(!queued) *result += limited(throughput * direct_light(surface, depth, sampler), depth);";
    let weight = "weight = found_weight(density, light_pdf(leaving, surface, hit));";
    let file = "integrator/path";
    let no_direct_light = Plant::Kernel {
        file,
        from: text,
        to: "",
        times: 1,
    };
    let full_weight = Plant::Kernel {
        file,
        from: weight,
        to: "weight = 1.0;",
        times: 1,
    };
    full_weight.library_over(&no_direct_light.library(folder)?, folder)
}

/// Independent samples.
fn independent() -> Result<Sampler, CheckError> {
    let demand = Demand {
        samples: None,
        dimensions: dimensions::needed(MAX_DEPTH as u32),
        width: Some(SIZE),
    };
    sampler(("pixel-hash", &[]), "none", &demand, &Plant::Nothing)
}

/// Images of a scene, or the error word that a kernel raised.
fn render(
    bench: &Bench,
    stage: &Stage,
    (name, change): (&str, (&str, ParamValue)),
    replicates: Replicates,
) -> Result<Vec<Image>, CheckError> {
    let variant = Variant {
        name: name.to_owned(),
        params: Params([(change.0.to_owned(), change.1)].into()),
        ..Variant::default()
    };
    let integrator = IntegratorRegistry::default().configured(&variant);
    let integrator = integrator.map_err(|e| CheckError::Stale(e.to_string()))?;
    let built = build("bvh", &[], &stage.soup)?;
    let traced = Traced::upload(bench.gpu, &*built)?;
    let buffers = SceneBuffers::upload(bench.gpu, &stage.scene, &stage.soup)?;
    let sampler = independent()?;
    let job = RenderJob {
        size: [SIZE; 2],
        camera: stage.camera,
        sampler: &sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(bench.gpu, &buffers, &traced, &job, false)?;
    let one = |k: u32| -> Result<Image, CheckError> {
        let mut shots = renderer.render(&[replicates.spp], replicates.seed + 77 * k)?;
        Ok(shots.remove(0).image)
    };
    (0..replicates.count).map(one).collect()
}

fn path(depth: i64) -> (&'static str, (&'static str, ParamValue)) {
    ("path", ("max_depth", ParamValue::Integer(depth)))
}

/// The box of walls that emit as much as they absorb, and the white sphere under a white sky.
pub fn furnace(bench: &Bench) -> Finding {
    let albedo = 0.8;
    let stage = Stage::builtin("furnace-box", &[("albedo", ParamValue::Number(albedo))])?;
    let images = render(bench, &stage, path(MAX_DEPTH), BOX)?;
    let means: Vec<f64> = images.iter().map(Image::mean).collect();
    let right = 1.0 - albedo.powi(MAX_DEPTH as i32 + 1);
    let error = (variance(&means).unwrap_or(f64::NAN) / means.len() as f64).sqrt();
    let found = mean(&means).unwrap_or(f64::NAN);
    let agrees = (found - right).abs() <= STANDARD_ERRORS * error + ROUNDING * right;
    // NaN does not agree.
    if !agrees {
        return Ok(Some(format!(
            "furnace-box: {found:.5} ± {error:.5}, not {right:.5}"
        )));
    }
    if error > 0.02 * right {
        return Ok(Some(format!("furnace-box: an error of {error:.5}")));
    }
    let stage = Stage::builtin("white-furnace", &[])?;
    let images = render(bench, &stage, path(MAX_DEPTH), ONE)?;
    let pixels = images.iter().flat_map(|i| &i.pixels).flatten();
    let off = |v: &&f32| v.is_nan() || (**v - 1.0).abs() >= 1e-5;
    Ok(pixels
        .filter(off)
        .max_by(|a, b| a.total_cmp(b))
        .map(|v| format!("white-furnace: a pixel of {v}, not 1")))
}

/// Ambient occlusion of a closed box, long and short rays, and of a convex body.
pub fn occlusion(bench: &Bench) -> Finding {
    let inside = Stage::builtin("furnace-box", &[])?;
    let outside = Stage::builtin("white-furnace", &[])?;
    for (stage, radius, least, most) in [
        (&inside, 2.0, 0.0, 0.0),
        (&inside, 0.1, 0.2, 0.95),
        (&outside, 2.0, 1.0, 1.0),
    ] {
        let what = ("ao", ("radius", ParamValue::Number(radius)));
        let images = render(bench, stage, what, ONE)?;
        let found = images[0].mean();
        if !(least..=most).contains(&found) {
            let scene = &stage.scene.name;
            return Ok(Some(format!(
                "{scene}: {found} of the rays of length {radius} are free, not {least} to {most}"
            )));
        }
    }
    Ok(None)
}

/// Height of the thin box: five times the default offset of a ray from its walls.
const GAP: f32 = 2e-5;
/// Of a square of 2 × 2 units, in turn.
const CORNERS: [(f32, f32); 4] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)];

/// A closed box of 4 × 4 units and [`GAP`], seen from its middle, below a lamp and a white sky: an upper
/// bound of ray offsets. Rays that begin farther off their wall than the box is high are outside.
fn thin_box() -> Stage {
    let mut mesh = Vec::new();
    for (axis, end) in (0..3).flat_map(|axis| [(axis, -1.0), (axis, 1.0)]) {
        let corner = |(u, v): (f32, f32)| {
            let mut p = Vec3::splat(end);
            [p[(axis + 1) % 3], p[(axis + 2) % 3]] = [u, v];
            p * Vec3::new(2.0, GAP / 2.0, 2.0)
        };
        let [a, b, c, d] = CORNERS.map(corner);
        mesh.extend([[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices }));
    }
    let walls = mesh.len();
    let [a, b, c, d] = CORNERS.map(|(x, z)| Vec3::new(x, 1.0, z));
    mesh.extend([[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices }));
    let mut scene = plain_scene("thin box".to_owned(), mesh);
    let shining = Material::diffuse("lamp", Vec3::splat(0.5)).emitting(Vec3::ONE);
    scene.materials.push(shining);
    scene.material_ids[walls..].fill(1);
    scene.camera = Some(Camera {
        eye: Vec3::new(0.1, 0.0, 0.2),
        target: Vec3::new(1.1, 0.0, 0.5),
        up: Vec3::Y,
        vertical_fov_degrees: 60.0,
    });
    Stage::new(scene)
}

/// The thin box is dark inside, to the last bit.
pub fn thin_walls(bench: &Bench) -> Finding {
    let stage = thin_box();
    let long = ("ao", ("radius", ParamValue::Number(2.0)));
    for what in [path(MAX_DEPTH), long] {
        let name = what.0;
        let images = render(bench, &stage, what, ONE)?;
        let pixels = images.iter().flat_map(|i| &i.pixels).flatten();
        let lit = pixels.filter(|v| **v != 0.0).count();
        if lit > 0 {
            return Ok(Some(format!(
                "{name}: {lit} values in a dark box are not 0"
            )));
        }
    }
    Ok(None)
}

/// Images of the Cornell box.
pub fn cornell_images(bench: &Bench, replicates: Replicates) -> Result<Vec<Image>, CheckError> {
    let stage = Stage::builtin("cornell-box", &[])?;
    render(bench, &stage, path(MAX_DEPTH), replicates)
}

/// The bias check against the reference, per tile and for the whole image.
pub fn bias(bench: &Bench) -> Finding {
    let images = cornell_images(bench, CORNELL)?;
    let check = check_bias(&images, &bench.world.reference, BiasOptions::default());
    let check = check.map_err(|e| CheckError::Other(e.to_string()))?;
    let z = check.whole.map_or(0.0, |whole| whole.t);
    let rejected = check.rejected.len();
    let tiles = format!("{rejected} of {} tiles rejected, z = {z:.1}", check.tiles);
    match check.verdict {
        BiasVerdict::NoBiasFound if z.abs() <= STANDARD_ERRORS => Ok(None),
        BiasVerdict::NotTestable(reason) => Ok(Some(reason)),
        _ => Ok(Some(tiles)),
    }
}
