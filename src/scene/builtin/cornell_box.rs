//! The Cornell box: the measured geometry published by the Program of Computer Graphics of Cornell
//! University ("Cornell Box Data", 1998), in millimetres, with its camera.
//!
//! Reflectances and light radiance are the usual linear RGB conversions of the published spectra.
//! The ceiling is a frame around the light, so that no surfaces coincide.

use super::super::builder::{Look, SceneBuilder};
use super::super::{DEFAULT_IOR, Material};
use super::BuiltinScene;
use super::sphere::SphereGrid;
use glam::{DVec3, Vec3};
use raystone_core::geometry::Camera;
use raystone_core::parameters;

parameters! {
    /// `cornell-box`.
    pub(super) struct CornellBox {
        /// a ball of glass in the place of the short block
        glass: bool = false;
    }
}

const WHITE: u32 = 0;
const RED: u32 = 1;
const GREEN: u32 = 2;
const LIGHT: u32 = 3;
const GLASS: u32 = 4;

type Quad = [[f32; 3]; 4];

/// Floor, back wall, right wall, left wall.
const ROOM: [(u32, Quad); 4] = [
    (
        WHITE,
        [
            [552.8, 0.0, 0.0],
            [0.0, 0.0, 0.0],
            [0.0, 0.0, 559.2],
            [549.6, 0.0, 559.2],
        ],
    ),
    (
        WHITE,
        [
            [549.6, 0.0, 559.2],
            [0.0, 0.0, 559.2],
            [0.0, 548.8, 559.2],
            [556.0, 548.8, 559.2],
        ],
    ),
    (
        GREEN,
        [
            [0.0, 0.0, 559.2],
            [0.0, 0.0, 0.0],
            [0.0, 548.8, 0.0],
            [0.0, 548.8, 559.2],
        ],
    ),
    (
        RED,
        [
            [552.8, 0.0, 0.0],
            [549.6, 0.0, 559.2],
            [556.0, 548.8, 559.2],
            [556.0, 548.8, 0.0],
        ],
    ),
];

const CEILING: Quad = [
    [556.0, 548.8, 0.0],
    [556.0, 548.8, 559.2],
    [0.0, 548.8, 559.2],
    [0.0, 548.8, 0.0],
];

/// Its corners adjoin those of [`CEILING`].
const LAMP: Quad = [
    [343.0, 548.8, 227.0],
    [343.0, 548.8, 332.0],
    [213.0, 548.8, 332.0],
    [213.0, 548.8, 227.0],
];

/// Corners (x, z) of a block's top in order, and its height.
const BLOCKS: [([[f32; 2]; 4], f32); 2] = [
    (
        [[130.0, 65.0], [82.0, 225.0], [240.0, 272.0], [290.0, 114.0]],
        165.0,
    ),
    (
        [
            [423.0, 247.0],
            [265.0, 296.0],
            [314.0, 456.0],
            [472.0, 406.0],
        ],
        330.0,
    ),
];

/// Centre and radius of the ball, clear of floor and walls, without visible facets.
const BALL: ([f64; 3], f64) = ([186.0, 91.0, 169.0], 90.0);
const BALL_GRID: SphereGrid = SphereGrid {
    bands: 96,
    sectors: 192,
};

impl BuiltinScene for CornellBox {
    const NAME: &'static str = "cornell-box";
    const DESCRIPTION: &'static str =
        "the original Cornell box: measured room, two blocks, light in the ceiling (mm)";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::default();
        let quad = |builder: &mut SceneBuilder, corners: Quad, material| {
            builder.push_quad(corners.map(Vec3::from), material);
        };
        for (material, corners) in ROOM {
            quad(&mut builder, corners, material);
        }
        for k in 0..4 {
            let next = (k + 1) % 4;
            let side = [CEILING[k], CEILING[next], LAMP[next], LAMP[k]];
            quad(&mut builder, side, WHITE);
        }
        quad(&mut builder, LAMP, LIGHT);
        if self.glass {
            let (centre, radius) = BALL;
            let place = |v: DVec3| (DVec3::from(centre) + radius * v).as_vec3();
            BALL_GRID.push(&mut builder, GLASS, place);
        }
        for (top, height) in BLOCKS.into_iter().skip(usize::from(self.glass)) {
            let at = |k: usize, y: f32| [top[k % 4][0], y, top[k % 4][1]];
            quad(&mut builder, [0, 1, 2, 3].map(|k| at(k, height)), WHITE);
            for k in 0..4 {
                let side = [at(k, 0.0), at(k, height), at(k + 1, height), at(k + 1, 0.0)];
                quad(&mut builder, side, WHITE);
            }
        }
        let mut materials = vec![
            Material::diffuse("white", Vec3::new(0.725, 0.71, 0.68)),
            Material::diffuse("red", Vec3::new(0.63, 0.065, 0.05)),
            Material::diffuse("green", Vec3::new(0.14, 0.45, 0.091)),
            Material::diffuse("light", Vec3::splat(0.78)).emitting(Vec3::new(18.4, 15.6, 8.0)),
        ];
        if self.glass {
            materials.push(Material::dielectric("glass", Vec3::ONE, DEFAULT_IOR));
        }
        let look = Look {
            materials,
            camera: Some(Camera {
                eye: Vec3::new(278.0, 273.0, -800.0),
                target: Vec3::new(278.0, 273.0, 0.0),
                up: Vec3::Y,
                // Focal length 35 mm, film 25 mm.
                vertical_fov_degrees: 39.3077,
            }),
            ..Look::default()
        };
        (builder, look)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{load_default, load_with};
    use super::*;
    use crate::DIELECTRIC;
    use raystone_core::params::ParamValue;

    #[test]
    fn a_ball_of_glass_takes_the_place_of_one_block_and_stands_clear_of_all_else() {
        let scene = load_with("cornell-box", &[("glass", ParamValue::Flag(true))]);
        let plain = load_default("cornell-box");
        let kind = |id: &u32| scene.materials[*id as usize].kind;
        let others = scene
            .material_ids
            .iter()
            .filter(|id| kind(id) != &DIELECTRIC);
        assert_eq!(others.count(), plain.triangles.len() - 10);
        let ([_, height, _], radius) = BALL;
        assert!(height > radius);
        assert_eq!(scene.bounds(), plain.bounds());
    }

    #[test]
    fn the_box_has_the_published_extent_and_its_ceiling_leaves_room_for_the_light() {
        let scene = load_default("cornell-box");
        assert_eq!(scene.triangles.len(), 38);
        let bounds = scene.bounds();
        assert_eq!(bounds.min.to_array(), [0.0, 0.0, 0.0]);
        assert_eq!(bounds.max.to_array(), [556.0, 548.8, 559.2]);
        let area_at_ceiling = |emitting: bool| -> f32 {
            let pairs = scene.triangles.iter().zip(&scene.material_ids);
            pairs
                .filter(|(t, _)| t.vertices.iter().all(|v| v.y == 548.8))
                .filter(|(_, m)| (scene.materials[**m as usize].emission.x > 0.0) == emitting)
                .map(|(t, _)| {
                    let [a, b, c] = t.vertices;
                    0.5 * (b - a).cross(c - a).length()
                })
                .sum()
        };
        let (light, frame) = (area_at_ceiling(true), area_at_ceiling(false));
        assert_eq!(light, 130.0 * 105.0);
        assert!((light + frame - 556.0 * 559.2).abs() < 1.0, "{frame}");
    }
}
