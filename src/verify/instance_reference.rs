//! The reference for structures that transform rays to object space. Its answers come from brute
//! force over the same instances with the same transforms and records, so hits must be
//! bit-identical here too. Flat triangles in world space round differently and are the reference
//! for flat structures only.

use crate::gate::{Meeting, ReferenceTracer};
use crate::holes::SceneHoles;
use crate::rays::RaySet;
use glam::DVec3;
use raystone_accel::oracle::{self, Holes, Surfaces, Verdict};
use raystone_accel::{
    AccelError, Hit, InstanceReference, Placed, Ray, TriangleSoup, brute_force_instances,
};
use raystone_config::Gate;
use raystone_core::geometry::Triangle;
use raystone_record::RayClass;
use raystone_scene::{Instance, SceneData};

/// Oracle answers held at a time, one per ray and instance.
const ORACLE_QUESTIONS: usize = 1_000_000;

/// The unchecked reference for the same rays in object space; `None` if no ray is transformed.
///
/// # Errors
/// An object has too many triangles for a BVH.
pub(super) fn new(
    soup: &TriangleSoup,
    sets: &[RaySet],
    seed: u64,
) -> Result<Option<ReferenceTracer>, AccelError> {
    let placed = soup.placed.as_ref();
    let Some(placed) = placed.filter(|p| !p.instances.iter().all(Instance::is_identity)) else {
        return Ok(None);
    };
    let twin = InstanceReference::new(placed)?;
    // The intervals of hard rays end at this reference's hits.
    let of_class = |set: &RaySet| match set.class {
        RayClass::Hard => RaySet::hard(soup, &twin, seed),
        _ => set.judged_by(&twin),
    };
    Ok(Some(ReferenceTracer::of_sets(
        sets.iter().map(of_class).collect(),
    )))
}

/// Compares this reference with brute force and the oracle.
pub(super) fn check(
    reference: &mut ReferenceTracer,
    (scene, placed): (&SceneData, &Placed),
    settings: &Gate,
) {
    let triangles = scene.triangles.len();
    reference.check_brute_force(settings.brute_force_tests, triangles, |rays| {
        brute_force_instances(placed, rays)
    });
    let at_once = (ORACLE_QUESTIONS / placed.instances.len()).max(64);
    let mut pairs = reference.subset((settings.oracle_rays as usize).min(at_once));
    pairs.extend(reference.hard().take(at_once));
    let verdicts = oracle_verdicts((scene, placed), &pairs);
    reference.note_oracle(&pairs, verdicts);
}

/// The oracle's verdict on each answer. Every instance is tested with the ray in its object space:
/// the hit one for a correct hit, the others for a free path to it.
fn oracle_verdicts((scene, placed): (&SceneData, &Placed), pairs: &[(Ray, Hit)]) -> Vec<Verdict> {
    let mut verdicts = vec![Verdict::Agrees; pairs.len()];
    for (index, object) in placed.objects.iter().enumerate() {
        let of_object = |i: &&Instance| i.object as usize == index;
        let mut questions = Vec::new();
        let mut asked = Vec::new();
        for instance in placed.instances.iter().filter(of_object) {
            let ids = instance.first..instance.first + object.records.len() as u32;
            for (pair, (ray, hit)) in pairs.iter().enumerate() {
                let tests = object.intersection;
                let local = placed.object_ray(instance, &tests.raised(ray));
                let local = tests.raised(&local);
                questions.push(if ids.contains(&hit.triangle) {
                    (local, Some((hit.triangle - instance.first, hit.t)))
                } else {
                    (local.between(local.t_min, hit.t), None)
                });
                asked.push(pair);
            }
        }
        let records = object.records.iter();
        let triangles: Vec<Triangle> = records.map(|record| record.triangle()).collect();
        // All copies of an object have the same holes.
        let first = placed.instances.iter().find(of_object).map(|i| i.first);
        let holes = SceneHoles::of(scene).map(|holes| holes.of_copy(first.unwrap_or(0)));
        let surfaces = Surfaces {
            triangles: &triangles,
            holes: holes.as_ref().map(|holes| holes as &dyn Holes),
        };
        let answers = oracle::judge_closest_hits(surfaces, &questions);
        for (pair, answer) in asked.into_iter().zip(answers) {
            match (&verdicts[pair], &answer) {
                (Verdict::Wrong(_), _) | (_, Verdict::Agrees) => {}
                _ => verdicts[pair] = answer,
            }
        }
    }
    verdicts
}

/// The intersection of a ray with triangle `id` of the scene, in object space.
pub(super) fn meeting(placed: &Placed, ray: &Ray, id: u32, t: f32) -> Option<Meeting> {
    let (instance, record) = placed.locate(id)?;
    Some(Meeting {
        ray: placed.object_ray(instance, ray),
        record: *record,
        transform_error: transform_error(instance, record, ray, f64::from(t)),
    })
}

/// First-order change of the distance to a triangle's plane from rounding the transformed ray: t =
/// n·(v0 − o′) / n·d′, where o′ and d′ are sums of four and three products.
fn transform_error(
    instance: &Instance,
    record: &raystone_accel::triangle::TriangleRecord,
    ray: &Ray,
    t: f64,
) -> f64 {
    if instance.is_identity() {
        return 0.0;
    }
    let wide = |v: [f32; 3]| DVec3::from_array(v.map(f64::from));
    let (linear, offset) = instance.to_object.parts();
    let sizes = glam::DMat3::from_cols(
        linear.x_axis.abs(),
        linear.y_axis.abs(),
        linear.z_axis.abs(),
    );
    let unit = 0.5 * f64::from(f32::EPSILON);
    let origin_error = 4.0 * unit * (sizes * wide(ray.origin).abs() + offset.abs());
    let direction_error = 3.0 * unit * (sizes * wide(ray.direction).abs());
    let [e, f] = record.edges().map(DVec3::from_array);
    let normal = e.cross(f);
    let moved = normal.abs().dot(origin_error + t.abs() * direction_error);
    moved / normal.dot(linear * wide(ray.direction)).abs()
}
