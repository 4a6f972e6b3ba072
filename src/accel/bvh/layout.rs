//! What traversals ask of a layout of nodes, and what they carry for one ray.

use super::super::Counters;
use super::super::intersection::Reciprocal;
use super::super::leaf::LeafReader;
use super::super::ray::{Hit, NO_HIT, Ray};

/// Inner nodes to go to from a node, in order, and which child the first is (0 or 1).
pub(super) struct Inner {
    pub first: u32,
    pub second: u32,
    pub side: u32,
}

/// One ray on its way.
pub(super) struct Query<'a> {
    pub ray: &'a Ray,
    pub inverse: Reciprocal,
    pub any: bool,
    pub leaves: LeafReader<'a>,
    pub hit: Hit,
    pub counters: &'a mut Counters,
}

impl<'a> Query<'a> {
    pub fn new(
        ray: &'a Ray,
        any: bool,
        leaves: LeafReader<'a>,
        counters: &'a mut Counters,
    ) -> Self {
        Self {
            ray,
            inverse: leaves.soup.intersection.inverse(ray.direction),
            any,
            leaves,
            hit: Hit::miss(ray),
            counters,
        }
    }

    /// Whether any hit is enough and there is one.
    pub fn is_answered(&self) -> bool {
        self.any && self.hit.triangle != NO_HIT
    }

    pub fn test_leaf(&mut self, reference: u32) {
        let Self {
            ray,
            inverse,
            leaves,
            hit,
            counters,
            ..
        } = self;
        leaves.test_leaf(reference, ray, *inverse, hit, counters);
    }

    pub fn count_stack(&mut self, entries: usize) {
        let highest = &mut self.counters.stack_high_water;
        *highest = (*highest).max(entries as u32);
    }
}

/// A layout that ordered traversals can walk; see the twins of its methods.
pub(super) trait Nodes {
    /// Tests what `node` holds, and tells where to go from there.
    fn visit(&self, node: u32, query: &mut Query) -> Inner;
    /// The node to visit after child `from` of `node` is done with, or [`NONE`].
    fn second_child(&self, node: u32, from: u32, query: &mut Query) -> u32;
    /// The parent, [`NONE`] of the root.
    fn parent(&self, node: u32) -> u32;
    /// Child 0 or 1 of a node.
    fn child(&self, node: u32, side: u32, counters: &mut Counters) -> u32;
}
