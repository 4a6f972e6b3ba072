//! `meta-bvh` with `loop = nested`: the traversal of an object is a loop inside that of the upper
//! level. Twin of `kernels/accel/meta_bvh_nested.wesl`.

use super::super::leaf::LEAF;
use super::super::ray::Hit;
use super::super::twin::Query;
use super::instance::{NOTHING, is_open, level, near_and_far, trace_object};
use super::meta_bvh::Built;

pub(super) fn trace(built: &Built, mut query: Query) -> Hit {
    let forest = &built.base.forest;
    let world = level(&query.ray, built.top.growth, forest.intersection);
    let mut stack = Vec::new();
    let mut current = built.root();
    loop {
        let children = near_and_far((current, built.node(current)), &world, &mut query);
        let mut next = NOTHING;
        for (enter, reference) in children {
            if !is_open(enter, &world, &query.hit) || reference == NOTHING {
                continue;
            }
            if reference >= LEAF {
                trace_object(forest, built.load_entry(reference), &mut query);
                if query.is_answered() {
                    return query.hit;
                }
            } else if next == NOTHING {
                next = reference;
            } else {
                stack.push(reference);
                query.count_stack(stack.len());
            }
        }
        if next == NOTHING {
            match stack.pop() {
                Some(reference) => next = reference,
                None => return query.hit,
            }
        }
        current = next;
    }
}
