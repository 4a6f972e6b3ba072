//! Thin triangles: needles and strips in general position, with planes and weights that are
//! inaccurate in f32. Such surfaces must not shadow themselves.

use crate::mesh::Mesh;
use crate::trial_scenes::{TrialScene, camera, depth};
use glam::{Quat, Vec2, Vec3, vec3};
use raystone_core::params::ParamValue;
use raystone_scene::{Material, SceneData, SceneError};

pub(super) fn scenes() -> Result<Vec<TrialScene>, SceneError> {
    let occlusion = |radius| ("ao", vec![("radius", ParamValue::Number(radius))]);
    Ok(vec![TrialScene {
        scene: slivers()?,
        trials: vec![
            ("path", vec![depth(4)]),
            occlusion(0.05),
            occlusion(0.5),
            ("primary", vec![]),
        ],
    }])
}

/// A flat fan of needles with an aspect ratio of 250, and a flat sheet of strips with a ratio of
/// 1,500 and three long edges each. They fill the view of a plane that is not axis-aligned, white
/// where nothing else is visible.
///
/// # Errors
/// A built-in scene is missing.
pub fn sheets() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.4, 1.0, 3.2), vec3(0.0, 0.0, 0.0), Vec3::Y);
    let mesh = Mesh::new("sheets", camera, Vec3::ONE)?;
    Ok(with_sheets(mesh).done(Vec::new()))
}

fn with_sheets(mut mesh: Mesh) -> Mesh {
    const NEEDLES: u32 = 240;
    const STRIPS: u32 = 900;
    let sheet = mesh.material(Material::diffuse("sheet", vec3(0.8, 0.7, 0.6)));
    let turn = Quat::from_euler(glam::EulerRot::XYZ, 0.43, 0.31, -0.17);
    let place = |x: f32, y: f32| vec3(0.07, -0.03, 0.11) + turn * vec3(x, 0.0, y);
    let mut add = |corners| mesh.triangle(corners, [Vec2::ZERO; 3], sheet);
    let tip = place(-1.5, 1.5);
    let edge = |k: u32| place(-1.5 + k as f32 / 80.0, 0.0);
    for k in 0..NEEDLES {
        // The tip is every corner in turn.
        let mut corners = [tip, edge(k), edge(k + 1)];
        corners.rotate_left(k as usize % 3);
        add(corners);
    }
    for k in 0..STRIPS {
        let [low, high] = [k, k + 1].map(|k| -1.8 * k as f32 / STRIPS as f32);
        let foot = -1.2 + 2.4 * (k * 37 % 100) as f32 / 100.0;
        let [a, b] = [-1.5, 1.5].map(|x| place(x, low));
        let [c, d] = [-1.5, 1.5].map(|x| place(x, high));
        let middle = place(foot, high);
        // A flat triangle with two needles beside it.
        for mut corners in [[a, b, middle], [a, middle, c], [b, d, middle]] {
            corners.rotate_left(k as usize % 3);
            add(corners);
        }
    }
    mesh
}

/// The sheets with a block standing on them, and a lamp.
fn slivers() -> Result<SceneData, SceneError> {
    let camera = camera(vec3(0.4, 1.6, 3.2), vec3(0.0, 0.0, 0.0), Vec3::Y);
    let mut mesh = with_sheets(Mesh::new("slivers", camera, vec3(0.2, 0.3, 0.4))?);
    let block = mesh.material(Material::diffuse("block", vec3(0.5, 0.8, 0.6)));
    let lamp = Material::diffuse("lamp", Vec3::splat(0.3)).emitting(vec3(8.0, 7.0, 6.0));
    let lamp = mesh.material(lamp);
    mesh.block(vec3(-0.5, -0.1, -0.4), vec3(0.6, 0.7, 0.5), block);
    mesh.plain([vec3(-0.6, 2.2, -0.6), 1.2 * Vec3::X, 0.8 * Vec3::Z], lamp);
    Ok(mesh.done(Vec::new()))
}
