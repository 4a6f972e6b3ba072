//! Slots for the children of a wide node, such that visiting them in ascending order of `slot ^
//! octant of the ray` is roughly front to back. CPU version of `kernels/accel/wide/octants.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, section 3.3.

use super::WideChild;
use crate::bounds::Bounds;

/// One per octant.
const SLOTS: usize = 8;

/// Projection of a child's offset on the direction of a slot, as an integer in the order of [`f32::total_cmp`].
fn agreement(offset: [f32; 3], slot: usize) -> i32 {
    let along = |axis: usize| {
        let x = offset[axis];
        if slot >> axis & 1 == 1 { x } else { -x }
    };
    let bits = (along(0) + along(1) + along(2)).to_bits().cast_signed();
    bits ^ (bits >> 31 & i32::MAX)
}

/// Eight children in the corners of a cube take the slots whose bits say on which side they lie.
///
/// # Errors
/// Another child of a slot.
pub(crate) fn check() -> Result<(), String> {
    let corner = |slot: u32| {
        let min = [0, 1, 2].map(|axis| 3.0 * (slot >> axis & 1) as f32);
        WideChild {
            bounds: Bounds {
                min,
                max: min.map(|x| x + 1.0),
            },
            ..WideChild::NOTHING
        }
    };
    let whole = Bounds {
        min: [0.0; 3],
        max: [4.0; 3],
    };
    // Not in their order.
    let children: Vec<WideChild> = (0..8).map(|k| corner(k * 3 % 8)).collect();
    let found = arrange(&whole, &children);
    let wrong = (0..8).find(|&slot| found[slot as usize].bounds.min != corner(slot).bounds.min);
    wrong.map_or(Ok(()), |slot| {
        Err(format!(
            "the child in slot {slot} of a known cube lies at {:?}: this program visits far children first; build it anew, \
             and report what stays wrong",
            found[slot as usize].bounds.min
        ))
    })
}

/// The children in slots, assigned greedily by best agreement; of equal ones the first child's, and its first slot's. Empty
/// slots get an empty leaf.
pub(super) fn arrange(bounds: &Bounds, children: &[WideChild]) -> Vec<WideChild> {
    let middle = bounds.doubled_centre();
    let mut agreements = [[0; SLOTS]; SLOTS];
    for (row, child) in agreements.iter_mut().zip(children) {
        let centre = child.bounds.doubled_centre();
        let offset = [0, 1, 2].map(|axis| centre[axis] - middle[axis]);
        *row = std::array::from_fn(|slot| agreement(offset, slot));
    }
    let mut free = [true; SLOTS];
    let best_of = |index: usize, free: &[bool; SLOTS]| {
        let mut best: Option<(i32, usize)> = None;
        for (slot, &found) in agreements[index].iter().enumerate() {
            if free[slot] && best.is_none_or(|(most, _)| found > most) {
                best = Some((found, slot));
            }
        }
        let (agreement, slot) = best.expect("no more children than slots");
        (agreement, index, slot)
    };
    let mut slots = vec![WideChild::NOTHING; SLOTS];
    // Of every child that has no slot yet, its best free one.
    let mut wishes: Vec<_> = (0..children.len()).map(|k| best_of(k, &free)).collect();
    while let Some((mut first, rest)) = wishes.split_first().map(|(wish, rest)| (*wish, rest)) {
        for wish in rest {
            if wish.0 > first.0 {
                first = *wish;
            }
        }
        let (_, index, slot) = first;
        slots[slot] = children[index];
        free[slot] = false;
        wishes.retain(|wish| wish.1 != index);
        for wish in wishes.iter_mut().filter(|wish| wish.2 == slot) {
            *wish = best_of(wish.1, &free);
        }
    }
    slots
}
