//! The exact mode's verdict on answers: rounding errors are counted, not tolerated.

use super::exact::{ExactCrossing, Side};
use super::triangle::Crossing;
use super::{ClosestHit, brute_force};
use rayon::prelude::*;
use raystone_core::geometry::{Ray, Triangle};

/// A triangle that a ray hits within its interval, exactly.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Crossed {
    /// Its index.
    pub triangle: u32,
    /// Through its interior or an edge.
    pub side: Side,
    /// Distance in units of the direction, f64.
    pub t: f64,
    /// Rounding error bound of the distance in f32; infinite where the ray grazes the plane.
    pub slack: f64,
    /// True if every such test must find it.
    pub definite: bool,
}

/// All exact hits of a ray.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ExactTruth {
    /// By increasing distance.
    pub hits: Vec<Crossed>,
}

/// The exact verdict on an answer.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum ExactVerdict {
    /// A correct miss.
    Miss,
    /// The triangle is hit, and none is nearer beyond rounding; its distance.
    Hit(f64),
    /// Only rounding decides whether the hit lies in the interval of the ray.
    Borderline,
    /// A triangle is hit, but the answer is a miss.
    FalseMiss {
        /// True if rounding explains it: the ray passes near the edge of every triangle it hits.
        explained: bool,
    },
    /// Nothing is hit, but the answer is a triangle.
    FalseHit {
        /// True if rounding explains it: the ray passes near an edge of the triangle.
        explained: bool,
    },
    /// Something else is hit, but not this triangle.
    WrongTriangle,
    /// This triangle is hit, but another one is nearer.
    NotNearest,
}

/// All hits of every ray, edges included, on all cores. All numbers except `t_max` must be finite.
pub fn exact_truths(triangles: &[Triangle], rays: &[Ray]) -> Vec<ExactTruth> {
    let candidates = brute_force::candidates(triangles, rays);
    (rays.par_iter().zip(&candidates))
        .map(|(ray, found)| ExactTruth::new(triangles, ray, found))
        .collect()
}

impl ExactTruth {
    fn new(triangles: &[Triangle], ray: &Ray, candidates: &[u32]) -> Self {
        let crossed = |&id: &u32| {
            let triangle = &triangles[id as usize];
            let exact = ExactCrossing::new(triangle, ray);
            exact.is_hit().then(|| {
                let bounded = Crossing::new(triangle, ray);
                Crossed {
                    triangle: id,
                    side: exact.side,
                    t: exact.t,
                    slack: slack(&bounded),
                    definite: bounded.is_definite(ray),
                }
            })
        };
        let mut hits: Vec<Crossed> = candidates.iter().filter_map(crossed).collect();
        hits.sort_by(|a, b| a.t.total_cmp(&b.t));
        Self { hits }
    }

    /// The verdict on a closest-hit answer to `ray`, given its exact hits.
    pub fn judge(&self, triangles: &[Triangle], ray: &Ray, answer: ClosestHit) -> ExactVerdict {
        let Some((id, _)) = answer else {
            return self.judge_miss(ray);
        };
        let Some(triangle) = triangles.get(id as usize) else {
            return ExactVerdict::FalseHit { explained: false };
        };
        let own = ExactCrossing::new(triangle, ray);
        let bounded = Crossing::new(triangle, ray);
        if matches!(own.side, Side::Outside | Side::Parallel) {
            return if self.hits.is_empty() {
                ExactVerdict::FalseHit {
                    explained: bounded.is_possible(ray),
                }
            } else {
                ExactVerdict::WrongTriangle
            };
        }
        let slack = slack(&bounded);
        if !own.in_interval {
            return if near_end(own.t, slack, ray) {
                ExactVerdict::Borderline
            } else {
                ExactVerdict::FalseHit { explained: false }
            };
        }
        let nearer = |other: &&Crossed| other.t + other.slack < own.t - slack;
        match self.hits.iter().find(nearer) {
            Some(other) if !near_end(other.t, other.slack, ray) => ExactVerdict::NotNearest,
            _ => ExactVerdict::Hit(own.t),
        }
    }

    fn judge_miss(&self, ray: &Ray) -> ExactVerdict {
        if self.hits.is_empty() {
            return ExactVerdict::Miss;
        }
        if self.hits.iter().all(|hit| near_end(hit.t, hit.slack, ray)) {
            return ExactVerdict::Borderline;
        }
        ExactVerdict::FalseMiss {
            explained: !self.hits.iter().any(|hit| hit.definite),
        }
    }
}

fn slack(crossing: &Crossing) -> f64 {
    crossing.distance().map_or(f64::INFINITY, |d| d.error)
}

/// True if rounding may move the distance across an end of the interval. A distance exactly at an
/// end is inside: where it is exactly representable, rounding is no excuse.
fn near_end(t: f64, slack: f64, ray: &Ray) -> bool {
    [ray.t_min, ray.t_max]
        .map(f64::from)
        .into_iter()
        .any(|end| t != end && (t - end).abs() <= slack)
}

#[cfg(test)]
mod tests {
    use super::*;
    use glam::Vec3;

    fn floor(z: f32) -> [Triangle; 2] {
        let at = |x: f32, y: f32| Vec3::new(x, y, z);
        let [a, b, c, d] = [at(0.0, 0.0), at(1.0, 0.0), at(1.0, 1.0), at(0.0, 1.0)];
        [[a, b, c], [a, c, d]].map(Triangle::from)
    }

    fn down(x: f32, y: f32, t_max: f32) -> Ray {
        Ray::new([x, y, 1.0], Vec3::NEG_Z).between(0.0, t_max)
    }

    #[test]
    fn answers_are_sorted_into_hits_misses_and_each_kind_of_fault() {
        use ExactVerdict::{Borderline, FalseHit, FalseMiss, Hit, Miss, NotNearest, WrongTriangle};
        let triangles = [floor(0.0), floor(-1.0)].concat();
        let judge = |ray: Ray, answer: ClosestHit| {
            exact_truths(&triangles, &[ray])[0].judge(&triangles, &ray, answer)
        };
        let (inside, diagonal) = (down(0.75, 0.25, 10.0), down(0.5, 0.5, 10.0));
        let (beside, touching) = (down(3.0, 0.5, 10.0), down(0.75, 0.25, 1.0));
        let short = down(0.75, 0.25, 1.0_f32.next_down());
        for (ray, answer, verdict) in [
            (inside, Some((0, 1.0)), Hit(1.0)),
            (inside, Some((1, 1.0)), WrongTriangle),
            (inside, Some((2, 2.0)), NotNearest),
            (inside, None, FalseMiss { explained: false }),
            (diagonal, Some((0, 1.0)), Hit(1.0)),
            (diagonal, Some((1, 1.0)), Hit(1.0)),
            (diagonal, None, FalseMiss { explained: true }),
            (beside, None, Miss),
            (beside, Some((0, 1.0)), FalseHit { explained: false }),
            (beside, Some((99, 1.0)), FalseHit { explained: false }),
            (touching, Some((0, 1.0)), Hit(1.0)),
            (touching, None, FalseMiss { explained: true }),
            (short, None, Miss),
            (short, Some((0, 1.0)), Borderline),
        ] {
            assert_eq!(judge(ray, answer), verdict, "{ray:?} {answer:?}");
        }
    }
}
