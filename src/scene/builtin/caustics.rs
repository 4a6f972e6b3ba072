//! A scene for light over mirrors: a small lamp that shines away from the floor.

use super::super::Material;
use super::super::builder::{Look, SceneBuilder};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use glam::{Vec2, Vec3};
use raystone_core::geometry::Camera;
use raystone_core::parameters;

parameters! {
    /// What reflects the light of `caustics`.
    pub(super) enum Reflector {
        /// A plane mirror above, and one that leans beside.
        Planes = "planes",
        /// The underside of a ball.
        Ball = "ball",
        /// A hollow part of a sphere.
        Hollow = "hollow",
    }

    /// `caustics`.
    pub(super) struct Caustics {
        /// what reflects the light
        reflector: Reflector = Reflector::Ball;
        /// edge of the square lamp
        lamp: f32 = 0.05, in 0.001..=0.5;
        /// rings of a curved mirror; with 1 it has 4 facets, with n 8 n² - 4 n
        rings: u32 = 8, in 1..=100;
    }
}

const FLOOR: u32 = 0;
const LAMP: u32 = 1;
const MIRROR: u32 = 2;
/// Flux of the lamp.
const POWER: f32 = 20.0;

/// A part of a sphere about its axis, up or down (`side`), to this part of a turn, with its normals.
fn push_cap(
    builder: &mut SceneBuilder,
    (center, radius): (Vec3, f32),
    (side, reach): (f32, f64),
    rings: u32,
) {
    let sectors = 4 * rings;
    let at = |ring: u32, sector: u32| {
        let (sin, cos) = sin_cos_turns(reach * f64::from(ring) / f64::from(rings));
        let around = (f64::from(sector) + 0.5 * f64::from(ring)) / f64::from(sectors);
        let (z, x) = sin_cos_turns(around);
        Vec3::new((sin * x) as f32, side * cos as f32, (sin * z) as f32)
    };
    for (ring, sector) in (0..rings).flat_map(|ring| (0..sectors).map(move |s| (ring, s))) {
        let [a, b] = [at(ring, sector), at(ring, sector + 1)];
        let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
        // The first ring has no second ones.
        let facets = [[a, c, d], [a, d, b]];
        for normals in facets.into_iter().take(if ring == 0 { 1 } else { 2 }) {
            let corners = normals.map(|normal| center + radius * normal);
            builder.push_corners(corners, [Vec2::ZERO; 3], Some(normals), MIRROR);
        }
    }
}

impl BuiltinScene for Caustics {
    const NAME: &'static str = "caustics";
    const DESCRIPTION: &'static str =
        "a floor that a small lamp lights over mirrors: plane ones, a ball, or a hollow one";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::default();
        let corner = |x: f32, z: f32| Vec3::new(1.5 * x, 0.0, 1.5 * z);
        let corners = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
        builder.push_quad(corners.map(|(x, z)| corner(x, z)), FLOOR);
        let half = 0.5 * self.lamp;
        let lamp = corners.map(|(x, z)| Vec3::new(0.1 + half * x, 0.7, half * z));
        builder.push_quad(lamp, LAMP);
        match self.reflector {
            Reflector::Planes => {
                let above = corners.map(|(x, z)| Vec3::new(1.5 * x, 1.6, 1.5 * z));
                builder.push_quad(above, MIRROR);
                let beside = [
                    (1.2, 0.1, -1.5),
                    (1.6, 1.3, -1.5),
                    (1.6, 1.3, 1.5),
                    (1.2, 0.1, 1.5),
                ];
                builder.push_quad(beside.map(Vec3::from), MIRROR);
            }
            Reflector::Ball => {
                let ball = (Vec3::new(0.0, 1.9, 0.0), 0.7);
                push_cap(&mut builder, ball, (-1.0, 0.22), self.rings);
            }
            Reflector::Hollow => {
                let ball = (Vec3::new(0.0, 0.2, 0.0), 1.6);
                push_cap(&mut builder, ball, (1.0, 0.13), self.rings);
            }
        }
        let radiance = POWER / (std::f32::consts::PI * self.lamp * self.lamp);
        let lamp = Material {
            emits_both_sides: false,
            ..Material::diffuse("lamp", Vec3::ZERO).emitting(Vec3::splat(radiance))
        };
        let look = Look {
            materials: vec![
                Material::diffuse("floor", Vec3::splat(0.5)),
                lamp,
                Material::mirror("mirror", Vec3::splat(0.9)),
            ],
            camera: Some(Camera::upright(
                Vec3::new(0.0, 1.1, 2.6),
                Vec3::new(0.0, 0.2, 0.0),
                45.0,
            )),
            ..Look::default()
        };
        (builder, look)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::load_with;
    use raystone_core::params::ParamValue;

    #[test]
    fn curved_mirrors_have_as_many_facets_as_rings_say_with_normals_and_the_lamp_its_flux() {
        for (rings, facets) in [(1, 4), (8, 480)] {
            for reflector in ["ball", "hollow"] {
                let changes = [
                    ("rings", ParamValue::Integer(rings)),
                    ("reflector", ParamValue::Name(reflector.to_owned())),
                ];
                let scene = load_with("caustics", &changes);
                assert_eq!(scene.triangles.len(), 4 + facets, "{reflector}");
                assert_eq!(scene.normals.len(), scene.triangles.len());
                let lights = crate::LightList::of(&scene).lights;
                let [lamp] = &lights[..] else {
                    panic!("{lights:?}")
                };
                let flux =
                    lamp.area * std::f64::consts::PI * f64::from(scene.materials[1].emission.x);
                assert!((flux / 20.0 - 1.0).abs() < 1e-6, "{flux}");
            }
        }
    }

    #[test]
    fn a_lamp_of_any_size_has_the_same_flux() {
        for lamp in [0.01, 0.05, 0.4] {
            let scene = load_with("caustics", &[("lamp", ParamValue::Number(lamp))]);
            let light = &crate::LightList::of(&scene).lights[0];
            assert!((light.area / (lamp * lamp) - 1.0).abs() < 1e-6, "{light:?}");
            let radiance = f64::from(scene.materials[1].emission.x);
            let flux = light.area * std::f64::consts::PI * radiance;
            assert!((flux / 20.0 - 1.0).abs() < 1e-6, "{lamp}: {flux}");
        }
    }
}
