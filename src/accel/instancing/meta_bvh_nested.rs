//! `meta-bvh` with `loop = nested`: the traversal of an object is a loop inside that of the upper
//! level. Twin of `kernels/accel/meta_bvh_nested.wesl`.

use super::super::ray::Hit;
use super::super::twin::Query;
use super::instance::{level, trace_object, walk};
use super::meta_bvh::Built;

pub(super) fn trace(built: &Built, mut query: Query) -> Hit {
    let forest = &built.base.forest;
    let world = level(&query.ray, built.top.growth, forest.intersection);
    let node = |index| built.node(index);
    walk(
        node,
        built.root(),
        &world,
        &mut query,
        |reference, query| {
            trace_object(forest, built.load_entry(reference), query);
        },
    );
    query.hit
}
