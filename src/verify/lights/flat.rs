//! Triangles and parallelograms, sampled uniformly.

use super::{LightChecks, LightTwin};
use crate::path_oracle::hits::Hits;
use crate::path_oracle::texture::Textures;
use crate::path_oracle::{LightSample, Rounding};
use glam::DVec3;
use raystone_scene::{LIGHT_KINDS, SceneData, Source};

/// Single triangles. Mitsuba gets them with their meshes.
pub(super) static TRIANGLES: LightChecks =
    LightChecks::new(LIGHT_KINDS[0], LightTwin::Surface, |_, _, _| Ok(()));

pub(super) static PARALLELOGRAMS: LightChecks =
    LightChecks::new(LIGHT_KINDS[1], LightTwin::Surface, |_, _, _| Ok(()));

pub(crate) fn sample(
    (scene, textures, hits): (&SceneData, &Textures, &Hits),
    source: Source,
    from: DVec3,
    [u, v]: [f64; 2],
    rounding: &mut Rounding,
) -> Option<LightSample> {
    let (triangles, point, [x, y], area) = match source {
        Source::Triangle(id) => {
            let [a, b, c] = scene.triangles[id as usize].vertices.map(|v| v.as_dvec3());
            let root = u.sqrt();
            let point = a * (1.0 - root) + b * (root * (1.0 - v)) + c * (root * v);
            let edges = [b - a, c - a];
            (
                [id; 2],
                point,
                edges,
                0.5 * edges[0].cross(edges[1]).length(),
            )
        }
        Source::Parallelogram(of) => {
            let edges = of.edges.map(|e| e.as_dvec3());
            let point = of.corner.as_dvec3() + u * edges[0] + v * edges[1];
            (
                of.triangles,
                point,
                edges,
                edges[0].cross(edges[1]).length(),
            )
        }
        Source::Light(_) => return None,
    };
    let id = triangles[0];
    let material = &scene.materials[scene.material_ids[id as usize] as usize];
    let to_light = rounding.point(point, point.abs() + x.abs() + y.abs()) - from;
    let distance = to_light.length();
    let direction = to_light / distance;
    // The edges of a parallelogram turn about its front, those of a triangle as in the file.
    let turns = matches!(source, Source::Triangle(_)) && scene.is_mirrored(id as usize);
    let front = x.cross(y).normalize() * if turns { -1.0 } else { 1.0 };
    let away = front.dot(direction);
    if away >= 0.0 && !material.emits_both_sides {
        return None;
    }
    // Parallelograms have neither texture nor mask.
    let root = u.sqrt();
    let weights = [root * (1.0 - v), root * v];
    if hits.is_cut_out(id, weights, rounding) {
        return None;
    }
    let at = textures.coordinates(id, weights);
    Some(LightSample {
        direction,
        distance,
        radiance: material.emission.as_dvec3() * textures.colour(material.emission_texture, at),
        density: Some(distance * distance / (area * away.abs())),
        triangles: Some(triangles),
    })
}
