//! Faults of the division of triangles and rays.

use super::{row, structure, text};
use crate::{Check, Mutant, Subject};

const WHOLE: Subject = structure("divide-and-conquer", &[("naive", "2")]);
const SHORT: Subject = structure(
    "divide-and-conquer",
    &[("naive", "1"), ("capacity", "16384")],
);
const SHALLOW: Subject = structure("divide-and-conquer", &[("naive", "1"), ("levels", "3")]);

pub const MUTANTS: &[Mutant] = &[
    row(
        "divide-last-triangle-not-tested",
        "the last triangle of a problem is not tested",
        text(
            "accel/divide_and_conquer/passes/answer",
            "slot < end",
            "slot + 1u < end",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-first-slot-of-a-second-part",
        "the slots of a second part begin where they end",
        text(
            "accel/divide_and_conquer/problem",
            "edge - problem_word(problem, TRIANGLES)",
            "edge",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-second-part-from-the-front",
        "second parts fill their slots upwards",
        text(
            "accel/divide_and_conquer/passes/partition",
            "edge - 1u - rank",
            "edge + rank",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-second-part-not-entered",
        "no ray enters a second part",
        text(
            "accel/divide_and_conquer/passes/expand",
            "if (enters(parts, ray, end)) { put(parts, place); }",
            "",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-box-of-two-corners",
        "the box of a triangle lacks its third corner",
        text(
            "accel/divide_and_conquer/problem",
            "join(join(OrderedBox(a, a), OrderedBox(b, b)), OrderedBox(c, c))",
            "join(OrderedBox(a, a), OrderedBox(b, b))",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-low-corner-joined-as-high",
        "the low corner of a part is its greatest",
        text(
            "accel/divide_and_conquer/problem",
            "raise(at + axis, ~around.low[axis])",
            "raise(at + axis, ~around.high[axis])",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-pairs-without-room-dropped",
        "pairs for whose parts there is no room are lost",
        text(
            "accel/divide_and_conquer/passes/answer",
            "at >= level.expands || problem_word",
            "at < level.expands && problem_word",
        ),
        SHORT,
        Check::Lattice,
    ),
    row(
        "divide-last-level-dropped",
        "problems of the last level are not answered",
        text(
            "accel/divide_and_conquer/passes/divide",
            "level.level + 1u < LEVELS &&",
            "true &&",
        ),
        SHALLOW,
        Check::Lattice,
    ),
    row(
        "divide-first-batch-only",
        "every batch of rays is the first",
        text(
            "accel/divide_and_conquer/passes/rays",
            "level.first + item",
            "item",
        ),
        SHORT,
        Check::Lattice,
    ),
    row(
        "divide-last-workgroup-missing",
        "pairs of a workgroup that is not full are left out",
        text(
            "accel/divide_and_conquer/passes/plan",
            "(pairs + LANES - 1u) / LANES",
            "pairs / LANES",
        ),
        WHOLE,
        Check::Lattice,
    ),
    row(
        "divide-found-not-cleared",
        "rays begin with the triangle of index 0 as their nearest",
        text(
            "accel/divide_and_conquer/passes/rays",
            "atomicStore(&state[FOUND + place], NO_HIT);",
            "",
        ),
        WHOLE,
        Check::Lattice,
    ),
];
