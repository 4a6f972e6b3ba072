//! The binary tree under `bvh` and `roped-bvh`: binned SAH on both cores, the same tree for any
//! number of threads.
//!
//! Source: I. Wald, "On fast construction of SAH-based bounding volume hierarchies", 2007.

use super::bounds::Bounds;
use super::triangle::TriangleRecord;
use super::{AccelError, BuildLog, TriangleSoup};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};
use crate::measure::record::StructureStats;

const BINS: usize = 16;
/// Below this depth splits are by SAH, beyond it by the median, so that depth stays below
/// `SAH_DEPTH + log2(n)` whatever the input.
const SAH_DEPTH: u32 = 48;
/// Subtrees of fewer triangles are built by one thread.
const PARALLEL_GRAIN: usize = 4096;

/// A node; children of an inner node lie at `left` and `right`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TreeNode {
    /// Box around everything below.
    pub bounds: Bounds,
    /// What is below.
    pub kind: NodeKind,
}

/// What a node holds.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum NodeKind {
    /// Two children, by node index.
    Inner {
        /// First child.
        left: u32,
        /// Second child.
        right: u32,
    },
    /// A range of [`Tree::order`].
    Leaf {
        /// First entry.
        first: u32,
        /// Number of entries.
        count: u32,
    },
}

/// A binary tree over triangles; node 0 is the root, nodes are in depth-first order.
#[derive(Debug, Clone, Default)]
pub struct Tree {
    /// Nodes; empty for an empty scene.
    pub nodes: Vec<TreeNode>,
    /// Triangle indices, leaf by leaf.
    pub order: Vec<u32>,
}

/// Parameters that all structures over this tree share.
pub fn tree_parameters() -> ParameterSchema {
    let number = |name, description, default| Parameter {
        name,
        description,
        default: ParamValue::Number(default),
        range: ParamRange::Number {
            min: 0.01,
            max: 100.0,
        },
    };
    vec![
        Parameter {
            name: "leaf_size",
            description: "most triangles in a leaf",
            default: ParamValue::Integer(4),
            range: ParamRange::Integer { min: 1, max: 31 },
        },
        number("traversal_cost", "SAH cost of visiting an inner node", 1.0),
        number("intersection_cost", "SAH cost of testing a triangle", 1.0),
    ]
}

#[derive(Clone, Copy)]
struct Primitive {
    bounds: Bounds,
    id: u32,
}

struct Settings {
    leaf_size: usize,
    traversal_cost: f32,
    intersection_cost: f32,
}

impl Tree {
    /// Builds the tree with the builder that `params` name; phases are timed in `log`.
    ///
    /// # Errors
    /// A limit of the builder is exceeded.
    pub fn build(
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Tree, AccelError> {
        Ok(log.phase("binned", || Self::build_binned(soup, params)))
    }

    fn build_binned(soup: &TriangleSoup, params: &Params) -> Tree {
        let settings = Settings {
            leaf_size: params.integer("leaf_size") as usize,
            traversal_cost: params.number("traversal_cost") as f32,
            intersection_cost: params.number("intersection_cost") as f32,
        };
        let mut primitives: Vec<Primitive> = soup
            .records
            .iter()
            .map(|r| Primitive {
                bounds: r.bounds(),
                id: r.id,
            })
            .collect();
        if primitives.is_empty() {
            return Tree::default();
        }
        let bounds = bounds_of(&primitives);
        let subtree = build_subtree(&mut primitives, bounds, 0, &settings, 0);
        let order = primitives.iter().map(|p| p.id).collect();
        drop(primitives);
        let mut nodes = Vec::new();
        lay_out(subtree, &mut nodes);
        nodes.shrink_to_fit();
        Tree { nodes, order }
    }

    /// Deepest leaf; the root has depth 0.
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

    /// Figures of the tree; `bytes` is left 0. SAH with both constants 1: sum over inner nodes of
    /// A(node) / A(root) plus sum over leaves of A(leaf) · triangles / A(root).
    pub fn stats(&self) -> StructureStats {
        let mut stats = StructureStats {
            nodes: self.nodes.len() as u64,
            references: self.order.len() as u64,
            ..Default::default()
        };
        let Some(root) = self.nodes.first() else {
            return stats;
        };
        let leaves = self.nodes.iter().filter_map(|node| match node.kind {
            NodeKind::Inner { .. } => None,
            NodeKind::Leaf { count, .. } => Some(count as usize),
        });
        stats.leaf_histogram = super::leaf_histogram(leaves);
        let mut cost = 0.0_f64;
        for node in &self.nodes {
            let weight = match node.kind {
                NodeKind::Inner { .. } => 1,
                NodeKind::Leaf { count, .. } => {
                    stats.leaves += 1;
                    count
                }
            };
            cost += f64::from(node.bounds.half_area()) * f64::from(weight);
        }
        let root_area = f64::from(root.bounds.half_area());
        stats.sah_cost = (root_area > 0.0).then(|| cost / root_area);
        stats.depth = Some(self.depth());
        stats
    }
}

/// Bookkeeping of `validate()`: every node reached once, every triangle in one leaf that contains it.
pub struct Coverage<'a> {
    soup: &'a TriangleSoup,
    nodes: Vec<bool>,
    triangles: Vec<bool>,
}

impl<'a> Coverage<'a> {
    /// Nothing reached yet.
    pub fn new(soup: &'a TriangleSoup, nodes: usize) -> Self {
        Self {
            soup,
            nodes: vec![false; nodes],
            triangles: vec![false; soup.records.len()],
        }
    }

    /// Notes that a node is reached.
    ///
    /// # Errors
    /// It does not exist or was reached before.
    pub fn node(&mut self, index: usize) -> Result<(), AccelError> {
        match self.nodes.get_mut(index) {
            // The root of an empty scene is no node.
            None if index == 0 => Ok(()),
            None => Err(AccelError::Invalid(format!("node {index} does not exist"))),
            Some(true) => Err(AccelError::Invalid(format!(
                "node {index} is reached twice"
            ))),
            Some(seen) => {
                *seen = true;
                Ok(())
            }
        }
    }

    /// Notes the triangles of a leaf with these bounds; `None` is a range outside the array.
    ///
    /// # Errors
    /// The range does not exist, or a triangle differs from the scene's, is in two leaves, or
    /// sticks out of the leaf's box.
    pub fn leaf(
        &mut self,
        triangles: Option<&[TriangleRecord]>,
        bounds: &Bounds,
    ) -> Result<(), AccelError> {
        let Some(triangles) = triangles else {
            return Err(AccelError::Invalid(
                "a leaf lies outside the triangle array".to_owned(),
            ));
        };
        for triangle in triangles {
            let id = triangle.id;
            if self.soup.records.get(id as usize) != Some(triangle) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} is not the scene's"
                )));
            }
            if std::mem::replace(&mut self.triangles[id as usize], true) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} is in two leaves"
                )));
            }
            if !bounds.contains(&triangle.bounds()) {
                return Err(AccelError::Invalid(format!(
                    "triangle {id} sticks out of its leaf's box"
                )));
            }
        }
        Ok(())
    }

    /// Checks that nothing was missed.
    ///
    /// # Errors
    /// A node or triangle was not reached.
    pub fn is_complete(&self) -> Result<(), AccelError> {
        if let Some(lost) = self.triangles.iter().position(|seen| !seen) {
            return Err(AccelError::Invalid(format!(
                "triangle {lost} is in no leaf"
            )));
        }
        match self.nodes.iter().position(|seen| !seen) {
            Some(orphan) => Err(AccelError::Invalid(format!(
                "node {orphan} is never reached"
            ))),
            None => Ok(()),
        }
    }
}

/// A subtree under construction. Subtrees above the parallel grain are joined by reference and laid
/// out once in the end: copying them at every level would cost O(n log n).
enum Subtree {
    /// Nodes in depth-first order, children relative to the first.
    Whole(Vec<TreeNode>),
    Inner(Bounds, Box<(Subtree, Subtree)>),
}

/// Builds the subtree over `primitives`, which begin at `first` in the whole order.
fn build_subtree(
    primitives: &mut [Primitive],
    bounds: Bounds,
    first: u32,
    settings: &Settings,
    depth: u32,
) -> Subtree {
    if primitives.len() <= PARALLEL_GRAIN {
        let mut nodes = Vec::new();
        append_subtree(primitives, bounds, first, settings, depth, &mut nodes);
        return Subtree::Whole(nodes);
    }
    let Some((middle, [low_bounds, high_bounds])) = split(primitives, &bounds, settings, depth)
    else {
        return Subtree::Whole(vec![leaf(primitives, bounds, first)]);
    };
    let (low, high) = primitives.split_at_mut(middle);
    let second = first + middle as u32;
    Subtree::Inner(
        bounds,
        Box::new(rayon::join(
            || build_subtree(low, low_bounds, first, settings, depth + 1),
            || build_subtree(high, high_bounds, second, settings, depth + 1),
        )),
    )
}

/// The same on one thread, straight into `nodes`.
fn append_subtree(
    primitives: &mut [Primitive],
    bounds: Bounds,
    first: u32,
    settings: &Settings,
    depth: u32,
    nodes: &mut Vec<TreeNode>,
) {
    let here = nodes.len();
    nodes.push(leaf(primitives, bounds, first));
    let Some((middle, [low_bounds, high_bounds])) = split(primitives, &bounds, settings, depth)
    else {
        return;
    };
    let (low, high) = primitives.split_at_mut(middle);
    append_subtree(low, low_bounds, first, settings, depth + 1, nodes);
    let right = nodes.len() as u32;
    nodes[here].kind = NodeKind::Inner {
        left: here as u32 + 1,
        right,
    };
    append_subtree(
        high,
        high_bounds,
        first + middle as u32,
        settings,
        depth + 1,
        nodes,
    );
}

fn leaf(primitives: &[Primitive], bounds: Bounds, first: u32) -> TreeNode {
    let count = primitives.len() as u32;
    TreeNode {
        bounds,
        kind: NodeKind::Leaf { first, count },
    }
}

/// Appends a subtree to the final nodes and frees it.
fn lay_out(subtree: Subtree, nodes: &mut Vec<TreeNode>) {
    let here = nodes.len() as u32;
    match subtree {
        Subtree::Whole(part) => nodes.extend(part.into_iter().map(|mut node| {
            if let NodeKind::Inner { left, right } = &mut node.kind {
                *left += here;
                *right += here;
            }
            node
        })),
        Subtree::Inner(bounds, children) => {
            nodes.push(TreeNode {
                bounds,
                kind: NodeKind::Leaf { first: 0, count: 0 },
            });
            let (low, high) = *children;
            lay_out(low, nodes);
            let right = nodes.len() as u32;
            nodes[here as usize].kind = NodeKind::Inner {
                left: here + 1,
                right,
            };
            lay_out(high, nodes);
        }
    }
}

fn bounds_of(primitives: &[Primitive]) -> Bounds {
    primitives
        .iter()
        .fold(Bounds::EMPTY, |b, p| b.union(&p.bounds))
}

/// Partitions `primitives`; returns where the second half starts and the bounds of both. `None`
/// makes a leaf.
fn split(
    primitives: &mut [Primitive],
    bounds: &Bounds,
    settings: &Settings,
    depth: u32,
) -> Option<(usize, [Bounds; 2])> {
    let count = primitives.len();
    if count <= 1 {
        return None;
    }
    let best = (depth < SAH_DEPTH)
        .then(|| best_bin_split(primitives))
        .flatten();
    let leaf_cost = settings.intersection_cost * count as f32;
    match best {
        Some(plan) => {
            let area = bounds.half_area().max(f32::MIN_POSITIVE);
            let cost = settings.traversal_cost + settings.intersection_cost * plan.cost / area;
            if count <= settings.leaf_size && leaf_cost <= cost {
                return None;
            }
            Some((partition(primitives, |p| plan.side(p)), plan.bounds))
        }
        None if count <= settings.leaf_size => None,
        // All centres coincide, or the tree is already deep: halves, in an order that depends on
        // the input alone.
        None => {
            let axis = longest_axis(bounds);
            primitives.sort_unstable_by(|a, b| {
                let key = |p: &Primitive| p.bounds.doubled_centre()[axis];
                key(a).total_cmp(&key(b)).then(a.id.cmp(&b.id))
            });
            let (low, high) = primitives.split_at(count / 2);
            Some((count / 2, [bounds_of(low), bounds_of(high)]))
        }
    }
}

fn longest_axis(bounds: &Bounds) -> usize {
    let extent = bounds.extent();
    (0..3)
        .max_by(|&a, &b| extent[a].total_cmp(&extent[b]))
        .unwrap_or(0)
}

struct BinSplit {
    axis: usize,
    origin: f32,
    scale: f32,
    bin: usize,
    /// Sum over both sides of half area times count.
    cost: f32,
    /// Bounds of both sides.
    bounds: [Bounds; 2],
}

impl BinSplit {
    fn side(&self, primitive: &Primitive) -> bool {
        bin_of(
            primitive.bounds.doubled_centre()[self.axis],
            self.origin,
            self.scale,
        ) < self.bin
    }
}

fn bin_of(centre: f32, origin: f32, scale: f32) -> usize {
    (((centre - origin) * scale) as usize).min(BINS - 1)
}

/// The best of the 3 × 15 bin borders; `None` if all centres coincide.
fn best_bin_split(primitives: &[Primitive]) -> Option<BinSplit> {
    let mut centres = Bounds::EMPTY;
    for p in primitives {
        let c = p.bounds.doubled_centre();
        centres = centres.union(&Bounds { min: c, max: c });
    }
    let extent = centres.extent();
    let scale = extent.map(|e| {
        if e > 0.0 {
            BINS as f32 * (1.0 - 1e-6) / e
        } else {
            0.0
        }
    });
    let mut bins = [[(Bounds::EMPTY, 0u32); BINS]; 3];
    for p in primitives {
        let c = p.bounds.doubled_centre();
        for axis in 0..3 {
            let bin = &mut bins[axis][bin_of(c[axis], centres.min[axis], scale[axis])];
            bin.0 = bin.0.union(&p.bounds);
            bin.1 += 1;
        }
    }
    let mut best: Option<BinSplit> = None;
    for axis in 0..3 {
        if !(scale[axis] > 0.0 && scale[axis].is_finite()) {
            continue;
        }
        // Bounds and count of all bins from this one on.
        let mut right = [(Bounds::EMPTY, 0u32); BINS];
        let (mut bounds, mut count) = (Bounds::EMPTY, 0u32);
        for bin in (1..BINS).rev() {
            bounds = bounds.union(&bins[axis][bin].0);
            count += bins[axis][bin].1;
            right[bin] = (bounds, count);
        }
        let (mut bounds, mut count) = (Bounds::EMPTY, 0u32);
        for bin in 1..BINS {
            bounds = bounds.union(&bins[axis][bin - 1].0);
            count += bins[axis][bin - 1].1;
            let (right_bounds, right_count) = right[bin];
            if count == 0 || right_count == 0 {
                continue;
            }
            let cost =
                bounds.half_area() * count as f32 + right_bounds.half_area() * right_count as f32;
            if best.as_ref().is_none_or(|b| cost < b.cost) {
                let (origin, scale) = (centres.min[axis], scale[axis]);
                best = Some(BinSplit {
                    axis,
                    origin,
                    scale,
                    bin,
                    cost,
                    bounds: [bounds, right_bounds],
                });
            }
        }
    }
    best
}

/// Moves the elements of the first side to the front; returns how many there are.
fn partition(primitives: &mut [Primitive], is_first: impl Fn(&Primitive) -> bool) -> usize {
    let mut boundary = 0;
    for i in 0..primitives.len() {
        if is_first(&primitives[i]) {
            primitives.swap(i, boundary);
            boundary += 1;
        }
    }
    boundary
}
