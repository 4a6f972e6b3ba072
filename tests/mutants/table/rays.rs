//! Faults of the tree over rays.

use super::{built, row, structure, text};
use crate::{Check, Mutant, Subject};
use raystone::accel::GpuBuffers;

const RAYS: Subject = structure("ray-hierarchy", &[]);
const BOXES: Subject = structure("ray-hierarchy", &[("bound", "box")]);
const PAIRS: Subject = structure("ray-hierarchy", &[("union", "pairwise")]);
const WIDE: Subject = structure(
    "ray-hierarchy",
    &[("branching", "64"), ("capacity", "16384")],
);
const APART: Subject = structure("ray-hierarchy", &[("fused", "false")]);
const BUNDLES: Subject = structure("ray-hierarchy", &[("bundle", "4"), ("cluster", "6")]);
const SORTED: Subject = structure("ray-hierarchy", &[("order", "morton")]);
const PARTS: Subject = structure("ray-hierarchy", &[("chunks", "3")]);
const CHOSEN: Subject = structure("ray-hierarchy", &[("start", "0")]);
const BOTH: Subject = structure("ray-hierarchy", &[("dual", "2")]);
const BOTH_WALKED: Subject = structure(
    "ray-hierarchy",
    &[("dual", "2"), ("branching", "8"), ("capacity", "16384")],
);

/// Balls of half their radius.
fn shrink_balls(buffers: &mut GpuBuffers) -> usize {
    let limits = buffers.uniforms.iter().find(|(name, _)| *name == "limits");
    let count = limits.and_then(|(_, values)| values.words("elements"));
    let count = count.map_or(0, |words| words[0] as usize);
    let words = buffers.arrays[0].words.to_mut();
    for ball in words.chunks_exact_mut(12).take(count) {
        ball[3] = (0.5 * f32::from_bits(ball[3])).to_bits();
    }
    count
}

pub const MUTANTS: &[Mutant] = &[
    row(
        "ray-balls-too-small",
        "balls around triangles have half their radius",
        built("radii of balls", shrink_balls),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-pair-forgets-the-second",
        "of two children the first comes twice",
        text(
            "accel/ray_hierarchy/enclosing",
            "pair((*children)[k], (*children)[k + apart])",
            "pair((*children)[k], (*children)[k])",
        ),
        PAIRS,
        Check::Lattice,
    ),
    row(
        "ray-wide-cone-refuses",
        "a cone beyond a right angle meets nothing, as the printed test says",
        text(
            "accel/ray_hierarchy/node",
            "let side = across * node.cosine - along * node.sine;",
            "let side = across * node.cosine - along * node.sine; if (node.cosine < 0.0) { return false; }",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-cone-without-its-ball",
        "the ball of a node is not added to that of a primitive",
        text(
            "accel/ray_hierarchy/node",
            "let reached = radius + node.radius;",
            "let reached = radius;",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-behind-the-apex",
        "a primitive around the origins is missed",
        text(
            "accel/ray_hierarchy/node",
            "{ return distance <= reached + slack; }",
            "{ return false; }",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-reach-from-the-centre",
        "the end of a ray is measured to the middle of a primitive",
        text(
            "accel/ray_hierarchy/node",
            "distance - reached > node.reach + slack",
            "distance > node.reach",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-reach-without-length",
        "the end of a ray is measured in lengths of its direction",
        text(
            "accel/ray_hierarchy/node",
            "* longest * length * (1.0 + bounding.inflation)",
            "* (1.0 + bounding.inflation)",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-slab-of-the-axis",
        "the slabs of a box know the axis of a cone alone",
        text(
            "accel/ray_hierarchy/node",
            "select(d * node.cosine + aside[a], 1.0, d >= node.cosine)",
            "d",
        ),
        BOXES,
        Check::Lattice,
    ),
    row(
        "ray-slab-leaves-early",
        "a ray leaves a slab as if it were the fastest",
        text(
            "accel/ray_hierarchy/node",
            "leave = min(leave, far[a] / least);",
            "leave = min(leave, far[a] / most);",
        ),
        BOXES,
        Check::Lattice,
    ),
    row(
        "ray-last-child-not-tested",
        "the last node of a level is never met",
        text(
            "accel/ray_hierarchy/passes/expand",
            "if (child.x >= below) {",
            "if (child.x + 1u >= below) {",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-children-of-one-word",
        "the bits of children beyond the thirty-second are those of the first",
        text(
            "accel/ray_hierarchy/passes/expand",
            "met[k / 32u] |=",
            "met[0u] |=",
        ),
        WIDE,
        Check::Lattice,
    ),
    row(
        "ray-pairs-without-room-dropped",
        "pairs whose children have no room are lost",
        text(
            "accel/ray_hierarchy/passes/expand",
            "walk(pair.x, pair.y);",
            "",
        ),
        WIDE,
        Check::Lattice,
    ),
    row(
        "ray-walk-ends-early",
        "a walk ends below the second child",
        text(
            "accel/ray_hierarchy/tree",
            "if (level == tree.level) {",
            "if (level + 1u >= tree.level) {",
        ),
        WIDE,
        Check::Gate,
    ),
    row(
        "ray-last-workgroup-missing",
        "pairs of a workgroup that is not full are left out",
        text(
            "accel/ray_hierarchy/passes/plan",
            "(count + LANES - 1u) / LANES",
            "count / LANES",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-candidates-counted-short",
        "the compaction sees all children but one of each pair",
        text(
            "accel/ray_hierarchy/passes/plan",
            "min(count, tree.expands) * CHILDREN",
            "min(count, tree.expands) * (CHILDREN - 1u)",
        ),
        APART,
        Check::Lattice,
    ),
    row(
        "ray-flag-of-the-next-child",
        "a child stays where its neighbour is met",
        text(
            "accel/ray_hierarchy/passes/expand",
            "flags[at * CHILDREN + k] =",
            "flags[at * CHILDREN + (k ^ 1u)] =",
        ),
        APART,
        Check::Lattice,
    ),
    row(
        "ray-last-offer-wins",
        "the last triangle that is hit stays, not the nearest",
        text(
            "accel/found",
            "load_triangle(found), ray, inverse, &hit",
            "load_triangle(triangle), ray, inverse, &hit",
        ),
        RAYS,
        Check::Lattice,
    ),
    row(
        "ray-bundle-of-one",
        "only the first ray of a bundle is tested",
        text(
            "accel/ray_hierarchy/tree",
            "min((bundle + 1u) * BUNDLE, tree.rays)",
            "min(bundle * BUNDLE + 1u, tree.rays)",
        ),
        BUNDLES,
        Check::Lattice,
    ),
    row(
        "ray-cluster-one-short",
        "the last triangle of a cluster is not tested",
        text(
            "accel/ray_hierarchy/tree",
            "index < end; index++",
            "index + 1u < end; index++",
        ),
        BUNDLES,
        Check::Lattice,
    ),
    row(
        "ray-answers-out-of-order",
        "answers of sorted rays stay where they were sorted to",
        text(
            "accel/ray_hierarchy/passes/answers",
            "item = ray_places[place];",
            "item = place;",
        ),
        SORTED,
        Check::Lattice,
    ),
    row(
        "ray-first-part-only",
        "every part of the primitives is the first",
        text(
            "accel/ray_hierarchy/passes/begin",
            "part.first + item / nodes",
            "item / nodes",
        ),
        PARTS,
        Check::Lattice,
    ),
    row(
        "ray-no-level-begins",
        "no level gets the workgroups to begin a descent whose level is chosen",
        text(
            "accel/ray_hierarchy/passes/choose",
            "place == best",
            "false",
        ),
        CHOSEN,
        Check::Lattice,
    ),
    row(
        "ray-shortened-too-far",
        "rays end half way to their nearest hit",
        text(
            "accel/ray_hierarchy/passes/leaves",
            "nearest(place, ray).t",
            "0.5 * nearest(place, ray).t",
        ),
        PARTS,
        Check::Lattice,
    ),
    row(
        "ray-last-primitive-below",
        "the last primitive of a level is no child",
        text(
            "accel/ray_hierarchy/passes/expand",
            "child.y - tree.primitive_below >= tree.many_below",
            "child.y - tree.primitive_below + 1u >= tree.many_below",
        ),
        BOTH,
        Check::Lattice,
    ),
    row(
        "ray-children-of-one-side",
        "a pair that is divided on both sides has the first child of its primitive only",
        text(
            "accel/ray_hierarchy/tree",
            "<< BRANCHING_BITS) + (k >> BRANCHING_BITS);",
            "<< BRANCHING_BITS);",
        ),
        BOTH,
        Check::Lattice,
    ),
    row(
        "ray-walk-of-one-primitive",
        "a pair of inner nodes that has no room is answered by its first primitive",
        text(
            "accel/ray_hierarchy/tree",
            "first + (1u << bits)",
            "first + 1u",
        ),
        BOTH_WALKED,
        Check::Lattice,
    ),
    row(
        "ray-longest-stream-one-more",
        "the longest stream has one pair more than it had: no other answer",
        text(
            "accel/ray_hierarchy/passes/plan",
            "atomicMax(&state[at + 2u], count);",
            "atomicMax(&state[at + 2u], count + 1u);",
        ),
        RAYS,
        Check::Work,
    ),
    row(
        "ray-pairs-one-less",
        "of each stream one pair is not counted: no other answer",
        text(
            "accel/ray_hierarchy/passes/plan",
            "atomicAdd(&state[at + 1u], count);",
            "atomicAdd(&state[at + 1u], count - min(count, 1u));",
        ),
        RAYS,
        Check::Work,
    ),
    row(
        "ray-curve-of-other-axes",
        "rays are sorted along a curve with x and z exchanged: no other answer",
        text(
            "accel/ray_hierarchy/passes/keys",
            "(interleave(cell) << 9u)",
            "(interleave(cell.zyx) << 9u)",
        ),
        SORTED,
        Check::Work,
    ),
];
