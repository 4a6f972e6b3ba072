//! `meta-bvh` with `loop = nested`: the traversal of an object is a loop inside that of the upper
//! level. CPU version of `kernels/accel/meta_bvh_nested.wesl`.

use super::super::ray::Hit;
use super::super::twin::Walk;
use super::instance::{descend, level, trace_object};
use super::meta_bvh::Levels;

pub(super) fn trace(levels: Levels, mut walk: Walk) -> Hit {
    let forest = &levels.base.forest;
    let world = level(&walk.ray, levels.top.growth, forest.intersection);
    let node = |index| levels.node(index);
    let enter = |reference, walk: &mut Walk| {
        trace_object(forest, levels.load_entry(reference), walk);
    };
    descend(node, levels.root(), &world, &mut walk, enter);
    walk.hit
}
