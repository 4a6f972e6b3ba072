//! The outcome of each ray, and the sum over a cell.

use super::Found;
use super::case::{Case, Truth};
use rayon::prelude::*;
use raystone_accel::oracle::{ExactTruth, ExactVerdict, exact_truths};
use raystone_accel::{Hit, NO_HIT, Ray};
use raystone_core::geometry::Triangle;
use raystone_record::figure::{self, Figure};
use raystone_record::{Key, axis};
use std::collections::BTreeMap;

/// Errors of right hits: of the distance, in ulp and relative, and of the hit point, in ulp of its greatest
/// coordinate and relative to the way of the ray.
pub(crate) type Errors<T = f64> = [T; 4];

/// The outcome of a ray.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Outcome {
    /// The verdict on the answer.
    pub verdict: ExactVerdict,
    /// Errors, where the answer is a hit of the triangle that it names.
    pub errors: Option<Errors>,
}

/// The right answers to every ray of a case: found once for all structures.
pub(crate) struct CaseTruth<'a> {
    case: &'a Case,
    /// Exact truths; empty where there is no exact truth.
    truths: Vec<ExactTruth>,
}

impl<'a> CaseTruth<'a> {
    /// Looks up the truth of every ray.
    pub(crate) fn new(case: &'a Case) -> Self {
        let truths = match case.truth {
            Truth::Exact | Truth::Closed => exact_truths(&case.scene.triangles, &case.rays),
            _ => Vec::new(),
        };
        Self { case, truths }
    }

    /// Checks one answer.
    pub(crate) fn judge(&self, index: usize, hit: &Hit) -> Outcome {
        let answer = (hit.triangle != NO_HIT).then_some((hit.triangle, hit.t));
        let plain = |verdict| Outcome {
            verdict,
            errors: None,
        };
        match (self.case.truth, answer) {
            (Truth::Hit, None) => plain(ExactVerdict::FalseMiss { explained: false }),
            (Truth::Miss, Some(_)) => plain(ExactVerdict::FalseHit { explained: false }),
            (Truth::Hit | Truth::Miss, _) => plain(ExactVerdict::Miss),
            (Truth::Exact | Truth::Closed, _) => {
                let ray = &self.case.rays[index];
                let triangles = &self.case.scene.triangles;
                let verdict = self.truths[index].judge(triangles, ray, answer);
                let errors = match verdict {
                    ExactVerdict::Hit(t) => {
                        Some(errors(&triangles[hit.triangle as usize], ray, hit, t))
                    }
                    _ => None,
                };
                Outcome { verdict, errors }
            }
        }
    }

    /// Checks the answers to all rays, on all cores.
    pub(crate) fn judge_all(&self, hits: &[Hit]) -> Vec<Outcome> {
        (hits.par_iter().enumerate())
            .map(|(i, hit)| self.judge(i, hit))
            .collect()
    }
}

/// Returns the distance between neighbouring f32 numbers at `x`.
pub(crate) fn ulp(x: f64) -> f64 {
    let exponent = (x.abs().max(f64::from(f32::MIN_POSITIVE))).log2().floor();
    2f64.powi(exponent as i32 - 23)
}

/// Returns the errors of a hit whose exact distance is `t`. Integrators compute the hit point from the barycentrics;
/// its error is the greatest of its coordinates, relative to the way of the ray.
fn errors(triangle: &Triangle, ray: &Ray, hit: &Hit, t: f64) -> Errors {
    let [v0, v1, v2] = triangle.vertices;
    let found = v0 - hit.u * (v0 - v1) + hit.v * (v2 - v0);
    let [origin, direction] = [ray.origin, ray.direction].map(|v| glam::Vec3::from(v).as_dvec3());
    let point = origin + direction * t;
    let size = point.abs().max_element();
    let way = (direction * t).abs().max_element();
    let off = (f64::from(hit.t) - t).abs();
    let point_off = (found.as_dvec3() - point).abs().max_element();
    // Records hold finite numbers only.
    let relative = |off: f64, to: f64| {
        if off == 0.0 {
            0.0
        } else {
            (off / to).min(f64::MAX)
        }
    };
    [
        off / ulp(t),
        relative(off, t.abs()),
        point_off / ulp(size),
        relative(point_off, way),
    ]
}

/// Counts of the rays of a cell.
const COUNTED: [&Figure; 12] = [
    &figure::RAYS,
    &figure::FALSE_MISSES,
    &figure::UNEXPLAINED_MISSES,
    &figure::CRACKS,
    &figure::FALSE_HITS,
    &figure::UNEXPLAINED_HITS,
    &figure::WRONG_TRIANGLE,
    &figure::NOT_NEAREST,
    &figure::BORDERLINE,
    &figure::DIFFERING,
    &figure::ANY_DIFFERING,
    &figure::TIES,
];

/// Median, 99th percentile and greatest of each error.
const ERRORS: Errors<[&Figure; 3]> = [
    [
        &figure::T_ULP_MEDIAN,
        &figure::T_ULP_P99,
        &figure::T_ULP_MOST,
    ],
    [&figure::T_MEDIAN, &figure::T_P99, &figure::T_MOST],
    [
        &figure::POINT_ULP_MEDIAN,
        &figure::POINT_ULP_P99,
        &figure::POINT_ULP_MOST,
    ],
    [
        &figure::POINT_MEDIAN,
        &figure::POINT_P99,
        &figure::POINT_MOST,
    ],
];

/// The ray to look at first.
#[derive(Debug, Clone, PartialEq)]
pub struct Worst {
    /// Its fault.
    pub what: String,
    /// The command that shows it.
    pub replay: String,
}

/// Counts over the rays of a cell.
#[derive(Debug, Clone, Default)]
pub struct Tally {
    /// By id of the figure.
    counts: BTreeMap<&'static str, usize>,
    /// Errors of right hits.
    errors: Vec<Errors>,
    /// The ray to look at first, and how bad it is.
    worst: Option<(f64, Worst)>,
}

/// Returns the badness of a verdict, and its name.
fn badness(outcome: &Outcome) -> (f64, &'static str) {
    match outcome.verdict {
        ExactVerdict::FalseMiss { explained: false } => (5e9, "false miss"),
        ExactVerdict::FalseHit { explained: false } => (4e9, "false hit"),
        ExactVerdict::NotNearest => (3e9, "not the nearest"),
        ExactVerdict::FalseMiss { .. } => (2e9, "false miss, within rounding of an edge"),
        ExactVerdict::WrongTriangle => (1.2e9, "wrong triangle"),
        ExactVerdict::FalseHit { .. } => (1.1e9, "false hit, within rounding of an edge"),
        _ => (outcome.errors.map_or(0.0, |e| e[0].min(1e9)), "error of t"),
    }
}

impl Tally {
    /// Adds to a count.
    pub fn count(&mut self, figure: &'static Figure, more: usize) {
        *self.counts.entry(&*figure.id).or_default() += more;
    }

    /// Returns a count so far.
    fn counted(&self, figure: &Figure) -> usize {
        self.counts.get(&*figure.id).copied().unwrap_or(0)
    }

    /// Adds a ray.
    pub fn add(&mut self, outcome: &Outcome, closed: bool, replay: impl FnOnce() -> String) {
        self.count(&figure::RAYS, 1);
        match outcome.verdict {
            ExactVerdict::Miss | ExactVerdict::Hit(_) => {}
            ExactVerdict::Borderline => self.count(&figure::BORDERLINE, 1),
            ExactVerdict::FalseMiss { explained } => {
                self.count(&figure::FALSE_MISSES, 1);
                self.count(&figure::UNEXPLAINED_MISSES, usize::from(!explained));
                self.count(&figure::CRACKS, usize::from(closed));
            }
            ExactVerdict::FalseHit { explained } => {
                self.count(&figure::FALSE_HITS, 1);
                self.count(&figure::UNEXPLAINED_HITS, usize::from(!explained));
            }
            ExactVerdict::WrongTriangle => self.count(&figure::WRONG_TRIANGLE, 1),
            ExactVerdict::NotNearest => self.count(&figure::NOT_NEAREST, 1),
        }
        self.errors.extend(outcome.errors);
        let (badness, what) = badness(outcome);
        self.note(badness, what, replay);
    }

    /// Notes a ray if it is worse than the worst so far.
    pub fn note(&mut self, badness: f64, what: &str, replay: impl FnOnce() -> String) {
        if badness > self.worst.as_ref().map_or(0.0, |worst| worst.0) {
            let what = what.to_owned();
            let replay = replay();
            self.worst = Some((badness, Worst { what, replay }));
        }
    }

    /// Adds the sums of another rung.
    pub fn join(&mut self, other: Self) {
        for (id, count) in other.counts {
            *self.counts.entry(id).or_default() += count;
        }
        self.errors.extend(other.errors);
        if other.worst.as_ref().map(|w| w.0) > self.worst.as_ref().map(|w| w.0) {
            self.worst = other.worst;
        }
    }

    /// Returns the median, 99th percentile and greatest of each error; `None` without a right hit.
    fn quantiles(&self) -> Option<Errors<[f64; 3]>> {
        let last = self.errors.len().checked_sub(1)?;
        Some([0, 1, 2, 3].map(|which| {
            let mut errors: Vec<f64> = self.errors.iter().map(|e| e[which]).collect();
            errors.sort_by(f64::total_cmp);
            [0.5, 0.99, 1.0].map(|share| errors[(last as f64 * share).round() as usize])
        }))
    }

    /// Adds the counts of one case to the results.
    pub(crate) fn tell_rung(&self, found: &mut Found, case: &Case) {
        let at = Key::default().with(axis::SUBJECT, &case.label);
        let at = at.with(axis::PLACE, case.place);
        let counts = [&figure::RAYS, &figure::FALSE_MISSES];
        found.add(&at, counts.map(|id| (id, self.counted(id) as f64)));
        if let Some([t, _, point, _]) = self.quantiles() {
            let errors = [
                (&figure::T_ULP_P99, t[1]),
                (&figure::POINT_ULP_P99, point[1]),
            ];
            found.add(&at, errors);
        }
    }

    /// Adds everything to the results; any hits only if they were traced. The worst ray of a structure that answers as brute
    /// force does is that of brute force.
    pub(crate) fn tell(self, found: &mut Found, at: &Key, asked_any: bool, is_brute_force: bool) {
        let counted = COUNTED
            .iter()
            .filter(|figure| asked_any || figure.id != figure::ANY_DIFFERING.id);
        found.add(
            at,
            counted.map(|figure| (*figure, self.counted(figure) as f64)),
        );
        let [closest, any] = [&figure::DIFFERING, &figure::ANY_DIFFERING].map(|f| self.counted(f));
        found.add(at, [(&figure::UNEQUAL, (closest + any) as f64)]);
        if let Some(errors) = self.quantiles() {
            let figures = ERRORS.iter().zip(errors);
            found.add(
                at,
                figures.flat_map(|(figures, errors)| (*figures).into_iter().zip(errors)),
            );
        }
        if is_brute_force || closest + any > 0 {
            found.look_at(at, self.worst.map(|(_, worst)| worst));
        }
    }
}

/// Tallies known outcomes: of errors 0 to 99 the middle, all but a hundredth and the most; and of two misses at an edge one in a closed body.
/// An ulp of 1 is 2⁻²³.
///
/// # Errors
/// A figure is another than it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let mut tally = Tally::default();
    for k in 0..100 {
        let outcome = Outcome {
            verdict: ExactVerdict::Hit(1.0),
            errors: Some([f64::from(k), 0.0, 0.0, 0.0]),
        };
        tally.add(&outcome, true, || format!("ray {k}"));
    }
    let mut other = Tally::default();
    let miss = Outcome {
        verdict: ExactVerdict::FalseMiss { explained: true },
        errors: None,
    };
    other.add(&miss, true, || "crack".to_owned());
    other.add(&miss, false, || "silhouette".to_owned());
    for (figure, more) in [(&figure::DIFFERING, 3), (&figure::ANY_DIFFERING, 4)] {
        other.count(figure, more);
    }
    tally.join(other);
    let mut found = Found::default();
    tally.tell(&mut found, &Key::default(), true, true);
    let worst = found.notes.first().map(|note| note.text.as_str());
    let value = |figure: &Figure| {
        let reading = found.readings.iter().find(|r| r.figure == figure.id);
        reading.map(|reading| reading.value.value)
    };
    let known = [
        (&figure::RAYS, 102.0),
        (&figure::FALSE_MISSES, 2.0),
        (&figure::UNEXPLAINED_MISSES, 0.0),
        (&figure::CRACKS, 1.0),
        (&figure::UNEQUAL, 7.0),
        (&figure::T_ULP_MEDIAN, 50.0),
        (&figure::T_ULP_P99, 98.0),
        (&figure::T_ULP_MOST, 99.0),
    ];
    let wrong = known
        .into_iter()
        .find(|(figure, value_of)| value(figure) != Some(*value_of));
    if wrong.is_none() && worst == Some("crack") && ulp(1.0) == f64::from(f32::EPSILON) {
        return Ok(());
    }
    let wrong = wrong.map(|(figure, expected)| (&figure.id, value(figure), expected));
    Err(format!(
        "of known outcomes the worst is {worst:?} or a figure another than it should be ({wrong:?}): this program shows wrong figures; build \
         it anew, and report what stays wrong"
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn an_ulp_is_the_distance_to_the_next_number() {
        for x in [1.0_f32, 1.5, 2.0, 3e-8, 7e20, f32::MIN_POSITIVE] {
            let next = f64::from(x.next_up()) - f64::from(x);
            assert_eq!(ulp(f64::from(x)), next, "{x}");
        }
        assert_eq!(ulp(0.0), f64::from(f32::from_bits(1)));
    }

    #[test]
    fn a_tally_counts_cracks_apart_keeps_the_worst_ray_and_knows_its_quantiles() {
        assert_eq!(check(), Ok(()));
        let mut found = Found::default();
        Tally::default().tell(&mut found, &Key::default(), false, true);
        let not_asked = |r: &raystone_record::Reading| r.figure != figure::ANY_DIFFERING.id;
        assert!(found.readings.iter().all(not_asked));
    }

    #[test]
    fn a_rung_tells_the_99th_percentile_of_distance_and_point() {
        let mut tally = Tally::default();
        for k in 0..=100 {
            let k = f64::from(k);
            let outcome = Outcome {
                verdict: ExactVerdict::Hit(1.0),
                errors: Some([k, 0.0, 1000.0 + 2.0 * k, 0.0]),
            };
            tally.add(&outcome, false, String::new);
        }
        let case = Case {
            family: "plane",
            label: "plane, ordinary".to_owned(),
            place: crate::placement::Placement::ORDINARY,
            scene: crate::case::scene(Vec::new(), None),
            rays: Vec::new(),
            truth: Truth::Exact,
        };
        let mut found = Found::default();
        tally.tell_rung(&mut found, &case);
        let told: Vec<(&str, f64)> = (found.readings.iter())
            .map(|r| (r.figure.as_str(), r.value.value))
            .collect();
        let expected = [
            (&*figure::RAYS.id, 101.0),
            (&*figure::FALSE_MISSES.id, 0.0),
            (&*figure::T_ULP_P99.id, 99.0),
            (&*figure::POINT_ULP_P99.id, 1198.0),
        ];
        assert_eq!(told, expected);
    }
}
