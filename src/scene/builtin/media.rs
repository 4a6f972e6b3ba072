//! Scenes with a medium: a spot in a foggy hall, and a cloud over the ground.

use super::super::builder::{Look, SceneBuilder};
use super::super::{Light, Material, SceneError, SceneMedium};
use super::BuiltinScene;
use glam::{DVec3, Vec3, vec3};
use raystone_core::geometry::Camera;
use raystone_core::parameters;
use raystone_volume::{MediaError, Phase, Volume, phase, procedures};

parameters! {
    /// `fog`.
    pub(super) struct Fog {
        /// extinction of the fog, per scene unit; the hall is 8 wide
        density: f32 = 0.12, in 0.0..=100.0;
        /// share of it that scatters
        albedo: f32 = 0.9, in 0.0..=1.0;
    }
}

parameters! {
    /// `cloud`.
    pub(super) struct Cloud {
        /// extinction where the cloud is densest, per scene unit; it is 4 wide
        density: f32 = 12.0, in 0.0..=1000.0;
        /// share of it that scatters
        albedo: f32 = 0.98, in 0.0..=1.0;
        /// voxels along an axis
        voxels: u32 = 48, in 4..=128;
    }
}

/// Where a hall has columns, and their half width.
const COLUMNS: [[f32; 2]; 6] = [
    [-2.2, -2.5],
    [-2.2, 0.0],
    [-2.2, 2.0],
    [2.2, -2.5],
    [2.2, 0.0],
    [2.2, 2.0],
];
const HALF: f32 = 0.25;
const STONE: u32 = 0;
const LAMP: u32 = 1;

/// The scene with a medium, or the reason why it has none.
fn with_medium(
    (mut builder, mut look): (SceneBuilder, Look),
    name: &str,
    volume: Result<Volume, MediaError>,
) -> (SceneBuilder, Look) {
    let medium = volume.and_then(|volume| SceneMedium::new(volume, "level-map"));
    match medium {
        Ok(medium) => look.media = vec![medium],
        Err(source) => {
            let name = name.to_owned();
            builder.refused = Some(SceneError::Medium { name, source });
        }
    }
    (builder, look)
}

/// Four sides of a column from the floor to this height, seen from outside.
fn push_column(builder: &mut SceneBuilder, [x, z]: [f32; 2], height: f32) {
    let corners = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
    let at = |k: usize, y: f32| {
        let [dx, dz] = corners[k % 4];
        vec3(x + HALF * dx, y, z + HALF * dz)
    };
    for k in 0..4 {
        let side = [at(k, 0.0), at(k + 1, 0.0), at(k + 1, height), at(k, height)];
        builder.push_quad(side, STONE);
    }
}

impl BuiltinScene for Fog {
    const NAME: &'static str = "fog";
    const DESCRIPTION: &'static str =
        "a hall with six columns in even fog, under a lamp in the fog and a spot from the side";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::default();
        let (wide, high, deep) = (4.0, 4.0, 4.0);
        let corner = |x: f32, y: f32, z: f32| vec3(wide * x, high * y, deep * z);
        let room = [
            [[-1., 0., -1.], [-1., 0., 1.], [1., 0., 1.], [1., 0., -1.]],
            [[-1., 0., -1.], [1., 0., -1.], [1., 1., -1.], [-1., 1., -1.]],
            [[-1., 0., 1.], [-1., 0., -1.], [-1., 1., -1.], [-1., 1., 1.]],
            [[1., 0., -1.], [1., 0., 1.], [1., 1., 1.], [1., 1., -1.]],
        ];
        for side in room {
            builder.push_quad(side.map(|[x, y, z]| corner(x, y, z)), STONE);
        }
        for place in COLUMNS {
            push_column(&mut builder, place, high);
        }
        let lamp = |x: f32, z: f32| vec3(x, 3.2, z - 1.0);
        let lamp = [
            lamp(-0.4, -0.4),
            lamp(0.4, -0.4),
            lamp(0.4, 0.4),
            lamp(-0.4, 0.4),
        ];
        builder.push_quad(lamp, LAMP);
        let look = Look {
            materials: vec![
                Material::diffuse("stone", vec3(0.6, 0.58, 0.55)),
                Material::diffuse("lamp", Vec3::ZERO).emitting(vec3(9.0, 7.5, 5.0)),
            ],
            camera: Some(Camera::upright(
                vec3(0.6, 1.5, 6.5),
                vec3(-0.1, 1.5, 0.0),
                50.0,
            )),
            lights: vec![Light::Spot {
                position: vec3(3.6, 3.6, 1.0),
                direction: vec3(-0.8, -0.55, -0.25).normalize(),
                intensity: vec3(90.0, 110.0, 140.0),
                inner: 10_f32.to_radians(),
                outer: 13_f32.to_radians(),
                decay: true,
            }],
            ..Look::default()
        };
        let scattering = self.density * self.albedo;
        let volume = Volume::constant(scattering, self.density - scattering, 1.0).and_then(|fog| {
            Volume {
                low: DVec3::new(-4.0, 0.0, -4.0),
                high: DVec3::new(4.0, 4.0, 4.0),
                phase: Phase {
                    kind: phase::HENYEY_GREENSTEIN,
                    anisotropy: 0.3,
                },
                ..fog
            }
            .checked()
        });
        with_medium((builder, look), Self::NAME, volume)
    }
}

impl BuiltinScene for Cloud {
    const NAME: &'static str = "cloud";
    const DESCRIPTION: &'static str =
        "a cloud on a grid over the ground, in the light of a sun and of a blue sky";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::default();
        let ground = [[-1.0, -1.0], [-1.0, 1.0], [1.0, 1.0], [1.0, -1.0]];
        builder.push_quad(ground.map(|[x, z]| vec3(12.0 * x, 0.0, 12.0 * z)), STONE);
        let look = Look {
            materials: vec![Material::diffuse("ground", vec3(0.3, 0.32, 0.25))],
            camera: Some(Camera::upright(
                vec3(0.0, 1.2, 7.5),
                vec3(0.0, 2.0, 0.0),
                45.0,
            )),
            environment: vec3(0.25, 0.4, 0.7),
            lights: vec![Light::Directional {
                direction: vec3(0.6, -0.8, -0.35).normalize(),
                irradiance: vec3(4.0, 3.7, 3.2),
            }],
            ..Look::default()
        };
        let volume = procedures::cloud(self.voxels).and_then(|mut cloud| {
            let most = cloud.scattering.iter().copied().fold(0.0, f32::max);
            let shares = cloud.scattering.iter().map(|s| s / most);
            let shares: Vec<f32> = shares.collect();
            cloud.scattering = shares
                .iter()
                .map(|x| x * self.density * self.albedo)
                .collect();
            cloud.absorption = (shares.iter().zip(&cloud.scattering))
                .map(|(x, scattered)| (x * self.density - scattered).max(0.0))
                .collect();
            Volume {
                low: DVec3::new(-2.0, 0.8, -1.5),
                high: DVec3::new(2.0, 3.4, 1.5),
                phase: Phase {
                    kind: phase::HENYEY_GREENSTEIN,
                    anisotropy: 0.6,
                },
                ..cloud
            }
            .checked()
        });
        with_medium((builder, look), Self::NAME, volume)
    }
}

#[cfg(test)]
mod tests {
    use super::super::tests::{load_default, load_with};
    use raystone_core::params::ParamValue::Number;

    #[test]
    fn both_scenes_hold_their_medium_within_reach_of_their_light() {
        for name in ["fog", "cloud"] {
            let scene = load_default(name);
            assert!(scene.daylight.is_none());
            let volume = scene.media[0].volume.clone();
            assert!(volume.scattering.iter().any(|s| *s > 0.0), "{name}");
            let clear = load_with(name, &[("albedo", Number(1.0))]);
            let absorbs = clear.media[0].volume.absorption.clone();
            assert!(absorbs.iter().all(|a| *a < 1e-5), "{name}");
        }
    }

    #[test]
    fn a_cloud_has_its_density_where_it_is_densest_and_its_albedo_everywhere() {
        let parameters = [("density", Number(12.0)), ("albedo", Number(0.75))];
        let scene = load_with("cloud", &parameters);
        let volume = &scene.media[0].volume;
        let voxels = volume.scattering.iter().zip(&volume.absorption);
        let extinctions: Vec<f32> = voxels.clone().map(|(s, a)| s + a).collect();
        let densest = extinctions.iter().copied().fold(0.0, f32::max);
        assert!((densest - 12.0).abs() < 1e-4, "{densest}");
        for ((scattered, _), extinction) in voxels.zip(&extinctions) {
            assert!((scattered - 0.75 * extinction).abs() < 1e-4 * densest);
        }
        // The same cloud, thinner in proportion.
        let thin = load_with("cloud", &[("density", Number(3.0))]);
        let thin = &thin.media[0].volume;
        for (k, extinction) in extinctions.iter().enumerate() {
            let here = thin.scattering[k] + thin.absorption[k];
            assert!((4.0 * here - extinction).abs() < 1e-4 * densest, "{k}");
        }
        assert_eq!((volume.high - volume.low).x, 4.0);
    }
}
