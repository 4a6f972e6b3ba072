//! A trial scene for connections over mirrors: plane, convex and hollow ones with normals of vertices, some that connections leave out,
//! and lights of every kind that they know.

use crate::mesh::Mesh;
use crate::trial_lights::luminaire_lights;
use crate::trial_reach::alphas;
use crate::trial_scenes::{TrialScene, camera, depth, word};
use glam::{Quat, Vec2, Vec3, vec3};
use raystone_core::params::ParamValue;
use raystone_scene::{
    AlphaChannel, AlphaMask, GEOMETRIC, Light, Material, SceneData, SceneError, Texture,
    TextureUse, encode_normal,
};
use std::f32::consts::TAU;

/// Connections over mirrors.
pub(crate) fn connected() -> (&'static str, ParamValue) {
    word("connection", "specular")
}

pub(super) fn scenes() -> Result<Vec<TrialScene>, SceneError> {
    let path = |changes: &[_]| ("path", [changes, &[connected()]].concat());
    Ok(vec![TrialScene {
        scene: mirrors()?,
        trials: vec![
            path(&[depth(4)]),
            path(&[
                depth(3),
                word("strategy", "mis-power"),
                word("light_choice", "tree"),
            ]),
            path(&[
                depth(3),
                word("lights", "all"),
                word("strategy", "light"),
                word("roulette", "none"),
            ]),
            path(&[depth(2), word("light_choice", "uniform")]),
        ],
    }])
}

/// A part of a sphere about an axis, as fine as it has rings and sectors, with its normals at the vertices.
pub(crate) fn cap(
    mesh: &mut Mesh,
    (centre, radius): (Vec3, f32),
    (axis, angle): (Vec3, f32),
    [rings, sectors]: [u32; 2],
    material: u32,
) {
    let turn = Quat::from_rotation_arc(Vec3::Y, axis.normalize());
    let at = |ring: u32, sector: u32| {
        let theta = angle * ring as f32 / rings as f32;
        // Rings are turned against each other.
        let phi = TAU * (sector as f32 + 0.5 * ring as f32) / sectors as f32;
        turn * vec3(
            theta.sin() * phi.cos(),
            theta.cos(),
            -theta.sin() * phi.sin(),
        )
    };
    mesh.scene
        .normals
        .resize(mesh.scene.triangles.len(), [GEOMETRIC; 3]);
    for ring in 0..rings {
        for sector in 0..sectors {
            let [a, b] = [at(ring, sector), at(ring, sector + 1)];
            let [c, d] = [at(ring + 1, sector), at(ring + 1, sector + 1)];
            // The first ring has no second ones.
            let facets = [[a, c, d], [a, d, b]];
            for facet in facets.iter().take(if ring == 0 { 1 } else { 2 }) {
                let corners = facet.map(|normal| centre + radius * normal);
                mesh.triangle(corners, [Vec2::ZERO; 3], material);
                mesh.scene.normals.push(facet.map(encode_normal));
            }
        }
    }
}

/// The texture of a normal map that leans.
fn leaning() -> Texture {
    let texels = [[150, 120, 240, 255], [110, 150, 235, 255]];
    Texture {
        name: "leaning".to_owned(),
        width: 2,
        height: 1,
        texels: texels.to_vec(),
    }
}

/// Materials of no triangle.
const SPARE: u32 = 30;

/// A floor and a wall between mirrors.
pub(crate) fn mirrors() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.9, 1.7, 3.2), vec3(0.0, 0.5, 0.0), Vec3::Y);
    let mut mesh = Mesh::new("mirrors", camera, vec3(0.05, 0.04, 0.03))?;
    let mirror = |name| Material::mirror(name, vec3(0.9, 0.8, 0.7));
    // Which materials connect is a bit of each: those of the mirrors are beyond the first word.
    for spare in 0..SPARE {
        mesh.material(Material::diffuse(format!("spare {spare}"), Vec3::ONE));
    }
    let [floor, wall, plane, ball, dish, holed, wavy, lamp, shard] = [
        Material::diffuse("floor", vec3(0.7, 0.6, 0.5)),
        Material::phong("wall", vec3(0.3, 0.4, 0.6), vec3(0.3, 0.3, 0.2), 12.0),
        mirror("plane"),
        mirror("ball"),
        mirror("dish"),
        Material {
            mask: Some(AlphaMask::of(
                TextureUse::plain(0),
                AlphaChannel::Alpha,
                Some(0.5),
            )),
            ..mirror("holed")
        },
        Material {
            normal_texture: Some(TextureUse::plain(1)),
            ..mirror("wavy")
        },
        Material::diffuse("lamp", Vec3::splat(0.2)).emitting_from_front(vec3(4.0, 3.5, 3.0)),
        Material::diffuse("shard", Vec3::splat(0.1)).emitting(vec3(6.0, 9.0, 7.0)),
    ]
    .map(|material| mesh.material(material));
    mesh.plain([vec3(-2.0, 0.0, -2.0), 4.0 * Vec3::Z, 4.0 * Vec3::X], floor);
    mesh.plain([vec3(-2.0, 0.0, -1.9), 4.0 * Vec3::X, 2.5 * Vec3::Y], wall);
    let leant = vec3(-0.2, 1.5, 0.1);
    mesh.plain([vec3(-1.4, 0.05, -1.2), leant, 1.6 * Vec3::Z], plane);
    mesh.plain(
        [vec3(-0.9, 0.1, 1.1), 0.7 * Vec3::X, vec3(0.0, 0.7, 0.2)],
        holed,
    );
    mesh.plain(
        [vec3(0.9, 0.1, 1.3), 0.6 * Vec3::X, vec3(0.1, 0.6, 0.2)],
        wavy,
    );
    // So large that paths find it over mirrors.
    let faces = vec3(0.0, -0.1, 1.6);
    mesh.plain([vec3(-1.3, 2.2, -0.9), 1.6 * Vec3::X, faces], lamp);
    let corners = [
        vec3(-0.9, 1.5, -1.5),
        vec3(-0.6, 1.7, -1.4),
        vec3(-0.8, 1.9, -1.2),
    ];
    mesh.triangle(corners, [Vec2::ZERO; 3], shard);
    let sphere = (vec3(0.5, 0.0, -0.5), 0.6);
    cap(&mut mesh, sphere, (Vec3::Y, 1.4), [5, 12], ball);
    let hollow = (vec3(0.9, 0.9, 0.3), 1.0);
    cap(&mut mesh, hollow, (vec3(1.0, 0.1, 0.0), 0.6), [3, 9], dish);
    let mut scene = mesh.done(vec![alphas("holes", [4, 3]), leaning()]);
    let toward = vec3(-1.0, -0.5, -0.1);
    scene.lights = vec![
        Light::Sphere {
            center: vec3(0.2, 1.4, 0.9),
            radius: 0.08,
            radiance: vec3(60.0, 50.0, 70.0),
        },
        Light::Point {
            position: vec3(-0.4, 1.3, 0.2),
            intensity: vec3(1.5, 2.0, 2.5),
        },
        Light::Spot {
            position: vec3(0.3, 1.2, -0.9),
            direction: toward,
            intensity: vec3(4.0, 3.0, 3.0),
            inner: 0.3,
            outer: 0.6,
            decay: true,
        },
    ];
    scene.lights.push(luminaire_lights()[0].clone());
    Ok(scene)
}
