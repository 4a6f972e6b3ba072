//! Scenes for lights: one of each kind over a floor, a measured luminaire, many lamps.

use super::super::builder::{Look, SceneBuilder};
use super::super::{IesProfile, Light, Material};
use super::BuiltinScene;
use glam::{Mat3, Quat, Vec3};
use raystone_core::geometry::Camera;
use raystone_core::parameters;
use raystone_core::random::Pcg32;
use std::path::Path;
use std::sync::Arc;

parameters! {
    /// What shines on the floor of `lamp`.
    pub(super) enum Lamp {
        /// A square of 1 × 1 that shines down.
        Rectangle = "rectangle",
        /// A disk of radius 0.5, of 64 triangles, that shines down.
        Disk = "disk",
        /// A sphere of radius 0.25.
        Sphere = "sphere",
        /// A point.
        Point = "point",
        /// A spot, 20 to 30 degrees from its axis.
        Spot = "spot",
        /// Light from straight above.
        Directional = "directional",
    }

    /// `lamp`.
    pub(super) struct LampScene {
        /// what shines
        kind: Lamp = Lamp::Rectangle;
    }
}

parameters! {
    /// `luminaire`.
    pub(super) struct Luminaire {
        /// IES file (LM-63) of the luminaire; an even one of 100 cd if empty
        file: String = String::new();
        /// height above the floor
        height: f32 = 2.5, in 0.01..=1000.0;
        /// luminous flux that the intensities are scaled to, lumens; 0 leaves them as measured
        lumens: f64 = 0.0, in 0.0..=1e9;
        /// radiant flux that they are scaled to, watts of 683 lumens; 0 leaves them as measured
        watts: f64 = 0.0, in 0.0..=1e9;
    }
}

parameters! {
    /// `many-lights`.
    pub(super) struct ManyLights {
        /// number of lamps
        lamps: u32 = 128, in 1..=4096;
    }
}

const FLOOR: u32 = 0;
const SHINING: u32 = 1;

/// A grey floor of edge 2·`half` in the plane y = 0, seen from the side.
fn on_floor(half: f32, lights: Vec<Light>) -> (SceneBuilder, Look) {
    let mut builder = SceneBuilder::default();
    let corner = |x: f32, z: f32| Vec3::new(x * half, 0.0, z * half);
    let corners = [
        corner(-1.0, -1.0),
        corner(-1.0, 1.0),
        corner(1.0, 1.0),
        corner(1.0, -1.0),
    ];
    builder.push_quad(corners, FLOOR);
    let lamp = Material {
        emits_both_sides: false,
        ..Material::diffuse("lamp", Vec3::ZERO).emitting(Vec3::splat(10.0))
    };
    let look = Look {
        materials: vec![Material::diffuse("floor", Vec3::splat(0.5)), lamp],
        camera: Some(Camera::upright(
            Vec3::new(0.0, 0.7 * half, 1.6 * half),
            Vec3::new(0.0, 0.1 * half, 0.0),
            55.0,
        )),
        lights,
        ..Look::default()
    };
    (builder, look)
}

const HEIGHT: f32 = 2.0;

impl BuiltinScene for LampScene {
    const NAME: &'static str = "lamp";
    const DESCRIPTION: &'static str =
        "a floor below one light of a kind: its irradiance is known in closed form";

    fn build(&self) -> (SceneBuilder, Look) {
        let position = HEIGHT * Vec3::Y;
        let white = Vec3::splat(10.0);
        let light = match self.kind {
            Lamp::Rectangle | Lamp::Disk => None,
            Lamp::Sphere => Some(Light::Sphere {
                center: position,
                radius: 0.25,
                radiance: white,
            }),
            Lamp::Point => Some(Light::Point {
                position,
                intensity: white,
            }),
            Lamp::Spot => Some(Light::Spot {
                position,
                direction: Vec3::NEG_Y,
                intensity: white,
                inner: 20_f32.to_radians(),
                outer: 30_f32.to_radians(),
                decay: true,
            }),
            Lamp::Directional => Some(Light::Directional {
                direction: Vec3::NEG_Y,
                irradiance: white,
            }),
        };
        let (mut builder, look) = on_floor(2.0, light.into_iter().collect());
        let at = |x: f32, z: f32| Vec3::new(x, HEIGHT, z);
        match self.kind {
            Lamp::Rectangle => {
                let corners = [at(-0.5, -0.5), at(0.5, -0.5), at(0.5, 0.5), at(-0.5, 0.5)];
                builder.push_quad(corners, SHINING);
            }
            Lamp::Disk => {
                let corner = |k: usize| {
                    let (sin, cos) = super::numeric::sin_cos_turns(k as f64 / 64.0);
                    at(0.5 * cos as f32, 0.5 * sin as f32)
                };
                for k in 0..64 {
                    builder.push([position, corner(k), corner((k + 1) % 64)], SHINING);
                }
            }
            _ => {}
        }
        (builder, look)
    }
}

impl Luminaire {
    /// The file's profile, or an isotropic one. If the file cannot be read, the scene is refused.
    fn profile(&self, builder: &mut SceneBuilder) -> Option<IesProfile> {
        let even = "TILT=NONE 1 -1 1 2 1 1 2 0 0 0 1 1 0 0 180 0 100 100";
        let profile = if self.file.is_empty() {
            IesProfile::parse("even", &even.replacen("NONE ", "NONE\n", 1))
        } else {
            IesProfile::read(Path::new(&self.file))
        };
        match profile {
            Ok(mut profile) => {
                builder.report.warnings.append(&mut profile.warnings);
                Some(profile)
            }
            Err(error) => {
                builder.refused = Some(error.into());
                None
            }
        }
    }

    fn scale(&self, profile: &IesProfile) -> f32 {
        let wanted = if self.watts > 0.0 {
            LUMENS_PER_WATT * self.watts
        } else {
            self.lumens
        };
        let measured = profile.lumens();
        if wanted > 0.0 && measured > 0.0 {
            (wanted / measured) as f32
        } else {
            1.0
        }
    }
}

/// Luminous efficacy of monochromatic light of 540 THz, by the definition of the candela.
const LUMENS_PER_WATT: f64 = 683.0;

impl BuiltinScene for Luminaire {
    const NAME: &'static str = "luminaire";
    const DESCRIPTION: &'static str =
        "a floor below a luminaire with the intensities of an IES file";

    fn build(&self) -> (SceneBuilder, Look) {
        let (mut builder, mut look) = on_floor(2.0 * self.height, Vec::new());
        if let Some(profile) = self.profile(&mut builder) {
            // The nadir points down, the horizontal angle begins at +x.
            let axes = Mat3::from_cols(Vec3::X, Vec3::Z, Vec3::NEG_Y);
            look.lights.push(Light::Ies {
                position: self.height * Vec3::Y,
                rotation: Quat::from_mat3(&axes).normalize(),
                color: Vec3::splat(self.scale(&profile)),
                profile: Arc::new(profile),
            });
        }
        (builder, look)
    }
}

impl BuiltinScene for ManyLights {
    const NAME: &'static str = "many-lights";
    const DESCRIPTION: &'static str =
        "blocks on a floor below many small lamps of unequal power and colour";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut random = Pcg32::new(20);
        let (mut builder, mut look) = on_floor(10.0, Vec::new());
        let mut number = |low: f32, high: f32| low + (high - low) * random.uniform() as f32;
        for _ in 0..24 {
            let corner = Vec3::new(number(-9.0, 8.0), 0.0, number(-9.0, 8.0));
            let size = Vec3::new(number(0.3, 1.0), number(0.3, 2.0), number(0.3, 1.0));
            push_block(&mut builder, corner, size);
        }
        look.materials.truncate(1);
        for lamp in 1..=self.lamps {
            let color = Vec3::new(number(0.3, 1.0), number(0.3, 1.0), number(0.3, 1.0));
            let power = 400.0 / self.lamps as f32 * number(0.0, 1.0).powi(3) + 0.1;
            let place = Vec3::new(number(-9.5, 9.5), number(2.2, 4.0), number(-9.5, 9.5));
            let edge = number(0.05, 0.3);
            let material = Material {
                emits_both_sides: false,
                ..Material::diffuse("lamp", Vec3::ZERO).emitting(color * power / (edge * edge))
            };
            look.materials.push(material);
            let at = |x: f32, z: f32| place + edge * Vec3::new(x, 0.0, z);
            builder.push_quad(
                [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)],
                lamp,
            );
        }
        (builder, look)
    }
}

/// The top and four walls of a box.
fn push_block(builder: &mut SceneBuilder, corner: Vec3, size: Vec3) {
    let at = |x: f32, y: f32, z: f32| corner + size * Vec3::new(x, y, z);
    let around = [[0.0, 0.0], [0.0, 1.0], [1.0, 1.0], [1.0, 0.0]];
    builder.push_quad(around.map(|[x, z]| at(x, 1.0, z)), FLOOR);
    for k in 0..4 {
        let ([ax, az], [bx, bz]) = (around[k], around[(k + 1) % 4]);
        let wall = [
            at(ax, 0.0, az),
            at(bx, 0.0, bz),
            at(bx, 1.0, bz),
            at(ax, 1.0, az),
        ];
        builder.push_quad(wall, FLOOR);
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{load_default, load_with, try_load_with};
    use crate::LightList;
    use raystone_core::params::ParamValue;

    #[test]
    fn every_lamp_is_a_light_of_its_kind_that_shines_down() {
        let kinds = [
            ("rectangle", 1, 1),
            ("disk", 64, 0),
            ("sphere", 1, 2),
            ("point", 1, 3),
            ("spot", 1, 4),
            ("directional", 1, 6),
        ];
        for (name, count, number) in kinds {
            let scene = load_with("lamp", &[("kind", ParamValue::Name(name.to_owned()))]);
            let list = LightList::of(&scene);
            assert_eq!(list.lights.len(), count, "{name}");
            assert_eq!(list.lights[0].kind(&scene).number(), number, "{name}");
            assert_eq!(scene.daylight, None);
            for triangle in &scene.triangles[2..] {
                let [a, b, c] = triangle.vertices;
                assert!((b - a).cross(c - a).y < 0.0, "{name}");
            }
        }
    }

    #[test]
    fn a_luminaire_is_scaled_to_lumens_or_watts_and_needs_its_file() {
        let power = |changes: &[(&str, ParamValue)]| {
            let scene = load_with("luminaire", changes);
            LightList::of(&scene)
                .lights
                .first()
                .map(|light| light.power)
        };
        let near = |found: Option<f64>, lumens: f64| {
            assert!(
                (found.expect("a light") / lumens - 1.0).abs() < 1e-6,
                "{found:?}"
            );
        };
        near(power(&[]), 400.0 * std::f64::consts::PI);
        near(power(&[("lumens", ParamValue::Number(70.0))]), 70.0);
        near(power(&[("watts", ParamValue::Number(2.0))]), 1366.0);
        let missing = ("file", ParamValue::Name("none.ies".to_owned()));
        let error = try_load_with("luminaire", &[missing]).unwrap_err();
        assert!(error.to_string().contains("none.ies"), "{error}");
    }

    #[test]
    fn many_lights_are_that_many() {
        let scene = load_default("many-lights");
        assert_eq!(LightList::of(&scene).lights.len(), 128);
    }

    #[test]
    fn the_floor_below_a_luminaire_reaches_twice_its_height() {
        for height in [0.5, 2.5, 40.0] {
            let scene = load_with("luminaire", &[("height", ParamValue::Number(height))]);
            let bounds = scene.bounds();
            let reach = [bounds.max.x, bounds.max.z, -bounds.min.x, -bounds.min.z];
            assert_eq!(reach, [2.0 * height as f32; 4]);
            let Some(crate::Light::Ies { position, .. }) = scene.lights.first() else {
                panic!("{:?}", scene.lights)
            };
            assert_eq!(position.to_array(), [0.0, height as f32, 0.0]);
        }
    }
}
