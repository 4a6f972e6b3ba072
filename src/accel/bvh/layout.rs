//! What traversals ask of a layout of nodes.

use super::super::leaf::LeafReader;
use super::super::twin::Walk;

/// Inner nodes to go to from a node, in order, and which child the first is (0 or 1).
pub(super) struct Inner {
    pub first: u32,
    pub second: u32,
    pub side: u32,
}

/// A layout that ordered traversals can walk; see the twins of its methods.
pub(super) trait Nodes {
    /// Tests what `node` holds, and tells where to go from there.
    fn visit(&self, node: u32, leaves: LeafReader, walk: &mut Walk) -> Inner;
    /// The node to visit after child `from` of `node` is done with, or [`NONE`].
    fn second_child(&self, node: u32, from: u32, walk: &mut Walk) -> u32;
    /// The parent, [`NONE`] of the root.
    fn parent(&self, node: u32) -> u32;
    /// Child 0 or 1 of a node.
    fn child(&self, node: u32, side: u32, walk: &mut Walk) -> u32;
}
