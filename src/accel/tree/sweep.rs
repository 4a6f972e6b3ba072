//! SAH at every triangle, of all axes or only the longest.
//!
//! Why a full sweep may be worse than a few bins: the cost of a split assumes that both sides are
//! leaves. It overrates a side of n triangles by about n over the logarithm of n, so it favours
//! putting a few hundred triangles into a node nearly as large as its parent: at its second split
//! Crytek Sponza loses 837 triangles of the floor and the objects on it to a node of 0.74 of the
//! area, where 12 bins cut off the six large ones of the floor. A sweep finds such splits because
//! it tries them all. On other scenes it is better (Dabrovic's Sponza: 68.1 against 69.7). Nodes of
//! `sweep_bins_from` triangles or more are therefore split only at borders of bins over their box:
//! 70.1 against 73.9 for Crytek Sponza, with 70.3 for bins alone.
//!
//! References are sorted once along each axis; a split divides the sorted lists and preserves their
//! order. Sources: I. Wald, V. Havran, "On building fast kd-trees for ray tracing, and on doing
//! that in O(N log N)", 2006; the longest axis alone: A. Dufay, 2017, chapter 4.

use super::Tree;
use super::depth::SAH_DEPTH;
use super::grow::grow;
use super::parameters::TreeParameters;
use super::reference::{Box3, Reference};
use crate::bounds::Bounds;
use rayon::prelude::*;

#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Axes {
    All,
    Longest,
}

pub(super) fn build(references: &[Reference], axes: Axes, settings: &TreeParameters) -> Tree {
    let mut lists = [0, 1, 2].map(|axis| {
        let mut list: Vec<u32> = (0..references.len() as u32).collect();
        list.par_sort_unstable_by(|&a, &b| {
            references[a as usize].compare(&references[b as usize], axis)
        });
        list
    });
    let sweep = Sweep {
        references,
        axes,
        settings,
    };
    let (mut scratch, mut areas) = (vec![0; references.len()], vec![0.0; references.len()]);
    // The sorted lists of a node, with scratch of the same length.
    let lists = lists.each_mut().map(|list| &mut list[..]);
    let whole = (lists, &mut scratch[..], &mut areas[..]);
    let tree = grow(
        whole,
        |part| part.0[0].len(),
        |(lists, scratch, areas), depth, order| {
            let bounds = sweep.bounds_of(lists[0]);
            let Some(split) = sweep.split(&lists, bounds, areas, depth) else {
                order.extend(lists[0].iter().map(|&place| sweep.reference(place).id));
                return (Bounds::from(bounds), None);
            };
            let (low, high) = sweep.divide(lists, scratch, split);
            let scratch = scratch.split_at_mut(low[0].len());
            let areas = areas.split_at_mut(low[0].len());
            let halves = [(low, scratch.0, areas.0), (high, scratch.1, areas.1)];
            (Bounds::from(bounds), Some(halves))
        },
    );
    tree.into()
}

struct Sweep<'a> {
    references: &'a [Reference],
    axes: Axes,
    settings: &'a TreeParameters,
}

/// The sorted lists of a node: the same references along x, y and z.
type Lists<'a> = [&'a mut [u32]; 3];

impl Sweep<'_> {
    fn reference(&self, place: u32) -> &Reference {
        &self.references[place as usize]
    }

    fn bounds_of(&self, list: &[u32]) -> Box3 {
        let bounds = |&place: &u32| self.reference(place).bounds();
        list.iter().map(bounds).fold(Box3::EMPTY, Box3::union)
    }

    /// Axis and size of the first half of the best split; `None` makes a leaf.
    fn split(
        &self,
        lists: &Lists,
        bounds: Box3,
        areas: &mut [f32],
        depth: u32,
    ) -> Option<(usize, usize)> {
        let count = lists[0].len();
        let own_areas = lists[0]
            .iter()
            .map(|&p| self.reference(p).bounds().half_area());
        if self.settings.must_be_leaf(bounds, own_areas) {
            return None;
        }
        let longest = bounds.longest_axis();
        if depth >= SAH_DEPTH {
            return Some((longest, count / 2));
        }
        let axes = match self.axes {
            Axes::All => 0..3,
            Axes::Longest => longest..longest + 1,
        };
        let mut best = (f32::INFINITY, longest, count / 2);
        let bins = self.settings.bins as f32;
        let coarse = self.axes == Axes::All && count >= self.settings.sweep_bins_from;
        for only_borders in if coarse { &[true, false][..] } else { &[false] } {
            for axis in axes.clone() {
                let scale = bins / (bounds.max[axis] - bounds.min[axis]);
                let bin = |place: u32| {
                    let centre = 0.5 * self.reference(place).centre()[axis];
                    ((centre - bounds.min[axis]) * scale) as u32
                };
                let allowed = |a: u32, b: u32| !only_borders || bin(a) != bin(b);
                let (cost, middle) = self.best_place(lists[axis], areas, allowed);
                if cost < best.0 {
                    best = (cost, axis, middle);
                }
            }
            if best.0 < f32::INFINITY {
                break;
            }
        }
        Some((best.1, best.2))
    }

    /// Cost (half area times count, both sides) and index of the best split of one list between two
    /// references that `allowed` accepts.
    fn best_place(
        &self,
        list: &[u32],
        areas: &mut [f32],
        allowed: impl Fn(u32, u32) -> bool,
    ) -> (f32, usize) {
        let mut high = Box3::EMPTY;
        for place in (1..list.len()).rev() {
            high = high.union(self.reference(list[place]).bounds());
            areas[place] = high.half_area();
        }
        let mut best = (f32::INFINITY, list.len() / 2);
        let mut low = Box3::EMPTY;
        for place in 1..list.len() {
            low = low.union(self.reference(list[place - 1]).bounds());
            let above = (list.len() - place) as f32;
            let cost = low.half_area() * place as f32 + areas[place] * above;
            if cost < best.0 && allowed(list[place - 1], list[place]) {
                best = (cost, place);
            }
        }
        best
    }

    /// Splits the lists, preserving their order, by the position along the split axis.
    fn divide<'l>(
        &self,
        lists: Lists<'l>,
        scratch: &mut [u32],
        (axis, middle): (usize, usize),
    ) -> (Lists<'l>, Lists<'l>) {
        let pivot = *self.reference(lists[axis][middle]);
        for list in [0, 1, 2].into_iter().filter(|&other| other != axis) {
            let list = &mut *lists[list];
            let (mut low, mut high) = (0, 0);
            for index in 0..list.len() {
                let place = list[index];
                if self.reference(place).compare(&pivot, axis).is_lt() {
                    list[low] = place;
                    low += 1;
                } else {
                    scratch[high] = place;
                    high += 1;
                }
            }
            list[low..].copy_from_slice(&scratch[..high]);
        }
        let [x, y, z] = lists.map(|list| list.split_at_mut(middle));
        ([x.0, y.0, z.0], [x.1, y.1, z.1])
    }
}
