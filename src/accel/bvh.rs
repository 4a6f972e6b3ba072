//! `bvh`: binary BVH with the boxes of both children in a 64-byte node, traversed near child first
//! with a stack. Twin of `kernels/accel/bvh.wesl`.
//!
//! Source: T. Aila, S. Laine, "Understanding the efficiency of ray traversal on GPUs", HPG 2009.

use super::bounds::{Bounds, enter_box};
use super::ray::{Hit, NO_HIT, Ray, safe_inverse};
use super::tree::{Coverage, NodeKind, Tree, tree_parameters};
use super::triangle::{TriangleRecord, intersect_triangle};
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords,
    TriangleSoup,
};
use crate::config::{ParameterSchema, Params};
use crate::measure::record::StructureStats;
use bytemuck::{Pod, Zeroable};

/// Marks a reference to a leaf; bits 26–30 hold its count, bits 0–25 its first triangle.
const LEAF: u32 = 0x8000_0000;
const COUNT_SHIFT: u32 = 26;
const FIRST_MASK: u32 = (1 << COUNT_SHIFT) - 1;
/// Root of an empty scene and missing second child of a one-leaf tree: a leaf without triangles.
const EMPTY_LEAF: u32 = LEAF;

/// The registry entry.
pub struct Bvh;

impl AccelKind for Bvh {
    fn name(&self) -> &'static str {
        "bvh"
    }

    fn description(&self) -> &'static str {
        "binary BVH, binned SAH (Wald 2007), stack, near child first (Aila & Laine 2009)"
    }

    fn parameters(&self) -> ParameterSchema {
        tree_parameters()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        Ok(Box::new(BvhTwin::build(soup, params, log)?))
    }
}

/// Boxes of both children with what they refer to: four `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    left_min: [f32; 3],
    left: u32,
    left_max: [f32; 3],
    unused_left: u32,
    right_min: [f32; 3],
    right: u32,
    right_max: [f32; 3],
    unused_right: u32,
}

impl Node {
    const NOTHING: Node = Node {
        left_min: [0.0; 3],
        left: EMPTY_LEAF,
        left_max: [0.0; 3],
        unused_left: 0,
        right_min: [0.0; 3],
        right: EMPTY_LEAF,
        right_max: [0.0; 3],
        unused_right: 0,
    };

    fn left_bounds(&self) -> Bounds {
        Bounds {
            min: self.left_min,
            max: self.left_max,
        }
    }

    fn right_bounds(&self) -> Bounds {
        Bounds {
            min: self.right_min,
            max: self.right_max,
        }
    }
}

/// The built structure; it is its own CPU twin, and the judge of the gate.
pub struct BvhTwin {
    stats: StructureStats,
    nodes: Vec<Node>,
    /// Triangle records leaf by leaf, so that a leaf is one run of memory.
    leaf_triangles: Vec<TriangleRecord>,
    stack_entries: u32,
}

impl BvhTwin {
    /// Builds tree and layout.
    ///
    /// # Errors
    /// More triangles than a leaf reference can address.
    pub fn build(
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        let count = soup.records.len() as u64;
        if count > u64::from(FIRST_MASK) {
            return Err(AccelError::Limit {
                what: "triangles of a bvh".into(),
                needed: count,
                limit: FIRST_MASK.into(),
            });
        }
        let tree = Tree::build(soup, params, log)?;
        let (nodes, leaf_triangles): (Vec<Node>, Vec<TriangleRecord>) = log.phase("layout", || {
            (
                layout(&tree),
                tree.order
                    .iter()
                    .map(|&id| soup.records[id as usize])
                    .collect(),
            )
        });
        let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
        // One entry is pushed for each level at most.
        let stack_entries = tree.depth().max(1);
        Ok(Self {
            stats: StructureStats {
                bytes: bytes as u64,
                ..tree.stats()
            },
            nodes,
            leaf_triangles,
            stack_entries,
        })
    }

    fn leaf(
        &self,
        reference: u32,
        ray: &Ray,
        inverse: [f32; 3],
        hit: &mut Hit,
        counters: &mut Counters,
    ) {
        let first = (reference & FIRST_MASK) as usize;
        let count = ((reference & !LEAF) >> COUNT_SHIFT) as usize;
        for triangle in &self.leaf_triangles[first..first + count] {
            counters.triangle_tests += 1;
            intersect_triangle(triangle, ray, inverse, hit);
        }
    }

    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let inverse = safe_inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        let mut stack = Vec::with_capacity(self.stack_entries as usize);
        let mut current = 0_u32;
        loop {
            counters.nodes += 1;
            counters.box_tests += 2;
            let node = &self.nodes[current as usize];
            let left = enter_box(&node.left_bounds(), ray, inverse, hit.t);
            let right = enter_box(&node.right_bounds(), ray, inverse, hit.t);
            let (mut near, mut far) = ((left, node.left), (right, node.right));
            if right.is_some_and(|r| left.is_none_or(|l| r < l)) {
                std::mem::swap(&mut near, &mut far);
            }
            let mut next = None;
            for (enter, reference) in [near, far] {
                // The far child is looked at again: the near one may have brought a nearer hit.
                if !enter.is_some_and(|e| e <= hit.t * super::bounds::BOX_PAD) {
                    continue;
                }
                if reference & LEAF != 0 {
                    self.leaf(reference, ray, inverse, &mut hit, counters);
                    if any && hit.triangle != NO_HIT {
                        return hit;
                    }
                } else if next.is_none() {
                    next = Some(reference);
                } else {
                    stack.push(reference);
                    counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
                }
            }
            match next.or_else(|| stack.pop()) {
                Some(reference) => current = reference,
                None => return hit,
            }
        }
    }
}

/// Nodes with the boxes of their children, in the tree's depth-first order, leaves folded into
/// references.
fn layout(tree: &Tree) -> Vec<Node> {
    let mut inner_index = vec![u32::MAX; tree.nodes.len()];
    let mut inner_count = 0;
    for (index, node) in tree.nodes.iter().enumerate() {
        if matches!(node.kind, NodeKind::Inner { .. }) {
            inner_index[index] = inner_count;
            inner_count += 1;
        }
    }
    let reference = |index: u32| match tree.nodes[index as usize].kind {
        NodeKind::Inner { .. } => inner_index[index as usize],
        NodeKind::Leaf { first, count } => LEAF | count << COUNT_SHIFT | first,
    };
    let mut nodes = Vec::with_capacity(inner_count as usize);
    for node in &tree.nodes {
        if let NodeKind::Inner { left, right } = node.kind {
            let (l, r) = (
                &tree.nodes[left as usize].bounds,
                &tree.nodes[right as usize].bounds,
            );
            nodes.push(Node {
                left_min: l.min,
                left: reference(left),
                left_max: l.max,
                right_min: r.min,
                right: reference(right),
                right_max: r.max,
                ..Node::NOTHING
            });
        }
    }
    if nodes.is_empty() {
        let mut root = Node::NOTHING;
        if let Some(only) = tree.nodes.first() {
            (root.left_min, root.left_max, root.left) =
                (only.bounds.min, only.bounds.max, reference(0));
        }
        nodes.push(root);
    }
    nodes
}

impl BuiltAccel for BvhTwin {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let mut coverage = Coverage::new(soup, self.nodes.len());
        coverage.node(0)?;
        let mut stack = vec![(0_u32, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = stack.pop() {
            if depth > self.stack_entries {
                return Err(AccelError::Invalid(format!(
                    "node {index}: deeper than the stack of {}",
                    self.stack_entries
                )));
            }
            let node = &self.nodes[index as usize];
            for (reference, bounds) in [
                (node.left, node.left_bounds()),
                (node.right, node.right_bounds()),
            ] {
                if reference == EMPTY_LEAF {
                    continue;
                }
                if !around.contains(&bounds) {
                    return Err(AccelError::Invalid(format!(
                        "node {index}: a child's box leaves its own"
                    )));
                }
                if reference & LEAF == 0 {
                    coverage.node(reference as usize)?;
                    stack.push((reference, bounds, depth + 1));
                } else {
                    let first = (reference & FIRST_MASK) as usize;
                    let count = ((reference & !LEAF) >> COUNT_SHIFT) as usize;
                    coverage.leaf(self.leaf_triangles.get(first..first + count), &bounds)?;
                }
            }
        }
        coverage.is_complete()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "accel/bvh",
            features: Vec::new(),
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: bytemuck::cast_slice(&self.nodes).into(),
                    element_bytes: 64,
                },
                NamedWords {
                    name: "leaf_triangles",
                    words: bytemuck::cast_slice(&self.leaf_triangles).into(),
                    element_bytes: 48,
                },
            ],
            uniforms: vec![super::limits(self.nodes.len(), self.nodes.len())],
            // A multiple of 16, so that scenes of like depth share a kernel.
            constants: vec![("STACK_ENTRIES", self.stack_entries.next_multiple_of(16))],
        }
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, _: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(self))
    }
}

impl CpuTwin for BvhTwin {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
    }
}

impl CpuTwin for &BvhTwin {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        (**self).closest_hit(ray, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        (**self).any_hit(ray, counters)
    }
}
