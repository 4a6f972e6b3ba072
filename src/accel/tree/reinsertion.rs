//! Reinsertion: subtrees are moved to where they reduce the tree's surface area most.
//!
//! A round searches the best positions of the largest subtrees on all cores while the tree is
//! constant, then moves them one by one, most profitable first. A move is dropped if an earlier one
//! touched its nodes, so the result does not depend on the number of threads.
//!
//! Sources: J. Bittner, M. Hapala, V. Havran, "Fast insertion-based optimization of bounding volume
//! hierarchies", 2013 (the search); D. Meister, J. Bittner, "Parallel reinsertion for bounding
//! volume hierarchy optimization", 2018 (rounds).

use super::depth::depth_limit;
use super::grow::lay_out;
use super::parameters::TreeParameters;
use super::reference::Box3;
use super::{NodeKind, Tree, TreeNode};
use rayon::prelude::*;

const ROOT: u32 = 0;

/// A node with a parent link. Siblings are adjacent, at an odd index and the next even one.
#[derive(Clone, Copy)]
struct Node {
    bounds: Box3,
    parent: u32,
    /// First child, or [`Node::leaf_first`] of a leaf.
    first: u32,
    /// Entries of a leaf; 0 for inner nodes.
    count: u32,
    /// Levels below.
    height: u32,
}

/// A move: `node` becomes the sibling of `target`.
#[derive(Clone, Copy)]
struct Move {
    node: u32,
    target: u32,
    /// Reduction of the tree's half area.
    gain: f32,
}

/// Improves `tree` by `settings.reinsertion` rounds; leaves are unchanged.
pub(super) fn optimise(tree: Tree, settings: &TreeParameters) -> Tree {
    let mut hierarchy = Hierarchy::new(&tree);
    let order = tree.order;
    drop(tree.nodes);
    for _ in 0..settings.reinsertion {
        if hierarchy.round(settings.reinsertion_share) == 0 {
            break;
        }
    }
    hierarchy.lay_out(&order)
}

struct Hierarchy {
    nodes: Vec<Node>,
    depth_limit: u32,
    /// Nodes changed by moves of this round.
    touched: Vec<bool>,
}

fn sibling(node: u32) -> u32 {
    ((node - 1) ^ 1) + 1
}

impl Hierarchy {
    fn new(tree: &Tree) -> Self {
        let mut nodes: Vec<Node> = Vec::with_capacity(tree.nodes.len());
        let node = |index: u32, parent| {
            let TreeNode { bounds, kind } = tree.nodes[index as usize];
            let (first, count) = match kind {
                NodeKind::Leaf { first, count } => (first, count),
                // For now the source of its children.
                NodeKind::Inner { .. } => (index, 0),
            };
            Node {
                bounds: bounds.into(),
                parent,
                first,
                count,
                height: 0,
            }
        };
        nodes.push(node(0, ROOT));
        // Breadth first keeps large nodes, which searches visit most, together.
        let mut here = 0;
        while here < nodes.len() {
            if nodes[here].count == 0
                && let NodeKind::Inner { left, right } = tree.nodes[nodes[here].first as usize].kind
            {
                nodes[here].first = nodes.len() as u32;
                nodes.push(node(left, here as u32));
                nodes.push(node(right, here as u32));
            }
            here += 1;
        }
        let mut hierarchy = Self {
            depth_limit: depth_limit(tree.order.len()),
            touched: vec![false; nodes.len()],
            nodes,
        };
        for index in (0..hierarchy.nodes.len() as u32).rev() {
            hierarchy.update(index);
        }
        hierarchy
    }

    fn node(&self, index: u32) -> &Node {
        &self.nodes[index as usize]
    }

    /// Sets box and height of an inner node from its children.
    fn update(&mut self, index: u32) {
        let Node { first, count, .. } = *self.node(index);
        if count == 0 {
            let (left, right) = (*self.node(first), *self.node(first + 1));
            let node = &mut self.nodes[index as usize];
            node.bounds = left.bounds.union(right.bounds);
            node.height = 1 + left.height.max(right.height);
        }
    }

    /// One round; returns the number of moved subtrees.
    fn round(&mut self, share: f32) -> usize {
        let mut moves: Vec<Move> = self
            .candidates(share)
            .into_par_iter()
            .filter_map(|node| self.best_move(node))
            .collect();
        moves.par_sort_unstable_by(|a, b| b.gain.total_cmp(&a.gain).then(a.node.cmp(&b.node)));
        self.touched.fill(false);
        moves.into_iter().filter(|&m| self.apply(m)).count()
    }

    /// The largest nodes, by index.
    fn candidates(&self, share: f32) -> Vec<u32> {
        // Neither the root nor its children can move.
        let mut all: Vec<u32> = (3..self.nodes.len() as u32).collect();
        let wanted = (all.len() as f32 * share).ceil() as usize;
        if wanted < all.len() {
            let area = |index: &u32| self.node(*index).bounds.half_area();
            all.select_nth_unstable_by(wanted, |a, b| area(b).total_cmp(&area(a)).then(a.cmp(b)));
            all.truncate(wanted);
            all.sort_unstable();
        }
        all
    }

    /// The best new position of a subtree, by branch and bound over the rest of the tree.
    ///
    /// Going up from the node, `saved` is the area that its removal saves in the nodes passed;
    /// going down again, the area that the insertion adds to boxes on the way is subtracted.
    fn best_move(&self, index: u32) -> Option<Move> {
        let moved = self.node(index).bounds;
        let least = moved.half_area();
        let parent = self.node(index).parent;
        let mut best = Move {
            node: index,
            target: ROOT,
            gain: 0.0,
        };
        let mut pivot = parent;
        let mut beside = sibling(index);
        let mut without = self.node(beside).bounds;
        let mut saved = self.node(parent).bounds.half_area();
        let mut stack: Vec<(f32, u32)> = Vec::with_capacity(64);
        loop {
            stack.push((saved, beside));
            while let Some((saved, target)) = stack.pop() {
                if saved - least <= best.gain {
                    continue;
                }
                let node = self.node(target);
                let gain = saved - node.bounds.union(moved).half_area();
                // Moving it next to its current sibling changes nothing.
                if gain > best.gain && target != sibling(index) {
                    (best.gain, best.target) = (gain, target);
                }
                if node.count == 0 {
                    let below = gain + node.bounds.half_area();
                    stack.push((below, node.first));
                    stack.push((below, node.first + 1));
                }
            }
            if pivot == ROOT {
                break;
            }
            if pivot != parent {
                without = without.union(self.node(beside).bounds);
                saved += self.node(pivot).bounds.half_area() - without.half_area();
            }
            beside = sibling(pivot);
            pivot = self.node(pivot).parent;
        }
        (best.gain > 0.0).then_some(best)
    }

    /// Moves a subtree unless an earlier move of the round is in the way or the tree would become
    /// too deep; returns true if it did.
    fn apply(&mut self, Move { node, target, .. }: Move) -> bool {
        let parent = self.node(node).parent;
        let beside = sibling(node);
        let involved = [node, beside, parent, target, self.node(target).parent];
        if target == parent || involved.iter().any(|&i| self.touched[i as usize]) {
            return false;
        }
        let mut depth = 1;
        let mut above = target;
        while above != ROOT {
            // Earlier moves may have moved the target below the node.
            if above == node {
                return false;
            }
            above = self.node(above).parent;
            depth += 1;
        }
        if depth + self.node(node).height.max(self.node(target).height) > self.depth_limit {
            return false;
        }
        involved
            .iter()
            .for_each(|&i| self.touched[i as usize] = true);

        // The sibling replaces the parent, which frees the pair.
        let pair = node.min(beside);
        let (moved, kept, displaced) = (*self.node(node), *self.node(beside), *self.node(target));
        let below = |parent, node| Node { parent, ..node };
        self.place(parent, below(self.node(parent).parent, kept));
        // If the target were the sibling, it would have moved; but that is excluded.
        self.place(pair, below(target, displaced));
        self.place(pair + 1, below(target, moved));
        let joint = &mut self.nodes[target as usize];
        (joint.first, joint.count) = (pair, 0);
        self.update_upwards(target);
        self.update_upwards(self.node(parent).parent);
        true
    }

    /// Stores a node at `index` and updates its children's links.
    fn place(&mut self, index: u32, node: Node) {
        self.nodes[index as usize] = node;
        if node.count == 0 {
            self.nodes[node.first as usize].parent = index;
            self.nodes[node.first as usize + 1].parent = index;
        }
    }

    fn update_upwards(&mut self, mut index: u32) {
        loop {
            let before = *self.node(index);
            self.update(index);
            let after = self.node(index);
            if index == ROOT || (before.bounds == after.bounds && before.height == after.height) {
                return;
            }
            index = before.parent;
        }
    }

    /// The tree in depth-first order, with the leaves as consecutive runs of a new order.
    fn lay_out(&self, old_order: &[u32]) -> Tree {
        lay_out(ROOT, |index, _, order| {
            let node = self.node(index);
            if node.count == 0 {
                return (node.bounds.into(), Some([node.first, node.first + 1]));
            }
            let entries = node.first as usize..(node.first + node.count) as usize;
            order.extend_from_slice(&old_order[entries]);
            (node.bounds.into(), None)
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    /// A tree over boxes in an order that knows nothing of space, so that most nodes would gain far away.
    fn careless(random: &mut Pcg32, boxes: usize) -> Hierarchy {
        let leaves: Vec<Box3> = (0..boxes)
            .map(|_| {
                let low = 10.0 * random.in_cube().as_vec3a();
                let size = random.in_cube().as_vec3a().abs();
                Box3 {
                    min: low,
                    max: low + size,
                }
            })
            .collect();
        let tree = lay_out(0..boxes, |range, _, order| {
            let bounds = leaves[range.clone()]
                .iter()
                .copied()
                .fold(Box3::EMPTY, Box3::union);
            let middle = range.start + range.len().div_ceil(3);
            if range.len() > 1 {
                return (
                    bounds.into(),
                    Some([range.start..middle, middle..range.end]),
                );
            }
            order.push(range.start as u32);
            (bounds.into(), None)
        });
        Hierarchy::new(&tree)
    }

    /// The sum of half the areas of all nodes.
    fn areas(hierarchy: &Hierarchy) -> f64 {
        let areas = hierarchy
            .nodes
            .iter()
            .map(|n| f64::from(n.bounds.half_area()));
        areas.sum()
    }

    #[test]
    fn the_best_move_spares_as_much_area_as_the_best_of_all_moves_that_are_tried() {
        let mut random = Pcg32::new(11);
        for _ in 0..4 {
            let before = careless(&mut random, 14);
            for node in 3..before.nodes.len() as u32 {
                let spared = |target: u32| {
                    let mut after = Hierarchy {
                        nodes: before.nodes.clone(),
                        touched: vec![false; before.nodes.len()],
                        depth_limit: u32::MAX,
                    };
                    let gain = 0.0;
                    let is_done = after.apply(Move { node, target, gain });
                    is_done.then(|| areas(&before) - areas(&after))
                };
                // Neither beside itself, nor beside a node that holds it: those places are not searched.
                let holds = |target: u32| {
                    let mut above = node;
                    while above != target && above != ROOT {
                        above = before.node(above).parent;
                    }
                    above == target
                };
                let targets = 1..before.nodes.len() as u32;
                let others = targets.filter(|t| *t != sibling(node) && !holds(*t));
                let most = others.filter_map(spared).fold(0.0, f64::max);
                let found = before
                    .best_move(node)
                    .map_or(0.0, |best| f64::from(best.gain));
                assert!(
                    (found - most).abs() < 1e-3 * most.max(1.0),
                    "{node}: {found}, {most}"
                );
            }
        }
    }
}
