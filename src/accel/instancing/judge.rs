//! The reference for structures that transform rays: every instance is tested, without world boxes.

use super::super::bounds::{Bounds, enter_box};
use super::super::brute_force::EveryTriangle;
use super::super::bvh::BvhParameters;
use super::super::{
    AccelError, BuildLog, BuiltAccel, BuiltBvh, Counters, CpuTwin, Hit, NO_HIT, Ray, TriangleSoup,
};
use super::instance::object_ray;
use super::placed::Placed;
use rayon::prelude::*;

/// Nearest hits by testing every triangle of every instance, in parallel over the rays.
pub fn brute_force_instances(placed: &Placed, rays: &[Ray]) -> Vec<Hit> {
    let object = |soup| EveryTriangle::new(soup, true);
    let objects: Vec<_> = placed.objects.iter().map(object).collect();
    let closest = |ray: &Ray| {
        let mut hit = Hit::miss(ray);
        if ray.is_ray() {
            for instance in &placed.instances {
                let tests = placed.objects[instance.object as usize].intersection;
                let local = object_ray(instance, &tests.raised(ray));
                objects[instance.object as usize].intersect(&local, instance.first, &mut hit);
            }
        }
        hit
    };
    rays.par_iter().map(closest).collect()
}

/// The same answers, faster: the scalar plain BVH of every object, for one instance after the
/// other. It uses no world box, so it can check those of the structures.
pub struct InstanceReference<'a> {
    placed: &'a Placed,
    objects: Vec<(Bounds, BuiltBvh)>,
}

impl<'a> InstanceReference<'a> {
    /// Builds and validates the BVH of each object, all parameters at their defaults.
    ///
    /// # Errors
    /// An object has too many triangles for a BVH.
    pub fn new(placed: &'a Placed) -> Result<Self, AccelError> {
        let build = |object: &TriangleSoup| {
            let built =
                BuiltBvh::build(object, &BvhParameters::default(), &mut BuildLog::default())?;
            built.validate(object)?;
            Ok::<_, AccelError>((object.bounds(), built))
        };
        Ok(Self {
            placed,
            objects: placed.objects.iter().map(build).collect::<Result<_, _>>()?,
        })
    }
}

impl CpuTwin for InstanceReference<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        let mut best = Hit::miss(ray);
        for instance in &self.placed.instances {
            let object = &self.placed.objects[instance.object as usize];
            let tests = object.intersection;
            let mut local = tests.raised(&object_ray(instance, &tests.raised(ray)));
            // Include hits at the same distance: the triangle may have the lower index.
            local.t_max = best.t;
            let (bounds, built) = &self.objects[instance.object as usize];
            let inverse = tests.inverse(local.direction);
            if enter_box(bounds, &local, *inverse, inverse.pad, best.t).is_none() {
                continue;
            }
            let hit = built.twin(object).closest_hit(&local, counters);
            if hit.triangle == NO_HIT {
                continue;
            }
            let triangle = hit.triangle + instance.first;
            if hit.t < best.t || triangle < best.triangle {
                best = Hit { triangle, ..hit };
            }
        }
        best
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.closest_hit(ray, counters).triangle != NO_HIT
    }
}
