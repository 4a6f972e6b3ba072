//! Which triangles a ray may hit at all: every one whose group the ray's line meets.

use super::OracleRay;
use super::groups::{Groups, Line};
use crate::geometry::Triangle;
use rayon::prelude::*;

/// From so many rays on it pays to bring neighbours together.
const MANY: usize = 64;

/// For each ray the triangles that it may hit, increasing; all triangles of which an f32 test could answer
/// a point near the triangle are among them, wherever on the ray's line.
pub(super) fn candidates(triangles: &[Triangle], rays: &[OracleRay]) -> Vec<Vec<u32>> {
    let corners = |id: usize| triangles[id].vertices.map(|v| v.to_array());
    let groups = Groups::new(triangles.len(), rays.len() >= MANY, corners);
    let of_ray = |ray: &OracleRay| {
        let line = Line::whole(ray.origin, ray.direction);
        let mut found = Vec::new();
        groups.visit(&line, |group| {
            found.extend_from_slice(groups.members(group));
            f32::INFINITY
        });
        found.sort_unstable();
        found
    };
    rays.par_iter().map(of_ray).collect()
}
