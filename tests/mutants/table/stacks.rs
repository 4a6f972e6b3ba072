//! Faults of the last entries of stacks, and of the last levels of a trail.

use super::words::*;
use super::{built, row, structure, text};
use crate::subject::Changes;
use crate::{Check, Mutant, Plant};
use raystone::accel::GpuBuffers;

const SHORT: Changes = &[("traversal", "short-stack")];
/// Whose stack has no entry to spare.
const OWN_BOXES: Changes = &[("node_bytes", "32")];

const fn stacked(
    name: &'static str,
    what: &'static str,
    plant: Plant,
    of: &'static str,
    changes: Changes,
) -> Mutant {
    row(name, what, plant, structure(of, changes), Check::Stacks)
}

const fn too_small(
    name: &'static str,
    change: fn(&mut GpuBuffers) -> usize,
    of: &'static str,
    changes: Changes,
) -> Mutant {
    let what = "the stack has an entry less than it needs";
    stacked(name, what, built("STACK_ENTRIES", change), of, changes)
}

pub const MUTANTS: &[Mutant] = &[
    too_small("an-entry-less", take_an_entry, "bvh", OWN_BOXES),
    too_small("an-entry-less-of-pairs", take_two_entries, "bvh", &[]),
    too_small("an-entry-less-of-cells", take_an_entry, "kd-tree", &[]),
    too_small("an-entry-less-of-four", take_two_entries, "bvh4", &[]),
    too_small("an-entry-less-of-eight", take_two_entries, "cwbvh", &[]),
    stacked(
        "last-entry-below-its-place",
        "the last entry of a stack replaces the one before it",
        text(
            "accel/stack",
            "    @if(!short_stack) let place = (*stack).held;\n    @if(!stack_private && !stack_workgroup && !refill) {",
            "    @if(!short_stack) let place = min((*stack).held, STACK_ENTRIES - 2u);\n    @if(!stack_private && !stack_workgroup && !refill) {",
        ),
        "bvh",
        OWN_BOXES,
    ),
    stacked(
        "last-cell-below-its-place",
        "the last cell that waits replaces the one before it",
        text(
            "accel/kd_tree",
            "waiting[entries] = far;",
            "waiting[min(entries, STACK_ENTRIES - 2u)] = far;",
        ),
        "kd-tree",
        &[],
    ),
    stacked(
        "level-32-is-level-0",
        "the 33rd level of a trail is taken for the first",
        text("accel/bvh/short_stack", "level >= 32u", "level > 32u"),
        "bvh",
        SHORT,
    ),
    stacked(
        "trail-without-its-last-bit",
        "the last bit of each word of a trail is lost",
        text(
            "accel/bvh/short_stack",
            "let bit = 1u << (level & 31u);",
            "let bit = (1u << (level & 31u)) & 0x7fffffffu;",
        ),
        "bvh",
        SHORT,
    ),
    stacked(
        "deepest-level-above-itself",
        "of the lower levels of a trail that are pending the one above the deepest is taken",
        text(
            "accel/bvh/short_stack",
            "32u + firstLeadingBit(bits.y)",
            "31u + firstLeadingBit(bits.y)",
        ),
        "bvh",
        SHORT,
    ),
];
