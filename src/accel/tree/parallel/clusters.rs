//! Parallel locally-ordered clustering: in each round every cluster finds the neighbour with which
//! it would have the smallest box, and mutual choices are merged. CPU version of
//! `kernels/accel/tree/parallel/clusters.wesl`.
//!
//! Source: D. Meister, J. Bittner, "Parallel locally-ordered clustering for bounding volume
//! hierarchy construction", TVCG 24(3), 2018.
//!
//! *Ties* are broken by the exclusive or of the two indices. It is symmetric, and no two neighbours
//! of a cluster share it, so among all pairs of the smallest area at least one is mutual, and every
//! round merges something. Indices alone would do that too, but with many equal areas (copies,
//! lattices) each cluster would choose its first neighbour and a round would merge one pair; this
//! way it merges nearly all.
//!
//! *Rounds* are bounded: boxes that shrink along the curve could make only the last two choose each
//! other. After [`FREE_ROUNDS`] clusters are merged pairwise in order, so that the total number of
//! rounds, and the depth of the tree, stay below that plus the logarithm of the number of
//! triangles.

use super::boxes::{OrderedBox, half_area, join, number};
use super::rounds::FREE_ROUNDS;
use super::{LinkedNode, LinkedTree, Sorted};
use rayon::prelude::*;

/// A neighbour with its sort key.
#[derive(Clone, Copy)]
struct Choice {
    area: f32,
    apart: u32,
}

const WORST: Choice = Choice {
    area: 3.4e38,
    apart: u32::MAX,
};

fn is_better(a: Choice, b: Choice) -> bool {
    a.area < b.area || (a.area == b.area && a.apart < b.apart)
}

/// The indices examined, its own among them.
fn neighbourhood(place: u32, count: u32, radius: u32) -> std::ops::Range<u32> {
    place.saturating_sub(radius)..(place + radius + 1).min(count)
}

/// The cluster to merge with without a search; itself if there is none.
fn next_door(place: u32, count: u32) -> u32 {
    if place ^ 1 < count { place ^ 1 } else { place }
}

type Corners = [[f32; 3]; 2];

/// The neighbour that a cluster would merge with; itself if it is alone.
fn nearest(boxes: &[Corners], place: u32, radius: u32) -> u32 {
    let (mut best, mut chosen) = (WORST, place);
    let [low, high] = boxes[place as usize];
    for other in neighbourhood(place, boxes.len() as u32, radius) {
        let [other_low, other_high] = boxes[other as usize];
        let least = |axis: usize| low[axis].min(other_low[axis]);
        let greatest = |axis: usize| high[axis].max(other_high[axis]);
        let choice = Choice {
            area: half_area([0, 1, 2].map(least), [0, 1, 2].map(greatest)),
            apart: other ^ place,
        };
        if other != place && is_better(choice, best) {
            (best, chosen) = (choice, other);
        }
    }
    chosen
}

/// The tree; inner nodes in order of creation.
pub(super) fn build(sorted: Sorted, radius: u32) -> LinkedTree {
    let mut nodes = sorted.leaves;
    let mut clusters: Vec<u32> = (0..nodes.len() as u32).collect();
    let mut round = 0;
    while clusters.len() > 1 {
        let count = clusters.len() as u32;
        let around = |cluster: &u32| nodes[*cluster as usize].around();
        let corners = |OrderedBox { low, high }| [low.map(number), high.map(number)];
        let boxes: Vec<Corners> = clusters.par_iter().map(around).map(corners).collect();
        let choose = |place: u32| {
            if round < FREE_ROUNDS {
                nearest(&boxes, place, radius)
            } else {
                next_door(place, count)
            }
        };
        let chosen: Vec<u32> = (0..count).into_par_iter().map(choose).collect();
        let mut next = Vec::with_capacity(clusters.len());
        for (place, &other) in (0..).zip(&chosen) {
            let cluster = clusters[place as usize];
            if chosen[other as usize] != place || other == place {
                next.push(cluster);
            } else if place < other {
                let other = clusters[other as usize];
                let [a, b] = [cluster, other].map(|c| nodes[c as usize].around());
                next.push(nodes.len() as u32);
                nodes.push(LinkedNode::new(join(a, b), [cluster, other]));
            }
        }
        clusters = next;
        round += 1;
    }
    LinkedTree {
        nodes,
        root: clusters[0],
    }
}
