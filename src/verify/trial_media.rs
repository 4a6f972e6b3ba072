//! Trial scenes with media: fog and a cloud, lamps inside and outside, surfaces in them and around them, every phase function, and
//! coefficients that differ by channel; and several media at once.

use crate::kinds::KindChecks;
use crate::mesh::Mesh;
use crate::trial_mirrors::{connected, mirrors};
use crate::trial_scenes::{Trial, TrialScene, clamp, depth, lamps, points, word};
use glam::{DVec3, Vec3, vec3};
use raystone_scene::{Light, Material, SceneData, SceneError, SceneMedium};
use raystone_volume::{Bounds, MediaError, Phase, Volume, phase, procedures};

fn path(changes: &[(&'static str, raystone_core::params::ParamValue)]) -> Trial {
    ("path", changes.to_vec())
}

/// The scenes with media.
///
/// # Errors
/// A built-in scene is missing.
pub(crate) fn media(kinds: &KindChecks) -> Result<Vec<TrialScene>, SceneError> {
    Ok(vec![
        TrialScene {
            scene: in_medium("fog", lamps()?, fog(), "dda")?,
            trials: vec![
                path(&[depth(6)]),
                path(&[
                    depth(4),
                    word("strategy", "mis-power"),
                    word("roulette", "albedo"),
                    clamp(),
                ]),
                path(&[depth(3), word("light_choice", "tree")]),
                path(&[depth(3), word("strategy", "bsdf"), word("roulette", "none")]),
            ],
        },
        TrialScene {
            scene: in_medium("cloud", points(&kinds.lights)?, cloud(), "level-map")?,
            trials: vec![
                path(&[depth(5)]),
                path(&[
                    depth(3),
                    word("lights", "all"),
                    word("light_choice", "uniform"),
                ]),
                path(&[
                    depth(2),
                    word("strategy", "light"),
                    word("light_choice", "tree"),
                ]),
            ],
        },
        TrialScene {
            scene: in_medium("mist", mirrors()?, fog(), "dda")?,
            trials: vec![path(&[depth(3), connected()])],
        },
        TrialScene {
            scene: in_medium("smoke", glowing()?, smoke(), "sparse-tree")?,
            trials: vec![path(&[depth(4)])],
        },
        TrialScene {
            scene: in_colours("haze", points(&kinds.lights)?, cloud(), HAZE, "bricks")?,
            trials: vec![
                path(&[depth(5)]),
                path(&[depth(2), word("lights", "all"), word("roulette", "albedo")]),
            ],
        },
        TrialScene {
            scene: in_colours("amber", glazed()?, amber(), AMBER, "dda")?,
            trials: vec![
                path(&[depth(9)]),
                path(&[depth(5), word("roulette", "none")]),
            ],
        },
    ])
}

/// The scenes with several media, which overlap and stand apart.
///
/// # Errors
/// A built-in scene is missing.
pub(crate) fn several_media(kinds: &KindChecks) -> Result<Vec<TrialScene>, SceneError> {
    const GREY: [Vec3; 2] = [Vec3::ONE; 2];
    Ok(vec![
        TrialScene {
            scene: in_several(
                "banks",
                lamps()?,
                [(fog(), GREY), (cloud(), GREY), (smoke(), GREY)],
                "level-map",
            )?,
            trials: vec![
                path(&[depth(5)]),
                path(&[depth(3), word("lights", "all")]),
                path(&[
                    depth(3),
                    word("light_choice", "tree"),
                    word("roulette", "albedo"),
                ]),
            ],
        },
        TrialScene {
            scene: in_several("veils", mirrors()?, [(cloud(), GREY), (fog(), GREY)], "dda")?,
            trials: vec![path(&[depth(3), connected()])],
        },
        TrialScene {
            scene: in_several(
                "dyes",
                points(&kinds.lights)?,
                [(cloud(), HAZE), (fog(), AMBER), (smoke(), GREY)],
                "bricks",
            )?,
            trials: vec![
                path(&[depth(5)]),
                path(&[depth(2), word("lights", "all"), word("roulette", "none")]),
            ],
        },
    ])
}

/// Tints of scattering and absorption. One channel of the haze scatters nothing.
const HAZE: [Vec3; 2] = [vec3(1.0, 0.4, 0.0), vec3(0.3, 0.0, 1.0)];
const AMBER: [Vec3; 2] = [vec3(1.0, 0.7, 0.3), vec3(0.1, 0.5, 1.0)];

/// The scene with a medium, which it is named after.
fn in_medium(
    name: &str,
    scene: SceneData,
    volume: Result<Volume, MediaError>,
    structure: &str,
) -> Result<SceneData, SceneError> {
    in_colours(name, scene, volume, [Vec3::ONE; 2], structure)
}

/// The same with tints of scattering and absorption.
fn in_colours(
    name: &str,
    scene: SceneData,
    volume: Result<Volume, MediaError>,
    tints: [Vec3; 2],
    structure: &str,
) -> Result<SceneData, SceneError> {
    in_several(name, scene, [(volume, tints)], structure)
}

/// The same with several media.
fn in_several<const N: usize>(
    name: &str,
    mut scene: SceneData,
    media: [(Result<Volume, MediaError>, [Vec3; 2]); N],
    structure: &str,
) -> Result<SceneData, SceneError> {
    let media = media
        .into_iter()
        .map(|(volume, tints)| SceneMedium::tinted(volume?, tints, structure));
    let media: Result<Vec<SceneMedium>, MediaError> = media.collect();
    scene.media = media.map_err(|source| SceneError::Medium {
        name: name.to_owned(),
        source,
    })?;
    name.clone_into(&mut scene.name);
    Ok(scene)
}

/// Fog that is everywhere the same, around all lamps and half of the floor, thrown forward.
fn fog() -> Result<Volume, MediaError> {
    let fog = Volume::constant(0.3, 0.1, 1.0)?;
    Volume {
        low: DVec3::new(-2.5, 0.0, -3.0),
        high: DVec3::new(2.0, 3.4, 2.0),
        phase: Phase {
            kind: phase::HENYEY_GREENSTEIN,
            anisotropy: 0.6,
        },
        ..fog
    }
    .checked()
}

/// A cloud in an ellipsoid with the camera in it, whose albedo differs from place to place, thrown back.
fn cloud() -> Result<Volume, MediaError> {
    let mut cloud = procedures::cloud(12)?;
    for (place, absorbed) in cloud.absorption.iter_mut().enumerate() {
        *absorbed *= (place % 7) as f32;
    }
    Volume {
        low: DVec3::new(-3.0, -0.5, -2.5),
        high: DVec3::new(2.5, 3.0, 4.5),
        bounds: Bounds::Sphere,
        phase: Phase {
            kind: phase::SCHLICK,
            anisotropy: -0.5,
        },
        ..cloud
    }
    .checked()
}

/// Smoke that is empty in its middle, in boxes of unequal sides. No plane between voxels lies in a surface: on which side
/// of it rays begin there, and so which numbers they draw, rounding decides.
fn smoke() -> Result<Volume, MediaError> {
    let smoke = Volume::new([9, 5, 14], |p| {
        let far = (p - 0.5).length() > 0.25;
        let density = if far { (0.5 + p.y) as f32 } else { 0.0 };
        [0.8 * density, 0.05, 1.0]
    })?;
    Volume {
        low: DVec3::new(-1.93, 0.13, -1.83),
        high: DVec3::new(1.9, 2.5, 2.2),
        ..smoke
    }
    .checked()
}

/// The scene of lamps with two balls of light, one of them in the smoke.
fn glowing() -> Result<SceneData, SceneError> {
    let mut scene = lamps()?;
    let ball = |center, radius, radiance| Light::Sphere {
        center,
        radius,
        radiance,
    };
    scene.lights = vec![
        ball(vec3(-0.9, 1.6, 0.8), 0.2, vec3(9.0, 6.0, 3.0)),
        ball(vec3(2.6, 2.4, -1.0), 0.3, vec3(1.0, 3.0, 6.0)),
    ];
    Ok(scene)
}

/// Low corner and size of a block of glass.
const GLASS: [Vec3; 2] = [vec3(0.15, 0.5, 1.4), vec3(0.8, 0.9, 0.7)];

/// What fills the block up to its surfaces.
fn amber() -> Result<Volume, MediaError> {
    let amber = Volume::constant(2.0, 1.5, 1.0)?;
    let [low, size] = GLASS;
    Volume {
        low: low.as_dvec3(),
        high: (low + size).as_dvec3(),
        phase: Phase {
            kind: phase::HENYEY_GREENSTEIN,
            // Nearly even.
            anisotropy: 0.1,
        },
        ..amber
    }
    .checked()
}

/// The scene of lamps with a block of glass before them.
fn glazed() -> Result<SceneData, SceneError> {
    let mut mesh = Mesh { scene: lamps()? };
    let glass = mesh.material(Material::dielectric("glass", vec3(0.9, 1.0, 0.95), 1.5));
    let [low, size] = GLASS;
    mesh.block(low, size, glass);
    Ok(mesh.done(Vec::new()))
}
