//! `meta-bvh` with `loop = nested`: the traversal of an object is a loop inside that of the upper
//! level. Twin of `kernels/accel/meta_bvh_nested.wesl`.

use super::super::leaf::LEAF;
use super::super::ray::{Hit, NO_HIT, Ray};
use super::super::{Counters, CpuTwin};
use super::instance::{NOTHING, is_open, level, near_and_far, trace_object};
use super::meta_bvh::MetaBvhTwin;

pub(super) struct NestedTwin<'a>(pub &'a MetaBvhTwin);

impl NestedTwin<'_> {
    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let built = self.0;
        let forest = &built.base.forest;
        let ray = &forest.intersection.raised(ray);
        let world = level(ray, built.top.growth, forest.intersection);
        let mut hit = Hit::miss(ray);
        let mut stack = Vec::new();
        let mut current = built.root();
        loop {
            let children = near_and_far((current, built.node(current)), &world, hit.t, counters);
            let mut next = NOTHING;
            for (enter, reference) in children {
                if !is_open(enter, &world, &hit) || reference == NOTHING {
                    continue;
                }
                if reference >= LEAF {
                    let entry = built.load_entry(reference);
                    trace_object(forest, entry, ray, any, &mut hit, counters);
                    if any && hit.triangle != NO_HIT {
                        return hit;
                    }
                } else if next == NOTHING {
                    next = reference;
                } else {
                    stack.push(reference);
                    counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
                }
            }
            if next == NOTHING {
                match stack.pop() {
                    Some(reference) => next = reference,
                    None => return hit,
                }
            }
            current = next;
        }
    }
}

impl CpuTwin for NestedTwin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
    }
}
