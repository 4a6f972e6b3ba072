//! Faults of builders: changed words in their output. Each returns the number of places that it changed; 0 means that
//! the layout is no longer the one that the fault supposes.

use raystone::accel::GpuBuffers;
use raystone::gpu::UniformValues;

/// A reference to a leaf, and the bits of its count (`kernels/accel/leaf.wesl`).
const LEAF: u32 = 0x8000_0000;
const COUNT: u32 = 31 << 26;
/// No node: no child, no rope.
const NONE: u32 = 0x8000_0000;
/// The mark of a list's last triangle.
const LAST: u32 = 0x8000_0000;

/// Words of the array `name`.
fn words<'a>(buffers: &'a mut GpuBuffers, name: &str) -> &'a mut [u32] {
    let found = buffers.arrays.iter_mut().find(|array| array.name == name);
    found.map_or(&mut [], |array| array.words.to_mut())
}

/// Leaves of two triangles and more lose the last one. Pairs: words 3 and 11 are the children.
pub fn shorten_leaves(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes").chunks_exact_mut(16);
    let children = nodes.flat_map(|node| {
        let (left, right) = node.split_at_mut(8);
        [&mut left[3], &mut right[3]]
    });
    let leaves = children.filter(|c| **c >= LEAF && (**c & COUNT) > 1 << 26);
    leaves.map(|leaf| *leaf -= 1 << 26).count()
}

pub fn drop_second_child(buffers: &mut GpuBuffers) -> usize {
    let child = words(buffers, "nodes").get_mut(11);
    let child = child.filter(|c| **c != NONE);
    child.map(|c| *c = NONE).into_iter().count()
}

pub fn stack_of_one(buffers: &mut GpuBuffers) -> usize {
    let stack = buffers
        .constants
        .iter_mut()
        .filter(|c| c.0 == "STACK_ENTRIES");
    stack.map(|c| c.1 = 1).count()
}

/// The rope of the last first child that is a leaf leads to the root. Boxes: word 3 is the content,
/// word 7 the rope.
pub fn reverse_a_rope(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes").chunks_exact_mut(8);
    let mut leaves = nodes.filter(|node| node[3] >= LEAF && node[7] != NONE);
    leaves.next().map(|node| node[7] = 0).into_iter().count()
}

/// First children, at even places, lead to the same node as second children.
pub fn lengthen_ropes(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes");
    let mut changed = 0;
    for first in (2..nodes.len() / 8).step_by(2) {
        let (node, sibling) = (8 * first + 7, 8 * first + 15);
        if nodes[node] == first as u32 + 1 {
            nodes[node] = nodes[sibling];
            changed += 1;
        }
    }
    changed
}

/// Each byte of a word that is more than 0 becomes one less.
fn bytes_down(word: &mut u32) -> usize {
    let before = *word;
    *word = u32::from_le_bytes(before.to_le_bytes().map(|b| b.saturating_sub(1)));
    usize::from(*word != before)
}

/// Four-wide nodes have 12 words; the planes at the maximum of x are word 9.
pub fn round_maxima_down(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes").chunks_exact_mut(12);
    nodes.map(|node| bytes_down(&mut node[9])).sum()
}

/// Eight-wide nodes have 20 words; the planes at the minimum of x are words 8 and 9.
pub fn round_minima_up(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes").chunks_exact_mut(20);
    let planes = nodes.flat_map(|node| node[8..10].iter_mut());
    let up = |word: &mut u32| {
        *word = u32::from_le_bytes(word.to_le_bytes().map(|b| b.saturating_add(1)));
    };
    planes.map(up).count()
}

/// The triangle that is listed most often is replaced by another in all lists.
pub fn forget_a_triangle(buffers: &mut GpuBuffers) -> usize {
    let references = words(buffers, "references");
    let most = references.iter().copied().max().unwrap_or(0);
    let mut counts = vec![0_usize; most as usize + 1];
    references.iter().for_each(|&id| counts[id as usize] += 1);
    let Some((forgotten, _)) = counts.iter().enumerate().max_by_key(|(_, n)| **n) else {
        return 0;
    };
    let other = u32::from(forgotten == 0);
    let listed = references.iter_mut().filter(|id| **id == forgotten as u32);
    listed.map(|id| *id = other).count()
}

/// A box is a cell of four words, the last its list; all ones mean none.
pub fn empty_boxes(buffers: &mut GpuBuffers) -> usize {
    const EMPTY: u32 = u32::MAX;
    let cells = words(buffers, "cells").chunks_exact_mut(4);
    let listed = cells.filter(|cell| cell[3] != EMPTY);
    listed.step_by(2).map(|cell| cell[3] = EMPTY).count()
}

/// The lowest of the root's filled children, bits 0 to 7 of the first word.
pub fn drop_an_octant(buffers: &mut GpuBuffers) -> usize {
    let root = words(buffers, "nodes").first_mut();
    let inner = root.filter(|word| **word < LEAF && **word & 255 != 0);
    let dropped = inner.map(|word| *word &= *word - 1);
    dropped.into_iter().count()
}

pub fn end_lists_early(buffers: &mut GpuBuffers) -> usize {
    let references = words(buffers, "references");
    let mut changed = 0;
    for i in 1..references.len() {
        if references[i] >= LAST && references[i - 1] < LAST {
            references[i - 1] |= LAST;
            changed += 1;
        }
    }
    changed
}

/// A node is a plane's position and a word whose two lowest bits are its axis, or 3 for a leaf. Planes
/// move by half a unit.
pub fn move_planes(buffers: &mut GpuBuffers) -> usize {
    let nodes = words(buffers, "nodes").chunks_exact_mut(2);
    let inner = nodes.filter(|node| node[1] & 3 != 3);
    let moved = |node: &mut [u32]| node[0] = (f32::from_bits(node[0]) + 0.5).to_bits();
    inner.map(moved).count()
}

/// World boxes lie at the end of `nodes`, eight words each, the maximum in words 4 to 6. The last box
/// loses its upper half.
pub fn shrink_last_box(buffers: &mut GpuBuffers) -> usize {
    let instances = buffers.uniforms.iter().find(|u| u.0 == "limits");
    let elements = instances.and_then(|(_, values): &(_, UniformValues)| values.words("elements"));
    // A scene that is one object would lose half of its triangles: no matter of instances.
    let moved = elements.is_some_and(|count| count.first().is_some_and(|&n| n > 1));
    let nodes = words(buffers, "nodes");
    let Some(at) = nodes.len().checked_sub(8).filter(|_| moved) else {
        return 1;
    };
    for axis in 0..3 {
        let [low, high] = [at + axis, at + 4 + axis].map(|i| f32::from_bits(nodes[i]));
        nodes[at + 4 + axis] = (0.5 * (low + high)).to_bits();
    }
    3
}

/// Words before those of a sequence: where those of the decorrelation begin.
const HEADER: usize = 1;

/// Dimension 1 of Sobol has words 32 to 63; column 3 becomes that of column 2.
pub fn repeat_direction_number(table: &mut [u32]) -> usize {
    copy(table, HEADER + 32 + 3, HEADER + 32 + 2)
}

/// Two words per dimension: the base, and the start of its permutation. In base 3 the digit 1 maps to the image of 2.
pub fn repeat_digit(table: &mut [u32]) -> usize {
    let first = HEADER
        + table
            .get(HEADER + 3)
            .map_or(usize::MAX / 2, |&w| w as usize);
    copy(table, first + 1, first + 2)
}

/// One word a dimension.
pub fn repeat_component(table: &mut [u32]) -> usize {
    copy(table, HEADER + 1, HEADER)
}

/// A word for the greatest index, then two words per point.
pub fn repeat_point(table: &mut [u32]) -> usize {
    copy(table, HEADER + 3, HEADER + 1) + copy(table, HEADER + 4, HEADER + 2)
}

/// Column 15 of dimension 20 becomes that of column 14: no sooner than at sample 32768.
pub fn repeat_late_direction_number(table: &mut [u32]) -> usize {
    let first = HEADER + 20 * 32;
    copy(table, first + 15, first + 14)
}

/// Base 127 is that of dimension 30: its digit 100 maps to the image of 101.
pub fn repeat_late_digit(table: &mut [u32]) -> usize {
    let first = table
        .get(HEADER + 61)
        .map_or(usize::MAX / 2, |&w| HEADER + w as usize);
    copy(table, first + 100, first + 101)
}

/// Dimension 40 gets the base of dimension 39.
pub fn repeat_late_base(table: &mut [u32]) -> usize {
    copy(table, HEADER + 80, HEADER + 78)
}

/// Dimension 19 gets the component of dimension 18.
pub fn repeat_late_component(table: &mut [u32]) -> usize {
    copy(table, HEADER + 19, HEADER + 18)
}

/// The ninth set of points is the first one.
pub fn repeat_set(table: &mut [u32]) -> usize {
    let words = 2 * (table.get(HEADER).map_or(0, |&last| last as usize) + 1);
    let first = HEADER + 1;
    let changed = (0..words).map(|i| copy(table, first + 8 * words + i, first + i));
    changed.sum()
}

/// Overwrites word `to` by word `from`; 1 if that changes anything.
fn copy(table: &mut [u32], to: usize, from: usize) -> usize {
    match (table.get(to).copied(), table.get(from).copied()) {
        (Some(old), Some(new)) if old != new => {
            table[to] = new;
            1
        }
        _ => 0,
    }
}

/// Dimension 30 of Sobol has 32 words from here on.
pub fn flip_a_direction_bit(table: &mut [u32]) -> usize {
    let word = table.get_mut(HEADER + 30 * 32 + 7);
    word.map(|word| *word ^= 1 << 20).into_iter().count()
}

pub fn exchange_rows(table: &mut [u32]) -> usize {
    let first = HEADER + 40 * 32;
    let rows = table.get_mut(first..first + 64);
    rows.map(|rows| rows.rotate_left(32)).into_iter().count()
}

/// Dimension 41 has the base 181; 229 belongs to the 50th.
pub fn take_a_larger_prime(table: &mut [u32]) -> usize {
    let base = table.get_mut(HEADER + 82).filter(|base| **base == 181);
    base.map(|base| *base = 229).into_iter().count()
}

/// Base 101 is that of dimension 25.
pub fn exchange_digits(table: &mut [u32]) -> usize {
    let first = table
        .get(HEADER + 51)
        .map_or(usize::MAX / 2, |&w| HEADER + w as usize);
    if table.len() <= first + 57 {
        return 0;
    }
    table.swap(first + 30, first + 57);
    1
}

pub fn lengthen_step(table: &mut [u32]) -> usize {
    let step = table.get_mut(HEADER + 1);
    step.map(|step| *step += 430).into_iter().count()
}

/// The number of samples, then the quotient of 2³² over it.
pub fn divide_by_one_more(table: &mut [u32]) -> usize {
    let Some(&count) = table.get(HEADER) else {
        return 0;
    };
    table[HEADER + 1] = ((1_u64 << 32) / u64::from(count + 1)) as u32;
    1
}

pub fn halve_the_stack(buffers: &mut GpuBuffers) -> usize {
    let stack = buffers
        .constants
        .iter_mut()
        .filter(|c| c.0 == "STACK_ENTRIES" && c.1 > 1);
    stack.map(|c| c.1 /= 2).count()
}

pub fn take_an_entry(buffers: &mut GpuBuffers) -> usize {
    take_entries(buffers, 1)
}

/// Of a stack that has one to spare, or two where the kernel needs one itself.
pub fn take_two_entries(buffers: &mut GpuBuffers) -> usize {
    take_entries(buffers, 2)
}

fn take_entries(buffers: &mut GpuBuffers, fewer: u32) -> usize {
    let stack = buffers
        .constants
        .iter_mut()
        .filter(|c| c.0 == "STACK_ENTRIES" && c.1 > fewer);
    stack.map(|c| c.1 -= fewer).count()
}
