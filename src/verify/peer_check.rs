//! Correctness check of external tracers. Their hits differ from ours by rounding, so they are not
//! compared bit by bit: where the triangle differs from the reference, the oracle decides in double
//! precision whether rounding explains it.

use crate::holes::SceneHoles;
use crate::rays::RaySet;
use glam::Vec3;
use raystone_accel::oracle::{self, Holes, Surfaces, Verdict};
use raystone_accel::{Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_scene::SceneData;

/// Maximum rays per class checked by the oracle, spread evenly over those that differ: it tests
/// every triangle of the scene.
const MOST_JUDGED: usize = 256;
/// Relative difference of the distance that single precision explains. The distance counts as at
/// least a hundredth of the origin's largest coordinate, whose rounding dominates short rays. Plain
/// Möller–Trumbore tests of distant and thin triangles lose three digits.
pub(super) const EXPLAINED: f64 = 1e-3;

/// Differences of the answers for one class from the reference.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Differences {
    /// Rays with a different triangle.
    pub unlike: usize,
    /// The number of them that the oracle checked.
    pub judged: usize,
    /// Largest difference of a distance, for the same triangle, from the reference or the exact
    /// one, whichever is nearer: see `EXPLAINED`.
    pub farthest: f64,
}

/// Compares answers with the reference.
///
/// # Errors
/// A description of the first answer that rounding does not explain.
pub fn differences(
    scene: &SceneData,
    soup: &TriangleSoup,
    set: &RaySet,
    hits: &[Hit],
) -> Result<Differences, String> {
    if hits.len() != set.rays.len() {
        return Err(format!("{} answers to {} rays", hits.len(), set.rays.len()));
    }
    let mut found = Differences::default();
    let mut unlike = Vec::new();
    for ((ray, truth), hit) in set.rays.iter().zip(&set.truth).zip(hits) {
        let [is, was] = [hit, truth].map(|hit| hit.triangle != NO_HIT);
        let same = match set.query() {
            Query::Any => is == was,
            Query::Closest => hit.triangle == truth.triangle,
        };
        if !same {
            unlike.push((ray, hit));
        } else if is && set.query() == Query::Closest {
            // Along a triangle the reference is rounded too: the external tracer may be right.
            let off = off_by(ray, hit.t, f64::from(truth.t)).min(off_the_plane(soup, ray, hit));
            if !off.is_finite() || off > EXPLAINED {
                return Err(format!(
                    "ray {ray} | it {hit} | reference {truth}: the distance is wrong"
                ));
            }
            found.farthest = found.farthest.max(off);
        }
    }
    found.unlike = unlike.len();
    found.judged = unlike.len().min(MOST_JUDGED);
    let chosen: Vec<(&Ray, &Hit)> = (0..found.judged)
        .map(|i| unlike[i * unlike.len() / found.judged])
        .collect();
    judge(scene, soup, set.query(), &chosen)?;
    Ok(found)
}

/// Difference of a distance from another, relative to that or to a hundredth of the largest
/// coordinate of the ray's origin.
pub(super) fn off_by(ray: &Ray, found: f32, t: f64) -> f64 {
    let vector = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let reach = 0.01 * vector(ray.origin).abs().max_element() / vector(ray.direction).length();
    (f64::from(found) - t).abs() / t.abs().max(reach)
}

fn judge(
    scene: &SceneData,
    soup: &TriangleSoup,
    query: Query,
    answers: &[(&Ray, &Hit)],
) -> Result<(), String> {
    let holes = SceneHoles::of(scene);
    let surfaces = Surfaces {
        triangles: &scene.triangles,
        holes: holes.as_ref().map(|holes| holes as &dyn Holes),
    };
    let raised = |ray: &Ray| soup.intersection.raised(ray);
    let verdicts = match query {
        Query::Any => {
            let asked = answers
                .iter()
                .map(|(ray, hit)| (raised(ray), hit.triangle != NO_HIT));
            oracle::judge_any_hits(surfaces, &asked.collect::<Vec<_>>())
        }
        Query::Closest => {
            let asked = answers.iter().map(|(ray, hit)| {
                let answer =
                    (hit.triangle != NO_HIT).then(|| (hit.triangle, distance(soup, ray, hit)));
                (raised(ray), answer)
            });
            oracle::judge_closest_hits(surfaces, &asked.collect::<Vec<_>>())
        }
    };
    for ((ray, hit), verdict) in answers.iter().zip(verdicts) {
        if let Verdict::Wrong(fault) = verdict {
            return Err(format!("ray {ray} | it {hit} | f64: {fault}"));
        }
    }
    Ok(())
}

/// The distance, or the ray's intersection with the plane of the reported triangle if equal in
/// single precision: the oracle allows only the rounding of our own tests.
fn distance(soup: &TriangleSoup, ray: &Ray, hit: &Hit) -> f32 {
    match plane(soup, ray, hit) {
        Some(t) if off_by(ray, hit.t, t) <= EXPLAINED => t as f32,
        _ => hit.t,
    }
}

/// Difference between the reported distance and that to the triangle's plane: see [`off_by`].
fn off_the_plane(soup: &TriangleSoup, ray: &Ray, hit: &Hit) -> f64 {
    plane(soup, ray, hit).map_or(f64::INFINITY, |t| off_by(ray, hit.t, t))
}

/// Distance to the plane of the reported triangle, in double precision.
fn plane(soup: &TriangleSoup, ray: &Ray, hit: &Hit) -> Option<f64> {
    let vector = |v: [f32; 3]| Vec3::from(v).as_dvec3();
    let [a, b, c] = soup
        .records
        .get(hit.triangle as usize)?
        .vertices()
        .map(vector);
    let normal = (b - a).cross(c - a);
    Some(normal.dot(a - vector(ray.origin)) / normal.dot(vector(ray.direction)))
}
