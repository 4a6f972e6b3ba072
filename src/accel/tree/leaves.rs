//! Merging of subtrees that cost more than one leaf over their triangles.
//!
//! Greedy builders decide on a leaf before they know the result of a split. Here the subtree
//! already exists, so the decision is exact: for the given splits no other choice of leaves is
//! cheaper.

use super::parameters::TreeParameters;
use super::{NodeKind, Tree};

/// Properties of a subtree once everything below it is decided.
#[derive(Clone, Copy, Default)]
struct Below {
    /// Cost with the best choice of leaves, times the area of the root.
    cost: f32,
    /// Entries of the order.
    first: u32,
    count: u32,
    /// True if it is a single leaf.
    is_leaf: bool,
    /// The node after the subtree in depth-first order.
    end: u32,
}

/// Chooses the leaves of `tree`, whose leaves are consecutive runs of the order; a triangle that
/// occurs twice in one leaf is listed there once.
pub(super) fn choose_leaves(tree: Tree, has_duplicates: bool, settings: &TreeParameters) -> Tree {
    let mut below = vec![Below::default(); tree.nodes.len()];
    let triangles = |first: u32, count: u32| {
        let entries = &tree.order[first as usize..(first + count) as usize];
        if has_duplicates {
            distinct(entries).count()
        } else {
            entries.len()
        }
    };
    for (index, node) in tree.nodes.iter().enumerate().rev() {
        let area = node.bounds.half_area();
        let leaf_cost = |count: usize| settings.intersection_cost * area * count as f32;
        below[index] = match node.kind {
            NodeKind::Leaf { first, count } => Below {
                cost: leaf_cost(count as usize),
                first,
                count,
                is_leaf: true,
                end: index as u32 + 1,
            },
            NodeKind::Inner { left, right } => {
                let (l, r) = (below[left as usize], below[right as usize]);
                let mut subtree = Below {
                    cost: settings.traversal_cost * area + l.cost + r.cost,
                    first: l.first,
                    count: l.count + r.count,
                    is_leaf: false,
                    end: r.end,
                };
                if subtree.count as usize <= 2 * settings.leaf_size {
                    let count = triangles(subtree.first, subtree.count);
                    let pays = leaf_cost(count) <= subtree.cost || count <= settings.least_leaf();
                    if count <= settings.leaf_size && pays {
                        subtree.cost = leaf_cost(count);
                        subtree.is_leaf = true;
                    }
                }
                subtree
            }
        };
    }
    copy_kept(&tree, &below, has_duplicates)
}

/// Distinct entries, in order of first occurrence.
pub(crate) fn distinct(entries: &[u32]) -> impl Iterator<Item = u32> {
    let is_first = |(place, id): &(usize, &u32)| !entries[..*place].contains(id);
    entries
        .iter()
        .enumerate()
        .filter(is_first)
        .map(|(_, id)| *id)
}

/// The nodes above and at the chosen leaves, still in depth-first order.
fn copy_kept(tree: &Tree, below: &[Below], has_duplicates: bool) -> Tree {
    let mut nodes = Vec::with_capacity(tree.nodes.len());
    let mut order = Vec::with_capacity(tree.order.len());
    let mut new_index = vec![0_u32; tree.nodes.len()];
    let mut index = 0;
    while let Some(&node) = tree.nodes.get(index) {
        new_index[index] = nodes.len() as u32;
        let subtree = below[index];
        nodes.push(node);
        index += 1;
        if subtree.is_leaf {
            let (first, count) = (subtree.first as usize, subtree.count as usize);
            let entries = &tree.order[first..first + count];
            let begin = order.len();
            if has_duplicates {
                order.extend(distinct(entries));
            } else {
                order.extend_from_slice(entries);
            }
            nodes[new_index[index - 1] as usize].kind = NodeKind::Leaf {
                first: begin as u32,
                count: (order.len() - begin) as u32,
            };
            index = subtree.end as usize;
        }
    }
    for node in &mut nodes {
        if let NodeKind::Inner { left, right } = &mut node.kind {
            *left = new_index[*left as usize];
            *right = new_index[*right as usize];
        }
    }
    nodes.shrink_to_fit();
    Tree::new(nodes, order)
}
