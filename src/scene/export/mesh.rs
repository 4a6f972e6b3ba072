//! Meshes as binary PLY.

use crate::geometry::Triangle;
use crate::scene::SceneData;
use glam::{Vec2, Vec3};

/// The triangles of material `id`, none of whose vertices are shared, so that each keeps its own normal and texture
/// coordinates; nothing if there are none. With `back` they are turned over and moved behind themselves by so much.
pub(super) fn ply(scene: &SceneData, id: u32, back: Option<f32>) -> Option<Vec<u8>> {
    let of_material = |(index, found): (usize, &u32)| (*found == id).then_some(index);
    let ids = scene.material_ids.iter().enumerate();
    let indices: Vec<usize> = ids.filter_map(of_material).collect();
    if indices.is_empty() {
        return None;
    }
    let textured = !scene.uvs.is_empty();
    let uv_lines = if textured {
        "property float u\nproperty float v\n"
    } else {
        ""
    };
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         {uv_lines}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * indices.len(),
        indices.len(),
    )
    .into_bytes();
    for &index in &indices {
        let corners = match back {
            Some(gap) => turned(&scene.triangles[index], gap),
            None => scene.triangles[index].vertices,
        };
        let order = if back.is_some() { [0, 2, 1] } else { [0, 1, 2] };
        for (position, corner) in corners.into_iter().zip(order) {
            push(&mut bytes, &position.to_array());
            if textured {
                let uv: Vec2 = scene.uvs[index][corner];
                push(&mut bytes, &uv.to_array());
            }
        }
    }
    for first in (0i32..).step_by(3).take(indices.len()) {
        bytes.push(3);
        bytes.extend((first..first + 3).flat_map(i32::to_le_bytes));
    }
    Some(bytes)
}

fn push(bytes: &mut Vec<u8>, numbers: &[f32]) {
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
}

fn turned(triangle: &Triangle, gap: f32) -> [Vec3; 3] {
    let [a, b, c] = triangle.vertices;
    let behind = -gap * (b - a).cross(c - a).normalize_or_zero();
    [a, c, b].map(|v| v + behind)
}
