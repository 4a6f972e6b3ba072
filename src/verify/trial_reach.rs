//! Trial scenes for what small, plain scenes do not reach: masks that wrap in two ways and alphas equal to their
//! cutoff, surfaces that are partly transparent, rooms a hundred thousand times as large and as small, every light on every material at once, and
//! surfaces within a luminous ball.

use crate::kinds::KindChecks;
use crate::mesh::Mesh;
use crate::trial_mirrors::connected;
use crate::trial_scenes::{TrialScene, camera, clamp, depth, lamps, word};
use glam::{Vec3, vec2, vec3};
use raystone_core::params::ParamValue;
use raystone_scene::{
    AlphaChannel, AlphaMask, Light, Material, SceneData, SceneError, Texture, TextureUse, Wrap,
};

/// Factors of the large and the small room: powers of two, so that all coordinates stay exact.
const LARGE: f32 = 131_072.0;
const SMALL: f32 = 1.0 / 131_072.0;

pub(super) fn scenes(kinds: &KindChecks) -> Result<Vec<TrialScene>, SceneError> {
    let path = |changes: &[_]| ("path", changes.to_vec());
    let occlusion = || ("ao", vec![("radius", ParamValue::Number(0.3))]);
    let primary = || ("primary", vec![]);
    let mut scenes = vec![
        TrialScene {
            scene: fences()?,
            trials: vec![path(&[depth(3)]), primary()],
        },
        TrialScene {
            scene: veils()?,
            trials: vec![path(&[depth(2)]), path(&[depth(3)]), primary()],
        },
        TrialScene {
            scene: every_pair(kinds)?,
            trials: vec![path(&[depth(2), word("lights", "all")])],
        },
        TrialScene {
            scene: within_a_lamp()?,
            trials: vec![
                path(&[depth(3)]),
                path(&[depth(3), clamp()]),
                path(&[depth(3), connected()]),
            ],
        },
    ];
    for (name, factor) in [("large-room", LARGE), ("small-room", SMALL)] {
        let mut scene = scaled(lamps()?, name, factor);
        // Behind the block for most of the floor, and as far away as the lamps.
        scene.lights.push(Light::Sphere {
            center: factor * vec3(0.9, 2.4, -0.8),
            radius: 0.15 * factor,
            radiance: vec3(14.0, 9.0, 12.0),
        });
        scenes.push(TrialScene {
            scene,
            trials: vec![path(&[depth(8)]), occlusion(), primary()],
        });
    }
    Ok(scenes)
}

/// The same scene at another scale.
fn scaled(mut scene: SceneData, name: &str, factor: f32) -> SceneData {
    scene.name = name.to_owned();
    for vertex in scene.triangles.iter_mut().flat_map(|t| &mut t.vertices) {
        *vertex *= factor;
    }
    if let Some(camera) = &mut scene.camera {
        camera.eye *= factor;
        camera.target *= factor;
    }
    scene
}

/// An image of alphas of which whole rows and columns at the border are opaque.
pub(super) fn alphas(name: &str, [width, height]: [u32; 2]) -> Texture {
    let alpha = |at: u32| match (at % width, at / width) {
        (column, row) if column + 1 == width || row == 0 => 255,
        _ => [0, 90, 200, 255][(at * 7 % 5 % 4) as usize],
    };
    Texture {
        name: name.to_owned(),
        width,
        height,
        texels: (0..width * height).map(|at| [0, 0, 0, alpha(at)]).collect(),
    }
}

/// The ground, a wall behind, and a lamp above.
fn before_a_wall(mesh: &mut Mesh) {
    let ground = mesh.material(Material::diffuse("ground", vec3(0.7, 0.7, 0.6)));
    let lamp = Material::diffuse("lamp", Vec3::splat(0.2)).emitting(vec3(9.0, 8.0, 7.0));
    let lamp = mesh.material(lamp);
    mesh.plain(
        [vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X],
        ground,
    );
    mesh.plain(
        [vec3(-2.0, 0.0, -1.6), 4.0 * Vec3::X, 2.5 * Vec3::Y],
        ground,
    );
    mesh.plain([vec3(-0.6, 2.6, -0.5), 1.2 * Vec3::X, 0.9 * Vec3::Z], lamp);
}

/// Fences before a wall, each cut out by another image that wraps differently in both directions; one of them is
/// solid only where alpha is the cutoff itself.
fn fences() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.4, 1.7, 3.1), vec3(0.0, 0.6, -0.2), Vec3::Y);
    let mut mesh = Mesh::new("fences", camera, vec3(0.4, 0.5, 0.6))?;
    let fence = |name, color, (texture, wrap, cutoff)| Material {
        mask: Some(AlphaMask::of(
            TextureUse {
                wrap,
                ..TextureUse::plain(texture)
            },
            AlphaChannel::Alpha,
            Some(cutoff),
        )),
        ..Material::diffuse(name, color)
    };
    let [first, second, third] = [
        fence(
            "first",
            vec3(0.8, 0.3, 0.2),
            (0, [Wrap::Clamp, Wrap::Repeat], 1.0),
        ),
        fence(
            "second",
            vec3(0.2, 0.4, 0.8),
            (1, [Wrap::Mirrored, Wrap::Clamp], 0.5),
        ),
        fence(
            "third",
            vec3(0.3, 0.7, 0.3),
            (1, [Wrap::Repeat, Wrap::Mirrored], 0.7),
        ),
    ]
    .map(|m| mesh.material(m));
    before_a_wall(&mut mesh);
    let uv = [vec2(-1.7, -2.2), vec2(2.9, 3.4)];
    for (x, z, material) in [(-1.6, 0.3, first), (-0.4, -0.4, second), (0.2, 0.9, third)] {
        mesh.quad(
            [vec3(x, 0.0, z), 1.5 * Vec3::X, 1.3 * Vec3::Y],
            uv,
            material,
        );
    }
    Ok(mesh.done(vec![alphas("fine", [3, 5]), alphas("coarse", [4, 2])]))
}

/// Surfaces that are there by chance before a wall: one with the same alpha everywhere, one with the alphas of an
/// image and a factor, and a shining one.
fn veils() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.6, 1.4, 3.3), vec3(0.0, 0.7, -0.2), Vec3::Y);
    let mut mesh = Mesh::new("veils", camera, vec3(0.3, 0.5, 0.7))?;
    let blended = |name, color, factor, texture| Material {
        mask: Some(AlphaMask {
            texture,
            channel: AlphaChannel::Alpha,
            factor,
            cutoff: None,
        }),
        ..Material::diffuse(name, color)
    };
    let lace = TextureUse {
        wrap: [Wrap::Mirrored, Wrap::Clamp],
        ..TextureUse::plain(0)
    };
    let [even, lace, shining] = [
        blended("even", vec3(0.8, 0.3, 0.2), 0.6, None),
        blended("lace", vec3(0.2, 0.4, 0.8), 0.8, Some(lace)),
        blended("shining", Vec3::splat(0.2), 0.4, None).emitting(vec3(2.0, 3.0, 1.0)),
    ]
    .map(|m| mesh.material(m));
    before_a_wall(&mut mesh);
    let uv = [vec2(-0.7, 0.1), vec2(1.9, 0.9)];
    for (x, z, material) in [(-1.3, 0.4, even), (-0.3, 0.9, lace), (0.4, 0.1, shining)] {
        mesh.quad(
            [vec3(x, 0.0, z), 1.3 * Vec3::X, 1.3 * Vec3::Y],
            uv,
            material,
        );
    }
    Ok(mesh.done(vec![alphas("lace", [4, 5])]))
}

/// Balls of every kind of material among lights of every kind, all of which are sampled at every vertex.
fn every_pair(kinds: &KindChecks) -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.3, 2.2, 4.6), vec3(0.0, 0.6, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("every-pair", camera, vec3(0.1, 0.15, 0.2))?;
    let kinds_of_balls = kinds.materials.iter().flat_map(|kind| (kind.balls)());
    let mut materials: Vec<Material> = kinds_of_balls.map(|(_, material)| material).collect();
    materials.push(Material::mirror("mirror", vec3(0.9, 0.8, 0.7)));
    for (place, material) in materials.into_iter().enumerate() {
        let material = mesh.material(material);
        let (column, row) = ((place % 4) as f32, (place / 4) as f32);
        let centre = vec3(1.1 * column - 1.7, 0.45, 1.1 * row - 0.8);
        mesh.ball(centre, 0.42, material);
    }
    let floor = mesh.material(Material::diffuse("floor", vec3(0.7, 0.6, 0.5)));
    let lamp = Material::diffuse("lamp", Vec3::splat(0.2)).emitting(vec3(3.0, 2.0, 4.0));
    let lamp = mesh.material(lamp);
    mesh.plain([vec3(-3.0, 0.0, -3.0), 6.0 * Vec3::Z, 6.0 * Vec3::X], floor);
    mesh.plain([vec3(-2.2, 0.2, -1.4), Vec3::Y, 1.4 * Vec3::Z], lamp);
    let corners = [
        vec3(2.1, 0.3, -0.9),
        vec3(2.3, 1.4, -0.2),
        vec3(2.2, 0.4, 0.9),
    ];
    mesh.triangle(corners, [glam::Vec2::ZERO; 3], lamp);
    let mut scene = mesh.done(Vec::new());
    scene.lights = kinds
        .lights
        .iter()
        .flat_map(|kind| (kind.points)())
        .collect();
    scene.lights.extend(crate::trial_lights::luminaire_lights());
    scene.lights.push(crate::trial_lights::map());
    Ok(scene)
}

/// A block, a ball and a mirror in a corner, all of it within a ball that shines inwards, and beside a small one.
fn within_a_lamp() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.2, 1.5, 2.4), vec3(-0.1, 0.5, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("within-a-lamp", camera, Vec3::ZERO)?;
    let [mirror, floor, block, shiny] = [
        Material::mirror("mirror", vec3(0.9, 0.8, 0.7)),
        Material::diffuse("floor", vec3(0.7, 0.5, 0.6)),
        Material::diffuse("block", vec3(0.4, 0.7, 0.5)),
        Material::phong("shiny", vec3(0.2, 0.3, 0.4), Vec3::splat(0.5), 30.0),
    ]
    .map(|m| mesh.material(m));
    mesh.plain([vec3(-1.5, 0.0, -1.5), 3.0 * Vec3::Z, 3.0 * Vec3::X], floor);
    mesh.plain([vec3(-1.5, 0.0, -1.0), 3.0 * Vec3::X, 1.5 * Vec3::Y], floor);
    mesh.plain(
        [vec3(-1.4, 0.05, -0.2), vec3(-0.1, 0.8, 0.0), 0.9 * Vec3::Z],
        mirror,
    );
    mesh.block(vec3(-0.7, 0.0, -0.5), vec3(0.5, 0.9, 0.4), block);
    mesh.ball(vec3(0.5, 0.4, 0.3), 0.38, shiny);
    let mut scene = mesh.done(Vec::new());
    let ball = |center, radius, radiance| Light::Sphere {
        center,
        radius,
        radiance,
    };
    scene.lights = vec![
        ball(vec3(0.4, 0.3, -0.2), 4.5, vec3(0.5, 0.7, 0.9)),
        ball(vec3(-0.9, 1.1, 0.7), 0.15, vec3(9.0, 6.0, 3.0)),
    ];
    Ok(scene)
}
