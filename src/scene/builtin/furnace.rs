//! Scenes whose image is known exactly, to reveal any bias of an integrator.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use super::sphere::SphereGrid;
use glam::{DVec3, Vec3};
use raystone_core::geometry::Camera;
use raystone_core::parameters;

parameters! {
    /// `furnace-box`.
    pub(super) struct FurnaceBox {
        /// reflectance a of all walls; they emit 1 - a
        albedo: f32 = 0.5, in 0.0..=0.99;
    }
}

parameters! {
    /// `white-furnace`.
    pub(super) struct WhiteFurnace {}
}

impl BuiltinScene for FurnaceBox {
    const NAME: &'static str = "furnace-box";
    const DESCRIPTION: &'static str = "closed box of albedo a that emits 1 - a: with depth d of bounces every pixel \
                  is 1 - a^(d+1)";

    fn build(&self) -> (SceneBuilder, Look) {
        let albedo = self.albedo;
        let mut builder = SceneBuilder::default();
        // The bits of k are the coordinates of corner k; faces are counter-clockwise from inside.
        let faces = [
            [0, 2, 6, 4],
            [1, 5, 7, 3],
            [0, 4, 5, 1],
            [2, 3, 7, 6],
            [0, 1, 3, 2],
            [4, 6, 7, 5],
        ];
        for face in faces {
            let corner = |k: i32| Vec3::new((k & 1) as f32, (k >> 1 & 1) as f32, (k >> 2) as f32);
            builder.push_quad(face.map(corner), 0);
        }
        let wall =
            Material::diffuse("wall", Vec3::splat(albedo)).emitting(Vec3::splat(1.0 - albedo));
        let look = Look {
            materials: vec![wall],
            camera: Some(Camera::upright(
                Vec3::new(0.3, 0.4, 0.2),
                Vec3::new(0.7, 0.6, 0.9),
                60.0,
            )),
            ..Look::default()
        };
        (builder, look)
    }
}

impl BuiltinScene for WhiteFurnace {
    const NAME: &'static str = "white-furnace";
    const DESCRIPTION: &'static str =
        "white convex sphere under a white sky: every pixel is exactly 1";

    fn build(&self) -> (SceneBuilder, Look) {
        let grid = SphereGrid {
            bands: 32,
            sectors: 64,
        };
        let mut builder = SceneBuilder::new(false, grid.triangles());
        grid.push(&mut builder, 0, DVec3::as_vec3);
        let white = vec![Material::diffuse("white", Vec3::ONE)];
        (
            builder,
            Look::under_sky(white, 3.0 * Vec3::Z, Vec3::ZERO, 45.0),
        )
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{is_closed, load_default, load_with};
    use super::*;
    use raystone_core::params::ParamValue;

    #[test]
    fn both_furnaces_are_closed() {
        for (name, triangles) in [("furnace-box", 12), ("white-furnace", 3968)] {
            let mut scene = load_default(name);
            assert_eq!(scene.triangles.len(), triangles);
            assert!(is_closed(&scene), "{name}");
            scene.triangles.swap(0, 1);
            scene.triangles[0].vertices.swap(0, 1);
            assert!(!is_closed(&scene), "{name}");
        }
    }

    #[test]
    fn the_walls_of_the_box_emit_what_they_absorb() {
        let scene = load_with("furnace-box", &[("albedo", ParamValue::Number(0.75))]);
        let wall = &scene.materials[0];
        assert_eq!(wall.base_color + wall.emission, Vec3::ONE);
        assert_eq!(scene.emitters().len(), 12);
    }
}
