//! Quality metrics of trees: SAH cost and end-point overlap.

use super::{NodeKind, Tree, TreeNode};
use crate::StructureStats;
use crate::TriangleSoup;
use crate::polygon::Polygon;
use crate::triangle::TriangleRecord;
use rayon::prelude::*;
use std::collections::BTreeSet;

/// Triangles per task; constant, so that the sum does not depend on the number of threads.
const TRIANGLES_PER_TASK: usize = 16;
/// Triangles between two checks of the budget.
const TRIANGLES_PER_BATCH: usize = 128;

impl Tree {
    /// Depth of the deepest leaf; the root has depth 0.
    pub fn depth(&self) -> u32 {
        let mut depths = vec![0u32; self.nodes.len()];
        let mut deepest = 0;
        for (index, node) in self.nodes.iter().enumerate() {
            deepest = deepest.max(depths[index]);
            if let NodeKind::Inner { left, right } = node.kind {
                depths[left as usize] = depths[index] + 1;
                depths[right as usize] = depths[index] + 1;
            }
        }
        deepest
    }

    /// Statistics of the tree; `bytes` is left 0. SAH with both constants 1: sum over inner nodes
    /// of A(node) / A(root) plus sum over leaves of A(leaf) · triangles / A(root).
    pub fn stats(&self) -> StructureStats {
        let leaves = self.nodes.iter().filter_map(|node| match node.kind {
            NodeKind::Inner { .. } => None,
            NodeKind::Leaf { count, .. } => Some(count as usize),
        });
        let mut stats = StructureStats::of_leaves(leaves);
        if let Some(root) = self.nodes.first() {
            let cost = |node: &TreeNode| f64::from(node.bounds.half_area()) * weight(node.kind);
            let cost = self.nodes.iter().fold(0.0, |sum, node| sum + cost(node));
            let root_area = f64::from(root.bounds.half_area());
            stats.nodes = self.nodes.len() as u64;
            stats.sah_cost = (root_area > 0.0).then(|| cost / root_area);
            stats.depth = Some(self.depth());
            stats.epo = self.epo;
        }
        stats
    }

    /// End-point overlap (Aila, Karras, Laine, "On quality metrics of bounding volume hierarchies",
    /// 2013, eq. 2) with both constants 1: for each node, the area of the surface inside its box
    /// that belongs to none of its triangles, times the node's cost, over the area of all
    /// triangles. Rays that end on that surface visit the node in vain. Triangles are clipped
    /// exactly (f64).
    ///
    /// 0 if the triangles have no area. Takes time in proportion to triangles × nodes that overlap
    /// one; once `most` boxes have been visited, the result is extrapolated from the triangles so
    /// far, which are spread over all.
    pub fn epo(&self, soup: &TriangleSoup, most: u64) -> f64 {
        if self.nodes.is_empty() {
            return 0.0;
        }
        let leaves_of = self.leaves_of_triangles();
        let order = spread(soup.records.len());
        let mut total = Overlap::default();
        for batch in order.chunks(TRIANGLES_PER_BATCH) {
            let tasks = batch.par_chunks(TRIANGLES_PER_TASK);
            let parts: Vec<Overlap> = tasks
                .map(|part| {
                    let triangles = part.iter().map(|&place| &soup.records[place]);
                    self.overlap_of(triangles, &leaves_of)
                })
                .collect();
            // Sequential: the sum must not depend on the threads.
            for part in parts {
                total.area += part.area;
                total.foreign += part.foreign;
                total.visits += part.visits;
            }
            if total.visits >= most {
                break;
            }
        }
        if total.area > 0.0 {
            total.foreign / total.area
        } else {
            0.0
        }
    }

    /// Pairs of a triangle and a leaf that lists it, ascending.
    fn leaves_of_triangles(&self) -> Vec<(u32, u32)> {
        let mut pairs = vec![(0_u32, 0_u32); self.order.len()];
        for (index, node) in self.nodes.iter().enumerate() {
            if let NodeKind::Leaf { first, count } = node.kind {
                for place in first..first + count {
                    pairs[place as usize] = (self.order[place as usize], index as u32);
                }
            }
        }
        pairs.par_sort_unstable();
        pairs
    }

    fn overlap_of<'a>(
        &self,
        triangles: impl Iterator<Item = &'a TriangleRecord>,
        leaves_of: &[(u32, u32)],
    ) -> Overlap {
        let mut sum = Overlap::default();
        let mut walk = OverlapWalk {
            tree: self,
            own: Vec::new(),
            visits: 0,
        };
        for triangle in triangles {
            let begin = leaves_of.partition_point(|(id, _)| *id < triangle.id);
            let own = leaves_of[begin..]
                .iter()
                .take_while(|(id, _)| *id == triangle.id);
            walk.own = own.map(|(_, leaf)| *leaf).collect();
            let polygon = Polygon::new(triangle);
            sum.area += polygon.area();
            sum.foreign += walk.overlap(0, self.nodes.len() as u32, &polygon);
        }
        sum.visits = walk.visits;
        sum
    }
}

/// Sums over triangles: their area, the weighted area in foreign boxes, boxes visited.
#[derive(Default)]
struct Overlap {
    area: f64,
    foreign: f64,
    visits: u64,
}

/// `0..count` in an order whose every prefix is spread evenly: golden-ratio steps (Weyl).
fn spread(count: usize) -> Vec<usize> {
    let golden = (count as f64 * 0.618_033_988_749_895) as usize;
    let step = (golden..).find(|&step| gcd(step, count) == 1).unwrap_or(1);
    (0..count).map(|k| k * step % count).collect()
}

/// Checks that every triangle comes once, whatever divides their number.
///
/// # Errors
/// One does not: of how many.
pub(crate) fn check_spread() -> Result<(), String> {
    for count in 1..=64 {
        let seen: BTreeSet<usize> = spread(count).into_iter().collect();
        if seen.len() != count {
            let found = seen.len();
            return Err(format!(
                "the overlap of {count} known triangles is that of {found}: this program computes wrong figures; build it anew, and \
                 report what stays wrong"
            ));
        }
    }
    Ok(())
}

fn gcd(a: usize, b: usize) -> usize {
    if b == 0 { a } else { gcd(b, a % b) }
}

/// Cost of a node with both constants 1.
fn weight(kind: NodeKind) -> f64 {
    match kind {
        NodeKind::Inner { .. } => 1.0,
        NodeKind::Leaf { count, .. } => f64::from(count),
    }
}

/// The traversal of one triangle through the boxes that it overlaps.
struct OverlapWalk<'a> {
    tree: &'a Tree,
    /// Leaves that list the triangle, ascending.
    own: Vec<u32>,
    visits: u64,
}

impl OverlapWalk<'_> {
    /// Weighted area of the polygon in boxes of the subtree of nodes `node..end` that do not list
    /// its triangle. In depth-first order a subtree is one run of nodes.
    fn overlap(&mut self, node: u32, end: u32, polygon: &Polygon) -> f64 {
        self.visits += 1;
        let TreeNode { bounds, kind } = self.tree.nodes[node as usize];
        let inside = polygon.clipped(&bounds, 0.0);
        let area = inside.area();
        if area <= 0.0 {
            return 0.0;
        }
        let next_own = self.own.partition_point(|&leaf| leaf < node);
        let is_own = self.own.get(next_own).is_some_and(|&leaf| leaf < end);
        let here = if is_own { 0.0 } else { area * weight(kind) };
        match kind {
            NodeKind::Leaf { .. } => here,
            NodeKind::Inner { left, right } => {
                here + self.overlap(left, right, &inside) + self.overlap(right, end, &inside)
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::fixtures::soup;

    /// Two leaves; the first triangle extends into the lower half of the second one's box.
    fn two_leaves() -> (Tree, TriangleSoup) {
        let soup = soup([
            [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
            [[0.0, 0.0, 0.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0]],
        ]);
        let [a, b] = [0, 1].map(|i| soup.records[i].bounds());
        let leaf = |first| NodeKind::Leaf { first, count: 1 };
        let inner = NodeKind::Inner { left: 1, right: 2 };
        let nodes = [(a.union(&b), inner), (a, leaf(0)), (b, leaf(1))];
        let node = |(bounds, kind)| TreeNode { bounds, kind };
        let tree = Tree::new(nodes.map(node).to_vec(), vec![0, 1]);
        (tree, soup)
    }

    #[test]
    fn end_point_overlap_counts_foreign_surface_in_each_box_and_nothing_else() {
        let (tree, soup) = two_leaves();
        // The unit square in the corner of the first triangle (area 8) lies in the second leaf's
        // box; the second triangle touches the first leaf's box in one point.
        let second = Polygon::new(&soup.records[1]).area();
        let expected = 1.0 / (8.0 + second);
        let found = tree.epo(&soup, u64::MAX);
        assert!((found - expected).abs() < 1e-12, "{found} for {expected}");
    }

    #[test]
    fn the_overlap_of_a_record_is_of_all_triangles_of_a_small_scene() {
        let soup = crate::fixtures::lattice(8);
        let mut log = crate::BuildLog::default();
        let mut tree =
            Tree::build(&soup, &crate::tree::TreeParameters::default(), &mut log).unwrap();
        tree.note_epo(&soup);
        let part = tree.epo(&soup, 1);
        assert_ne!(tree.epo, Some(part), "too few triangles to tell");
        assert_eq!(tree.epo, Some(tree.epo(&soup, u64::MAX)));
    }

    #[test]
    fn a_triangle_in_two_leaves_is_foreign_to_neither() {
        let (mut tree, soup) = two_leaves();
        tree.order = vec![0, 1, 0];
        tree.nodes[2].kind = NodeKind::Leaf { first: 1, count: 2 };
        assert_eq!(tree.epo(&soup, u64::MAX), 0.0);
        assert_eq!(Tree::default().epo(&soup, u64::MAX), 0.0);
    }
}
