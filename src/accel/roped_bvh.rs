//! `roped-bvh`: the tree of `bvh` in depth-first order with skip pointers; no stack, fixed order.
//! Twin of `kernels/accel/roped_bvh.wesl`.
//!
//! Source: B. Smits, "Efficiency issues for ray tracing", 1998; Dufay 2017, Algorithm 4.4.

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

const COUNT_SHIFT: u32 = 26;
const FIRST_MASK: u32 = (1 << COUNT_SHIFT) - 1;

/// The registry entry.
pub struct RopedBvh;

impl AccelKind for RopedBvh {
    fn name(&self) -> &'static str {
        "roped-bvh"
    }

    fn description(&self) -> &'static str {
        "the tree of `bvh` with skip pointers: no stack, fixed order (Smits 1998, Dufay 2017 Alg. 4.4)"
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
        let count = soup.records.len() as u64;
        if count > u64::from(FIRST_MASK) {
            return Err(AccelError::Limit {
                what: "triangles of a roped-bvh".into(),
                needed: count,
                limit: FIRST_MASK.into(),
            });
        }
        let tree = Tree::build(soup, params, log)?;
        let (nodes, leaf_triangles): (Vec<Node>, Vec<TriangleRecord>) = log.phase("ropes", || {
            (
                ropes(&tree),
                tree.order
                    .iter()
                    .map(|&id| soup.records[id as usize])
                    .collect(),
            )
        });
        let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
        Ok(Box::new(Built {
            stats: StructureStats {
                bytes: bytes as u64,
                ..tree.stats()
            },
            nodes,
            leaf_triangles,
        }))
    }
}

/// A node, two `vec4<u32>`: box, leaf content (count and first triangle; 0 for an inner node), and
/// where to go when the box is missed or done with.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    min: [f32; 3],
    leaf: u32,
    max: [f32; 3],
    skip: u32,
}

struct Built {
    stats: StructureStats,
    nodes: Vec<Node>,
    leaf_triangles: Vec<TriangleRecord>,
}

/// In depth-first order a subtree is one run of nodes: its rope leads behind the run.
fn ropes(tree: &Tree) -> Vec<Node> {
    let mut ends: Vec<u32> = (1..=tree.nodes.len() as u32).collect();
    for index in (0..tree.nodes.len()).rev() {
        if let NodeKind::Inner { right, .. } = tree.nodes[index].kind {
            ends[index] = ends[right as usize];
        }
    }
    let node = |(node, &skip): (&super::tree::TreeNode, &u32)| Node {
        min: node.bounds.min,
        leaf: match node.kind {
            NodeKind::Inner { .. } => 0,
            NodeKind::Leaf { first, count } => count << COUNT_SHIFT | first,
        },
        max: node.bounds.max,
        skip,
    };
    tree.nodes.iter().zip(&ends).map(node).collect()
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let mut coverage = Coverage::new(soup, self.nodes.len());
        // Boxes of the subtrees around the present node, with where each ends.
        let mut around = vec![(Bounds::EVERYTHING, self.nodes.len())];
        for (index, node) in self.nodes.iter().enumerate() {
            around.retain(|(_, end)| index < *end);
            let skip = node.skip as usize;
            let (outer, end) = around[around.len() - 1];
            if skip <= index || skip > end {
                return Err(AccelError::Invalid(format!(
                    "node {index}: its rope leads to {skip}"
                )));
            }
            let bounds = Bounds {
                min: node.min,
                max: node.max,
            };
            if !outer.contains(&bounds) {
                return Err(AccelError::Invalid(format!(
                    "node {index}: its box leaves its parent's"
                )));
            }
            coverage.node(index)?;
            let (first, count) = (
                (node.leaf & FIRST_MASK) as usize,
                (node.leaf >> COUNT_SHIFT) as usize,
            );
            if count == 0 {
                around.push((bounds, skip));
            } else if skip == index + 1 {
                coverage.leaf(self.leaf_triangles.get(first..first + count), &bounds)?;
            } else {
                return Err(AccelError::Invalid(format!(
                    "leaf {index}: its rope skips a node"
                )));
            }
        }
        coverage.is_complete()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "accel/roped_bvh",
            features: Vec::new(),
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: bytemuck::cast_slice(&self.nodes).into(),
                    element_bytes: 32,
                },
                NamedWords {
                    name: "leaf_triangles",
                    words: bytemuck::cast_slice(&self.leaf_triangles).into(),
                    element_bytes: 48,
                },
            ],
            uniforms: vec![super::limits(self.nodes.len() + 1, self.nodes.len())],
            constants: Vec::new(),
        }
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, _: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self)))
    }
}

struct Twin<'a>(&'a Built);

impl Twin<'_> {
    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let inverse = safe_inverse(ray.direction);
        let mut hit = Hit::miss(ray);
        let mut current = 0;
        while let Some(node) = self.0.nodes.get(current) {
            counters.nodes += 1;
            counters.box_tests += 1;
            let bounds = Bounds {
                min: node.min,
                max: node.max,
            };
            if enter_box(&bounds, ray, inverse, hit.t).is_none() {
                current = node.skip as usize;
                continue;
            }
            let first = (node.leaf & FIRST_MASK) as usize;
            let count = (node.leaf >> COUNT_SHIFT) as usize;
            for triangle in &self.0.leaf_triangles[first..first + count] {
                counters.triangle_tests += 1;
                intersect_triangle(triangle, ray, inverse, &mut hit);
            }
            if any && hit.triangle != NO_HIT {
                break;
            }
            current += 1;
        }
        hit
    }
}

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
    }
}
