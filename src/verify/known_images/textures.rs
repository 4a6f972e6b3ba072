//! Textures with distinct texels: wrapping, transforms, orientation, encodings, normals.

use super::lamps::{NEAR, path};
use super::{KnownImage, View};
use crate::materials::PRINCIPLED_CHECKS;
use crate::mesh::Mesh;
use crate::path_oracle::scattered;
use glam::{DVec3, Mat2, Vec2, Vec3, vec2, vec3};
use raystone_core::geometry::Camera;
use raystone_scene::{
    Light, Material, SceneData, SceneError, Texture, TextureUse, Wrap, encode_normal,
};
use std::f64::consts::PI;

/// Texels of the picture, row by row from the top. No two are alike, and none is so dark that
/// bleeding from its neighbours over the width of a pixel shows.
const PICTURE: [[u8; 3]; 8] = [
    [250, 120, 150],
    [130, 200, 170],
    [160, 110, 240],
    [220, 180, 115],
    [110, 170, 200],
    [170, 250, 130],
    [140, 150, 190],
    [200, 130, 120],
];
const WIDTH: usize = 4;

/// Strength of the light from straight above.
const STRENGTH: f64 = 3.0;

pub(super) fn images() -> Result<Vec<KnownImage>, SceneError> {
    Ok(vec![
        pictures()?.turned(),
        normals()?.turned(),
        roughness()?.turned(),
    ])
}

fn texture(name: &str, width: usize, texels: &[[u8; 3]]) -> Texture {
    Texture {
        name: name.to_owned(),
        width: width as u32,
        height: (texels.len() / width) as u32,
        texels: texels.iter().map(|[r, g, b]| [*r, *g, *b, 255]).collect(),
    }
}

/// The mean of these texels of the picture, decoded from sRGB (IEC 61966-2-1).
fn mean(texels: &[[usize; 2]]) -> DVec3 {
    let decoded = |byte: u8| {
        let c = f64::from(byte) / 255.0;
        if c > 0.04045 {
            ((c + 0.055) / 1.055).powf(2.4)
        } else {
            c / 12.92
        }
    };
    let colour =
        |[column, row]: &[usize; 2]| DVec3::from_array(PICTURE[row * WIDTH + column].map(decoded));
    texels.iter().map(colour).sum::<DVec3>() / texels.len() as f64
}

fn empty(name: &str) -> Result<Mesh, SceneError> {
    let camera = Camera::upright(vec3(0.0, 4.0, 5.0), Vec3::ZERO, 45.0);
    Mesh::new(name, camera, Vec3::ZERO)
}

/// A square with u along +x from −1 to 2 and v along +z, in texture units of one half.
fn sheet(mesh: &mut Mesh, corner: Vec3, material: u32) {
    let uv = [vec2(-1.0, -1.0), vec2(2.0, 2.0)];
    let [x, z] = [1.5 * Vec3::X, 1.5 * Vec3::Z];
    // Seen from above, corners run counter-clockwise with v first: lay the square with u and v
    // swapped, and swap back.
    let p = |u: f32, v: f32| corner + u * x + v * z;
    let t = |u: f32, v: f32| uv[0] + vec2(u, v) * (uv[1] - uv[0]);
    for [a, b, c] in [
        [(0.0, 0.0), (0.0, 1.0), (1.0, 1.0)],
        [(0.0, 0.0), (1.0, 1.0), (1.0, 0.0)],
    ] {
        let corners = [a, b, c];
        mesh.triangle(
            corners.map(|(u, v)| p(u, v)),
            corners.map(|(u, v)| t(u, v)),
            material,
        );
    }
}

/// The point of a sheet with these texture coordinates.
fn point_of(corner: Vec3, [u, v]: [f32; 2]) -> Vec3 {
    corner + 0.5 * vec3(u + 1.0, 0.0, v + 1.0)
}

fn below_light(scene: &mut SceneData) {
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Y,
        irradiance: Vec3::splat(STRENGTH as f32),
    }];
}

/// Texture coordinates, and the texels that the picture blends equally there.
type Place = ([f32; 2], &'static [[usize; 2]]);

const REPEATED: [Place; 7] = [
    ([0.125, 0.25], &[[0, 0]]),
    ([0.875, 0.25], &[[3, 0]]),
    ([0.375, 0.75], &[[1, 1]]),
    ([0.25, 0.75], &[[0, 1], [1, 1]]),
    ([0.625, 0.5], &[[2, 0], [2, 1]]),
    ([1.0, 0.25], &[[3, 0], [0, 0]]),
    ([-0.625, 1.25], &[[1, 0]]),
];

/// Mirrored along u, clamped along v.
const BOUNDED: [Place; 5] = [
    ([0.375, 0.75], &[[1, 1]]),
    ([1.375, 0.25], &[[2, 0]]),
    ([-0.125, 0.25], &[[0, 0]]),
    ([0.125, 1.75], &[[0, 1]]),
    ([0.875, -0.75], &[[3, 0]]),
];

/// (u, v) becomes (v + 0.25, 0.5 − u).
const MOVED: [Place; 4] = [
    ([0.25, 0.125], &[[1, 0]]),
    ([-0.25, 0.375], &[[2, 1]]),
    ([0.25, -0.125], &[[0, 0]]),
    ([0.25, 0.75], &[[3, 0], [0, 0]]),
];

/// One picture on a floor and on a lamp, placed in three ways.
fn pictures() -> Result<KnownImage, SceneError> {
    const TINT: Vec3 = vec3(0.9, 0.8, 0.7);
    const EMITTED: Vec3 = vec3(2.0, 3.0, 4.0);
    let mut mesh = empty("textures")?;
    let plain = TextureUse::plain(0);
    let bounded = TextureUse {
        wrap: [Wrap::Mirrored, Wrap::Clamp],
        ..plain
    };
    let moved = TextureUse {
        linear: Mat2::from_cols(vec2(0.0, -1.0), vec2(1.0, 0.0)),
        offset: vec2(0.25, 0.5),
        ..plain
    };
    let painted = |used| Material {
        base_color_texture: Some(used),
        ..Material::diffuse("painted", TINT)
    };
    let lamp = Material {
        emission_texture: Some(plain),
        ..Material::diffuse("lamp", Vec3::ZERO).emitting(EMITTED)
    };
    let mut views = Vec::new();
    let sheets = [
        ("repeated", painted(plain), &REPEATED[..]),
        ("bounded", painted(bounded), &BOUNDED[..]),
        ("moved", painted(moved), &MOVED[..]),
        ("shining", lamp, &REPEATED[..4]),
    ];
    for (k, (name, material, places)) in sheets.into_iter().enumerate() {
        let corner = vec3(2.0 * k as f32, 0.0, 0.0);
        let is_lamp = material.emission_texture.is_some();
        let id = mesh.material(material);
        sheet(&mut mesh, corner, id);
        for ([u, v], texels) in places {
            let scale = if is_lamp {
                EMITTED.as_dvec3()
            } else {
                TINT.as_dvec3() * STRENGTH / PI
            };
            let name = format!("{name} at {u} {v}");
            let at = point_of(corner, [*u, *v]);
            views.push(View::new(&name, at, NEAR, scale * mean(texels)));
        }
    }
    let mut scene = mesh.done(vec![texture("picture", WIDTH, &PICTURE)]);
    below_light(&mut scene);
    Ok(KnownImage {
        name: "textures",
        scene,
        trial: path(1, &[]),
        views,
    })
}

/// A constant normal map, unscaled and scaled, and vertex normals.
fn normals() -> Result<KnownImage, SceneError> {
    const GREY: f32 = 0.5;
    /// x along u, y against v, z up.
    const MAP: [u8; 3] = [204, 153, 240];
    const WAY: Vec3 = vec3(0.7, -1.0, 0.4);
    let mut mesh = empty("normals")?;
    let grey = Material::diffuse("grey", Vec3::splat(GREY));
    let mapped = |scale| Material {
        normal_texture: Some(TextureUse {
            scale,
            ..TextureUse::plain(0)
        }),
        ..grey.clone()
    };
    let lit = |normal: DVec3| {
        let towards = -WAY.as_dvec3().normalize();
        let cosine = normal.normalize().dot(towards).max(0.0);
        DVec3::splat(f64::from(GREY) * STRENGTH / PI * cosine)
    };
    let mut views = Vec::new();
    let [x, y, z] = MAP.map(|byte| 2.0 * f64::from(byte) / 255.0 - 1.0);
    for (k, (name, scale)) in [("map", 1.0_f32), ("scaled map", 0.5)]
        .into_iter()
        .enumerate()
    {
        let corner = vec3(2.0 * k as f32, 0.0, 0.0);
        let id = mesh.material(mapped(scale));
        sheet(&mut mesh, corner, id);
        let scale = f64::from(scale);
        // u runs along x, v along z.
        let bent = DVec3::new(scale * x, z, -scale * y);
        let at = point_of(corner, [0.3, 0.6]);
        views.push(View::new(name, at, NEAR, lit(bent)));
    }
    let bends = [
        vec3(0.5, 1.0, 0.0),
        vec3(-0.3, 1.0, 0.4),
        vec3(0.0, 1.0, -0.6),
    ];
    let id = mesh.material(grey);
    let at = [Vec3::ZERO, Vec3::Z, vec3(1.0, 0.0, 1.0)].map(|p| p + 4.0 * Vec3::X);
    mesh.triangle(at, [Vec2::ZERO; 3], id);
    let weights = [0.2_f32, 0.5, 0.3];
    let mixed = |of: [Vec3; 3]| -> Vec3 { (0..3).map(|k| weights[k] * of[k]).sum() };
    let bent = mixed(bends.map(Vec3::normalize)).as_dvec3();
    views.push(View::new("vertices", mixed(at), NEAR, lit(bent)));
    let mut scene = mesh.done(vec![texture("map", 1, &[MAP])]);
    let flat = [encode_normal(Vec3::Y); 3];
    scene.normals = vec![flat; scene.triangles.len()];
    if let Some(last) = scene.normals.last_mut() {
        *last = bends.map(|n| encode_normal(n.normalize()));
    }
    scene.lights = vec![Light::Directional {
        direction: WAY,
        irradiance: Vec3::splat(STRENGTH as f32),
    }];
    Ok(KnownImage {
        name: "normals",
        scene,
        trial: path(1, &[]),
        views,
    })
}

/// A material with roughness and metalness from a linear texture.
fn roughness() -> Result<KnownImage, SceneError> {
    const TEXELS: [[u8; 3]; 2] = [[10, 180, 60], [250, 240, 200]];
    const WAY: Vec3 = vec3(0.5, -1.0, 0.3);
    let base = vec3(0.6, 0.4, 0.2);
    let of = |metallic, roughness| Material::principled("varied", base, metallic, roughness, 0.04);
    let mut mesh = empty("roughness")?;
    let varied = Material {
        metallic_roughness_texture: Some(TextureUse::plain(0)),
        ..of(0.9, 0.8)
    };
    let id = mesh.material(varied);
    sheet(&mut mesh, Vec3::ZERO, id);
    let from = vec3(-0.3, 0.5, -0.1);
    let local = |v: Vec3| vec3(v.z, v.x, v.y).as_dvec3().normalize();
    let view = |(k, u): (usize, f32)| {
        let [_, rough, metal] = TEXELS[k].map(|byte| f32::from(byte) / 255.0);
        let there = of(0.9 * metal, 0.8 * rough);
        let radiance = STRENGTH * scattered(&PRINCIPLED_CHECKS, &there, local(from), local(-WAY));
        let at = point_of(Vec3::ZERO, [u, 0.3]);
        View::new(["first texel", "second texel"][k], at, from, radiance)
    };
    let views = [(0, 0.25), (1, 0.75)].map(view).into();
    let mut scene = mesh.done(vec![texture("metal and roughness", 2, &TEXELS)]);
    scene.lights = vec![Light::Directional {
        direction: WAY,
        irradiance: Vec3::splat(STRENGTH as f32),
    }];
    Ok(KnownImage {
        name: "roughness",
        scene,
        trial: path(1, &[]),
        views,
    })
}
