//! `cwbvh`: compressed 8-wide BVH with nodes of 80 bytes, traversed in the order of the ray's octant.
//! Twin of `kernels/accel/cwbvh.wesl`.
//!
//! Source: H. Ylitie, T. Karras, S. Laine, "Efficient incoherent ray traversal on GPUs through
//! compressed wide BVHs", HPG 2017.

use super::bounds::Bounds;
use super::collapse::{CollapseSettings, WideChild, WideKind, WideTree};
use super::ray::{Hit, NO_HIT, Ray, safe_inverse};
use super::tree::Coverage;
use super::triangle::{TriangleRecord, intersect_triangle};
use super::wide::{Grid, Planes, enter_four, frame, leave_four, wide_parameters, wide_tree};
use super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords,
    TriangleSoup,
};
use crate::config::{ParameterSchema, Params};
use crate::measure::record::StructureStats;
use bytemuck::{Pod, Zeroable};

const WIDTH: usize = 8;
/// A slot counts its triangles in unary, in three bits.
const MAX_LEAF: u32 = 3;
const NODE_HITS: u32 = 0xff00_0000;
const NODE_SHIFT: u32 = 24;
const ROOT: u32 = 0x8000_0000;
/// Meaning of an inner child in slot 0: one hit bit, place 24.
const INNER: u8 = 1 << 5 | NODE_SHIFT as u8;

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
        let tree = wide_tree(soup, params, log)?;
        let settings = CollapseSettings::new(WIDTH, params);
        let wide = log.phase("collapse", || {
            WideTree::collapse(&tree, &settings, |bounds, children| {
                arrange_by_octant(bounds, children)
            })
        });
        let stats = wide.stats(&tree.nodes.first().map_or(Bounds::EMPTY, |root| root.bounds));
        Ok(Box::new(
            log.phase("layout", || Built::new(soup, wide, stats, params)),
        ))
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
    first_child: u32,
    first_triangle: u32,
    /// What a slot holds: 0 nothing; otherwise the hit bits it sets, shifted by 5, and where.
    meanings: [u8; WIDTH],
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
        self.exponents >> NODE_SHIFT
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
    fn new(soup: &TriangleSoup, wide: WideTree, stats: StructureStats, params: &Params) -> Self {
        let nodes: Vec<Node> = wide.nodes.iter().map(|slots| node(slots)).collect();
        let leaf_triangles: Vec<TriangleRecord> = wide
            .order
            .iter()
            .map(|&id| soup.records[id as usize])
            .collect();
        let bytes = size_of_val(&nodes[..]) + size_of_val(&leaf_triangles[..]);
        Self {
            stats: StructureStats {
                bytes: bytes as u64,
                ..stats
            },
            nodes,
            leaf_triangles,
            // A level leaves one group behind at most.
            stack_entries: wide.depth,
            texels: params.flag("texels"),
        }
    }

    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let inverse = safe_inverse(ray.direction);
        let backward = inverse.map(|x| x < 0.0);
        let octant = (0..3).fold(0, |bits, axis| bits | u32::from(!backward[axis]) << axis);
        let mut hit = Hit::miss(ray);
        let mut stack = Vec::with_capacity(self.stack_entries as usize);
        let mut group = (0, ROOT);
        loop {
            counters.nodes += 1;
            counters.box_tests += WIDTH as u32;
            let place = group.1.ilog2();
            let slot = (place - NODE_SHIFT) ^ octant;
            let node = group.0 + (group.1 & ((1 << slot) - 1)).count_ones();
            group.1 ^= 1 << place;
            if group.1 & NODE_HITS != 0 {
                stack.push(group);
                counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
            }
            let node = &self.nodes[node as usize];
            let planes = frame(node.low, node.exponents, ray.origin, inverse);
            let mut hits = 0;
            for half in 0..2 {
                let word = |planes: &[[u8; WIDTH]; 3], axis: usize| {
                    let q = &planes[axis][4 * half..];
                    u32::from_le_bytes([q[0], q[1], q[2], q[3]])
                };
                let choose = |far: bool| {
                    [0, 1, 2].map(|axis| {
                        let high = backward[axis] != far;
                        word(if high { &node.highs } else { &node.lows }, axis)
                    })
                };
                let enter = enter_four(choose(false), &planes, ray.t_min);
                let leave = leave_four(choose(true), &planes, hit.t);
                let entered = [0, 1, 2, 3].map(|i| enter[i] <= leave[i]);
                hits |= hit_bits(&node.meanings[4 * half..], entered, octant);
            }
            group = (node.first_child, hits & NODE_HITS | node.inner_mask());
            let mut triangles = hits & !NODE_HITS;
            while triangles != 0 {
                let index = node.first_triangle + triangles.trailing_zeros();
                triangles &= triangles - 1;
                counters.triangle_tests += 1;
                let triangle = &self.leaf_triangles[index as usize];
                intersect_triangle(triangle, ray, inverse, &mut hit);
                if any && hit.triangle != NO_HIT {
                    return hit;
                }
            }
            if group.1 & NODE_HITS == 0 {
                match stack.pop() {
                    Some(below) => group = below,
                    None => return hit,
                }
            }
        }
    }
}

/// Bits of the four children with these meanings, as far as they are entered.
fn hit_bits(meanings: &[u8], entered: [bool; 4], octant: u32) -> u32 {
    let mut bits = 0;
    for (meaning, entered) in meanings.iter().map(|&m| u32::from(m)).zip(entered) {
        let is_inner = meaning & NODE_SHIFT == NODE_SHIFT;
        let place = if is_inner { meaning ^ octant } else { meaning } & 31;
        if entered {
            bits |= meaning >> 5 << place;
        }
    }
    bits
}

/// The node with these children in its slots.
fn node(slots: &[WideChild]) -> Node {
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
    let mut inner_mask = 0;
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
        node.meanings[slot] = match child.kind {
            WideKind::Node(index) => {
                if inner_mask == 0 {
                    node.first_child = index;
                }
                inner_mask |= 1 << slot;
                INNER + slot as u8
            }
            WideKind::Leaf { first, count } => {
                if triangles == 0 {
                    node.first_triangle = first;
                }
                let place = triangles as u8;
                triangles += count;
                ((1 << count) - 1) << 5 | place
            }
        };
    }
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
                let meaning = node.meanings[slot];
                // What is below must lie in every decoded box on the way.
                let bounds = around.intersection(&node.bounds(slot));
                let place = usize::from(meaning & 31);
                if meaning == 0 {
                    continue;
                } else if meaning == INNER + slot as u8 {
                    let before = node.inner_mask() & ((1 << slot) - 1);
                    let child = node.first_child as usize + before.count_ones() as usize;
                    open.push((child, bounds, depth + 1));
                } else if matches!(meaning >> 5, 1 | 3 | 7) && place < 3 * WIDTH {
                    let first = node.first_triangle as usize + place;
                    let end = first + (meaning >> 5).count_ones() as usize;
                    coverage.leaf(self.leaf_triangles.get(first..end), &bounds)?;
                } else {
                    return Err(AccelError::Invalid(format!(
                        "node {index}: slot {slot} means {meaning:#x}"
                    )));
                }
            }
        }
        coverage.is_complete()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "accel/cwbvh",
            features: if self.texels {
                vec!["texels"]
            } else {
                Vec::new()
            },
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: bytemuck::cast_slice(&self.nodes).into(),
                    element_bytes: size_of::<Node>() as u32,
                },
                NamedWords {
                    name: "leaf_triangles",
                    words: bytemuck::cast_slice(&self.leaf_triangles).into(),
                    element_bytes: size_of::<TriangleRecord>() as u32,
                },
            ],
            uniforms: vec![super::limits(self.nodes.len(), self.nodes.len())],
            // A multiple of 8, so that scenes of like depth share a kernel.
            constants: vec![("STACK_ENTRIES", self.stack_entries.next_multiple_of(8))],
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

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.0.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.0.trace(ray, true, counters).triangle != NO_HIT
    }
}
