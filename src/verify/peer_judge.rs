//! Whether the answers of a ray caster of others are right. Its hits differ from ours by rounding, so they are not compared to the bit:
//! where its triangle is not the judge's, the oracle decides in double precision whether rounding explains that.

use crate::holes::SceneHoles;
use crate::rays::RaySet;
use glam::Vec3;
use raystone_accel::oracle::{self, Holes, Surfaces, Verdict};
use raystone_accel::{Hit, NO_HIT, Query, Ray, TriangleSoup};
use raystone_scene::SceneData;

/// Most rays of a class that the oracle looks at, spread evenly over those that differ: it tests every triangle of the scene.
const MOST_JUDGED: usize = 256;
/// Share of the distance (and of a hundredth of the origin's greatest coordinate, whose rounding a short one shows) that single
/// precision explains: plain Möller–Trumbore tests of far and thin triangles lose three digits.
const EXPLAINED: f64 = 1e-3;

/// How the answers to the rays of a class differ from the judge's.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Differences {
    /// Rays with another triangle.
    pub unlike: usize,
    /// How many of them were put to the oracle.
    pub judged: usize,
    /// Greatest difference of a distance at the same triangle from the judge's or the exact one, whichever is nearer: see `EXPLAINED`.
    pub farthest: f64,
}

/// Compares answers with the judge's.
///
/// # Errors
/// The first answer that rounding does not explain, in words.
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
            // Of a ray along a triangle the judge's own distance is rounded, too: it may be the peer that is right.
            let off = off_by(ray, hit.t, f64::from(truth.t)).min(off_the_plane(soup, ray, hit));
            if !off.is_finite() || off > EXPLAINED {
                return Err(format!(
                    "ray {ray} | it {hit} | judge {truth}: the distance is wrong"
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

/// How far a distance is from another, over that or a hundredth of the greatest coordinate of the ray's origin.
fn off_by(ray: &Ray, found: f32, t: f64) -> f64 {
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

/// The distance, or where the ray meets the plane of the triangle that it is said to hit, if that is the same in single precision: the oracle
/// allows our own tests' rounding and no more.
fn distance(soup: &TriangleSoup, ray: &Ray, hit: &Hit) -> f32 {
    match plane(soup, ray, hit) {
        Some(t) if off_by(ray, hit.t, t) <= EXPLAINED => t as f32,
        _ => hit.t,
    }
}

/// How far the distance is from that to the plane of the triangle: see [`off_by`].
fn off_the_plane(soup: &TriangleSoup, ray: &Ray, hit: &Hit) -> f64 {
    plane(soup, ray, hit).map_or(f64::INFINITY, |t| off_by(ray, hit.t, t))
}

/// Where the ray meets the plane of the triangle that it is said to hit, in double precision.
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
