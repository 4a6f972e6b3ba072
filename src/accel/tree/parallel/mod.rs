//! Bottom-up trees over sorted triangles, by methods suited to a device: `device-lbvh` and
//! `device-ploc` are built there, `host-lbvh` and `host-ploc` are their bit-identical CPU versions.
//!
//! Both sort triangles along a curve through the scene (`morton`). `lbvh` then derives the tree
//! from the codes, `clusters` merges neighbours in rounds. [`device`] records the passes, `refit`
//! fits boxes to moved triangles.

pub mod boxes;
mod clusters;
pub mod device;
mod lbvh;
pub(crate) mod morton;
mod refit;
mod rounds;

use super::depth::limit_depth;
use super::grow::lay_out;
use super::{NodeKind, Tree};
use crate::triangle::TriangleRecord;
use crate::{AccelError, TriangleSoup};
use boxes::{OrderedBox, doubled_centre, number, ordered};
use bytemuck::{Pod, Zeroable};
use rayon::prelude::*;

/// Marks a leaf, in place of its second child.
pub const LEAF: u32 = 0xffff_ffff;
/// Larger coordinates have infinite areas.
const LARGEST_COORDINATE: f32 = 1e18;

/// The method of the build.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Method {
    /// The radix tree over the codes.
    Lbvh,
    /// Parallel locally-ordered clustering.
    Ploc {
        /// Neighbours examined on either side of a cluster, 1 to 32.
        radius: u32,
    },
}

/// Settings shared by host and device builds.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Settings {
    /// The method.
    pub method: Method,
    /// Codes of 60 bits instead of 30.
    pub long_codes: bool,
}

/// A node: a child after each corner of its box. A leaf has its triangle first, then [`LEAF`].
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Eq, Pod, Zeroable)]
pub struct LinkedNode {
    /// Minimum corner: see `ordered`.
    pub low: [u32; 3],
    /// First child.
    pub left: u32,
    /// Maximum corner.
    pub high: [u32; 3],
    /// Second child.
    pub right: u32,
}

impl LinkedNode {
    fn new(around: OrderedBox, [left, right]: [u32; 2]) -> Self {
        Self {
            low: around.low,
            left,
            high: around.high,
            right,
        }
    }

    /// Its box.
    pub fn around(&self) -> OrderedBox {
        OrderedBox {
            low: self.low,
            high: self.high,
        }
    }

    /// Its children; meaningless for a leaf.
    pub fn children(&self) -> [u32; 2] {
        [self.left, self.right]
    }
}

/// A binary tree with a triangle in each leaf; leaves come first, in code order.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct LinkedTree {
    /// Leaves, then inner nodes.
    pub nodes: Vec<LinkedNode>,
    /// Index of the root.
    pub root: u32,
}

impl LinkedTree {
    /// Checks that every node except the root is the child of one other, and every leaf lists one
    /// of `triangles` triangles.
    ///
    /// # Errors
    /// The first node for which this fails, in a tree from a faulty device.
    pub fn check(&self, triangles: usize) -> Result<(), AccelError> {
        let mut seen = vec![false; self.nodes.len()];
        let mut open = Vec::from_iter((!self.nodes.is_empty()).then_some(self.root));
        while let Some(index) = open.pop() {
            let node = self.nodes.get(index as usize);
            let is_new = seen
                .get_mut(index as usize)
                .is_some_and(|s| !std::mem::replace(s, true));
            let Some(node) = node.filter(|_| is_new) else {
                return Err(AccelError::Invalid(format!(
                    "node {index} of {} is met twice or does not exist: the links of the tree are wrong",
                    self.nodes.len()
                )));
            };
            if node.right != LEAF {
                open.extend(node.children());
            } else {
                ensure!(
                    (node.left as usize) < triangles,
                    "leaf {index} lists triangle {} of {triangles}",
                    node.left
                );
            }
        }
        let lost = seen.iter().position(|s| !s);
        match lost {
            Some(index) => Err(AccelError::Invalid(format!(
                "node {index} is no node's child"
            ))),
            None => Ok(()),
        }
    }
}

impl From<LinkedTree> for Tree {
    fn from(tree: LinkedTree) -> Self {
        if tree.nodes.is_empty() {
            return Self::default();
        }
        limit_depth(lay_out(tree.root, |index: u32, _, order| {
            let node = &tree.nodes[index as usize];
            if node.right == LEAF {
                order.push(node.left);
                return (node.around().into(), None);
            }
            (node.around().into(), Some(node.children()))
        }))
    }
}

impl Tree {
    /// The nodes for the passes; a leaf stores only its first triangle.
    pub(crate) fn linked(&self) -> Vec<LinkedNode> {
        let nodes = self.nodes.par_iter().map(|node| {
            let key = |corner: [f32; 3]| corner.map(|x| ordered(x.to_bits()));
            let around = OrderedBox {
                low: key(node.bounds.min),
                high: key(node.bounds.max),
            };
            let links = match node.kind {
                NodeKind::Inner { left, right } => [left, right],
                NodeKind::Leaf { first, .. } => [self.order[first as usize], LEAF],
            };
            LinkedNode::new(around, links)
        });
        nodes.collect()
    }
}

struct Sorted {
    leaves: Vec<LinkedNode>,
    codes: Vec<[u32; 2]>,
}

/// The tree, built on the host: the CPU version of [`device::build`].
///
/// # Errors
/// A coordinate is too large or not a number.
pub fn build(soup: &TriangleSoup, settings: &Settings) -> Result<LinkedTree, AccelError> {
    check_coordinates(soup)?;
    let records = soup.records.par_iter();
    let boxes: Vec<OrderedBox> = records.map(OrderedBox::from).collect();
    if boxes.is_empty() {
        return Ok(LinkedTree::default());
    }
    let sorted = sort(&boxes, settings);
    Ok(match settings.method {
        Method::Lbvh => lbvh::build(sorted),
        Method::Ploc { radius } => clusters::build(sorted, radius),
    })
}

/// Checks that all coordinates are numbers and small enough.
fn check_coordinates(soup: &TriangleSoup) -> Result<(), AccelError> {
    let limit = LARGEST_COORDINATE.to_bits();
    let is_usable = |x: &f32| x.to_bits() & 0x7fff_ffff <= limit;
    let is_bad = |r: &TriangleRecord| !r.vertices().as_flattened().iter().all(is_usable);
    match soup.records.par_iter().position_first(is_bad) {
        Some(first) => Err(too_large(soup, first)),
        None => Ok(()),
    }
}

fn too_large(soup: &TriangleSoup, triangle: usize) -> AccelError {
    let vertices = soup.records.get(triangle).map(|r| r.vertices());
    AccelError::Invalid(format!(
        "triangle {triangle}: lbvh and ploc take coordinates up to {LARGEST_COORDINATE:e}; its vertices are {:?}",
        vertices.unwrap_or_default()
    ))
}

/// Leaves by their codes; those of one code by their triangles.
fn sort(boxes: &[OrderedBox], settings: &Settings) -> Sorted {
    let centre = |around: &OrderedBox| doubled_centre(*around).map(|x| ordered(x.to_bits()));
    let mut all = OrderedBox::NOTHING;
    for key in boxes.iter().map(centre) {
        all = boxes::join(
            all,
            OrderedBox {
                low: key,
                high: key,
            },
        );
    }
    let extent = [0, 1, 2].map(|axis| number(all.high[axis]) - number(all.low[axis]));
    let scale = morton::grid_scale(extent[0].max(extent[1]).max(extent[2]));
    let code = |around: &OrderedBox| {
        let centre = doubled_centre(*around);
        let cell =
            [0, 1, 2].map(|axis| morton::cell_of(centre[axis], number(all.low[axis]), scale));
        let [upper, lower] = morton::morton_code(cell);
        [upper, if settings.long_codes { lower } else { 0 }]
    };
    let mut order: Vec<([u32; 2], u32)> = boxes
        .par_iter()
        .map(code)
        .zip(0..boxes.len() as u32)
        .collect();
    order.par_sort_unstable();
    let leaf = |(_, triangle): &([u32; 2], u32)| {
        LinkedNode::new(boxes[*triangle as usize], [*triangle, LEAF])
    };
    Sorted {
        leaves: order.par_iter().map(leaf).collect(),
        codes: order.iter().map(|(code, _)| *code).collect(),
    }
}
