//! The oracle: the answer to a ray in f64, over every triangle near it, with f32 rounding accounted
//! for.
//!
//! It skips triangles far from the ray by group ([`Groups`]) and shares no code with the
//! structures, so it is an independent reference for them. A verdict is [`Verdict::Wrong`] only if
//! no f32 test of edge products (Möller–Trumbore) or sheared vertices (Woop, Benthin, Wald) could
//! have given the answer (the bounds are derived in `triangle.rs`), and [`Verdict::Agrees`] only if
//! every such test gives it. [`Verdict::Ambiguous`] is the small rest: near edges, at grazing
//! angles, between surfaces closer than rounding.

mod brute_force;
mod exact;
mod exact_verdict;
mod groups;
mod holes;
mod triangle;

pub use exact::{ExactCrossing, Side};
pub use exact_verdict::{Crossed, ExactTruth, ExactVerdict, exact_truths};
pub(crate) use groups::GROUP;
pub use groups::{Groups, Line};
pub use holes::{Cut, Holes, Surfaces, Weight};

use rayon::prelude::*;
use raystone_core::geometry::Ray;
use std::fmt;
use thiserror::Error;
use triangle::Crossing;

/// The nearest hit found by a structure: triangle index and distance; `None` for a miss.
pub type ClosestHit = Option<(u32, f32)>;

/// The oracle's verdict on an answer.
#[derive(Debug, Clone, PartialEq)]
pub enum Verdict {
    /// The only answer consistent with rounding.
    Agrees,
    /// One of several answers consistent with rounding.
    Ambiguous,
    /// Not explained by rounding.
    Wrong(Fault),
}

/// The fault of an answer.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Fault {
    /// The triangle index is not in the scene.
    #[error("triangle {id} does not exist: the scene has {triangles}")]
    NoSuchTriangle {
        /// Triangle index in the answer.
        id: u32,
        /// Number of triangles in the scene.
        triangles: usize,
    },
    /// The distance is not within the ray's interval, or NaN.
    #[error("triangle {id} at t = {t} is outside the ray's interval [{t_min}, {t_max}]")]
    OutOfInterval {
        /// Triangle index in the answer.
        id: u32,
        /// Distance in the answer.
        t: f32,
        /// Start of the interval.
        t_min: f32,
        /// End of the interval.
        t_max: f32,
    },
    /// The ray does not pass through the triangle.
    #[error("triangle {id}, answered at t = {t}, is not hit by the ray")]
    FalseHit {
        /// Triangle index in the answer.
        id: u32,
        /// Distance in the answer.
        t: f32,
    },
    /// The triangle is hit at another distance.
    #[error("triangle {id} is hit at {expected}, not at t = {t}")]
    Distance {
        /// Triangle index in the answer.
        id: u32,
        /// Distance in the answer.
        t: f32,
        /// The correct distance.
        expected: Distance,
    },
    /// A nearer triangle was missed.
    #[error("triangle {nearer} at {distance} is nearer than the answer, triangle {id} at t = {t}")]
    NotNearest {
        /// Triangle index in the answer.
        id: u32,
        /// Distance in the answer.
        t: f32,
        /// The nearest triangle that is certainly hit.
        nearer: u32,
        /// Its distance.
        distance: Distance,
    },
    /// The answer is a miss, but a triangle is hit.
    #[error("the answer is a miss, but triangle {id} is hit at {distance}")]
    FalseMiss {
        /// The nearest triangle that is certainly hit.
        id: u32,
        /// Its distance.
        distance: Distance,
    },
    /// The answer is blocked, but nothing blocks the segment.
    #[error("the answer is that the ray is blocked, but no triangle is hit")]
    FalseBlock,
}

/// A distance in f64 with the error bound of an f32 test; NaN if the ray grazes the triangle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Distance {
    /// Distance along the ray, in units of its direction.
    pub t: f64,
    /// Bound on the error of an f32 test.
    pub bound: f64,
}

impl fmt::Display for Distance {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "t = {:.9} ± {:.1e}", self.t, self.bound)
    }
}

/// Checks one closest-hit answer against all `triangles`.
pub fn judge<'a>(surfaces: impl Into<Surfaces<'a>>, ray: Ray, answer: ClosestHit) -> Verdict {
    let surfaces = surfaces.into();
    let candidates = brute_force::candidates(surfaces.triangles, &[ray]);
    Scene::new(surfaces, &ray, &candidates[0]).judge_closest(answer)
}

/// Checks many closest-hit answers, in the order of `queries`, on all cores.
pub fn judge_closest_hits<'a>(
    surfaces: impl Into<Surfaces<'a>>,
    queries: &[(Ray, ClosestHit)],
) -> Vec<Verdict> {
    judge_all(surfaces.into(), queries, |scene, answer| {
        scene.judge_closest(answer)
    })
}

/// Checks many any-hit answers (`true`: something lies in the ray's interval), on all cores.
pub fn judge_any_hits<'a>(
    surfaces: impl Into<Surfaces<'a>>,
    queries: &[(Ray, bool)],
) -> Vec<Verdict> {
    judge_all(surfaces.into(), queries, |scene, answer| {
        scene.judge_any(answer)
    })
}

fn judge_all<A: Copy + Sync>(
    surfaces: Surfaces,
    queries: &[(Ray, A)],
    judge: impl Fn(&Scene, A) -> Verdict + Sync,
) -> Vec<Verdict> {
    let rays: Vec<Ray> = queries.iter().map(|q| q.0).collect();
    let candidates = brute_force::candidates(surfaces.triangles, &rays);
    (queries.par_iter().zip(&candidates))
        .map(|((ray, answer), found)| judge(&Scene::new(surfaces, ray, found), *answer))
        .collect()
}

/// One ray with every triangle that it may hit.
struct Scene<'a> {
    triangles: usize,
    ray: &'a Ray,
    possible: Vec<Possible>,
}

/// A triangle that an f32 test may return.
struct Possible {
    id: u32,
    crossing: Crossing,
    /// True if every test must.
    is_definite: bool,
}

impl<'a> Scene<'a> {
    fn new(surfaces: Surfaces, ray: &'a Ray, candidates: &[u32]) -> Self {
        let possible = |&id: &u32| {
            let crossing = Crossing::new(&surfaces.triangles[id as usize], ray);
            if !crossing.is_possible(ray) {
                return None;
            }
            let cut = surfaces.cut(id, &crossing);
            let is_definite = cut == Cut::Surface && crossing.is_definite(ray);
            (cut != Cut::Hole).then_some(Possible {
                id,
                crossing,
                is_definite,
            })
        };
        let possible = candidates.iter().filter_map(possible).collect();
        Self {
            triangles: surfaces.triangles.len(),
            ray,
            possible,
        }
    }

    fn judge_any(&self, blocked: bool) -> Verdict {
        match (blocked, self.nearest_definite()) {
            (true, Some(_)) => Verdict::Agrees,
            (false, Some((id, distance))) => Verdict::Wrong(Fault::FalseMiss { id, distance }),
            (_, None) if !self.possible.is_empty() => Verdict::Ambiguous,
            (true, None) => Verdict::Wrong(Fault::FalseBlock),
            (false, None) => Verdict::Agrees,
        }
    }

    fn judge_closest(&self, answer: ClosestHit) -> Verdict {
        match answer {
            None => self.judge_any(false),
            Some((id, t)) => match self.find_fault(id, t) {
                Some(fault) => Verdict::Wrong(fault),
                None if self.is_only_answer(id, t) => Verdict::Agrees,
                None => Verdict::Ambiguous,
            },
        }
    }

    fn find_fault(&self, id: u32, t: f32) -> Option<Fault> {
        let (t_min, t_max) = (self.ray.t_min, self.ray.t_max);
        let triangles = self.triangles;
        if id as usize >= triangles {
            return Some(Fault::NoSuchTriangle { id, triangles });
        }
        if !(t_min..=t_max).contains(&t) {
            return Some(Fault::OutOfInterval {
                id,
                t,
                t_min,
                t_max,
            });
        }
        let Some(crossing) = self.possible(id) else {
            return Some(Fault::FalseHit { id, t });
        };
        if !crossing.accepts(t) {
            let expected = Distance::of(crossing);
            return Some(Fault::Distance { id, t, expected });
        }
        // The f32 distance of a definite hit is at most its upper bound, so a structure that tested
        // that triangle cannot have returned a greater t.
        let (nearer, distance) = self.nearest_definite()?;
        (distance.t + distance.bound < f64::from(t)).then_some(Fault::NotNearest {
            id,
            t,
            nearer,
            distance,
        })
    }

    /// True if the triangle is certainly hit and nothing else may lie at its distance or before.
    fn is_only_answer(&self, id: u32, t: f32) -> bool {
        let behind = |crossing: &Crossing| {
            (crossing.distance()).is_some_and(|other| other.value - other.error > f64::from(t))
        };
        self.possible.iter().all(|other| {
            if other.id == id {
                other.is_definite
            } else {
                behind(&other.crossing)
            }
        })
    }

    fn possible(&self, id: u32) -> Option<&Crossing> {
        let at = self.possible.binary_search_by_key(&id, |p| p.id).ok()?;
        Some(&self.possible[at].crossing)
    }

    /// The definite hit with the smallest upper bound of its distance.
    fn nearest_definite(&self) -> Option<(u32, Distance)> {
        let upper = |d: &Distance| d.t + d.bound;
        (self.possible.iter())
            .filter(|p| p.is_definite)
            .map(|p| (p.id, Distance::of(&p.crossing)))
            .min_by(|a, b| upper(&a.1).total_cmp(&upper(&b.1)))
    }
}

impl Distance {
    fn of(crossing: &Crossing) -> Self {
        let (t, bound) = (crossing.distance()).map_or((f64::NAN, f64::NAN), |d| (d.value, d.error));
        Self { t, bound }
    }
}
