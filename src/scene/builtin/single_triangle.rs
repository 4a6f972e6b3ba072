//! The least scene that a structure can be built of: for integrators that trace nothing.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::Builtin;
use crate::config::Params;
use crate::geometry::Camera;
use glam::Vec3;

pub(super) const SCENE: Builtin = Builtin {
    name: "single-triangle",
    description: "one triangle: what experiments with integrators that trace nothing get",
    schema: Vec::new,
    build,
};

fn build(_: &Params) -> (SceneBuilder, Look) {
    let mut builder = SceneBuilder::new(false, 1);
    builder.push([Vec3::X, Vec3::Y, Vec3::Z], 0);
    let look = Look {
        materials: vec![Material::diffuse("triangle", Vec3::splat(0.5))],
        textures: Vec::new(),
        camera: Some(Camera {
            eye: Vec3::splat(2.0),
            target: Vec3::splat(1.0 / 3.0),
            up: Vec3::Y,
            vertical_fov_degrees: 40.0,
        }),
        environment: Vec3::ONE,
    };
    (builder, look)
}
