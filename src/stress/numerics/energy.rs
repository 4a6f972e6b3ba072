//! Energy that long paths lose or gain without absorption: a closed box of albedo 1, a ball of glass.

use super::rig::{self, Rig};
use super::{Gauge, NumericsError};
use glam::Vec3;
use raystone_core::params::{Params, Variant};
use raystone_gpu::Gpu;
use raystone_image::Image;
use raystone_render::{ConfiguredIntegrator, CountedRays, Integrator, IntegratorFacts};
use raystone_sampling::dimensions;
use raystone_scene::{self as scene, DEFAULT_IOR, Material, SceneData};
use raystone_stats::statistics::{mean, variance};

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

/// Returns the furnace box with walls of albedo 1 that emit `emission`.
fn white_box(emission: f32) -> Result<SceneData, NumericsError> {
    let mut scene = scene::named("furnace-box")?;
    for material in &mut scene.materials {
        material.base_color = Vec3::ONE;
        material.emission = Vec3::splat(emission);
    }
    Ok(scene)
}

/// Measures the energy left by walks of up to 64 bounces, and by the path tracer with light and roulette.
pub(super) fn figures(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let spp = SPP[usize::from(quick)];
    let mut figures = walk(gpu, spp)?;
    let rig = Rig::new(gpu, white_box(1.0)?)?;
    for depth in PATH_DEPTHS[usize::from(quick)] {
        figures.push(path(&rig, *depth, spp)?);
    }
    figures.push(glass(gpu, spp)?);
    Ok(figures)
}

/// Measures the radiance in a ball of glass under a white sky: the square of its index, wherever one looks.
fn glass(gpu: &Gpu, spp: u32) -> Result<Gauge, NumericsError> {
    let mut scene = scene::named("white-furnace")?;
    scene.materials = vec![Material::dielectric("glass", Vec3::ONE, DEFAULT_IOR)];
    if let Some(camera) = &mut scene.camera {
        camera.eye = Vec3::new(0.1, -0.2, 0.3);
    }
    let pixels = radiance(&Rig::new(gpu, scene)?, GLASS_DEPTH, spp)?;
    let truth = f64::from(DEFAULT_IOR * DEFAULT_IOR);
    let found = mean(&pixels).unwrap_or(f64::NAN);
    let name = "radiance in a ball of glass, off the square of its index";
    let note = format!("{GLASS_DEPTH} bounces; nearly every path leaves at the first");
    Ok(Gauge::new(name, (found / truth - 1.0).abs(), note)
        .at_most(1e-4)
        .in_unit("relative"))
}

fn walk(gpu: &Gpu, spp: u32) -> Result<Vec<Gauge>, NumericsError> {
    let rig = Rig::new(gpu, white_box(0.0)?)?;
    let walk = ConfiguredIntegrator::new(&WALK, &Variant::default())?;
    let image = image(&rig, &walk, spp)?;
    let walks = f64::from(SIZE * SIZE * spp);
    let drift = |(channel, bounces): (usize, u32)| {
        let pixels = image.pixels.iter().map(|p| f64::from(p[channel]));
        let left = mean(&pixels.collect::<Vec<_>>()).unwrap_or(f64::NAN);
        let leaked = 1.0 / walks;
        Gauge::new(
            format!("energy lost or gained in {bounces} bounces of albedo 1"),
            (left - 1.0).abs(),
            format!(
                "{walks} walks in a closed box; one that leaks through an edge loses {leaked:.1e}"
            ),
        )
        .at_most(f64::from(bounces) * 1e-6)
        .in_unit("relative")
    };
    Ok([1, DEPTH / 2, DEPTH]
        .into_iter()
        .enumerate()
        .map(drift)
        .collect())
}

fn image(rig: &Rig, integrator: &ConfiguredIntegrator, spp: u32) -> Result<Image, NumericsError> {
    let sampler = rig::sampler("pixel-hash", integrator.facts.dimensions)?;
    let renderer = rig.renderer(integrator, &sampler, SIZE)?;
    renderer.reset()?;
    renderer.add_samples(0, spp, 1)?;
    Ok(renderer.image()?)
}

/// Returns the red channel of the path tracer's image.
fn radiance(rig: &Rig, depth: i64, spp: u32) -> Result<Vec<f64>, NumericsError> {
    let image = image(rig, &rig::path(Some(depth))?, spp)?;
    Ok(image.pixels.iter().map(|p| f64::from(p[0])).collect())
}

/// Measures the radiance of the path tracer after `depth` bounces: one emission for each surface met.
fn path(rig: &Rig, depth: i64, spp: u32) -> Result<Gauge, NumericsError> {
    let pixels = radiance(rig, depth, spp)?;
    let expected = depth as f64 + 1.0;
    let error = (variance(&pixels).unwrap_or(f64::NAN) / pixels.len() as f64).sqrt();
    let drift = mean(&pixels).unwrap_or(f64::NAN) - expected;
    let [relative, spread] = [drift, error].map(|x| x / expected);
    Ok(Gauge::new(
        format!("energy of the path tracer after {depth} bounces, off the truth"),
        drift.abs() / error,
        format!("relative {relative:+.1e} ± {spread:.1e}"),
    )
    .at_most(5.0)
    .in_unit("standard errors"))
}
