//! Trial scenes for special lights: environment maps, measured luminaires, many lights in a tree.

use crate::kinds::KindChecks;
use crate::mesh::Mesh;
use crate::trial_scenes::{Trial, TrialScene, camera, clamp, depth, word};
use glam::{Quat, Vec3, vec3};
use raystone_core::params::ParamValue;
use raystone_render::ConfiguredIntegrator;
use raystone_scene::{
    EnvironmentMap, GEOMETRIC, IesProfile, Light, Material, Photometry, SceneData, SceneError,
    encode_normal,
};
use std::sync::Arc;

fn path(changes: &[(&'static str, ParamValue)]) -> Trial {
    ("path", changes.to_vec())
}

fn tree() -> (&'static str, ParamValue) {
    word("light_choice", "tree")
}

pub(super) fn skies() -> Result<Vec<TrialScene>, SceneError> {
    Ok(vec![
        TrialScene {
            scene: sky()?,
            trials: vec![
                path(&[depth(4)]),
                path(&[
                    depth(3),
                    word("lights", "all"),
                    word("strategy", "mis-power"),
                ]),
                path(&[depth(2), word("strategy", "light"), tree()]),
                path(&[depth(2), word("light_choice", "uniform"), clamp()]),
            ],
        },
        TrialScene {
            scene: open_sky()?,
            trials: vec![path(&[depth(3)])],
        },
    ])
}

/// Lights of all kinds in a tree.
pub(super) fn many() -> Result<TrialScene, SceneError> {
    Ok(TrialScene {
        scene: many_lamps()?,
        trials: vec![
            path(&[depth(4), tree()]),
            path(&[depth(3), word("strategy", "mis-power")]),
            path(&[depth(2), word("lights", "all")]),
        ],
    })
}

/// Trial scenes for features that a scene's own paths may exercise too little: its maps, its
/// luminaires, its medium, and the light tree of an integrator. The integrator is checked as configured.
///
/// # Errors
/// A built-in scene is missing.
pub fn trials_of(
    kinds: &KindChecks,
    scene: &SceneData,
    integrator: &ConfiguredIntegrator,
) -> Result<Vec<TrialScene>, SceneError> {
    let mut scenes = Vec::new();
    if integrator.kind.name() != "path" {
        return Ok(scenes);
    }
    for kind in kinds.lights.iter() {
        if scene.lights.iter().any(|light| light.kind() == kind.kind) {
            scenes.extend((kind.trials)()?);
        }
    }
    if !scene.media.is_empty() {
        scenes.extend(crate::trial_media::media(kinds)?);
    }
    if scene.media.len() > 1 {
        scenes.extend(crate::trial_media::several_media(kinds)?);
    }
    let choice = integrator.params.0.get("light_choice");
    if choice.is_some_and(|by| by.to_string() == "tree") {
        scenes.push(many()?);
    }
    scenes.iter_mut().for_each(|trial| trial.trials.clear());
    Ok(scenes)
}

fn mixed(seed: u32) -> f32 {
    let word = (seed + 1)
        .wrapping_mul(0x9e37_79b9)
        .rotate_left(13)
        .wrapping_mul(0x85eb_ca6b);
    (word >> 8) as f32 / (1 << 24) as f32
}

/// A map of dark and bright texels, one of them a small sun, turned and scaled.
pub(super) fn map() -> Light {
    const SIZE: [u32; 2] = [13, 7];
    let texel = |at: u32| {
        let colour = vec3(mixed(3 * at), mixed(3 * at + 1), mixed(3 * at + 2));
        match (at / SIZE[0], at % SIZE[0]) {
            (1, 4) => vec3(90.0, 80.0, 60.0),
            (4, _) => Vec3::ZERO,
            (_, column) if column % 5 == 2 => Vec3::ZERO,
            _ => colour,
        }
    };
    Light::Environment {
        map: Arc::new(EnvironmentMap {
            name: "map".to_owned(),
            width: SIZE[0],
            height: SIZE[1],
            texels: (0..SIZE[0] * SIZE[1]).map(texel).collect(),
        }),
        scale: 1.3,
        turn: 0.7,
    }
}

/// Blocks, a ball and a mirror under the map, and a small lamp.
fn sky() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.9, 1.7, 3.0), vec3(0.0, 0.6, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("sky", camera, Vec3::splat(7.0))?;
    let [floor, block, shiny, mirror, lamp] = [
        Material::diffuse("floor", vec3(0.6, 0.7, 0.5)),
        Material::diffuse("block", vec3(0.8, 0.4, 0.3)),
        Material::phong("shiny", vec3(0.2, 0.3, 0.4), Vec3::splat(0.5), 40.0),
        Material::mirror("mirror", vec3(0.9, 0.8, 0.7)),
        Material::diffuse("lamp", Vec3::splat(0.2)).emitting(vec3(4.0, 6.0, 9.0)),
    ]
    .map(|m| mesh.material(m));
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X], floor);
    mesh.block(vec3(-0.9, 0.0, -0.8), vec3(0.6, 1.3, 0.5), block);
    mesh.ball(vec3(0.6, 0.5, 0.3), 0.45, shiny);
    mesh.plain(
        [vec3(-1.8, 0.1, 0.4), vec3(0.5, 0.0, 1.1), 1.1 * Vec3::Y],
        mirror,
    );
    mesh.plain([vec3(1.2, 0.9, -1.2), 0.4 * Vec3::X, 0.3 * Vec3::Y], lamp);
    let mut scene = mesh.done(Vec::new());
    scene.lights = vec![map()];
    Ok(scene)
}

/// Balls in mid-air under a map of more columns than a texture is wide, so that rays leave to all sides: also straight down, and
/// over the seam of the map.
fn open_sky() -> Result<SceneData, SceneError> {
    // The numbers of rows and columns are above and at a power of two.
    const SIZE: [u32; 2] = [1030, 8];
    let camera = camera(vec3(0.4, 0.3, 4.1), Vec3::ZERO, Vec3::Y);
    let mut mesh = Mesh::new("open-sky", camera, Vec3::ZERO)?;
    let [mirror, grey] = [
        Material::mirror("mirror", vec3(0.9, 0.8, 0.7)),
        Material::diffuse("grey", vec3(0.5, 0.6, 0.4)),
    ]
    .map(|m| mesh.material(m));
    mesh.ball(vec3(-0.8, 0.1, 0.0), 0.9, mirror);
    mesh.ball(vec3(1.0, -0.2, 0.3), 0.7, grey);
    let mut scene = mesh.done(Vec::new());
    // Neighbours in a row are alike: a direction is rounded to a part of a narrow texel.
    let texel = |at: u32| {
        let (row, column) = (at / SIZE[0], at % SIZE[0]);
        let around = std::f32::consts::TAU * column as f32 / SIZE[0] as f32;
        let shade = |k: u32| 0.6 + mixed(7 * row + k) + 0.5 * (around + k as f32).cos();
        vec3(shade(0), shade(1), shade(2))
    };
    scene.lights = vec![Light::Environment {
        map: Arc::new(EnvironmentMap {
            name: "wide map".to_owned(),
            width: SIZE[0],
            height: SIZE[1],
            texels: (0..SIZE[0] * SIZE[1]).map(texel).collect(),
        }),
        scale: 0.8,
        turn: -2.3,
    }];
    Ok(scene)
}

/// A luminaire of this type; all intensities differ except where angles meet.
fn profile(photometry: Photometry, axial: bool) -> IesProfile {
    let (vertical, horizontal) = match (photometry, axial) {
        (_, true) => (vec![0.0, 35.0, 80.0, 110.0], vec![0.0]),
        (Photometry::C, _) => (
            vec![0.0, 25.0, 60.0, 90.0, 130.0, 180.0],
            vec![0.0, 70.0, 180.0, 250.0, 360.0],
        ),
        _ => (
            vec![-90.0, -35.0, 10.0, 40.0, 90.0],
            vec![-90.0, -20.0, 45.0, 90.0],
        ),
    };
    let (rows, columns) = (vertical.len(), horizontal.len());
    let value = |at: usize| {
        let (mut column, mut row) = (at / rows, at % rows);
        // Where all angles of the other kind are one direction, and where the circle closes.
        match photometry {
            Photometry::C if row == 0 || row == rows - 1 => column = 0,
            Photometry::C if column == columns - 1 => column = 0,
            Photometry::A if row == 0 || row == rows - 1 => column = 0,
            Photometry::B if column == 0 || column == columns - 1 => row = 0,
            _ => {}
        }
        0.2 + 2.0 * mixed((40 + 10 * column + row) as u32)
    };
    IesProfile {
        name: "luminaire".to_owned(),
        photometry,
        candela: (0..rows * columns).map(value).collect(),
        vertical,
        horizontal,
        rated_lumens: None,
        input_watts: 0.0,
        warnings: Vec::new(),
    }
}

fn luminaire(photometry: Photometry, axial: bool, position: Vec3, turn: Quat) -> Light {
    Light::Ies {
        position,
        rotation: turn.normalize(),
        color: vec3(1.0, 0.8, 1.4),
        profile: Arc::new(profile(photometry, axial)),
    }
}

pub(super) fn luminaire_lights() -> [Light; 5] {
    let turn = |x: f32, y: f32, z: f32, w: f32| Quat::from_xyzw(x, y, z, w);
    [
        luminaire(
            Photometry::C,
            false,
            vec3(-0.9, 1.4, 0.6),
            turn(0.3, 0.6, -0.2, 0.7),
        ),
        luminaire(
            Photometry::B,
            false,
            vec3(0.8, 1.1, 0.9),
            turn(-0.5, 0.4, 0.6, 0.2),
        ),
        luminaire(
            Photometry::A,
            false,
            vec3(0.1, 1.6, -0.9),
            turn(0.8, -0.1, 0.3, 0.5),
        ),
        luminaire(
            Photometry::C,
            true,
            vec3(1.3, 0.7, -0.4),
            turn(0.7, 0.1, 0.1, 0.7),
        ),
        half_a_turn(vec3(-0.2, 1.2, 1.1), turn(0.6, 0.2, -0.3, 0.6)),
    ]
}

/// A luminaire measured at the ends of half a turn alone, which lights nothing beyond.
fn half_a_turn(position: Vec3, turn: Quat) -> Light {
    let mut half = profile(Photometry::C, false);
    half.candela.truncate(2 * half.vertical.len());
    half.horizontal = vec![0.0, 180.0];
    Light::Ies {
        position,
        rotation: turn.normalize(),
        color: vec3(0.7, 1.1, 0.9),
        profile: Arc::new(half),
    }
}

/// A corner with a block between luminaires of all types.
pub(super) fn luminaires() -> Result<Vec<TrialScene>, SceneError> {
    let camera = camera(vec3(1.4, 2.1, 3.3), vec3(-0.1, 0.5, -0.2), Vec3::Y);
    let mut mesh = Mesh::new("luminaires", camera, Vec3::ZERO)?;
    room(&mut mesh);
    let mut scene = mesh.done(Vec::new());
    scene.lights = luminaire_lights().into();
    Ok(vec![TrialScene {
        scene,
        trials: vec![path(&[depth(3)])],
    }])
}

fn room(mesh: &mut Mesh) {
    let wall = |name, r, g, b| Material::diffuse(name, vec3(r, g, b));
    let [floor, left, back, block] = [
        wall("floor", 0.7, 0.6, 0.5),
        wall("left", 0.3, 0.7, 0.5),
        wall("back", 0.6, 0.6, 0.8),
        wall("block", 0.8, 0.5, 0.6),
    ]
    .map(|m| mesh.material(m));
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X], floor);
    mesh.plain([vec3(-2.0, 0.0, -2.0), 3.0 * Vec3::Y, 4.0 * Vec3::Z], left);
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 3.0 * Vec3::Y], back);
    mesh.block(vec3(-0.4, 0.0, -0.3), vec3(0.6, 0.8, 0.5), block);
}

/// Lamps of all kinds, sizes and directions: one- and two-sided flat ones, balls, points, spots,
/// luminaires, directional lights. The floor has vertex normals, so it matters which normal the
/// choice of a light uses.
fn many_lamps() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.2, 1.8, 3.4), vec3(-0.1, 0.6, -0.2), Vec3::Y);
    let mut mesh = Mesh::new("many-lamps", camera, Vec3::ZERO)?;
    room(&mut mesh);
    let shade = |k: u32| vec3(mixed(k), mixed(k + 1), mixed(k + 2)) + 0.1;
    let within = |k: u32| vec3(-1.8, 0.3, -1.8) + vec3(3.4, 2.2, 3.4) * (shade(k) - 0.1);
    let aside = |k: u32| 0.5 * (shade(k) - 0.6);
    for lamp in 0..12 {
        let k = 300 + 20 * lamp;
        let material = Material::diffuse("lamp", shade(k));
        let power = shade(k + 3) * 9.0;
        let material = mesh.material(match lamp % 3 {
            0 => material.emitting(power),
            _ => material.emitting_from_front(power),
        });
        let quad = [within(k + 6), aside(k + 9), aside(k + 12)];
        match lamp % 4 {
            3 => {
                let [a, b, c] = quad;
                mesh.triangle([a, a + b, a + c], [glam::Vec2::ZERO; 3], material);
            }
            _ => mesh.plain(quad, material),
        }
    }
    let mut scene = mesh.done(Vec::new());
    scene.normals = vec![[GEOMETRIC; 3]; scene.triangles.len()];
    let bent = |x: f32, z: f32| encode_normal(vec3(x, 1.0, z).normalize());
    scene.normals[0] = [bent(-0.4, -0.1), bent(0.5, -0.2), bent(0.4, 0.3)];
    scene.normals[1] = [bent(-0.4, -0.1), bent(0.4, 0.3), bent(-0.3, 0.4)];
    for k in (600..700).step_by(20) {
        scene.lights.extend([
            Light::Sphere {
                center: within(k),
                radius: 0.02 + 0.1 * mixed(k + 3),
                radiance: 8.0 * shade(k + 4),
            },
            Light::Point {
                position: within(k + 7),
                intensity: 0.3 * shade(k + 10),
            },
            Light::Spot {
                position: within(k + 13),
                direction: shade(k + 16) - 0.6,
                intensity: shade(k + 5),
                inner: 0.4,
                outer: 0.9,
                decay: k % 40 == 0,
            },
        ]);
    }
    scene.lights.extend(luminaire_lights());
    let sun = |x: f32| Light::Directional {
        direction: vec3(x, -1.0, -0.4),
        irradiance: vec3(0.3, 0.2, 0.4),
    };
    scene.lights.extend([sun(0.3), sun(-0.8), map()]);
    Ok(scene)
}
