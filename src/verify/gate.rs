//! The correctness check: no figure is printed for a structure whose hits differ from the reference
//! tracer's.
//!
//! The reference tracer is the scalar CPU version of the plain BVH. It is checked against brute
//! force and the f64 oracle on as many rays as a budget allows. On an adapter with the host's
//! arithmetic, hits must be bit-identical. On one that fuses or divides differently, a differing
//! hit is a *tie* if both triangles lie within 4 ulp of the same distance in f64; ties are counted
//! and reported.
//!
//! A triangle test that is not exact has the default one's answers for a reference. Its own may
//! differ as far as f64 says that rounding explains; then other triangles are ties, too.
//!
//! Instanced scenes have a second reference for structures that transform rays to object space: see
//! `instance_reference`.

use crate::holes::SceneHoles;
use crate::instance_reference;
use crate::kept_checks::KeptChecks;
use crate::no_rays::{self, no_rays};
use crate::peer_check::{EXPLAINED, off_by};
use crate::rays::{RaySet, record_rays};
use raystone_accel::oracle::{self, Holes, Surfaces, Verdict};
use raystone_accel::triangle::TriangleRecord;
use raystone_accel::{
    AccelError, Ask, BuildLog, BuiltAccel, BuiltBvh, BvhParameters, Hit, NO_HIT, Query, Ray,
    RayBatch, Space, Traced, Tracer, TriangleBuffers, TriangleSoup, brute_force_hits,
};
use raystone_config::Gate;
use raystone_core::geometry::Camera;
use raystone_core::store::user_folder;
use raystone_gpu::{ArithmeticProbe, Gpu, GpuError, kernel_errors, wait_for};
use raystone_record::{ClassVerdict, GateVerdict, ReferenceCheck};
use raystone_scene::SceneData;

/// Minimum number of rays on which the reference tracer is checked against brute force.
const LEAST_BRUTE_FORCE_RAYS: usize = 2000;
/// One any-hit answer in this many may be another by a test that is not exact, where the closest hit
/// that would explain it is not traced.
const UNEXPLAINED: usize = 1000;
/// Distances within this many ulp count as equal on an adapter with inexact arithmetic.
const TIE_ULPS: f64 = 4.0;

/// The reference answers of a scene: recorded rays with their hits.
pub struct ReferenceTracer {
    /// Rays and reference hits, per class.
    pub sets: Vec<RaySet>,
    /// The reference tracer against brute force.
    pub brute_force: ReferenceCheck,
    /// The reference tracer against the f64 oracle.
    pub oracle: ReferenceCheck,
    /// The reference for structures that trace instances; `None` if no ray is transformed.
    pub instances: Option<Box<ReferenceTracer>>,
}

/// How to treat earlier checks of the reference tracer.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Checks {
    /// Repeat them.
    Repeated,
    /// Reuse those cached on disk for a bit-identical reference.
    Kept,
}

impl ReferenceTracer {
    /// Builds the reference tracer, records the rays and checks the reference itself.
    ///
    /// # Errors
    /// The scene has too many triangles for a BVH.
    pub fn new(
        scene: &SceneData,
        soup: &TriangleSoup,
        camera: Camera,
        settings: &Gate,
        seed: u64,
        past: Checks,
    ) -> Result<Self, AccelError> {
        let tests = soup.intersection;
        let exact = (!tests.triangle.is_exact()).then(|| soup.clone().intersecting(tests.exact()));
        let soup = exact.as_ref().unwrap_or(soup);
        let params = BvhParameters::default();
        let tree = BuiltBvh::build(soup, &params, &mut BuildLog::default())?;
        tree.validate(soup)?;
        let twin = tree.twin(soup);
        let mut sets = record_rays(scene, soup, camera, &twin, settings, seed);
        sets.retain(|set| set.is_timed() || tests.bears_hard_rays());
        drop(tree);
        let mut reference = Self::of_sets(sets);
        reference.instances = instance_reference::new(soup, &reference.sets, seed)?.map(Box::new);
        let kept = match past {
            Checks::Repeated => None,
            Checks::Kept => user_folder().and_then(|folder| {
                KeptChecks::of(
                    &folder,
                    &reference,
                    &scene.hash,
                    soup.intersection,
                    settings,
                )
            }),
        };
        if !kept
            .as_ref()
            .is_some_and(|kept| kept.restore(&mut reference))
        {
            reference.check(scene, soup, settings);
            kept.iter().for_each(|kept| kept.keep(&reference));
        }
        Ok(reference)
    }

    /// A reference with these answers, not yet checked.
    pub(super) fn of_sets(sets: Vec<RaySet>) -> Self {
        Self {
            sets,
            brute_force: ReferenceCheck::default(),
            oracle: ReferenceCheck::default(),
            instances: None,
        }
    }

    fn check(&mut self, scene: &SceneData, soup: &TriangleSoup, settings: &Gate) {
        self.check_brute_force(settings.brute_force_tests, soup.records.len(), |rays| {
            brute_force_hits(soup, rays)
        });
        self.check_oracle(scene, soup, settings.oracle_rays as usize);
        if let (Some(reference), Some(placed)) = (&mut self.instances, &soup.placed) {
            instance_reference::check(reference, (scene, placed), settings);
        }
    }

    /// The same reference with every `every`-th ray.
    pub fn thinned(&self, every: usize) -> Self {
        let thin = |set: &RaySet| RaySet {
            class: set.class,
            rays: set.rays.iter().step_by(every).copied().collect(),
            truth: set.truth.iter().step_by(every).copied().collect(),
            shadow: Vec::new(),
        };
        Self {
            sets: self.sets.iter().map(thin).collect(),
            brute_force: self.brute_force.clone(),
            oracle: self.oracle.clone(),
            instances: self
                .instances
                .as_ref()
                .map(|reference| Box::new(reference.thinned(every))),
        }
    }

    /// The reference for structures that intersect triangles in this space.
    pub fn of(&self, space: Space) -> &Self {
        match (space, &self.instances) {
            (Space::Instances, Some(reference)) => reference,
            _ => self,
        }
    }

    fn pairs(&self, timed: bool) -> impl Iterator<Item = (Ray, Hit)> {
        let sets = self.sets.iter().filter(move |s| s.is_timed() == timed);
        sets.flat_map(|s| s.rays.iter().copied().zip(s.truth.iter().copied()))
    }

    pub(super) fn hard(&self) -> impl Iterator<Item = (Ray, Hit)> {
        self.pairs(false)
    }

    /// `count` rays (or all, if fewer) spread evenly over all classes except the hard one.
    pub(super) fn subset(&self, count: usize) -> Vec<(Ray, Hit)> {
        let all: Vec<(Ray, Hit)> = self.pairs(true).collect();
        let count = count.min(all.len());
        (0..count).map(|i| all[i * all.len() / count]).collect()
    }

    /// Compares with `brute_force` on all hard rays and on as many others as `tests` triangle tests
    /// allow, at `triangles` tests per ray.
    pub(super) fn check_brute_force(
        &mut self,
        tests: u64,
        triangles: usize,
        brute_force: impl FnOnce(&[Ray]) -> Vec<Hit>,
    ) {
        let affordable = (tests / triangles.max(1) as u64) as usize;
        let mut pairs = self.subset(affordable.max(LEAST_BRUTE_FORCE_RAYS));
        pairs.extend(self.hard());
        let rays: Vec<Ray> = pairs.iter().map(|(ray, _)| *ray).collect();
        let truth = brute_force(&rays);
        self.brute_force.rays = rays.len();
        for ((ray, judged), brute) in pairs.iter().zip(&truth) {
            if !judged.same_bits(brute) {
                self.brute_force.wrong += 1;
                self.brute_force.first_wrong.get_or_insert_with(|| {
                    describe(ray, "reference", judged, "brute force", brute)
                });
            }
        }
    }

    fn check_oracle(&mut self, scene: &SceneData, soup: &TriangleSoup, rays: usize) {
        let mut pairs = self.subset(rays);
        pairs.extend(self.hard());
        let questions: Vec<_> = pairs
            .iter()
            .map(|(ray, hit)| {
                // The ray as traced: clamping components near zero decides hits at edges.
                let answer = (hit.triangle != NO_HIT).then_some((hit.triangle, hit.t));
                (soup.intersection.raised(ray), answer)
            })
            .collect();
        let holes = SceneHoles::of(scene);
        let surfaces = Surfaces {
            triangles: &scene.triangles,
            holes: holes.as_ref().map(|holes| holes as &dyn Holes),
        };
        let verdicts = oracle::judge_closest_hits(surfaces, &questions);
        self.note_oracle(&pairs, verdicts);
    }

    /// Counts the oracle's verdicts on these answers; those of hard rays come last.
    pub(super) fn note_oracle(&mut self, pairs: &[(Ray, Hit)], verdicts: Vec<Verdict>) {
        let hard = self.hard().count().min(pairs.len());
        self.oracle.rays = pairs.len();
        for (place, ((ray, hit), verdict)) in pairs.iter().zip(verdicts).enumerate() {
            match verdict {
                Verdict::Agrees => {}
                Verdict::Ambiguous => {
                    self.oracle.ambiguous += 1;
                    self.oracle.hard_ambiguous += usize::from(place >= pairs.len() - hard);
                }
                Verdict::Wrong(fault) => {
                    self.oracle.wrong += 1;
                    self.oracle.first_wrong.get_or_insert_with(|| {
                        format!("ray {ray} | reference {hit} | f64: {fault}")
                    });
                }
            }
        }
    }

    /// The first ray on which the reference tracer itself is wrong.
    pub fn first_wrong(&self) -> Option<&str> {
        let checks = [&self.brute_force, &self.oracle];
        (checks.into_iter()).find_map(|check| check.first_wrong.as_deref())
    }

    /// True if the reference tracer agrees with brute force and with the oracle.
    pub fn is_sound(&self) -> bool {
        self.brute_force.wrong == 0 && self.oracle.wrong == 0
    }
}

/// Traces all recorded rays, closest and any hit, and compares with the reference for the space in
/// which the structure intersects triangles.
///
/// # Errors
/// A kernel does not compile, the device is lost or hangs, or its driver cuts loops short.
pub fn gate(
    gpu: &Gpu,
    triangles: &TriangleBuffers,
    soup: &TriangleSoup,
    traced: &Traced,
    reference: &ReferenceTracer,
    probe: &ArithmeticProbe,
    runtime_checks: bool,
) -> Result<GateVerdict, GpuError> {
    let stage = (gpu, triangles, soup);
    wait_for(gate_async(stage, traced, reference, probe, runtime_checks))
}

/// See [`gate`]: a future that suspends while the device works. Its first argument holds the device, and the triangles
/// there and on the host.
///
/// # Errors
/// As [`gate`].
pub async fn gate_async(
    (gpu, triangles, soup): (&Gpu, &TriangleBuffers, &TriangleSoup),
    traced: &Traced,
    reference: &ReferenceTracer,
    probe: &ArithmeticProbe,
    runtime_checks: bool,
) -> Result<GateVerdict, GpuError> {
    let reference = reference.of(traced.space);
    let mut errors = 0;
    let mut classes = Vec::new();
    for set in &reference.sets {
        let mut rays = set.rays.clone();
        if !set.is_timed() {
            rays.extend(no_rays(set));
        }
        let batch = |query: Query| {
            let ask = Ask {
                coherent: set.is_coherent(),
                runtime_checks,
                ..query.into()
            };
            Tracer::new(gpu, triangles, traced, ask)?.batch(&rays)
        };
        let (closest, any) = (batch(Query::Closest)?, batch(Query::Any)?);
        closest.trace_async().await?;
        any.trace_async().await?;
        if !set.is_timed() {
            // Timed batches are checked after timing; a second pass exposes state left by the
            // first.
            closest.trace_in_rows_async().await?;
            any.trace_in_rows_async().await?;
        }
        errors |= closest.error_word_async().await? | any.error_word_async().await?;
        let (mut hits, mut found) = (closest.hits_async().await?, any.found_async().await?);
        let other_hits = hits.split_off(set.rays.len().min(hits.len()));
        let other_found = found.split_off(set.rays.len().min(found.len()));
        let is_exact = probe.is_exact();
        let mut class = compare(set, &hits, &found, soup, traced.space, is_exact);
        let others = &rays[set.rays.len()..];
        no_rays::note(&mut class, others, &other_hits, &other_found);
        classes.push(class);
    }
    if let Err(refused @ GpuError::LoopsCut { .. }) = gpu.check_error_word(errors) {
        return Err(refused);
    }
    Ok(GateVerdict {
        inexact: !soup.intersection.triangle.is_exact(),
        ..verdict(classes, errors, reference)
    })
}

/// The verdict on answers of all classes and the error word of their kernels.
pub(super) fn verdict(
    classes: Vec<ClassVerdict>,
    errors: u32,
    reference: &ReferenceTracer,
) -> GateVerdict {
    let right = classes.iter().all(|c| c.wrong == 0);
    GateVerdict {
        passed: right && errors == 0 && reference.is_sound(),
        classes,
        brute_force: reference.brute_force.clone(),
        oracle: reference.oracle.clone(),
        kernel_errors: kernel_errors(errors),
        work: None,
        structural: None,
        elsewhere: None,
        inexact: false,
    }
}

/// Checks all answers left by a timed batch, and the error word of all its dispatches. Returns a
/// description of the faults, or `None`.
///
/// # Errors
/// The device is lost or hangs.
pub fn timed_fault(
    batch: &RayBatch,
    set: &RaySet,
    soup: &TriangleSoup,
    space: Space,
    exact: bool,
) -> Result<Option<String>, GpuError> {
    wait_for(timed_fault_async(batch, set, soup, space, exact))
}

/// See [`timed_fault`].
///
/// # Errors
/// As [`timed_fault`].
pub async fn timed_fault_async(
    batch: &RayBatch,
    set: &RaySet,
    soup: &TriangleSoup,
    space: Space,
    exact: bool,
) -> Result<Option<String>, GpuError> {
    let mut hits = set.truth.clone();
    let mut found: Vec<_> = hits.iter().map(|h| Some(h.triangle != NO_HIT)).collect();
    match set.query() {
        Query::Closest => hits = batch.hits_async().await?,
        Query::Any => found = batch.found_async().await?,
    }
    let mut faults = kernel_errors(batch.error_word_async().await?);
    let verdict = compare(set, &hits, &found, soup, space, exact);
    let any_of_inexact = set.query() == Query::Any && !soup.intersection.triangle.is_exact();
    let few = if any_of_inexact {
        set.rays.len() / UNEXPLAINED
    } else {
        0
    };
    if let Some(first) = verdict.first_wrong.filter(|_| verdict.wrong > few) {
        faults.push(format!(
            "{} of {} rays of the last timed turn differ from the reference tracer; first: {first}",
            verdict.wrong, verdict.rays
        ));
    }
    Ok((!faults.is_empty()).then(|| faults.join("; ")))
}

/// Compares the answers of a structure with the reference.
pub fn compare(
    set: &RaySet,
    hits: &[Hit],
    found: &[Option<bool>],
    soup: &TriangleSoup,
    space: Space,
    exact: bool,
) -> ClassVerdict {
    let mut verdict = ClassVerdict {
        class: set.class,
        rays: set.rays.len(),
        wrong: 0,
        ties: 0,
        first_wrong: None,
    };
    let exact_test = soup.intersection.triangle.is_exact();
    for (index, (ray, truth)) in set.rays.iter().zip(&set.truth).enumerate() {
        let none = Hit {
            t: f32::NAN,
            ..Hit::miss(ray)
        };
        let hit = hits.get(index).copied().unwrap_or(none);
        let of_any = if exact_test { truth } else { &hit };
        let any_right = found.get(index) == Some(&Some(of_any.triangle != NO_HIT));
        if hit.same_bits(truth) && any_right {
            continue;
        }
        if !exact && exact_test && any_right && is_tie(ray, &hit, truth, soup, space) {
            verdict.ties += 1;
            continue;
        }
        if !exact_test && any_right && is_explained(ray, &hit, truth, soup, space) {
            verdict.ties += usize::from(hit.triangle != truth.triangle);
            continue;
        }
        verdict.wrong += 1;
        verdict.first_wrong.get_or_insert_with(|| {
            let any = if any_right {
                ""
            } else {
                " | any-hit answer differs"
            };
            describe(ray, "structure", &hit, "reference", truth) + any
        });
    }
    verdict
}

/// True if both triangles and the answer lie within 4 ulp of the same distance in f64 and the ray
/// may hit the other triangle (a plane extends beyond its triangle). For transformed rays, the
/// error from rounding the transform is added.
fn is_tie(ray: &Ray, hit: &Hit, truth: &Hit, soup: &TriangleSoup, space: Space) -> bool {
    let (Some(found), Some(expected)) = (
        Meeting::new(ray, hit, soup, space),
        Meeting::new(ray, truth, soup, space),
    ) else {
        return false;
    };
    let ulp = |t: f64| t.abs() * f64::from(f32::EPSILON);
    let slack = found.transform_error + expected.transform_error;
    let near = |a: f64, b: f64| (a - b).abs() <= TIE_ULPS * ulp(a.abs().max(b.abs())) + slack;
    near(found.plane_distance(), expected.plane_distance())
        && near(f64::from(hit.t), f64::from(truth.t))
        && (hit.triangle == truth.triangle || found.may_hit(hit.t))
}

/// True if rounding explains the answer of a test that is not exact. As of a peer, the distance is that
/// of the plane of its triangle or of the reference, and the barycentrics lie where the ray is then. In
/// f64 the ray may hit this triangle there; and where the reference has another, the ray may miss that
/// one or meets both at the same distance.
fn is_explained(ray: &Ray, hit: &Hit, truth: &Hit, soup: &TriangleSoup, space: Space) -> bool {
    let [found, expected] = [hit, truth].map(|hit| Meeting::new(ray, hit, soup, space));
    let is_near = |t: f64| off_by(ray, hit.t, t) <= EXPLAINED;
    let (same, beside) = (hit.triangle == truth.triangle, is_near(f64::from(truth.t)));
    let is_right = match &found {
        None => hit.same_bits(&Hit::miss(ray)),
        Some(found) => {
            let plane = found.plane_distance();
            found.is_at(hit) && (same && beside || is_near(plane) && found.may_hit(plane as f32))
        }
    };
    let is_left_out = |expected: &Meeting| same || found.is_some() && beside || expected.may_miss();
    is_right && expected.as_ref().is_none_or(is_left_out)
}

/// A ray and a triangle in the space where they are intersected.
pub(super) struct Meeting {
    pub ray: Ray,
    pub record: TriangleRecord,
    /// Largest change of the distance to the plane from rounding the transformed ray.
    pub transform_error: f64,
}

impl Meeting {
    /// `None` for a miss or for a triangle index that is not in the scene.
    fn new(ray: &Ray, hit: &Hit, soup: &TriangleSoup, space: Space) -> Option<Self> {
        if hit.triangle == NO_HIT {
            return None;
        }
        match (space, &soup.placed) {
            (Space::Instances, Some(placed)) => {
                instance_reference::meeting(placed, ray, hit.triangle, hit.t)
            }
            _ => Some(Self {
                ray: soup.intersection.raised(ray),
                record: *soup.records.get(hit.triangle as usize)?,
                transform_error: 0.0,
            }),
        }
    }

    fn plane_distance(&self) -> f64 {
        let v = |a: [f32; 3]| glam::DVec3::from_array(a.map(f64::from));
        let [v0, v1, v2] = self.record.vertices().map(v);
        let normal = (v1 - v0).cross(v2 - v0);
        normal.dot(v0 - v(self.ray.origin)) / normal.dot(v(self.ray.direction))
    }

    /// True if the barycentrics of a hit are those of its place on the ray, up to what single precision explains of a distance.
    fn is_at(&self, hit: &Hit) -> bool {
        let v = |a: [f32; 3]| glam::DVec3::from_array(a.map(f64::from));
        let [v0, v1, v2] = self.record.vertices().map(v);
        let (origin, direction) = (v(self.ray.origin), v(self.ray.direction));
        let [t, first, second] = [hit.t, hit.u, hit.v].map(f64::from);
        let apart = v0 + (v1 - v0) * first + (v2 - v0) * second - origin - direction * t;
        let reach = (t * direction.length()).max(0.01 * origin.abs().max_element());
        apart.length() <= EXPLAINED * reach
    }

    /// True if rounding alone can explain a hit on the triangle at `t`.
    fn may_hit(&self, t: f32) -> bool {
        self.may_be(Some((0, t)))
    }

    /// True if rounding alone can explain that the triangle is not hit.
    fn may_miss(&self) -> bool {
        self.may_be(None)
    }

    fn may_be(&self, answer: Option<(u32, f32)>) -> bool {
        let triangle = self.record.triangle();
        !matches!(
            oracle::judge(&[triangle], self.ray, answer),
            Verdict::Wrong(_)
        )
    }
}

/// A ray in the format of `raystone trace --ray`, with two answers.
fn describe(ray: &Ray, left: &str, a: &Hit, right: &str, b: &Hit) -> String {
    format!("ray {ray} | {left} {a} | {right} {b}")
}
