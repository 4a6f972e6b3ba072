//! The node interface that traversals use.

use super::super::leaf::LeafReader;
use super::super::twin::Walk;

/// Inner nodes to visit from a node, in order, and which child comes first (0 or 1).
pub(super) struct Inner {
    pub first: u32,
    pub second: u32,
    pub side: u32,
}

/// A layout for ordered traversals; see the kernel versions of its methods.
pub(super) trait Nodes {
    /// Tests the contents of `node` and returns where to go next.
    fn visit(&self, node: u32, leaves: LeafReader, walk: &mut Walk) -> Inner;
    /// The node to visit after child `from` of `node`, or [`NONE`].
    fn second_child(&self, node: u32, from: u32, walk: &mut Walk) -> u32;
    /// The parent; [`NONE`] for the root.
    fn parent(&self, node: u32) -> u32;
    fn child(&self, node: u32, side: u32, walk: &mut Walk) -> u32;
}
