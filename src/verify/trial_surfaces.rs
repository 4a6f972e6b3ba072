//! Trial scenes for surfaces and paths: textures of every use and wrap mode, vertex normals,
//! daylight over scenes without a light, and a pane so close above a floor that rays must not start
//! far from it.

use crate::mesh::Mesh;
use crate::trial_scenes::{TrialScene, camera, depth};
use glam::{Mat2, Vec2, Vec3, vec2, vec3};
use raystone_scene::{
    Daylight, GEOMETRIC, Material, SceneData, SceneError, Texture, TextureUse, WHITE, Wrap,
    encode_color, encode_normal,
};

pub(super) fn scenes() -> Result<Vec<TrialScene>, SceneError> {
    let trial = |scene, changes: &[_]| TrialScene {
        scene,
        trials: vec![("path", changes.to_vec())],
    };
    Ok(vec![
        TrialScene {
            scene: mapped()?,
            trials: vec![("path", vec![depth(4)]), ("primary", vec![])],
        },
        trial(under_the_sky()?, &[depth(5)]),
        trial(close_pane()?, &[depth(3)]),
        TrialScene {
            scene: layers(0.0)?,
            trials: vec![("path", vec![depth(3)]), ("primary", vec![])],
        },
        trial(mirrored()?, &[depth(7)]),
    ])
}

/// A floor and a wall of two coloured layers each, coplanar except for rounding, or `apart` scene
/// units apart: the last bit decides which is hit.
///
/// # Errors
/// A built-in scene is missing.
pub fn layers(apart: f32) -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.1, 1.6, 2.9), vec3(0.0, 0.3, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("layers", camera, vec3(0.5, 0.6, 0.7))?;
    let [red, blue] = [vec3(0.8, 0.2, 0.1), vec3(0.1, 0.3, 0.9)]
        .map(|colour| mesh.material(Material::diffuse("layer", colour)));
    let lamp = Material::diffuse("lamp", Vec3::splat(0.3)).emitting(vec3(5.0, 4.0, 3.0));
    let lamp = mesh.material(lamp);
    let turn = glam::Quat::from_euler(glam::EulerRot::XYZ, 0.21, 0.37, -0.13);
    for [corner, along, across] in [
        [vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X],
        [vec3(-2.0, 0.0, -1.3), 4.0 * Vec3::X, 3.0 * Vec3::Y],
    ] {
        let [corner, along, across] = [corner, along, across].map(|v| turn * v);
        let below = corner - apart * along.cross(across).normalize();
        mesh.plain([corner, along, across], red);
        // From another corner and of another size, so that no coordinate is the same.
        let other = below - 0.013 * along - 0.021 * across;
        mesh.plain([other, 1.037 * along, 1.041 * across], blue);
    }
    mesh.plain([vec3(-0.5, 2.4, -0.4), 1.0 * Vec3::X, 0.8 * Vec3::Z], lamp);
    Ok(mesh.done(Vec::new()))
}

fn texture(name: &str, [width, height]: [u32; 2], texel: impl Fn(u32) -> [u32; 3]) -> Texture {
    let texels = (0..width * height).map(|at| {
        let [r, g, b] = texel(at).map(|c| (c % 256) as u8);
        [r, g, b, 255]
    });
    Texture {
        name: name.to_owned(),
        width,
        height,
        texels: texels.collect(),
    }
}

/// Textures of colour, metalness and roughness, normals and emission, each placed and wrapped
/// differently, on a floor, a wall with vertex normals, and a lamp.
fn mapped() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.5, 1.7, 2.6), vec3(0.0, 0.5, -0.3), Vec3::Y);
    let mut mesh = Mesh::new("mapped", camera, vec3(0.3, 0.4, 0.6))?;
    let placed = |texture, wrap, [x, y]: [Vec2; 2], scale| TextureUse {
        texture,
        wrap,
        linear: Mat2::from_cols(x, y),
        offset: vec2(0.3, -0.6),
        scale,
    };
    let turned = [vec2(0.8, 0.5), vec2(-0.6, 1.1)];
    let plain = [Vec2::X, Vec2::Y];
    let floor = Material::principled("floor", vec3(0.8, 0.9, 0.7), 0.7, 0.9, 0.04);
    let floor = Material {
        base_color_texture: Some(placed(0, [Wrap::Mirrored, Wrap::Clamp], turned, 1.0)),
        metallic_roughness_texture: Some(placed(1, [Wrap::Repeat, Wrap::Mirrored], plain, 1.0)),
        ..floor
    };
    let wall = Material {
        normal_texture: Some(placed(2, [Wrap::Clamp, Wrap::Repeat], turned, 0.7)),
        base_color_texture: Some(placed(0, [Wrap::Repeat; 2], plain, 1.0)),
        ..Material::diffuse("wall", vec3(0.9, 0.8, 0.9))
    };
    let lamp = Material {
        emission_texture: Some(placed(0, [Wrap::Mirrored; 2], turned, 1.0)),
        ..Material::diffuse("lamp", Vec3::splat(0.5)).emitting_from_front(vec3(5.0, 7.0, 6.0))
    };
    let [floor, wall, lamp] = [floor, wall, lamp].map(|m| mesh.material(m));
    let uv = [vec2(-1.3, 0.2), vec2(1.9, 2.6)];
    mesh.quad(
        [vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X],
        uv,
        floor,
    );
    mesh.quad(
        [vec3(-2.0, 0.0, -1.5), 4.0 * Vec3::X, 2.0 * Vec3::Y],
        uv,
        wall,
    );
    mesh.quad(
        [vec3(-0.6, 2.2, -0.6), 1.2 * Vec3::X, 0.9 * Vec3::Z],
        uv,
        lamp,
    );
    // The map of normals runs the other way round.
    mesh.quad(
        [vec3(-1.1, 0.2, -0.9), vec3(0.9, 0.0, 0.2), 1.2 * Vec3::Y],
        [vec2(1.7, 0.1), vec2(-0.4, 1.9)],
        wall,
    );
    let mut scene = mesh.done(vec![
        texture("colours", [5, 3], |i| {
            [73 * i + 40, 31 * i * i + 90, 17 * i + 120]
        }),
        texture("rough", [3, 4], |i| [7 * i, 40 * i + 80, 90 * i + 30]),
        texture("bumps", [4, 3], |i| {
            [50 * i % 90 + 80, 70 * i % 80 + 90, 230]
        }),
    ]);
    let bent = |x: f32, y: f32| encode_normal(vec3(x, y, 1.0).normalize());
    scene.normals = vec![[GEOMETRIC; 3]; scene.triangles.len()];
    scene.normals[2] = [bent(-0.4, -0.1), bent(0.5, -0.2), bent(0.4, 0.3)];
    scene.normals[3] = [bent(-0.4, -0.1), bent(0.4, 0.3), bent(-0.3, 0.4)];
    Ok(scene)
}

/// A room without a lamp, with vertex colours: escaping rays see the sky, also through surfaces.
fn under_the_sky() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(1.3, 1.5, 2.2), vec3(0.0, 0.5, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("under-the-sky", camera, vec3(0.9, 1.1, 0.8))?;
    let floor = mesh.material(Material::diffuse("floor", vec3(0.7, 0.6, 0.5)));
    let block = mesh.material(Material::diffuse("block", vec3(0.4, 0.6, 0.8)));
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X], floor);
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::X, 2.0 * Vec3::Y], floor);
    mesh.block(vec3(-0.5, 0.0, -0.4), vec3(0.7, 0.8, 0.6), block);
    let mut scene = mesh.done(Vec::new());
    // The floor and the wall have vertices of different colours.
    let color = |k: usize| {
        let part = |step: usize| ((k * step) % 7) as f32 / 7.0;
        encode_color(vec3(part(3), part(5), 1.0 - part(2)))
    };
    let corners = |t: usize| [color(3 * t), color(3 * t + 1), color(3 * t + 2)];
    scene.colors = vec![[WHITE; 3]; scene.triangles.len()];
    (0..4).for_each(|triangle| scene.colors[triangle] = corners(triangle));
    scene.daylight = Some(Daylight {
        reach: 1.2,
        ..Daylight::default()
    });
    Ok(scene)
}

/// Mirrored lamps that emit from their front, and balls with vertex normals: of glass, mirrored, a
/// mirror, and a glossy one.
fn mirrored() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.3, 1.6, 3.1), vec3(0.0, 0.6, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("mirrored", camera, vec3(0.3, 0.4, 0.5))?;
    let [floor, lamp, glass, mirror, metal, phong] = [
        Material::diffuse("floor", vec3(0.7, 0.6, 0.5)),
        Material::diffuse("lamp", Vec3::splat(0.3)).emitting_from_front(vec3(8.0, 7.0, 6.0)),
        Material::dielectric("glass", vec3(0.9, 1.0, 0.95), 1.5),
        Material::mirror("mirror", vec3(0.9, 0.8, 0.9)),
        Material::principled("metal", vec3(0.9, 0.7, 0.5), 0.8, 0.35, 0.04),
        Material::phong("phong", vec3(0.2, 0.3, 0.4), vec3(0.4, 0.4, 0.3), 20.0),
    ]
    .map(|m| mesh.material(m));
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X], floor);
    let upper = mesh.scene.triangles.len();
    mesh.plain([vec3(-1.2, 2.3, -0.6), 0.8 * Vec3::Z, 0.7 * Vec3::X], lamp);
    let corners = [
        vec3(0.4, 2.2, -0.5),
        vec3(0.6, 2.1, 0.4),
        vec3(1.2, 2.3, -0.4),
    ];
    mesh.triangle(corners, [Vec2::ZERO; 3], lamp);
    let mut balls = vec![mesh.scene.triangles.len()];
    let places = [
        (vec3(-0.8, 0.45, 0.4), glass),
        (vec3(0.2, 0.55, -0.3), mirror),
        (vec3(0.95, 0.4, 0.5), metal),
        (vec3(0.1, 0.25, 0.9), phong),
    ];
    for (centre, material) in places {
        mesh.ball(centre, centre.y - 0.02, material);
        balls.push(mesh.scene.triangles.len());
    }
    let mut scene = mesh.done(Vec::new());
    scene.mirrored = (0..scene.triangles.len())
        .map(|id| (upper..balls[1]).contains(&id))
        .collect();
    scene.normals = vec![[GEOMETRIC; 3]; scene.triangles.len()];
    for (ball, (centre, _)) in balls.windows(2).zip(places) {
        for id in ball[0]..ball[1] {
            // Mirroring reverses the orientation.
            if scene.mirrored[id] {
                scene.triangles[id].vertices.swap(1, 2);
            }
            let corners = scene.triangles[id].vertices;
            scene.normals[id] = corners.map(|v| encode_normal((v - centre).normalize()));
        }
    }
    Ok(scene)
}

/// A few ray offsets above a floor.
const CLOSE: f32 = 1e-4;

/// A tinted pane so close above a floor that a ray with ten times the offset starts above it.
fn close_pane() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.9, 1.9, 1.6), Vec3::ZERO, Vec3::Y);
    let mut mesh = Mesh::new("close-pane", camera, vec3(0.6, 0.5, 0.4))?;
    let [floor, pane, lamp] = [
        Material::diffuse("floor", vec3(0.8, 0.7, 0.6)),
        Material::thin_dielectric("pane", vec3(0.6, 0.8, 0.7), 1.5),
        Material::diffuse("lamp", Vec3::ZERO).emitting(vec3(9.0, 7.0, 8.0)),
    ]
    .map(|m| mesh.material(m));
    let ground = |height| [vec3(-1.5, height, -1.5), 3.0 * Vec3::Z, 3.0 * Vec3::X];
    mesh.plain(ground(0.0), floor);
    mesh.plain(ground(CLOSE), pane);
    mesh.plain([vec3(-0.4, 1.4, -0.9), 0.8 * Vec3::X, 0.6 * Vec3::Z], lamp);
    Ok(mesh.done(Vec::new()))
}
