//! Candidate triangles of a ray: all those whose group the ray's line meets.

use super::groups::{Groups, Line};
use rayon::prelude::*;
use raystone_core::geometry::{Ray, Triangle};

/// Minimum number of rays for which sorting triangles into groups pays off.
const MANY: usize = 64;

/// For each ray the triangles that it may hit, in ascending order. They include every triangle for
/// which an f32 test could return a point near the triangle, anywhere on the ray's line.
pub(super) fn candidates(triangles: &[Triangle], rays: &[Ray]) -> Vec<Vec<u32>> {
    let corners = |id: usize| triangles[id].vertices.map(|v| v.to_array());
    let groups = Groups::new(triangles.len(), rays.len() >= MANY, corners);
    let of_ray = |ray: &Ray| {
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

#[cfg(test)]
mod tests {
    use super::super::triangle::Crossing;
    use super::*;
    use glam::Vec3;
    use raystone_core::random::Pcg32;

    #[test]
    fn the_coarse_test_keeps_every_triangle_that_may_be_hit() {
        let mut random = Pcg32::new(4);
        let mut signed = || 2.0 * random.uniform_f32() - 1.0;
        let mut vector = || Vec3::new(signed(), signed(), signed());
        // Groups of neighbours are small relative to the scene only with many triangles.
        let mut triangle = |_| {
            let centre = vector();
            [0; 3].map(|_| centre + 0.05 * vector()).into()
        };
        let soup: Vec<Triangle> = (0..6000).map(&mut triangle).collect();
        let mut ray = |_| Ray::new(1.5 * vector(), vector());
        let rays: Vec<_> = (0..200).map(&mut ray).collect();
        let candidates = candidates(&soup, &rays);
        let mut possible = 0;
        for (ray, found) in rays.iter().zip(&candidates) {
            for (id, triangle) in (0u32..).zip(&soup) {
                if Crossing::new(triangle, ray).is_possible(ray) {
                    possible += 1;
                    assert!(found.contains(&id));
                }
            }
        }
        let kept: usize = candidates.iter().map(Vec::len).sum();
        assert!(possible > 0 && kept >= possible);
        assert!(
            kept < 200 * soup.len() / 10,
            "{kept} kept: the coarse test rejects too little"
        );
    }
}
