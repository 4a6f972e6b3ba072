//! Faults of grids, octrees and kd-trees.

use super::words::*;
use super::{built, equivalent, row, structure, text};
use crate::{Check, Mutant, Subject};

const GRID: Subject = structure("uniform-grid", &[]);
const SKIP: Subject = structure("uniform-grid", &[("skip", "chebyshev")]);
const TWO_LEVEL: Subject = structure("two-level-grid", &[]);
const IRREGULAR: Subject = structure("irregular-grid", &[]);
const OCTREE: Subject = structure("octree", &[]);
const KD_TREE: Subject = structure("kd-tree", &[]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "dda-exits-early",
        "the walk ends in the first cell with a hit, which may lie behind the cell",
        text(
            "accel/uniform_grid",
            "if (hit.t * BOX_PAD < leave)",
            "if (hit.triangle != NO_HIT || hit.t < leave)",
        ),
        GRID,
        Check::Lattice,
    ),
    row(
        "dda-starts-at-the-origin",
        "the walk begins at the cell next to the origin: slower, and no other answer",
        text(
            "accel/uniform_grid",
            "in_cells(ray, enter)",
            "in_cells(ray, 0.0)",
        ),
        GRID,
        Check::Work,
    ),
    row(
        "cell-list-one-short",
        "the last triangle of a cell is not tested",
        text("accel/uniform_grid", "i < end; i++", "i + 1u < end; i++"),
        GRID,
        Check::Lattice,
    ),
    row(
        "triangle-not-inserted",
        "the builder forgets one triangle",
        built(
            "references to the triangle listed most often",
            forget_a_triangle,
        ),
        GRID,
        Check::Lattice,
    ),
    row(
        "dda-steps-along-the-wrong-axis",
        "the walk leaves along y where the ray leaves along z, and the other way round",
        text(
            "accel/grid",
            "return vec3<bool>(x, y, !x && !y);",
            "return vec3<bool>(x, !x && !y, y);",
        ),
        GRID,
        Check::Lattice,
    ),
    equivalent(
        row(
            "dda-steps-diagonally",
            "where two planes are equally near the walk crosses both at once",
            text(
                "accel/grid",
                "let y = !x && next.y == leave;",
                "let y = next.y == leave;",
            ),
            GRID,
            Check::Work,
        ),
        "cells are grown by a margin before triangles are listed in them, so the corner cell that is \
         stepped over lists nothing that its neighbours do not: no answer changes, and the one node \
         less is counted on one ray in thousands",
    ),
    row(
        "skip-one-too-far",
        "empty space is thought to reach one cell farther than it does",
        text(
            "accel/uniform_grid",
            "let reach = i32(max(word >> START_BITS, 1u));",
            "let reach = i32(max(word >> START_BITS, 1u)) + 1;",
        ),
        SKIP,
        Check::Lattice,
    ),
    row(
        "jump-along-one-axis",
        "out of empty space the walk leaves along one axis only: slower, and no other answer",
        text(
            "accel/uniform_grid",
            "select(jump(ray, leave, reach, cell, forward), cell,",
            "select(cell, cell,",
        ),
        SKIP,
        Check::Work,
    ),
    row(
        "part-entered-from-the-wrong-end",
        "the next top cell is entered at its far end",
        text(
            "accel/two_level_grid",
            "select(vec3<i32>(top.parts) - 1, vec3<i32>(0), forward)",
            "select(vec3<i32>(0), vec3<i32>(top.parts) - 1, forward)",
        ),
        TWO_LEVEL,
        Check::Lattice,
    ),
    row(
        "parts-of-the-wrong-axis",
        "the numbers of parts along x and y are exchanged",
        text(
            "accel/two_level_grid",
            "vec3<u32>(0u, PART_BITS, 2u * PART_BITS)",
            "vec3<u32>(PART_BITS, 0u, 2u * PART_BITS)",
        ),
        TWO_LEVEL,
        Check::Gate,
    ),
    row(
        "box-left-too-early",
        "the walk ends in the first box with a hit",
        text(
            "accel/irregular_grid",
            "if (hit.t * BOX_PAD < leave)",
            "if (hit.triangle != NO_HIT || hit.t < leave)",
        ),
        IRREGULAR,
        Check::Lattice,
    ),
    row(
        "voxel-left-behind",
        "along the axes that it does not leave by, the walk follows the ray late: no other answer",
        text(
            "accel/irregular_grid",
            "select(within, select(",
            "select(voxel, select(",
        ),
        IRREGULAR,
        Check::Work,
    ),
    row(
        "list-ends-at-its-first",
        "only the first triangle of a list is tested",
        text(
            "accel/irregular_grid",
            "place = select(place + 1u, end, word >= LAST);",
            "place = end;",
        ),
        IRREGULAR,
        Check::Lattice,
    ),
    row(
        "merged-boxes-lose-their-lists",
        "every second box with a list is written as empty",
        built("lists of boxes", empty_boxes),
        IRREGULAR,
        Check::Lattice,
    ),
    row(
        "octree-exits-early",
        "the walk ends in the first leaf with a hit",
        text(
            "accel/octree",
            "if (enter > hit.t * END_PAD)",
            "if (hit.triangle != NO_HIT)",
        ),
        OCTREE,
        Check::Lattice,
    ),
    row(
        "octree-children-not-mirrored",
        "the children of a node are taken for those of the ray's octant",
        text(
            "accel/octree",
            "let filled = mirrored(word & FILLED_MASK, flip);",
            "let filled = word & FILLED_MASK;",
        ),
        OCTREE,
        Check::Gate,
    ),
    row(
        "octree-passes-touched-children",
        "children that the ray only touches are passed by",
        text("accel/octree", "enter <= p.x", "enter < m.x"),
        OCTREE,
        Check::Lattice,
    ),
    row(
        "octree-child-dropped",
        "the builder says that a child of the root holds nothing",
        built("the mask of the root's children", drop_an_octant),
        OCTREE,
        Check::Lattice,
    ),
    row(
        "octree-lists-one-short",
        "the builder marks the last triangle but one as the last",
        built("ends of lists", end_lists_early),
        OCTREE,
        Check::Lattice,
    ),
    row(
        "kd-exits-early",
        "the walk ends in the first leaf with a hit",
        text(
            "accel/kd_tree",
            "if (enter > hit.t * END_PAD)",
            "if (hit.triangle != NO_HIT)",
        ),
        KD_TREE,
        Check::Lattice,
    ),
    row(
        "kd-near-and-far-swapped",
        "the far side of a plane is taken for the near one",
        text(
            "accel/kd_tree",
            "let side = u32(slope < 0.0);",
            "let side = u32(slope >= 0.0);",
        ),
        KD_TREE,
        Check::Lattice,
    ),
    row(
        "kd-passes-touched-cells",
        "a cell that ends in the plane where the segment begins is passed by",
        text("accel/kd_tree", "enter > plane * BOX_PAD", "enter >= plane"),
        KD_TREE,
        Check::Lattice,
    ),
    row(
        "kd-planes-moved",
        "the builder writes planes elsewhere than it split",
        built("split planes", move_planes),
        KD_TREE,
        Check::Lattice,
    ),
];
