//! What long paths lose or gain where nothing is absorbed: a closed box of albedo 1, a ball of glass.

use super::stage::{self, Stage};
use super::{Gauge, NumericsError};
use crate::gpu::Gpu;
use crate::integrator::{ConfiguredIntegrator, CountedRays, Integrator, IntegratorFacts};
use crate::measure::statistics::{mean, variance};
use crate::params::{Params, Variant};
use crate::sampling::dimensions;
use crate::scene::{DEFAULT_IOR, Material, SceneData};
use glam::Vec3;

/// Bounces of the longest walk.
const DEPTH: u32 = 64;
/// Sides of the images, pixels, and samples per pixel: quick or not.
const SIZE: u32 = 32;
const SPP: [u32; 2] = [256, 32];
/// Depths of the path tracer; it allows 20.
const PATH_DEPTHS: [&[i64]; 2] = [&[1, 20], &[20]];
const GLASS_DEPTH: i64 = 20;

/// The walk of `kernels/stress/energy.wesl` in the place of an integrator.
struct Walk;

impl Integrator for Walk {
    fn name(&self) -> &'static str {
        "energy-walk"
    }

    fn description(&self) -> &'static str {
        "what is left of the energy of a diffuse walk: a numerical check, not an image"
    }

    fn kernel(&self) -> &'static str {
        "stress/energy"
    }

    fn constants(&self, _: &Params) -> Vec<(&'static str, u32)> {
        vec![("MAX_DEPTH", DEPTH)]
    }

    fn facts(&self, _: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::needed(DEPTH),
            rays: vec![CountedRays::Bounce],
            needs_inline: true,
            ..Default::default()
        }
    }
}

static WALK: Walk = Walk;

/// The furnace box with walls of albedo 1 that emit `emission`.
fn white_box(emission: f32) -> Result<SceneData, NumericsError> {
    let mut scene = stage::scene("furnace-box")?;
    for material in &mut scene.materials {
        material.base_color = Vec3::ONE;
        material.emission = Vec3::splat(emission);
    }
    Ok(scene)
}

/// Energy left by walks of up to 64 bounces, and by the path tracer with light and roulette.
pub fn figures(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let spp = SPP[usize::from(quick)];
    let mut figures = walk(gpu, spp)?;
    let stage = Stage::new(gpu, &white_box(1.0)?)?;
    for depth in PATH_DEPTHS[usize::from(quick)] {
        figures.push(path(gpu, &stage, *depth, spp)?);
    }
    figures.push(glass(gpu, spp)?);
    Ok(figures)
}

/// The radiance in a ball of glass under a white sky: the square of its index, wherever one looks.
fn glass(gpu: &Gpu, spp: u32) -> Result<Gauge, NumericsError> {
    let mut scene = stage::scene("white-furnace")?;
    scene.materials = vec![Material::dielectric("glass", Vec3::ONE, DEFAULT_IOR)];
    if let Some(camera) = &mut scene.camera {
        camera.eye = Vec3::new(0.1, -0.2, 0.3);
    }
    let stage = Stage::new(gpu, &scene)?;
    let pixels = radiance(gpu, &stage, GLASS_DEPTH, spp)?;
    let truth = f64::from(DEFAULT_IOR * DEFAULT_IOR);
    let found = mean(&pixels).unwrap_or(f64::NAN);
    Ok(Gauge::checked(
        "radiance in a ball of glass, off the square of its index",
        (found / truth - 1.0).abs(),
        1e-4,
        "relative",
        format!("{GLASS_DEPTH} bounces; nearly every path leaves at the first"),
    ))
}

fn walk(gpu: &Gpu, spp: u32) -> Result<Vec<Gauge>, NumericsError> {
    let stage = Stage::new(gpu, &white_box(0.0)?)?;
    let walk = ConfiguredIntegrator::new(&WALK, &Variant::default())?;
    let sampler = stage::sampler("pixel-hash", walk.facts.dimensions)?;
    let renderer = stage.renderer(gpu, &walk, &sampler, SIZE)?;
    renderer.reset()?;
    renderer.add_samples(0, spp, 1)?;
    let image = renderer.image()?;
    let walks = f64::from(SIZE * SIZE * spp);
    let drift = |(channel, bounces): (usize, u32)| {
        let pixels = image.pixels.iter().map(|p| f64::from(p[channel]));
        let left = mean(&pixels.collect::<Vec<_>>()).unwrap_or(f64::NAN);
        Gauge::checked(
            &format!("energy lost or gained in {bounces} bounces of albedo 1"),
            (left - 1.0).abs(),
            f64::from(bounces) * 1e-6,
            "relative",
            format!(
                "{walks} walks in a closed box; one that leaks through an edge loses {:.1e}",
                1.0 / walks
            ),
        )
    };
    Ok([1, DEPTH / 2, DEPTH]
        .into_iter()
        .enumerate()
        .map(drift)
        .collect())
}

/// The red channel of the path tracer's image.
fn radiance(gpu: &Gpu, stage: &Stage, depth: i64, spp: u32) -> Result<Vec<f64>, NumericsError> {
    let path = stage::path(Some(depth))?;
    let sampler = stage::sampler("pixel-hash", path.facts.dimensions)?;
    let renderer = stage.renderer(gpu, &path, &sampler, SIZE)?;
    renderer.reset()?;
    renderer.add_samples(0, spp, 1)?;
    let image = renderer.image()?;
    Ok(image.pixels.iter().map(|p| f64::from(p[0])).collect())
}

/// The radiance of the path tracer after `depth` bounces: one emission for each surface met.
fn path(gpu: &Gpu, stage: &Stage, depth: i64, spp: u32) -> Result<Gauge, NumericsError> {
    let pixels = radiance(gpu, stage, depth, spp)?;
    let expected = depth as f64 + 1.0;
    let error = (variance(&pixels).unwrap_or(f64::NAN) / pixels.len() as f64).sqrt();
    let drift = mean(&pixels).unwrap_or(f64::NAN) - expected;
    Ok(Gauge::checked(
        &format!("energy of the path tracer after {depth} bounces, off the truth"),
        drift.abs() / error,
        5.0,
        "standard errors",
        format!(
            "relative {:+.1e} ± {:.1e}",
            drift / expected,
            error / expected
        ),
    ))
}
