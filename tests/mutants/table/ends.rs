//! Faults that show only at the ends of intervals: of rays, of lists, of stacks.

use super::{row, structure, text};
use crate::{Check, Mutant, Subject};

const BRUTE: Subject = structure("brute-force", &[]);
const BVH: Subject = structure("bvh", &[]);
const ROPED: Subject = structure("roped-bvh", &[]);
const WIDE4: Subject = structure("bvh4", &[]);
const WIDE8: Subject = structure("cwbvh", &[]);
const UNIFORM: Subject = structure("uniform-grid", &[]);
const OCTREE: Subject = structure("octree", &[]);
const KD: Subject = structure("kd-tree", &[]);
const NESTED: Subject = structure("meta-bvh", &[("loop", "nested")]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "segment-start-excluded",
        "a hit exactly at t_min is none",
        text("accel/triangle", "t >= ray.t_min", "t > ray.t_min"),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "segment-starts-at-the-origin",
        "hits before t_min count",
        text("accel/triangle", "t >= ray.t_min", "t >= 0.0"),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "box-ends-before-t-min",
        "a box that is left just behind t_min is missed",
        text(
            "accel/bounds",
            "let enter = max(span.x, t_min);",
            "let enter = max(span.x, t_min * 1.00001);",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "box-begins-behind-t-max",
        "a box that is entered just before the end is missed",
        text(
            "accel/bounds",
            "min(span.y, t_best) * BOX_PAD",
            "min(span.y, t_best * 0.99999) * BOX_PAD",
        ),
        ROPED,
        Check::Lattice,
    ),
    row(
        "wide-box-without-pad",
        "quantised boxes are left without a pad",
        text(
            "accel/wide",
            "vec4<f32>(t_best)) * BOX_PAD;",
            "vec4<f32>(t_best)) * 0.99999;",
        ),
        WIDE8,
        Check::Lattice,
    ),
    row(
        "wide-boxes-end-before-t-max",
        "a quantised box that is entered just before the end is missed",
        text(
            "accel/wide",
            "vec4<f32>(t_best)) * BOX_PAD;",
            "vec4<f32>(t_best * 0.99999)) * BOX_PAD;",
        ),
        WIDE4,
        Check::Lattice,
    ),
    row(
        "any-hit-beyond-the-end",
        "a shadow ray is blocked by what lies behind its end",
        text(
            "accel/query",
            "return trace(raised(ray), true).triangle != NO_HIT;",
            "return trace(raised(ray), true).triangle != NO_HIT || ray.t_max < ray.t_min;",
        ),
        BRUTE,
        Check::Lattice,
    ),
    row(
        "any-hit-misses-a-point",
        "a shadow ray whose ends are equal is free",
        text(
            "accel/query",
            "return trace(raised(ray), true).triangle != NO_HIT;",
            "return ray.t_min != ray.t_max && trace(raised(ray), true).triangle != NO_HIT;",
        ),
        KD,
        Check::Lattice,
    ),
    row(
        "any-hit-misses-what-begins-late",
        "a shadow ray that does not begin at its origin stops at the first box",
        text(
            "accel/query",
            "return trace(raised(ray), true).triangle != NO_HIT;",
            "return trace(raised(ray), true).triangle != NO_HIT && (ray.t_min == 0.0 || ray.t_max < 1e29);",
        ),
        OCTREE,
        Check::Lattice,
    ),
    row(
        "any-hit-culls-the-far-child",
        "a shadow ray never goes to far children",
        text(
            "accel/bvh/pairs",
            "&& !(any && (*hit).triangle != NO_HIT)) {",
            "&& !any) {",
        ),
        BVH,
        Check::Lattice,
    ),
    row(
        "any-hit-of-an-object-culls-the-far-child",
        "a shadow ray never goes to far children inside an object",
        text(
            "accel/instance",
            "&& !(any && (*hit).triangle != NO_HIT)) {",
            "&& !any) {",
        ),
        NESTED,
        Check::Lattice,
    ),
    row(
        "grid-entered-at-t-min-only",
        "the walk begins where the segment begins, wherever the grid lies",
        text(
            "accel/uniform_grid",
            "clamped(in_cells(ray, enter), grid.resolution)",
            "clamped(in_cells(ray, ray.t_min), grid.resolution)",
        ),
        UNIFORM,
        Check::Work,
    ),
    row(
        "kd-exit-forgets-the-end",
        "a cell that ends where the one waiting begins is thought to end before",
        text(
            "accel/kd_tree",
            "exit = min(exit, plane);",
            "exit = min(exit, plane * 0.99999);",
        ),
        KD,
        Check::Lattice,
    ),
    row(
        "kd-tree-entered-late",
        "a ray is thought to enter the tree a little farther along",
        text(
            "accel/kd_tree",
            "var enter = max(span.x, ray.t_min);",
            "var enter = max(span.x, ray.t_min) * 1.00001;",
        ),
        KD,
        Check::Lattice,
    ),
    row(
        "kd-cell-entered-late",
        "a cell that waits is thought to begin a little farther along",
        text(
            "accel/kd_tree",
            "distances[entries] = max(enter, plane);",
            "distances[entries] = max(enter, plane) * 1.000002;",
        ),
        KD,
        Check::Lattice,
    ),
    row(
        "kd-ends-too-early",
        "waiting cells that begin just before the hit are dropped",
        text(
            "accel/kd_tree",
            "if (enter > hit.t * END_PAD) {",
            "if (enter > hit.t * 0.9999) {",
        ),
        KD,
        Check::Lattice,
    ),
    row(
        "octree-ends-too-early",
        "cells that begin just before the hit are dropped",
        text(
            "accel/octree",
            "if (enter > hit.t * END_PAD) {",
            "if (enter > hit.t * 0.9999) {",
        ),
        OCTREE,
        Check::Lattice,
    ),
];
