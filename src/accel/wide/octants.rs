//! Slots for the children of a wide node, such that visiting them in ascending order of `slot ^
//! octant of the ray` is roughly front to back. CPU version of `kernels/accel/wide/octants.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017, section 3.3.

use super::WideChild;
use crate::bounds::Bounds;

/// One per octant.
const SLOTS: usize = 8;

/// Projection of a child's offset on the direction of a slot.
fn agreement(offset: [f32; 3], slot: usize) -> f32 {
    let along = |axis: usize| {
        let x = offset[axis];
        if slot >> axis & 1 == 1 { x } else { -x }
    };
    along(0) + along(1) + along(2)
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

/// The children in slots, assigned greedily by best agreement. Empty slots get an empty leaf.
pub(super) fn arrange(bounds: &Bounds, children: &[WideChild]) -> Vec<WideChild> {
    let middle = bounds.doubled_centre();
    let mut pairs: Vec<(f32, usize, usize)> = Vec::with_capacity(SLOTS * SLOTS);
    for (index, child) in children.iter().enumerate() {
        let centre = child.bounds.doubled_centre();
        let offset = [0, 1, 2].map(|axis| centre[axis] - middle[axis]);
        pairs.extend((0..SLOTS).map(|slot| (agreement(offset, slot), index, slot)));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut slots = vec![WideChild::NOTHING; SLOTS];
    let (mut placed, mut taken) = ([false; SLOTS], [false; SLOTS]);
    for (_, index, slot) in pairs {
        if !placed[index] && !taken[slot] {
            (placed[index], taken[slot]) = (true, true);
            slots[slot] = children[index];
        }
    }
    slots
}
