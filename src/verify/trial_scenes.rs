//! Small scenes with everything that single paths can get wrong: unequal, small, grazing and hidden
//! lamps, nested glass, panes, mirrors, repeating textures, and light from all sides. The tests of
//! the gate check paths on them, so a kernel fault shows even if no user scene triggers it.

use crate::kinds::KindChecks;
use crate::lights::LightRegistry;
use crate::materials::MaterialRegistry;
use crate::mesh::Mesh;
use glam::{Vec2, Vec3, vec2, vec3};
use raystone_core::geometry::Camera;
use raystone_core::params::ParamValue;
use raystone_scene::{self as scene, Material, SceneData, SceneError, Texture, TextureUse};

/// An integrator and its non-default parameters.
pub type Trial = (&'static str, Vec<(&'static str, ParamValue)>);

/// A scene and the integrators checked on it.
pub struct TrialScene {
    /// The scene, with a camera.
    pub scene: SceneData,
    /// The integrators.
    pub trials: Vec<Trial>,
}

pub use crate::trial_lights::trials_of;
pub use crate::trial_slivers::sheets;
pub use crate::trial_surfaces::layers;

/// The trial scenes of the built-in kinds.
///
/// # Errors
/// A built-in scene is missing.
pub fn trial_scenes() -> Result<Vec<TrialScene>, SceneError> {
    trial_scenes_of(&KindChecks::default())
}

/// The trial scenes of these kinds of materials and lights.
///
/// # Errors
/// As [`trial_scenes`].
pub fn trial_scenes_of(kinds: &KindChecks) -> Result<Vec<TrialScene>, SceneError> {
    let occlusion = |radius| ("ao", vec![("radius", ParamValue::Number(radius))]);
    let primary = || ("primary", vec![]);
    let mut scenes = vec![
        TrialScene {
            scene: lamps()?,
            trials: trials_of_lamps(),
        },
        TrialScene {
            scene: points(&kinds.lights)?,
            trials: vec![
                ("path", vec![depth(4)]),
                (
                    "path",
                    vec![
                        depth(3),
                        word("lights", "all"),
                        word("strategy", "mis-power"),
                    ],
                ),
                ("path", vec![depth(3), word("light_choice", "uniform")]),
            ],
        },
    ];
    for kind in kinds.materials.iter() {
        scenes.extend((kind.trials)()?);
    }
    scenes.extend([
        TrialScene {
            scene: glossy(&kinds.materials)?,
            trials: vec![
                ("path", vec![depth(6)]),
                ("path", vec![depth(3), word("strategy", "bsdf")]),
            ],
        },
        TrialScene {
            scene: textured()?,
            trials: vec![("path", vec![depth(4)]), primary()],
        },
        TrialScene {
            scene: scene::named("instances")?,
            trials: vec![
                ("path", vec![depth(6)]),
                occlusion(0.02),
                occlusion(0.3),
                primary(),
            ],
        },
    ]);
    for kind in kinds.lights.iter() {
        scenes.extend((kind.trials)()?);
    }
    scenes.push(crate::trial_lights::many()?);
    scenes.extend(crate::trial_surfaces::scenes()?);
    scenes.extend(crate::trial_mirrors::scenes()?);
    scenes.extend(crate::trial_slivers::scenes()?);
    scenes.extend(crate::trial_reach::scenes(kinds)?);
    scenes.extend(crate::trial_media::media(kinds)?);
    scenes.extend(crate::trial_media::several_media(kinds)?);
    Ok(scenes)
}

/// Strategies and roulettes of paths among lamps, and a clamp.
fn trials_of_lamps() -> Vec<Trial> {
    let with = |strategy, roulette| {
        let words = [word("strategy", strategy), word("roulette", roulette)];
        ("path", [&words[..], &[depth(5)]].concat())
    };
    let late = ("roulette_depth", ParamValue::Integer(1));
    vec![
        ("path", vec![depth(8)]),
        with("mis-power", "albedo"),
        with("bsdf", "none"),
        with("light", "albedo"),
        ("path", vec![clamp(), depth(4), late]),
    ]
}

pub(super) fn depth(depth: i64) -> (&'static str, ParamValue) {
    ("max_depth", ParamValue::Integer(depth))
}

/// Below most of what paths find after their first bounce.
pub(super) fn clamp() -> (&'static str, ParamValue) {
    ("clamp", ParamValue::Number(0.25))
}

pub(super) fn word(key: &'static str, value: &str) -> (&'static str, ParamValue) {
    (key, ParamValue::Name(value.to_owned()))
}

pub(super) fn camera(eye: Vec3, target: Vec3, up: Vec3) -> Camera {
    Camera {
        eye,
        target,
        up,
        vertical_fov_degrees: 47.0,
    }
}

/// Lamps of all sizes and colours over a floor between two walls: one large and dim, one small and
/// bright, one in the plane of a wall, one on edge, one hidden behind a block, one that faces away.
pub(super) fn lamps() -> Result<SceneData, SceneError> {
    let camera = camera(
        vec3(2.3, 2.2, 3.7),
        vec3(-0.4, 0.7, -0.3),
        vec3(0.1, 1.0, -0.05),
    );
    let mut mesh = Mesh::new("lamps", camera, vec3(0.02, 0.03, 0.05))?;
    let wall = |name, r, g, b| Material::diffuse(name, vec3(r, g, b));
    let [floor, red, blue, block] = [
        wall("floor", 0.7, 0.65, 0.5),
        wall("red", 0.8, 0.2, 0.15),
        wall("blue", 0.1, 0.25, 0.75),
        wall("block", 0.85, 0.9, 0.8),
    ]
    .map(|m| mesh.material(m));
    let mut lamp = |name, reflectance, emission| {
        mesh.material(Material::diffuse(name, Vec3::splat(reflectance)).emitting(emission))
    };
    let dim = lamp("dim", 0.5, vec3(0.6, 0.5, 0.4));
    let bright = lamp("bright", 0.0, vec3(160.0, 200.0, 90.0));
    let green = lamp("green", 0.3, vec3(0.0, 3.0, 0.0));
    let violet = lamp("violet", 0.2, vec3(4.0, 0.1, 6.0));
    mesh.plain([vec3(-3.0, 0.0, -3.0), 6.0 * Vec3::Z, 6.0 * Vec3::X], floor);
    mesh.plain([vec3(-2.0, 0.0, -3.0), 4.0 * Vec3::Y, 6.0 * Vec3::Z], red);
    mesh.plain([vec3(-3.0, 0.0, -2.0), 6.0 * Vec3::X, 4.0 * Vec3::Y], blue);
    mesh.block(vec3(-0.6, 0.0, -0.5), vec3(0.9, 1.1, 0.7), block);
    mesh.ball(vec3(1.0, 0.4, 0.9), 0.4, block);
    mesh.plain([vec3(-1.0, 3.2, -1.5), 2.0 * Vec3::X, 1.5 * Vec3::Z], dim);
    mesh.plain(
        [vec3(0.9, 1.9, -0.9), 0.04 * Vec3::X, 0.05 * Vec3::Z],
        bright,
    );
    // Stands on the floor, along the wall: light grazes both.
    mesh.plain([vec3(-1.9, 0.0, -1.9), 0.6 * Vec3::Y, 1.4 * Vec3::Z], green);
    mesh.triangle(
        [
            vec3(1.4, 0.05, -1.2),
            vec3(1.5, 0.9, -1.3),
            vec3(1.6, 0.05, -0.6),
        ],
        [Vec2::ZERO; 3],
        violet,
    );
    // In the shadow of the block, and facing away from everything else.
    mesh.triangle(
        [
            vec3(-0.5, 0.2, -0.9),
            vec3(0.2, 0.3, -0.9),
            vec3(-0.1, 0.8, -0.8),
        ],
        [Vec2::ZERO; 3],
        green,
    );
    mesh.triangle(
        [
            vec3(2.6, 0.3, 0.2),
            vec3(2.6, 1.2, 0.6),
            vec3(2.7, 0.4, 0.9),
        ],
        [Vec2::ZERO; 3],
        violet,
    );
    Ok(mesh.done(Vec::new()))
}

/// All kinds of lights without triangles except measured ones and maps, with a block and a lamp.
pub(super) fn points(kinds: &LightRegistry) -> Result<SceneData, SceneError> {
    let camera = camera(vec3(-1.2, 1.9, 3.4), vec3(0.1, 0.5, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("points", camera, Vec3::ZERO)?;
    let floor = mesh.material(Material::diffuse("floor", vec3(0.7, 0.6, 0.5)));
    let block = Material::phong("block", vec3(0.4, 0.5, 0.3), Vec3::splat(0.3), 20.0);
    let block = mesh.material(block);
    let lamp = Material::diffuse("lamp", Vec3::splat(0.2)).emitting_from_front(vec3(3.0, 2.0, 4.0));
    let lamp = mesh.material(lamp);
    mesh.plain([vec3(-3.0, 0.0, -3.0), 6.0 * Vec3::Z, 6.0 * Vec3::X], floor);
    mesh.plain([vec3(-3.0, 0.0, -2.0), 6.0 * Vec3::X, 4.0 * Vec3::Y], floor);
    mesh.block(vec3(-0.4, 0.0, -0.5), vec3(0.7, 0.9, 0.6), block);
    mesh.plain([vec3(1.5, 0.2, -1.0), vec3(0.0, 0.3, 1.2), Vec3::Y], lamp);
    let mut scene = mesh.done(Vec::new());
    scene.lights = kinds.iter().flat_map(|kind| (kind.points)()).collect();
    Ok(scene)
}

/// Balls of every glossy kind over a glossy floor, between two one-sided lamps and a sheet.
fn glossy(kinds: &MaterialRegistry) -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.5, 2.4, 5.2), vec3(0.0, 0.6, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("glossy", camera, vec3(0.2, 0.25, 0.3))?;
    let mut balls: Vec<_> = kinds.iter().flat_map(|kind| (kind.balls)()).collect();
    balls.sort_by_key(|(place, _)| place.unwrap_or(usize::MAX));
    for (place, (_, material)) in balls.into_iter().enumerate() {
        let material = mesh.material(material);
        let (column, row) = ((place % 4) as f32, (place / 4) as f32);
        mesh.ball(
            vec3(1.1 * column - 1.7, 0.5, 1.2 * row - 0.6),
            0.48,
            material,
        );
    }
    let floor = Material::principled("principled", vec3(0.9, 0.6, 0.4), 0.2, 0.6, 0.05);
    let floor = mesh.material(floor);
    let one_sided =
        Material::diffuse("lamp", Vec3::splat(0.3)).emitting_from_front(vec3(6.0, 7.0, 8.0));
    let both = Material::diffuse("sheet", Vec3::splat(0.5)).emitting(vec3(2.0, 1.5, 1.0));
    let [one_sided, both] = [one_sided, both].map(|m| mesh.material(m));
    mesh.plain([vec3(-4.0, 0.0, -4.0), 8.0 * Vec3::Z, 8.0 * Vec3::X], floor);
    mesh.plain(
        [vec3(-1.0, 2.6, -1.0), 2.0 * Vec3::X, 1.5 * Vec3::Z],
        one_sided,
    );
    mesh.plain(
        [vec3(-2.6, 0.2, -1.5), 1.2 * Vec3::Y, 2.0 * Vec3::Z],
        one_sided,
    );
    mesh.plain([vec3(2.7, 0.2, -1.5), 1.2 * Vec3::Y, 2.0 * Vec3::Z], both);
    Ok(mesh.done(Vec::new()))
}

/// Non-square, repeating, shifted and tinted textures on a floor, a wall, a mirror and a lamp.
fn textured() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.7, 1.6, 2.4), vec3(0.0, 0.5, -0.2), Vec3::Y);
    let mut mesh = Mesh::new("textured", camera, vec3(0.4, 0.5, 0.6))?;
    let painted = |material: Material, texture| Material {
        base_color_texture: Some(TextureUse::plain(texture)),
        ..material
    };
    let [floor, wall, mirror, lamp, plain] = [
        painted(Material::diffuse("floor", vec3(0.9, 0.7, 0.8)), 0),
        painted(Material::diffuse("wall", Vec3::ONE), 1),
        painted(Material::mirror("mirror", vec3(0.8, 0.9, 1.0)), 1),
        painted(Material::diffuse("lamp", Vec3::splat(0.6)), 0).emitting(vec3(5.0, 4.0, 3.0)),
        Material::diffuse("plain", vec3(0.4, 0.6, 0.5)),
    ]
    .map(|m| mesh.material(m));
    let to = |x: f32, y: f32| vec2(x, y);
    mesh.quad(
        [vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X],
        [to(-1.3, 0.2), to(2.4, 3.1)],
        floor,
    );
    mesh.quad(
        [vec3(-2.0, 0.0, -1.5), 4.0 * Vec3::X, 2.0 * Vec3::Y],
        [to(0.1, 0.9), to(0.8, 0.05)],
        wall,
    );
    mesh.quad(
        [vec3(-1.6, 0.0, -1.0), vec3(0.3, 0.0, 1.8), 1.2 * Vec3::Y],
        [to(0.0, 0.0), to(-1.0, 2.0)],
        mirror,
    );
    mesh.quad(
        [vec3(-0.5, 2.3, -0.5), 1.0 * Vec3::X, 0.8 * Vec3::Z],
        [to(0.0, 0.0), to(1.0, 1.0)],
        lamp,
    );
    mesh.block(vec3(0.2, 0.0, -0.6), vec3(0.5, 0.7, 0.4), plain);
    let texture = |name: &str, width: u32, height: u32, seed: u32| Texture {
        name: name.to_owned(),
        width,
        height,
        texels: (0..width * height)
            .map(|i| {
                [
                    (i * 73 + seed) % 256,
                    (i * i * 31 + 90) % 256,
                    (i * 17 + seed) % 64,
                    255,
                ]
            })
            .map(|texel| texel.map(|c| c as u8))
            .collect(),
    };
    Ok(mesh.done(vec![texture("wide", 7, 3, 12), texture("tall", 2, 5, 200)]))
}
