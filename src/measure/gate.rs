//! The gate: no figure is printed for a structure whose hits differ from the judge's.
//!
//! The judge is the scalar CPU twin of the plain BVH. It is itself compared with brute force and with
//! the f64 oracle on as many rays as a budget allows. On an adapter that computes like the host,
//! hits must be equal to the bit. On one that fuses or divides otherwise, a differing hit is a *tie*
//! if both triangles lie within 4 ulp of the same distance in f64; ties are counted and shown.
//!
//! A scene of instances has a second judge, for structures that take rays to the objects' spaces:
//! see [`super::instance_judge`].

use super::batch::{Batch, Query};
use super::instance_judge;
use super::rays::{RaySet, record_rays};
use super::record::{ClassVerdict, GateVerdict, JudgeCheck};
use crate::accel::AccelKind;
use crate::accel::triangle::TriangleRecord;
use crate::accel::{
    AccelError, BuildLog, BuiltAccel, BuiltBvh, Bvh, Hit, NO_HIT, Ray, Space, TriangleSoup,
    brute_force_hits,
};
use crate::config::{Gate, Params};
use crate::gpu::{ArithmeticProbe, Gpu, GpuError, kernel_errors};
use crate::integrator::{SceneBuffers, Traced};
use crate::oracle::{self, OracleRay, Verdict};
use crate::scene::{Camera, SceneData};

/// The judge is compared with brute force on at least this many rays.
const LEAST_BRUTE_FORCE_RAYS: usize = 2000;
/// Triangle tests that the f64 oracle may spend on a scene.
pub(super) const ORACLE_TESTS: usize = 300_000_000;
/// Two distances within this many ulp are the same on an adapter with inexact arithmetic.
const TIE_ULPS: f64 = 4.0;

/// The judge of a scene: recorded rays with its answers. The scalar BVH that gave them is not kept.
pub struct Judge {
    /// Rays and true hits, per class.
    pub sets: Vec<RaySet>,
    /// The judge against brute force.
    pub brute_force: JudgeCheck,
    /// The judge against the f64 oracle.
    pub oracle: JudgeCheck,
    /// The first ray on which the judge itself is wrong.
    pub first_wrong: Option<String>,
    /// The judge of structures that trace instances; `None` if no ray of the scene is transformed.
    pub instances: Option<Box<Judge>>,
}

impl Judge {
    /// Builds the judge, records the rays and checks the judge itself.
    ///
    /// # Errors
    /// The scene has too many triangles for a BVH.
    pub fn new(
        scene: &SceneData,
        soup: &TriangleSoup,
        camera: Camera,
        settings: &Gate,
        seed: u64,
    ) -> Result<Self, AccelError> {
        let mut params = Params::default();
        for parameter in Bvh.parameters() {
            params
                .0
                .insert(parameter.name.to_owned(), parameter.default);
        }
        let tree = BuiltBvh::build(soup, &params, &mut BuildLog::default())?;
        tree.validate(soup)?;
        let twin = tree.twin(soup);
        let sets = record_rays(scene, soup, camera, &twin, settings, seed);
        drop(tree);
        let mut judge = Self {
            sets,
            brute_force: JudgeCheck::default(),
            oracle: JudgeCheck::default(),
            first_wrong: None,
            instances: None,
        };
        judge.check_brute_force(settings.brute_force_tests, soup.records.len(), |rays| {
            brute_force_hits(soup, rays)
        });
        judge.check_oracle(scene, settings.oracle_rays as usize);
        judge.instances = instance_judge::new(soup, &judge.sets, settings)?.map(Box::new);
        Ok(judge)
    }

    /// The judge of structures that meet triangles in this space.
    pub fn of(&self, space: Space) -> &Self {
        match (space, &self.instances) {
            (Space::Instances, Some(judge)) => judge,
            _ => self,
        }
    }

    /// `count` rays (or all, if there are fewer) spread evenly over all classes.
    pub(super) fn subset(&self, count: usize) -> Vec<(Ray, Hit)> {
        let pairs = self
            .sets
            .iter()
            .flat_map(|s| s.rays.iter().copied().zip(s.truth.iter().copied()));
        let all: Vec<(Ray, Hit)> = pairs.collect();
        let count = count.min(all.len());
        (0..count).map(|i| all[i * all.len() / count]).collect()
    }

    /// Compares with `brute_force`, which costs a ray `triangles` tests, as far as `tests` reach.
    pub(super) fn check_brute_force(
        &mut self,
        tests: u64,
        triangles: usize,
        brute_force: impl FnOnce(&[Ray]) -> Vec<Hit>,
    ) {
        let affordable = (tests / triangles.max(1) as u64) as usize;
        let pairs = self.subset(affordable.max(LEAST_BRUTE_FORCE_RAYS));
        let rays: Vec<Ray> = pairs.iter().map(|(ray, _)| *ray).collect();
        let truth = brute_force(&rays);
        self.brute_force.rays = rays.len();
        for ((ray, judged), brute) in pairs.iter().zip(&truth) {
            if !judged.same_bits(brute) {
                self.brute_force.wrong += 1;
                self.first_wrong
                    .get_or_insert_with(|| describe(ray, "judge", judged, "brute force", brute));
            }
        }
    }

    fn check_oracle(&mut self, scene: &SceneData, rays: usize) {
        let affordable = (ORACLE_TESTS / scene.triangles.len().max(1)).max(64);
        let pairs = self.subset(rays.min(affordable));
        let questions: Vec<_> = pairs
            .iter()
            .map(|(ray, hit)| {
                (
                    oracle_ray(ray),
                    (hit.triangle != NO_HIT).then_some((hit.triangle, hit.t)),
                )
            })
            .collect();
        let verdicts = oracle::judge_closest_hits(&scene.triangles, &questions);
        self.note_oracle(&pairs, verdicts);
    }

    /// Counts what the oracle thinks of these answers.
    pub(super) fn note_oracle(&mut self, pairs: &[(Ray, Hit)], verdicts: Vec<Verdict>) {
        self.oracle.rays = pairs.len();
        for ((ray, hit), verdict) in pairs.iter().zip(verdicts) {
            match verdict {
                Verdict::Agrees => {}
                Verdict::Ambiguous => self.oracle.ambiguous += 1,
                Verdict::Wrong(fault) => {
                    self.oracle.wrong += 1;
                    self.first_wrong.get_or_insert_with(|| {
                        format!("{} | judge {} | f64: {fault}", ray_text(ray), hit_text(hit))
                    });
                }
            }
        }
    }

    /// Whether the judge agrees with brute force and with the oracle.
    pub fn is_sound(&self) -> bool {
        self.brute_force.wrong == 0 && self.oracle.wrong == 0
    }
}

pub(super) fn oracle_ray(ray: &Ray) -> OracleRay {
    OracleRay {
        origin: ray.origin,
        t_min: ray.t_min,
        direction: ray.direction,
        t_max: ray.t_max,
    }
}

/// Traces all recorded rays, closest and any hit, and compares with the judge of the space in which
/// the structure meets triangles.
///
/// # Errors
/// A kernel does not compile, the device is lost or hangs, or its driver cuts the loops short.
pub fn gate(
    gpu: &Gpu,
    scene: &SceneBuffers,
    soup: &TriangleSoup,
    traced: &Traced,
    judge: &Judge,
    probe: &ArithmeticProbe,
    runtime_checks: bool,
) -> Result<GateVerdict, GpuError> {
    let judge = judge.of(traced.space);
    let mut errors = 0;
    let mut classes = Vec::new();
    for set in &judge.sets {
        let closest = Batch::new(
            gpu,
            scene,
            traced,
            Query::Closest,
            &set.rays,
            runtime_checks,
        )?;
        closest.trace()?;
        let any = Batch::new(gpu, scene, traced, Query::Any, &set.rays, runtime_checks)?;
        any.trace()?;
        errors |= closest.error_word()? | any.error_word()?;
        classes.push(compare(
            set,
            &closest.hits()?,
            &any.found()?,
            soup,
            traced.space,
            probe.is_exact(),
        ));
    }
    if let Err(refused @ GpuError::LoopsCut { .. }) = gpu.check_error_word(errors) {
        return Err(refused);
    }
    let right = classes.iter().all(|c| c.wrong == 0);
    Ok(GateVerdict {
        passed: right && errors == 0 && judge.is_sound(),
        classes,
        brute_force: judge.brute_force.clone(),
        oracle: judge.oracle.clone(),
        kernel_errors: kernel_errors(errors),
        structural: None,
    })
}

/// Compares the answers of a structure with the judge's.
pub fn compare(
    set: &RaySet,
    hits: &[Hit],
    found: &[bool],
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
    for (index, (ray, truth)) in set.rays.iter().zip(&set.truth).enumerate() {
        let hit = hits.get(index).copied().unwrap_or(Hit {
            t: f32::NAN,
            triangle: NO_HIT,
            u: 0.0,
            v: 0.0,
        });
        let any_right = found.get(index) == Some(&(truth.triangle != NO_HIT));
        if hit.same_bits(truth) && any_right {
            continue;
        }
        if !exact && any_right && is_tie(ray, &hit, truth, soup, space) {
            verdict.ties += 1;
            continue;
        }
        verdict.wrong += 1;
        verdict.first_wrong.get_or_insert_with(|| {
            let any = if any_right {
                ""
            } else {
                " | any-hit answer differs"
            };
            describe(ray, "structure", &hit, "judge", truth) + any
        });
    }
    verdict
}

/// Whether both triangles lie within 4 ulp of the same distance in f64, as does the answer, and the
/// ray may hit the other one there: a plane goes on beyond its triangle. Where rays are transformed,
/// what rounding the transform can move the distance by comes on top.
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

/// A ray and a triangle in the space where they meet.
pub(super) struct Meeting {
    pub ray: Ray,
    pub record: TriangleRecord,
    /// How far rounding of the transformed ray may move the distance to the plane.
    pub transform_error: f64,
}

impl Meeting {
    /// `None` for a miss, or for a triangle that the scene has not.
    fn new(ray: &Ray, hit: &Hit, soup: &TriangleSoup, space: Space) -> Option<Self> {
        if hit.triangle == NO_HIT {
            return None;
        }
        match (space, &soup.placed) {
            (Space::Instances, Some(placed)) => {
                instance_judge::meeting(placed, ray, hit.triangle, hit.t)
            }
            _ => Some(Self {
                ray: *ray,
                record: *soup.records.get(hit.triangle as usize)?,
                transform_error: 0.0,
            }),
        }
    }

    /// Distance to the triangle's plane, f64.
    fn plane_distance(&self) -> f64 {
        let v = |a: [f32; 3]| glam::DVec3::from_array(a.map(f64::from));
        let [v0, v1, v2] = self.record.vertices().map(v);
        let normal = (v1 - v0).cross(v2 - v0);
        normal.dot(v0 - v(self.ray.origin)) / normal.dot(v(self.ray.direction))
    }

    /// Whether rounding alone can explain that the triangle was found at `t`.
    fn may_hit(&self, t: f32) -> bool {
        let triangle = self.record.triangle();
        !matches!(
            oracle::judge(&[triangle], oracle_ray(&self.ray), Some((0, t))),
            Verdict::Wrong(_)
        )
    }
}

fn describe(ray: &Ray, left: &str, a: &Hit, right: &str, b: &Hit) -> String {
    format!(
        "{} | {left} {} | {right} {}",
        ray_text(ray),
        hit_text(a),
        hit_text(b)
    )
}

/// A ray as replayable text: nine significant digits give back the same f32.
fn ray_text(ray: &Ray) -> String {
    let three = |[x, y, z]: [f32; 3]| format!("{x:?} {y:?} {z:?}");
    format!(
        "ray {} / {} / {:?} {:?}",
        three(ray.origin),
        three(ray.direction),
        ray.t_min,
        ray.t_max
    )
}

fn hit_text(hit: &Hit) -> String {
    if hit.triangle == NO_HIT {
        "misses".to_owned()
    } else {
        format!(
            "hits {} at t {:?} u {:?} v {:?}",
            hit.triangle, hit.t, hit.u, hit.v
        )
    }
}
