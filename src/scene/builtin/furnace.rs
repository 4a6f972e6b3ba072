//! Scenes whose image is known exactly: any bias of an integrator shows.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::Builtin;
use super::sphere::SphereGrid;
use crate::config::{ParamRange, ParamValue, Parameter, Params};
use crate::geometry::Camera;
use glam::{DVec3, Vec3};

pub(super) const FURNACE_BOX: Builtin = Builtin {
    name: "furnace-box",
    description: "closed box of albedo a that emits 1 - a: with depth d of bounces every pixel \
                  is 1 - a^(d+1)",
    schema: || {
        vec![Parameter {
            name: "albedo",
            description: "reflectance a of all walls; they emit 1 - a",
            default: ParamValue::Number(0.5),
            range: ParamRange::Number {
                min: 0.0,
                max: 0.99,
            },
        }]
    },
    build: build_box,
};

pub(super) const WHITE_FURNACE: Builtin = Builtin {
    name: "white-furnace",
    description: "white convex sphere under a white sky: every pixel is exactly 1",
    schema: Vec::new,
    build: build_sphere,
};

fn build_box(params: &Params) -> (SceneBuilder, Look) {
    let albedo = params.number("albedo") as f32;
    let mut builder = SceneBuilder::default();
    // Corner k has the bits of k as coordinates; faces are seen counter-clockwise from inside.
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
    let wall = Material::diffuse("wall", Vec3::splat(albedo)).emitting(Vec3::splat(1.0 - albedo));
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

fn build_sphere(_: &Params) -> (SceneBuilder, Look) {
    let grid = SphereGrid {
        bands: 32,
        sectors: 64,
    };
    let mut builder = SceneBuilder::new(false, grid.triangles());
    grid.push(&mut builder, 0, DVec3::as_vec3);
    let look = Look {
        materials: vec![Material::diffuse("white", Vec3::ONE)],
        camera: Some(Camera::upright(Vec3::new(0.0, 0.0, 3.0), Vec3::ZERO, 45.0)),
        environment: Vec3::ONE,
        ..Look::default()
    };
    (builder, look)
}

#[cfg(test)]
mod tests {
    use super::super::tests::{is_closed, load_default, load_with};
    use super::*;

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
