//! Faults of compressed wide BVHs.

use super::words::*;
use super::{built, row, structure, text};
use crate::{Check, Mutant, Subject};

const BVH4: Subject = structure("bvh4", &[]);
const CWBVH: Subject = structure("cwbvh", &[]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "quantised-planes-moved-inwards",
        "the slack of quantised planes makes boxes smaller",
        text(
            "accel/wide",
            "base - slack, base + slack",
            "base + slack, base - slack",
        ),
        BVH4,
        Check::Lattice,
    ),
    row(
        "quantisation-rounded-inwards-4",
        "the builder rounds the planes at the maximum of x down",
        built("planes at the maximum of x", round_maxima_down),
        BVH4,
        Check::Lattice,
    ),
    row(
        "quantisation-rounded-inwards-8",
        "the builder rounds the planes at the minimum of x up",
        built("planes at the minimum of x", round_minima_up),
        CWBVH,
        Check::Lattice,
    ),
    row(
        "sorting-network-loses-a-child",
        "of four sorted children the second comes twice and the third never",
        text(
            "accel/bvh4",
            "max(second, third), max(high.x, high.y)",
            "min(second, third), max(high.x, high.y)",
        ),
        BVH4,
        Check::Lattice,
    ),
    row(
        "child-culled-before-the-hit",
        "children that begin in the last tenth before the hit are dropped",
        text("accel/bvh4", "> hit.t * BOX_PAD", "> hit.t * 0.9"),
        BVH4,
        Check::Lattice,
    ),
    row(
        "stacked-distance-rounded-up",
        "a distance is rounded up where the stack keeps fewer bits of it",
        text(
            "accel/bvh4",
            "(next_nearest & STACKED_MASK) | rest",
            "((next_nearest + 256u) & STACKED_MASK) | rest",
        ),
        BVH4,
        Check::Lattice,
    ),
    row(
        "leaf-of-the-wrong-slot",
        "the triangles of slots before a leaf are not counted",
        text(
            "accel/bvh4",
            "sum_of_pairs(counts & ((1u << shift) - 1u))",
            "sum_of_pairs(counts & ((1u << shift) - 2u))",
        ),
        BVH4,
        Check::Lattice,
    ),
    row(
        "waiting-children-dropped",
        "children that must wait are not kept",
        text("accel/cwbvh", "entries += select(0u, 1u, left != 0u);", ""),
        CWBVH,
        Check::Lattice,
    ),
    row(
        "wrong-octant-in-the-group",
        "children are listed in the order of octant 0 and visited in that of the ray",
        text(
            "accel/cwbvh",
            "permute(slots & inner, octant)",
            "permute(slots & inner, 0u)",
        ),
        CWBVH,
        Check::Lattice,
    ),
    row(
        "octant-order-reversed",
        "children are visited in the order of the opposite octant: slower, and no other answer",
        text(
            "accel/cwbvh",
            "(*at).octant = select(0u, 1u, backward.x) | select(0u, 2u, backward.y) | select(0u, 4u, backward.z);",
            "(*at).octant = 7u ^ (select(0u, 1u, backward.x) | select(0u, 2u, backward.y) | select(0u, 4u, backward.z));",
        ),
        CWBVH,
        Check::Work,
    ),
    row(
        "leaf-of-one",
        "only the first triangle of a leaf is tested",
        text(
            "accel/cwbvh",
            "((triangles >> COUNT_SHIFT) & 3u)",
            "min((triangles >> COUNT_SHIFT) & 3u, 1u)",
        ),
        CWBVH,
        Check::Lattice,
    ),
];
