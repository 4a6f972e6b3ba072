//! Random triangles: the worst case for hierarchies, and a quick test of any structure.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use glam::Vec3;
use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// `triangle-soup`.
    pub(super) struct TriangleSoup {
        /// number of triangles
        triangles: usize = 10_000, in 1..=50_000_000;
        /// edge of the cube that holds a triangle, in edges of the unit cube
        size: f32 = 0.05, in 1e-4..=1.0;
        /// seed of the random generator (PCG, O'Neill 2014)
        seed: u64 = 1, in 0..=i64::MAX as u64;
    }
}

impl BuiltinScene for TriangleSoup {
    const NAME: &'static str = "triangle-soup";
    const DESCRIPTION: &'static str =
        "random triangles, centres uniform in the unit cube, under a white sky";

    fn build(&self) -> (SceneBuilder, Look) {
        let (count, size) = (self.triangles, self.size);
        let mut pcg = Pcg32::with_stream(self.seed, Pcg32::DEFAULT_STREAM);
        let mut point = || Vec3::new(pcg.uniform_f32(), pcg.uniform_f32(), pcg.uniform_f32());
        let mut builder = SceneBuilder::new(false, count);
        for index in 0..count {
            let corner = point() - 0.5 * size;
            let vertices = [0; 3].map(|_| corner + size * point());
            builder.push(vertices, (index % 3) as u32);
        }
        let colors = [(0.75, 0.35, 0.3), (0.35, 0.65, 0.4), (0.35, 0.45, 0.75)];
        let materials = colors.map(|color| Material::diffuse("soup", color.into()));
        let eye = Vec3::new(1.7, 1.3, 2.5);
        let look = Look::under_sky(materials.into(), eye, Vec3::splat(0.5), 40.0);
        (builder, look)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{load_default, load_with};
    use super::*;
    use raystone_core::params::ParamValue;

    #[test]
    fn triangles_fill_the_unit_cube_and_stay_within_their_size() {
        let scene = load_default("triangle-soup");
        assert_eq!(scene.triangles.len(), 10_000);
        let bounds = scene.bounds();
        assert!(bounds.min.min_element() >= -0.025 && bounds.max.max_element() <= 1.025);
        assert!(bounds.min.max_element() < 0.01 && bounds.max.min_element() > 0.99);
        let mean: Vec3 = scene.triangles.iter().map(|t| t.vertices[0]).sum::<Vec3>() / 1e4;
        assert!((mean - 0.5).abs().max_element() < 0.02, "{mean}");
        for triangle in &scene.triangles {
            let [a, b, c] = triangle.vertices;
            let extent = a.max(b).max(c) - a.min(b).min(c);
            assert!(extent.max_element() <= 0.0501);
        }
    }

    #[test]
    fn another_seed_gives_another_soup() {
        let other = load_with("triangle-soup", &[("seed", ParamValue::Integer(2))]);
        assert_ne!(other.hash, load_default("triangle-soup").hash);
    }
}
