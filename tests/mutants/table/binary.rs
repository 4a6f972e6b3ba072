//! Faults of the triangle test, boxes, and binary BVHs.

use super::words::*;
use super::{built, row, structure, text, texts};
use crate::{Check, Mutant, Subject};

const BRUTE: Subject = structure("brute-force", &[]);
const BVH: Subject = structure("bvh", &[]);
const BOXES: Subject = structure("bvh", &[("node_bytes", "32")]);
const PARENT: Subject = structure("bvh", &[("traversal", "parent-pointer")]);
const SHORT: Subject = structure(
    "bvh",
    &[("traversal", "short-stack"), ("short_stack_entries", "2")],
);
const ROPED: Subject = structure("roped-bvh", &[]);
const OCTANTS: Subject = structure("bvh", &[("traversal", "octant-roped")]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "distance-not-compared",
        "the last triangle that is hit wins, not the nearest",
        text(
            "accel/triangle",
            "t < (*hit).t || (t == (*hit).t && triangle.v0.w < (*hit).triangle)",
            "true",
        ),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "tie-broken-the-other-way",
        "of equally near triangles the highest index wins",
        text(
            "accel/triangle",
            "triangle.v0.w < (*hit).triangle",
            "(triangle.v0.w > (*hit).triangle || (*hit).triangle == 0xffffffffu)",
        ),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "segment-end-excluded",
        "a hit exactly at t_max is none",
        text("accel/triangle", "t <= ray.t_max", "t < ray.t_max"),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "box-not-padded",
        "the slab test has no pad",
        text(
            "accel/bounds",
            "enter <= min(span.y, t_best) * BOX_PAD",
            "enter <= min(span.y, t_best) * 0.999999",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "box-touched-is-missed",
        "a box that the ray touches at one distance is missed",
        text(
            "accel/bounds",
            "enter <= min(span.y, t_best) * BOX_PAD",
            "enter < min(span.y, t_best)",
        ),
        ROPED,
        Check::Lattice,
    ),
    row(
        "zero-direction-without-reciprocal",
        "the reciprocal of a direction of 0 is 0",
        text(
            "accel/bvh/stack",
            "let inverse = 1.0 / ray.direction;",
            "let inverse = select(1.0 / ray.direction, vec3<f32>(0.0), abs(ray.direction) < vec3<f32>(1e-15));",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "edges-see-another-direction",
        "directions are raised for slabs, not for edges",
        text(
            "accel/bvh/stack",
            "visit(*current, ray, inverse",
            "visit(*current, Ray(ray.origin, ray.t_min, select(ray.direction, vec3<f32>(0.0), abs(ray.direction) < vec3<f32>(1e-15)), ray.t_max), inverse",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "last-triangle-forgotten",
        "the loop over all triangles ends one short",
        texts(
            "accel/brute_force",
            "i < limits.elements",
            "i + 1u < limits.elements",
            1,
        ),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "leaf-one-short",
        "a leaf's last triangle is not tested",
        text("accel/leaf", "place < end;", "place + 1u < end;"),
        BVH,
        Check::Lattice,
    ),
    row(
        "leaf-off-by-one",
        "a leaf begins at its second triangle and ends one behind its last",
        text(
            "accel/leaf",
            "intersect_triangle(load_leaf_triangle(place), ray",
            "intersect_triangle(load_leaf_triangle(place + 1u), ray",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "leaf-references-one-short",
        "the builder writes leaves one triangle short",
        built("leaf references of pairs of boxes", shorten_leaves),
        BVH,
        Check::Lattice,
    ),
    row(
        "far-child-dropped",
        "the far child is not pushed",
        text("accel/bvh/stack", "push(stack, inner.second);", ""),
        BVH,
        Check::Lattice,
    ),
    row(
        "child-dropped-by-the-builder",
        "the root's second child is missing",
        built("the root's second child", drop_second_child),
        BVH,
        Check::Lattice,
    ),
    row(
        "near-and-far-swapped",
        "the far child is taken for the near one, and the near one culled as the far one",
        texts(
            "accel/bvh/pairs",
            "let swap = right < left;",
            "let swap = left < right;",
            2,
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "near-and-far-swapped-in-order-only",
        "the far child is visited first: slower, and no other answer",
        text(
            "accel/bvh/boxes",
            "return u32(along < 0.0);",
            "return u32(along >= 0.0);",
        ),
        BOXES,
        Check::Work,
    ),
    row(
        "far-child-culled-at-a-tie",
        "the far child is culled if it begins where the hit is",
        text(
            "accel/bvh/pairs",
            "far_enter <= (*hit).t * BOX_PAD",
            "far_enter < (*hit).t",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "stack-of-one",
        "the stack is too small",
        built("STACK_ENTRIES", stack_of_one),
        BVH,
        Check::Lattice,
    ),
    row(
        "pop-returns-the-oldest",
        "the stack hands out what was pushed first",
        text(
            "accel/stack",
            "@if(!stack_private && !stack_workgroup && !refill) return (*stack).entries[place];",
            "@if(!stack_private && !stack_workgroup && !refill) return (*stack).entries[0];",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "any-hit-not-at-the-end",
        "a shadow ray that ends exactly on a triangle is free",
        text(
            "accel/query",
            "trace(raised(ray), true).triangle != NO_HIT",
            "trace(raised(ray), true).t < ray.t_max",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "any-hit-inverted",
        "occluded rays are free and free ones occluded",
        text(
            "accel/query",
            "trace(raised(ray), true).triangle != NO_HIT",
            "trace(raised(ray), true).triangle == NO_HIT",
        ),
        ROPED,
        Check::Lattice,
    ),
    row(
        "any-hit-goes-on",
        "a shadow ray looks for the nearest hit: slower, and no other answer",
        text(
            "accel/query",
            "return trace(raised(ray), true)",
            "return trace(raised(ray), false)",
        ),
        BVH,
        Check::Work,
    ),
    row(
        "far-child-from-the-wrong-side",
        "on the way up the near child is taken for done when the far one is",
        text(
            "accel/bvh/pairs",
            "select(NONE, far, done == near && far < LEAF && entered)",
            "select(NONE, far, done == far && far < LEAF && entered)",
        ),
        PARENT,
        Check::Lattice,
    ),
    row(
        "no-way-up-to-the-far-child",
        "on the way up the far child is culled if it begins where the hit is",
        text(
            "accel/bvh/pairs",
            "far_enter <= t_best * BOX_PAD",
            "far_enter < t_best",
        ),
        PARENT,
        Check::Lattice,
    ),
    row(
        "trail-not-turned",
        "a restart leads to the child that is done",
        text("accel/bvh/short_stack", "        trail.side ^= bit;\n", ""),
        SHORT,
        Check::Lattice,
    ),
    row(
        "trail-never-done",
        "the trail goes on to say that a child is to be visited",
        text(
            "accel/bvh/short_stack",
            "        trail.pending ^= bit;\n",
            "",
        ),
        SHORT,
        Check::Lattice,
    ),
    row(
        "ring-forgets-that-it-forgot",
        "a short stack believes to hold what was overwritten",
        text(
            "accel/stack",
            "min((*stack).held + 1u, STACK_ENTRIES)",
            "(*stack).held + 1u",
        ),
        SHORT,
        Check::Lattice,
    ),
    row(
        "leaf-ends-the-walk",
        "behind the first leaf there is no rope",
        text(
            "accel/bvh/roped",
            "let rope = high.w;",
            "let rope = select(NONE, high.w, enter == MISSED || low.w < LEAF);",
        ),
        ROPED,
        Check::Lattice,
    ),
    row(
        "rope-reversed",
        "one rope leads back to where it came from",
        built("a rope of a leaf", reverse_a_rope),
        ROPED,
        Check::Lattice,
    ),
    row(
        "rope-too-long",
        "the ropes of first children skip the second",
        built("ropes of first children", lengthen_ropes),
        ROPED,
        Check::Lattice,
    ),
    row(
        "wrong-octant-rope",
        "the rope of another octant is followed",
        text("accel/bvh/octant_roped", "[octant & 3u]", "[octant & 1u]"),
        OCTANTS,
        Check::Lattice,
    ),
    row(
        "octant-of-the-wrong-axis",
        "y and z are exchanged in the octant: boxes come in another order, with ropes to match",
        text(
            "accel/bvh/octant_roped",
            "(down.y << 1u) | (down.z << 2u)",
            "(down.z << 1u) | (down.y << 2u)",
        ),
        OCTANTS,
        Check::Work,
    ),
];
