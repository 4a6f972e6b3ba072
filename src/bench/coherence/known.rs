//! Warps on a small machine, counted by hand.

use super::{CacheShape, Fetch, Kind, Machine, Pass, Trace, Warp, run};
use Kind::{Node, Triangle};
use raystone_config::{Coherence, Rule};
use raystone_record::{Tallies, Tally};

/// A lane that fetches 4 bytes at each of these addresses, step by step.
pub(super) fn lane(steps: &[(Kind, u64)]) -> Option<Trace> {
    let fetch = |first| vec![Fetch { first, bytes: 4 }];
    Some(Trace::of(
        steps.iter().map(|(kind, at)| (*kind, fetch(*at))),
    ))
}

pub(super) fn pass(class: u32, lanes: Vec<Option<Trace>>) -> Pass {
    Pass { class, lanes }
}

pub(super) fn machine(line_bytes: u64, [l1, l2]: [u64; 2]) -> Machine {
    let cache = |lines| CacheShape { lines, ways: 0 };
    Machine {
        rule: Rule::Loop,
        line_bytes,
        l1: cache(l1),
        l2: cache(l2),
    }
}

/// Two groups of four lanes. Lines of 16 bytes; an L1 holds two, the L2 three.
///
/// Turn 1: the first group visits: lines 0 and 2, both from memory. The second: line 0, from the L2.
/// Turn 2: a triangle, line 4, replaces line 0 in the first L1. Second group: line 0, L1 hit.
/// Turn 3: line 1 replaces line 2 in L1 and L2, where 0 was used more recently.
/// Turn 4: line 2, no longer in either.
pub(super) fn found() -> Tallies {
    let first = Warp {
        passes: vec![
            pass(
                0,
                vec![
                    lane(&[(Node, 0), (Triangle, 64)]),
                    lane(&[(Node, 4), (Node, 20)]),
                    None,
                    lane(&[(Node, 32)]),
                ],
            ),
            pass(2, vec![None, lane(&[(Node, 32)]), None, None]),
        ],
    };
    let second = Warp {
        passes: vec![pass(
            1,
            vec![lane(&[(Node, 0), (Node, 8)]), None, None, None],
        )],
    };
    run(&machine(16, [2, 3]), &[vec![first], vec![second]])
}

pub(super) fn by_hand() -> Tallies {
    let expected = [
        Tally {
            rays: 3,
            nodes: 4,
            triangles: 1,
            issues: 3,
            active: 5,
            lanes: 12,
            bytes: 20,
            lines: 4,
            l1_hits: 0,
            l2_hits: 0,
        },
        Tally {
            rays: 1,
            nodes: 2,
            triangles: 0,
            issues: 2,
            active: 2,
            lanes: 8,
            bytes: 8,
            lines: 2,
            l1_hits: 1,
            l2_hits: 1,
        },
        Tally {
            rays: 1,
            nodes: 1,
            triangles: 0,
            issues: 1,
            active: 1,
            lanes: 4,
            bytes: 4,
            lines: 1,
            l1_hits: 0,
            l2_hits: 0,
        },
    ];
    (0..).zip(expected).collect()
}

/// Runs them.
///
/// # Errors
/// They are counted otherwise.
pub(crate) fn check() -> Result<(), String> {
    // 2 KiB are 16 lines of 128 bytes, 12 KiB 96.
    let settings = Coherence {
        l1_kib: 2,
        l1_ways: 4,
        l2_kib: 12,
        l2_ways: 8,
        ..Coherence::default()
    };
    let machine = Machine::new(&settings);
    let cache = |lines, ways| CacheShape { lines, ways };
    if (machine.l1, machine.l2, machine.line_bytes) != (cache(16, 4), cache(96, 8), 128) {
        return Err(format!(
            "a known machine of coherence is {machine:?}: this program models another one; build it anew, and report what stays \
             wrong"
        ));
    }
    let (found, expected) = (found(), by_hand());
    (found == expected).then_some(()).ok_or_else(|| {
        format!(
            "known warps are counted as {found:?}, and should be {expected:?}: this program models coherence wrongly; build \
             it anew, and report what stays wrong"
        )
    })
}
