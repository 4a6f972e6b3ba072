//! Samples of lights against their densities.

use super::{lamp, towards};
use crate::support::*;
use glam::Vec3;
use raystone::geometry::Triangle;
use raystone::gpu::{Gpu, KernelLibrary};
use raystone::integrator::{
    ConfiguredIntegrator, CountedRays, Integrator, IntegratorFacts, RayOffset, RenderJob, Renderer,
};
use raystone::params::{Params, Variant};
use raystone::sampling::dimensions;
use raystone::scene::{EnvironmentMap, Light, SceneData};
use std::sync::Arc;

/// An integrator from a kernel of this folder.
#[derive(Debug, Clone, Copy)]
pub struct Probe {
    kernel: &'static str,
    feature: &'static str,
}

/// Kernels of this folder.
pub const SOURCES: [(&str, &str); 3] = [
    ("test/chosen", include_str!("kernels/chosen.wesl")),
    ("test/density", include_str!("kernels/density.wesl")),
    ("test/flux", include_str!("kernels/flux.wesl")),
];

/// Flux of the first light.
pub static FLUX: Probe = Probe {
    kernel: "test/flux",
    feature: "",
};

/// Densities with each way of choosing lights.
pub static DENSITY: [Probe; 3] = [
    Probe {
        kernel: "test/density",
        feature: "",
    },
    Probe {
        kernel: "test/density",
        feature: "uniform_lights",
    },
    Probe {
        kernel: "test/density",
        feature: "light_tree",
    },
];

/// The chosen light, by power, uniformly and by a tree.
pub static CHOSEN: [Probe; 3] = [
    Probe {
        kernel: "test/chosen",
        feature: "",
    },
    Probe {
        kernel: "test/chosen",
        feature: "uniform_lights",
    },
    Probe {
        kernel: "test/chosen",
        feature: "light_tree",
    },
];

impl Integrator for Probe {
    fn name(&self) -> &'static str {
        self.kernel
    }

    fn description(&self) -> &'static str {
        "a probe of lights"
    }

    fn kernel(&self) -> &'static str {
        self.kernel
    }

    fn features(&self, _: &Params) -> Vec<(&'static str, bool)> {
        vec![(self.feature, !self.feature.is_empty())]
    }

    fn facts(&self, _: &Params) -> IntegratorFacts {
        IntegratorFacts {
            dimensions: dimensions::needed(2),
            rays: vec![CountedRays::Primary],
            needs_inline: true,
            ..Default::default()
        }
    }
}

/// A library with the kernels of this folder added.
pub fn probing(library: KernelLibrary) -> Gpu {
    open(library.with_sources(&SOURCES))
}

/// Mean colours of images of `size` pixels, one per seed.
pub fn probe(
    gpu: &Gpu,
    scene: SceneData,
    of: &'static Probe,
    size: u32,
    [spp, seeds]: [u32; 2],
) -> Vec<[f64; 3]> {
    let seeds: Vec<u32> = (1..=seeds).map(|seed| 40 * seed).collect();
    let mut means = Vec::new();
    images(gpu, scene, of, size, spp, &seeds, |pixels| {
        let count = pixels.len() as f64;
        means.push([0, 1, 2].map(|c| pixels.iter().map(|p| f64::from(p[c])).sum::<f64>() / count));
    });
    means
}

/// Passes on the pixels of images of `size` pixels, one per seed.
pub fn images(
    gpu: &Gpu,
    scene: SceneData,
    of: &'static Probe,
    size: u32,
    spp: u32,
    seeds: &[u32],
    mut see: impl FnMut(&[[f32; 3]]),
) {
    let stage = Stage::new(gpu, scene);
    let traced = stage.traced(gpu, structure("bvh"));
    let integrator = ConfiguredIntegrator::new(of, &Variant::default()).expect("no parameters");
    let sampler = sampler("pixel-hash", "none");
    let job = RenderJob {
        size: [size; 2],
        camera: stage.camera,
        sampler: &sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, false);
    let renderer = renderer.unwrap_or_else(|e| panic!("{e}"));
    for seed in seeds {
        let mut shots = renderer.render(&[spp], *seed).expect("a render");
        see(&shots.remove(0).image.pixels);
    }
}

/// A sky that is dark nowhere and bright in one place.
pub fn sky() -> Light {
    let texel = |k: i32| {
        let (x, y) = (k % 16, k / 16);
        let sun = if (x, y) == (3, 2) { 40.0 } else { 0.0 };
        Vec3::new(
            0.2 + sun,
            0.3 + 0.05 * x as f32 + sun,
            0.5 + 0.1 * y as f32 + 0.9 * sun,
        )
    };
    let map = EnvironmentMap::new(
        "sky",
        [16, 8],
        (0..128).map(texel).collect(),
        &mut Vec::new(),
    );
    Light::Environment {
        map: Arc::new(map.expect("a map")),
        scale: 1.5,
        turn: 0.4,
    }
}

/// Scenes, each with its share of lights that rays can hit.
fn scenes() -> Vec<(&'static str, SceneData)> {
    let mut all: Vec<_> = ["rectangle", "disk", "sphere"]
        .map(|kind| (kind, lamp(kind)))
        .into();
    let mut several = lamp("sphere");
    for (k, x) in [1.2_f32, -1.0, 2.2].into_iter().enumerate() {
        several.lights.push(Light::Sphere {
            center: Vec3::new(x, 1.0 + 0.3 * k as f32, 0.9 * x),
            radius: 0.2,
            radiance: Vec3::splat(1.0 + 5.0 * k as f32),
        });
    }
    all.push(("several spheres", several));
    // No two of these lamps hide each other from the viewed place.
    let mut squares = lamp("rectangle");
    for place in [[1.6, 1.5, 0.0], [-1.5, 2.5, -1.5], [0.9, 1.1, 1.7]] {
        let corner = |x: f32, z: f32| Vec3::from(place) + Vec3::new(x, 0.1 * x, z);
        let [a, b, c, d] = [
            corner(0.0, 0.0),
            corner(0.4, 0.0),
            corner(0.4, 0.6),
            corner(0.0, 0.6),
        ];
        let halves = [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices });
        squares.triangles.extend(halves);
        squares.material_ids.extend([1, 1]);
    }
    all.push(("squares", squares));
    let mut under = lamp("point");
    under.lights = vec![sky()];
    all.push(("environment", under));
    for (_, scene) in &mut all {
        scene.camera = Some(towards([0.8, 0.5]));
    }
    all
}

pub fn fault(gpu: &Gpu, wanted: &str) -> Option<String> {
    for (name, scene) in scenes() {
        if wanted != name {
            continue;
        }
        for of in &DENSITY {
            let found = probe(gpu, scene.clone(), of, 32, [256, 12]);
            let [density, sampled, seen] =
                [0, 1, 2].map(|c| Estimate::of(&found.iter().map(|m| m[c]).collect::<Vec<_>>()));
            let place = format!("{name}, {of:?}: ");
            if !(density.agrees_with(1.0) && density.error < 0.02) {
                return Some(place + &format!("the density integrates to {density:?}, not 1"));
            }
            let difference = sampled.minus(&seen);
            if !(difference.agrees_with(0.0) && difference.error < 0.02 * seen.mean) {
                return Some(place + &format!("integral by samples {sampled:?}, by rays {seen:?}"));
            }
        }
    }
    None
}

#[test]
fn densities_integrate_to_one_and_samples_follow_them() {
    let gpu = probing(KernelLibrary::default());
    let names = scenes().into_iter().map(|(name, _)| name);
    for name in in_turn("scenes of densities", names) {
        assert_eq!(fault(&gpu, name), None);
    }
}
