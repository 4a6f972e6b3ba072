//! Meshes as binary PLY.

use glam::{Vec2, Vec3};
use raystone_scene::SceneData;
use raystone_scene::decode_normal;

/// The triangles of material `id`, and whether they have vertex normals; `None` if there are none.
/// Vertices are not shared, so each keeps its own normal and texture coordinates, which follow the
/// base colour's texture, or else the mask. With `back`, triangles are flipped and moved behind
/// themselves by that distance.
pub(super) fn ply(scene: &SceneData, id: u32, back: Option<f32>) -> Option<(Vec<u8>, bool)> {
    let of_material = |(index, found): (usize, &u32)| (*found == id).then_some(index);
    let ids = scene.material_ids.iter().enumerate();
    let indices: Vec<usize> = ids.filter_map(of_material).collect();
    if indices.is_empty() {
        return None;
    }
    let textured = !scene.uvs.is_empty();
    let material = scene.materials.get(id as usize)?;
    let of_mask = material.mask.and_then(|mask| mask.texture);
    let placed = material.base_color_texture.or(of_mask);
    let place = |uv: Vec2| placed.map_or(uv, |of| of.linear * uv + of.offset);
    let has_normal = |index: &usize| {
        let words = scene.normals.get(*index);
        words.is_some_and(|words| words.iter().any(|word| decode_normal(*word).is_some()))
    };
    let smooth = indices.iter().any(has_normal);
    let normal_lines = if smooth {
        "property float nx\nproperty float ny\nproperty float nz\n"
    } else {
        ""
    };
    let uv_lines = if textured {
        "property float u\nproperty float v\n"
    } else {
        ""
    };
    let mut bytes = format!(
        "ply\nformat binary_little_endian 1.0\nelement vertex {}\nproperty float x\nproperty float y\nproperty float z\n\
         {normal_lines}{uv_lines}element face {}\nproperty list uchar int vertex_indices\nend_header\n",
        3 * indices.len(),
        indices.len(),
    )
    .into_bytes();
    for &index in &indices {
        let turns = back.is_some() != scene.is_mirrored(index);
        let order = if turns { [0, 2, 1] } else { [0, 1, 2] };
        let behind = back.map_or(Vec3::ZERO, |gap| -gap * front(scene, index));
        for corner in order {
            let position = scene.triangles[index].vertices[corner] + behind;
            push(&mut bytes, &position.to_array());
            if smooth {
                let normal = normal(scene, index, corner);
                let side = if back.is_some() { -normal } else { normal };
                push(&mut bytes, &side.to_array());
            }
            if textured {
                push(&mut bytes, &place(scene.uvs[index][corner]).to_array());
            }
        }
    }
    for first in (0i32..).step_by(3).take(indices.len()) {
        bytes.push(3);
        bytes.extend((first..first + 3).flat_map(i32::to_le_bytes));
    }
    Some((bytes, smooth))
}

/// The normal at a corner, on the triangle's front; the triangle's if the file has none.
fn normal(scene: &SceneData, index: usize, corner: usize) -> Vec3 {
    let face = front(scene, index);
    let own = scene
        .normals
        .get(index)
        .and_then(|words| decode_normal(words[corner]));
    let own = own.map_or(face, |normal| normal.as_vec3());
    if own.dot(face) < 0.0 { -own } else { own }
}

fn push(bytes: &mut Vec<u8>, numbers: &[f32]) {
    bytes.extend(numbers.iter().flat_map(|v| v.to_le_bytes()));
}

/// The normal of a triangle on its front.
fn front(scene: &SceneData, index: usize) -> Vec3 {
    let [a, b, c] = scene.outward(index);
    (b - a).cross(c - a).normalize_or_zero()
}
