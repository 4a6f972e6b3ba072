//! Lights against closed forms, their samples against their densities, and the selection methods
//! against each other; and detection of planted faults.

mod chosen;
mod closed;
mod density;
mod environment;
mod faults;
mod files;
mod irradiance;
mod means;

use crate::support::*;
use glam::Vec3;
use raystone::geometry::Camera;
use raystone::gpu::Gpu;
use raystone::params::{ParamValue, Variant};
use raystone::scene::SceneData;

fn lamp(kind: &str) -> SceneData {
    builtin("lamp", &[("kind", ParamValue::Name(kind.to_owned()))])
}

/// Views a place on the floor from close up, so that all pixels see it.
fn towards([x, z]: [f64; 2]) -> Camera {
    let target = Vec3::new(x as f32, 0.0, z as f32);
    Camera {
        eye: target + Vec3::new(0.3, 0.4, 0.1),
        target,
        up: Vec3::Y,
        vertical_fov_degrees: 0.01,
    }
}

/// The integrator `path` with these parameters, given by name.
fn path_with(max_depth: i64, names: &[(&'static str, &str)]) -> Variant {
    let mut changes = vec![("max_depth", ParamValue::Integer(max_depth))];
    let named = |(key, name): &(&'static str, &str)| (*key, ParamValue::Name((*name).to_owned()));
    changes.extend(names.iter().map(named));
    integrator_variant("path", &changes)
}

/// Mean radiance with its standard error.
fn estimate(gpu: &Gpu, scene: &SceneData, camera: Camera, what: &Variant, spp: u32) -> Estimate {
    let mut scene = scene.clone();
    scene.camera = Some(camera);
    let stage = Stage::new(gpu, scene);
    let traced = stage.traced(gpu, structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, what, [8, 8], false);
    Estimate::of(&replicate_means(&renderer, spp, 12))
}
