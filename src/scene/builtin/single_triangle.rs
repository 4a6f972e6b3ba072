//! The smallest valid scene, for integrators that trace nothing.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use glam::Vec3;
use raystone_core::parameters;

parameters! {
    /// `single-triangle`.
    pub(super) struct SingleTriangle {}
}

impl BuiltinScene for SingleTriangle {
    const NAME: &'static str = "single-triangle";
    const DESCRIPTION: &'static str =
        "one triangle: what experiments with integrators that trace nothing get";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::new(false, 1);
        builder.push([Vec3::X, Vec3::Y, Vec3::Z], 0);
        let grey = vec![Material::diffuse("triangle", Vec3::splat(0.5))];
        let look = Look::under_sky(grey, Vec3::splat(2.0), Vec3::splat(1.0 / 3.0), 40.0);
        (builder, look)
    }
}
