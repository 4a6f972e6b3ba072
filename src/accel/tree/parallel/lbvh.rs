//! The radix tree over sorted codes: ranges and splits of its inner nodes, each found
//! independently. CPU version of `kernels/accel/tree/parallel/lbvh.wesl`.
//!
//! Source: T. Karras, "Maximizing parallelism in the construction of BVHs, octrees, and k-d trees",
//! HPG 2012.

use super::boxes::{OrderedBox, join};
use super::{LEAF, LinkedNode, LinkedTree, Sorted};
use rayon::prelude::*;

const CODE_BITS: i32 = 64;

struct Codes<'a>(&'a [[u32; 2]]);

impl Codes<'_> {
    /// Length of the codes' common prefix; indices break ties. −1 out of range.
    fn common_prefix(&self, i: i32, j: i32) -> i32 {
        let code = |place: i32| self.0.get(usize::try_from(place).ok()?);
        let (Some(a), Some(b)) = (code(i), code(j)) else {
            return -1;
        };
        let [upper, lower] = [a[0] ^ b[0], a[1] ^ b[1]];
        if upper != 0 {
            return upper.leading_zeros() as i32;
        }
        if lower != 0 {
            return 32 + lower.leading_zeros() as i32;
        }
        CODE_BITS + (i ^ j).leading_zeros() as i32
    }

    /// First and last leaf below an inner node.
    fn range_of(&self, node: u32) -> [u32; 2] {
        let i = node as i32;
        let mut side = -1;
        if self.common_prefix(i, i + 1) > self.common_prefix(i, i - 1) {
            side = 1;
        }
        let outside = self.common_prefix(i, i - side);
        let mut reach = 2;
        while self.common_prefix(i, i + reach * side) > outside {
            reach *= 2;
        }
        let mut length = 0;
        let mut step = reach / 2;
        while step >= 1 {
            if self.common_prefix(i, i + (length + step) * side) > outside {
                length += step;
            }
            step /= 2;
        }
        let j = i + length * side;
        [i.min(j) as u32, i.max(j) as u32]
    }

    /// The last leaf below the first child of a node with this range.
    fn split_of(&self, range: [u32; 2]) -> u32 {
        let [first, last] = range.map(|place| place as i32);
        let shared_bits = self.common_prefix(first, last);
        let mut split = first;
        let mut step = last - first;
        while step > 1 {
            step = (step + 1) / 2;
            let further = split + step;
            if further < last && self.common_prefix(first, further) > shared_bits {
                split = further;
            }
        }
        split as u32
    }
}

/// The radix tree; node `count + i` has the range that begins or ends at leaf `i`.
pub(super) fn build(sorted: Sorted) -> LinkedTree {
    let codes = Codes(&sorted.codes);
    let count = sorted.leaves.len() as u32;
    let inner = (0..count - 1).into_par_iter().map(|node| {
        let range = codes.range_of(node);
        let split = codes.split_of(range);
        let left = split + if split == range[0] { 0 } else { count };
        let right = split + 1 + if split + 1 == range[1] { 0 } else { count };
        LinkedNode::new(OrderedBox::NOTHING, [left, right])
    });
    let inner: Vec<LinkedNode> = inner.collect();
    let mut tree = LinkedTree {
        nodes: [sorted.leaves, inner].concat(),
        root: if count == 1 { 0 } else { count },
    };
    tree.fit();
    tree
}

impl LinkedTree {
    /// Computes the boxes of the inner nodes from those of the leaves.
    pub fn fit(&mut self) {
        let mut parents_first = Vec::with_capacity(self.nodes.len());
        let mut open = vec![self.root];
        while let Some(index) = open.pop() {
            let node = self.nodes[index as usize];
            if node.right != LEAF {
                parents_first.push(index);
                open.extend(node.children());
            }
        }
        for index in parents_first.into_iter().rev() {
            let [left, right] = self.nodes[index as usize].children();
            let [a, b] = [left, right].map(|child| self.nodes[child as usize].around());
            self.nodes[index as usize] = LinkedNode::new(join(a, b), [left, right]);
        }
    }
}
