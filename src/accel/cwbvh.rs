//! `cwbvh`: compressed 8-wide BVH with nodes of 80 bytes, traversed in the order of the ray's octant.
//! Twin of `kernels/accel/cwbvh.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017.

use super::bounds::Bounds;
use super::collapse::{CollapseSettings, WideChild, WideKind, WideTree};
use super::intersection::{Intersection, Reciprocal};
use super::ray::{Hit, NO_HIT, Ray};
use super::tree::Coverage;
use super::triangle::{TriangleRecord, intersect_triangle};
use super::wide::{
    Grid, Planes, enter_four, frame, leave_four, node_limit, wide_arrays, wide_parameters,
    wide_tree,
};
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, TriangleSoup,
};
use crate::accel::StructureStats;
use crate::params::{ParameterSchema, Params};
use bytemuck::{Pod, Zeroable};

const WIDTH: usize = 8;
/// A slot counts its triangles in unary, in three bits.
const MAX_LEAF: u32 = 3;
const PLACES_SHIFT: u32 = 8;
const SLOTS_MASK: u32 = 0xff;
const ROOT: u32 = 0x100;
const INDEX_MASK: u32 = 0x00ff_ffff;
const MASK_SHIFT: u32 = 24;
const COUNT_SHIFT: u32 = 5;
const PLACE_MASK: u32 = 31;

/// The registry entry.
pub struct Cwbvh;

impl AccelKind for Cwbvh {
    fn name(&self) -> &'static str {
        "cwbvh"
    }

    fn description(&self) -> &'static str {
        "compressed 8-wide BVH, 80-byte nodes, octant order, stack (Ylitie, Karras & Laine 2017)"
    }

    fn parameters(&self) -> ParameterSchema {
        wide_parameters(MAX_LEAF)
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let params = &params.completed(&self.parameters())?;
        let tree = wide_tree(soup, params, log)?;
        let settings = CollapseSettings::new(WIDTH, params);
        let wide = log.phase("collapse", || {
            WideTree::collapse(&tree, &settings, |bounds, children| {
                arrange_by_octant(bounds, children)
            })
        });
        node_limit("cwbvh", wide.nodes.len(), INDEX_MASK)?;
        Ok(Box::new(log.phase("layout", || {
            Built::new(soup, &wide, params.flag("texels"))
        })))
    }
}

/// A node: five `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct Node {
    /// First plane on each axis.
    low: [f32; 3],
    /// Biased exponents, and which slots are inner children in the highest byte.
    exponents: u32,
    /// Index, and which slots are leaves in the highest byte.
    first_child: u32,
    first_triangle: u32,
    /// Leaves: how many triangles, shifted by 5, and from where after the first of the node.
    triangles: [u8; WIDTH],
    /// Planes at the minimum on x, y, z.
    lows: [[u8; WIDTH]; 3],
    /// Planes at the maximum.
    highs: [[u8; WIDTH]; 3],
}

impl Node {
    fn grid(&self) -> Grid {
        let [x, y, z, _] = self.exponents.to_le_bytes();
        Grid {
            low: self.low,
            exponents: [x, y, z],
        }
    }

    fn inner_mask(&self) -> u32 {
        self.exponents >> MASK_SHIFT
    }

    fn leaf_mask(&self) -> u32 {
        self.first_child >> MASK_SHIFT
    }

    /// Index of the inner child in `slot`.
    fn child(&self, slot: u32) -> u32 {
        (self.first_child & INDEX_MASK) + (self.inner_mask() & ((1 << slot) - 1)).count_ones()
    }

    /// Places of the triangles of the leaf in `slot`.
    fn leaf(&self, slot: usize) -> std::ops::Range<usize> {
        let triangles = u32::from(self.triangles[slot]);
        let first = self.first_triangle as usize + (triangles & PLACE_MASK) as usize;
        first..first + (triangles >> COUNT_SHIFT) as usize
    }

    fn bounds(&self, slot: usize) -> Bounds {
        self.grid().bounds(&Planes {
            low: self.lows.map(|q| q[slot]),
            high: self.highs.map(|q| q[slot]),
        })
    }
}

struct Built {
    stats: StructureStats,
    nodes: Vec<Node>,
    leaf_triangles: Vec<TriangleRecord>,
    stack_entries: u32,
    texels: bool,
}

/// Moves children to slots such that visiting slots in ascending order of `slot ^ octant of the
/// ray` is about front to back: greedily, the child and the slot of best agreement first. Slots
/// without a child get an empty leaf.
fn arrange_by_octant(bounds: &Bounds, children: &mut Vec<WideChild>) {
    let middle = bounds.doubled_centre();
    let offset = |child: &WideChild| {
        let centre = child.bounds.doubled_centre();
        [0, 1, 2].map(|axis| centre[axis] - middle[axis])
    };
    // How far a child lies in the direction that a slot stands for.
    let agreement = |child: &WideChild, slot: usize| -> f32 {
        let along = |axis: usize| {
            let x = offset(child)[axis];
            if slot >> axis & 1 == 1 { x } else { -x }
        };
        along(0) + along(1) + along(2)
    };
    let mut pairs: Vec<(f32, usize, usize)> = Vec::with_capacity(WIDTH * WIDTH);
    for (index, child) in children.iter().enumerate() {
        pairs.extend((0..WIDTH).map(|slot| (agreement(child, slot), index, slot)));
    }
    pairs.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)).then(a.2.cmp(&b.2)));
    let mut slots = vec![WideChild::NOTHING; WIDTH];
    let (mut placed, mut taken) = ([false; WIDTH], [false; WIDTH]);
    for (_, index, slot) in pairs {
        if !placed[index] && !taken[slot] {
            (placed[index], taken[slot]) = (true, true);
            slots[slot] = children[index];
        }
    }
    *children = slots;
}

impl Built {
    fn new(soup: &TriangleSoup, wide: &WideTree, texels: bool) -> Self {
        let nodes: Vec<Node> = wide.nodes.iter().map(|slots| pack(slots)).collect();
        let leaf_triangles = wide.records(soup);
        let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
        Self {
            stats: StructureStats {
                bytes: bytes as u64,
                ..wide.stats()
            },
            nodes,
            leaf_triangles,
            // A level leaves one group behind at most.
            stack_entries: wide.depth,
            texels,
        }
    }

    fn trace(&self, ray: &Ray, inverse: Reciprocal, any: bool, counters: &mut Counters) -> Hit {
        let backward = inverse.map(|x| x < 0.0);
        let octant = (0..3).fold(0, |bits, axis| bits | u32::from(backward[axis]) << axis);
        let mut hit = Hit::miss(ray);
        let mut stack = Vec::with_capacity(self.stack_entries as usize);
        let mut group = (0, ROOT);
        loop {
            counters.box_tests += WIDTH as u32;
            let places = group.1 >> PLACES_SHIFT;
            let slot = bit_number(places & places.wrapping_neg()) ^ octant;
            let index = group.0 + (group.1 & ((1 << slot) - 1)).count_ones();
            counters.visit(index as usize);
            let left = places & (places - 1);
            if left != 0 {
                stack.push((group.0, left << PLACES_SHIFT | group.1 & SLOTS_MASK));
                counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
            }
            let node = &self.nodes[index as usize];
            let slots = slot_bits(node, ray, inverse, hit.t);
            let inner = node.inner_mask();
            group = (
                node.first_child & INDEX_MASK,
                permute(slots & inner, octant) << PLACES_SHIFT | inner,
            );
            let mut leaves = slots & node.leaf_mask();
            while leaves != 0 {
                let leaf = bit_number(leaves & leaves.wrapping_neg());
                leaves &= leaves - 1;
                for triangle in &self.leaf_triangles[node.leaf(leaf as usize)] {
                    counters.triangle_tests += 1;
                    intersect_triangle(triangle, ray, inverse, &mut hit);
                    if any && hit.triangle != NO_HIT {
                        return hit;
                    }
                }
            }
            if group.1 < ROOT {
                match stack.pop() {
                    Some(below) => group = below,
                    None => return hit,
                }
            }
        }
    }
}

/// The number of a bit that stands alone.
fn bit_number(bit: u32) -> u32 {
    bit.trailing_zeros()
}

/// Slots of a node whose boxes are entered, as bits.
fn slot_bits(node: &Node, ray: &Ray, inverse: Reciprocal, t_best: f32) -> u32 {
    let planes = frame(node.low, node.exponents, ray.origin, inverse);
    let mut bits = 0;
    for half in [0, 4] {
        let words = |far: bool| -> [u32; 3] {
            std::array::from_fn(|axis| {
                let high = (inverse[axis] < 0.0) != far;
                let q = if high { &node.highs } else { &node.lows }[axis];
                u32::from_le_bytes([q[half], q[half + 1], q[half + 2], q[half + 3]])
            })
        };
        let enter = enter_four(words(false), &planes, ray.t_min);
        let leave = leave_four(words(true), &planes, t_best);
        for i in 0..4 {
            bits |= u32::from(enter[i] <= leave[i]) << (half + i);
        }
    }
    bits
}

/// Moves bit i of eight to i ^ octant.
fn permute(bits: u32, octant: u32) -> u32 {
    (0..8).fold(0, |out, i| out | (bits >> i & 1) << (i ^ octant))
}

/// The node with these children in its slots.
fn pack(slots: &[WideChild]) -> Node {
    let bounds = slots
        .iter()
        .filter(|child| !child.is_nothing())
        .fold(Bounds::EMPTY, |b, child| b.union(&child.bounds));
    let mut node = Node::zeroed();
    if slots.iter().all(WideChild::is_nothing) {
        return node;
    }
    let grid = Grid::new(&bounds);
    node.low = grid.low;
    let [mut inner_mask, mut leaf_mask] = [0_u8; 2];
    let mut triangles = 0;
    for (slot, child) in slots.iter().enumerate() {
        if child.is_nothing() {
            continue;
        }
        let planes = grid.around(&child.bounds);
        for axis in 0..3 {
            node.lows[axis][slot] = planes.low[axis];
            node.highs[axis][slot] = planes.high[axis];
        }
        match child.kind {
            WideKind::Node(index) => {
                if inner_mask == 0 {
                    node.first_child = index;
                }
                inner_mask |= 1 << slot;
            }
            WideKind::Leaf { first, count } => {
                if leaf_mask == 0 {
                    node.first_triangle = first;
                }
                leaf_mask |= 1 << slot;
                node.triangles[slot] = (count << COUNT_SHIFT | triangles) as u8;
                triangles += count;
            }
        }
    }
    node.first_child |= u32::from(leaf_mask) << MASK_SHIFT;
    node.exponents = grid.exponent_word(inner_mask);
    node
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let mut coverage = Coverage::new(soup, self.nodes.len());
        let mut open = vec![(0, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = open.pop() {
            coverage.node(index)?;
            if depth > self.stack_entries {
                return Err(AccelError::Invalid(format!(
                    "node {index}: deeper than the stack of {}",
                    self.stack_entries
                )));
            }
            let node = &self.nodes[index];
            for slot in 0..WIDTH {
                // What is below must lie in every decoded box on the way.
                let bounds = around.intersection(&node.bounds(slot));
                let [is_inner, is_leaf] =
                    [node.inner_mask(), node.leaf_mask()].map(|mask| mask >> slot & 1 == 1);
                if is_inner && is_leaf {
                    return Err(AccelError::Invalid(format!(
                        "node {index}: slot {slot} is a leaf and a node"
                    )));
                } else if is_inner {
                    open.push((node.child(slot as u32) as usize, bounds, depth + 1));
                } else if is_leaf {
                    coverage.leaf(self.leaf_triangles.get(node.leaf(slot)), &bounds)?;
                }
            }
        }
        coverage.is_complete()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "accel/cwbvh",
            uniforms: vec![super::limits(self.nodes.len(), self.nodes.len())],
            // A multiple of 8, so that scenes of like depth share a kernel, and one to spare.
            constants: vec![(
                "STACK_ENTRIES",
                (self.stack_entries + 1).next_multiple_of(8),
            )],
            ..wide_arrays(&self.nodes, &self.leaf_triangles, self.texels)
        }
    }

    fn stats(&self) -> StructureStats {
        self.stats.clone()
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup.intersection)))
    }
}

struct Twin<'a>(&'a Built, Intersection);

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        let ray = &self.1.raised(ray);
        let inverse = self.1.inverse(ray.direction);
        self.0.trace(ray, inverse, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        let ray = &self.1.raised(ray);
        let inverse = self.1.inverse(ray.direction);
        let hit = self.0.trace(ray, inverse, true, counters);
        hit.triangle != NO_HIT
    }
}
