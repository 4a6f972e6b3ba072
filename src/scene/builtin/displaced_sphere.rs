//! A bumpy closed surface with any number of triangles of similar size.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use super::sphere::SphereGrid;
use glam::{DVec3, Vec3};
use raystone_core::parameters;

parameters! {
    /// `displaced-sphere`.
    pub(super) struct DisplacedSphere {
        /// number of triangles: the nearest grid that does not exceed it
        triangles: usize = 100_000, in 8..=50_000_000;
    }
}

impl BuiltinScene for DisplacedSphere {
    const NAME: &'static str = "displaced-sphere";
    const DESCRIPTION: &'static str =
        "closed bumpy sphere of any number of triangles under a white sky";

    fn build(&self) -> (SceneBuilder, Look) {
        let grid = SphereGrid::with_at_most(self.triangles);
        let mut builder = SceneBuilder::new(false, grid.triangles());
        grid.push(&mut builder, 0, |direction| {
            (radius(direction) * direction).as_vec3()
        });
        let grey = vec![Material::diffuse("grey", Vec3::splat(0.7))];
        let look = Look::under_sky(grey, Vec3::new(1.6, 1.3, 2.6), Vec3::ZERO, 40.0);
        (builder, look)
    }
}

/// Distance from the centre: three octaves of products of sines, between 0.75 and 1.25.
fn radius(direction: DVec3) -> f64 {
    let wave = |frequency: f64| {
        let sin = |x: f64, phase: f64| sin_cos_turns(frequency * x + phase).0;
        sin(direction.x, 0.1) * sin(direction.y, 0.35) * sin(direction.z, 0.6)
    };
    1.0 + 0.14 * wave(0.9) + 0.07 * wave(2.1) + 0.04 * wave(4.7)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{is_closed, load_with};
    use raystone_core::params::ParamValue;

    #[test]
    fn the_surface_is_closed_at_every_size_and_open_without_one_triangle() {
        for triangles in [8, 9, 1000, 20_001] {
            let value = ParamValue::Integer(triangles);
            let mut scene = load_with("displaced-sphere", &[("triangles", value)]);
            assert!(scene.triangles.len() as i64 <= triangles);
            assert!(is_closed(&scene), "{triangles}");
            scene.triangles.pop();
            assert!(!is_closed(&scene), "{triangles}");
        }
    }
}
