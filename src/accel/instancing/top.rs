//! The upper level: a tree over the instances, or over parts of them.
//!
//! Source of the parts: C. Benthin, S. Woop, I. Wald, A. T. Áfra, "Improved two-level BVHs using
//! partial re-braiding", HPG 2017. While the tree is built top-down, instances that are large
//! relative to the current box are replaced by the two children of their object's node, as long as
//! there is room for more entries. Here this is done only where the halves of the best split
//! overlap; otherwise there is nothing to gain.

use super::super::bounds::Bounds;
use super::super::bvh::pairs::Pair;
use super::super::leaf::{LEAF, leaf_reference};
use super::forest::Forest;
use super::instance::Entry;
use super::placed::Placed;
use super::world_box::BoxMap;
use crate::TriangleSoup;
use crate::known_figures::{half_a_square, soup_of, stats_of};
use glam::Vec3;
use raystone_core::params::{ParamValue, Params};
use raystone_scene::{Assembly, Instance, Transform};

const BINS: usize = 16;
/// Depth limit of SAH splits; below it the median is used, which bounds the depth by `SAH_DEPTH +
/// log2(entries)` for any input.
const SAH_DEPTH: u32 = 32;
/// Fraction of the current box above which an instance is opened.
const LARGE: f32 = 0.1;

/// Tree and entries of the upper level.
#[derive(Debug, Clone, Default)]
pub(super) struct Top {
    /// Root first. References to inner nodes count from the first node after the forest's.
    pub nodes: Vec<Pair>,
    /// The contents of the leaves.
    pub entries: Vec<Entry>,
    pub depth: u32,
    /// Growth of boxes, see [`super::world_box`].
    pub growth: f32,
}

impl Top {
    /// Levels of nodes, at least one, and so the stack entries for them.
    pub(super) fn levels(&self) -> u32 {
        self.depth.max(1)
    }

    /// Builds the upper level, with up to `rebraid` entries per instance on average.
    pub(super) fn build(instances: &[Instance], forest: &Forest, rebraid: usize) -> Self {
        let mut builder = Builder {
            forest,
            maps: instances.iter().map(BoxMap::new).collect(),
            instances,
            top: Self::default(),
        };
        let parts: Vec<Part> = (0..instances.len() as u32)
            .map(|instance| builder.whole(instance))
            .collect();
        let room = parts.len() * rebraid.saturating_sub(1);
        builder.top.growth = builder.maps.iter().map(BoxMap::growth).fold(0.0, f32::max);
        match parts.len() {
            0 => builder.top.nodes.push(Pair::new([Pair::MISSING; 2])),
            _ => {
                let root = builder.subtree(parts, room, 0);
                if root.0 >= LEAF {
                    builder.top.nodes.push(Pair::new([root, Pair::MISSING]));
                }
            }
        }
        builder.top
    }
}

/// A copy: the length of a row of triangles, of which one alone cannot be opened; its size along the row, half of that across, and place.
type Copy = (u32, f32, [f32; 3]);

/// Copies, and how many nodes they have above them for parts if two entries for each are allowed, by hand. Of two that are alike each is
/// opened once. Far from two others, large ones have all room but one, by their areas. And beside one that fills the box, two with a fifth
/// of it are opened at once, and the largest has the rest.
const ROOMS: [(&[Copy], u64); 3] = [
    (&[(16, 1.0, [0.0; 3]), (16, 1.0, [0.0, 0.25, 0.0])], 2),
    (
        &[
            (16, 10.0, [0.0; 3]),
            (16, 10.0, [0.0, 2.5, 0.0]),
            (1, 1.0, [1000.0, 0.0, 0.0]),
            (1, 1.0, [1000.0, 0.25, 0.0]),
        ],
        3,
    ),
    (
        &[
            (1, 230.0, [0.0; 3]),
            (16, 1.0, [0.0; 3]),
            (16, 1.0, [0.0, 0.25, 0.0]),
        ],
        2,
    ),
];

/// Builds trees over them.
///
/// # Errors
/// They have other numbers of nodes than they should.
pub(crate) fn check() -> Result<(), String> {
    ROOMS.iter().try_for_each(|(copies, expected)| {
        let soup = known(copies)?;
        let nodes = |entries| {
            let set = [("rebraid".to_owned(), ParamValue::Integer(entries))];
            let stats = stats_of("meta-bvh", &Params(set.into()), &soup);
            stats.map(|stats| stats.nodes)
        };
        let found = nodes(2)? - nodes(0)?;
        (found == *expected).then_some(()).ok_or_else(|| {
            format!(
                "a meta-bvh over known copies has {found} more nodes where these are opened, and should have {expected}: this program \
                 builds others than it says; build it anew, and report what stays wrong"
            )
        })
    })
}

fn known(copies: &[Copy]) -> Result<TriangleSoup, String> {
    let mut assembly = Assembly::default();
    let mut all = Vec::new();
    for (length, size, place) in copies {
        let deep = |place| {
            let mut triangle = half_a_square(place);
            triangle.vertices[1].z = 1.0;
            triangle
        };
        let row = (0..*length).map(deep).collect();
        let object = assembly.add_object(row).map_err(|e| e.to_string())?;
        let columns = [Vec3::X * *size, 0.5 * *size * Vec3::Y, Vec3::Z];
        let placed = assembly.place(object, Transform::new(columns, Vec3::from(*place)));
        all.extend(assembly.copy(&placed.map_err(|e| e.to_string())?));
    }
    Ok(TriangleSoup {
        placed: Some(Placed::new(&assembly)),
        ..soup_of(&all)
    })
}

/// An instance, or the part below a node of its object.
#[derive(Debug, Clone, Copy)]
struct Part {
    instance: u32,
    node: u32,
    bounds: Bounds,
}

struct Builder<'a> {
    forest: &'a Forest,
    instances: &'a [Instance],
    maps: Vec<BoxMap>,
    top: Top,
}

impl Builder<'_> {
    fn whole(&self, instance: u32) -> Part {
        let object = self.instances[instance as usize].object;
        let root = &self.forest.roots[object as usize];
        Part {
            instance,
            node: root.nodes.start,
            bounds: self.maps[instance as usize].world_box(&root.bounds),
        }
    }

    /// Both halves of a part, if its node has two inner children.
    fn halves(&self, part: &Part) -> Option<[Part; 2]> {
        let children = self.forest.nodes[part.node as usize].children();
        let map = &self.maps[part.instance as usize];
        children.iter().all(|(node, _)| *node < LEAF).then(|| {
            children.map(|(node, bounds)| Part {
                instance: part.instance,
                node,
                bounds: map.world_box(&bounds),
            })
        })
    }

    /// Builds the tree over `parts`, which may grow by `room`; returns the reference to it.
    fn subtree(&mut self, mut parts: Vec<Part>, mut room: usize, depth: u32) -> (u32, Bounds) {
        let bounds = bounds_of(&parts);
        if let [part] = parts[..] {
            return (self.entry(&part, depth), bounds);
        }
        let mut split = Split::best(&parts, depth);
        if room > 0 && split.halves_overlap() {
            let opened = self.open(&mut parts, &bounds, room);
            if opened > 0 {
                room -= opened;
                split = Split::best(&parts, depth);
            }
        }
        let [low_area, high_area] = split.areas;
        let share = f64::from(low_area) / f64::from(low_area + high_area).max(f64::MIN_POSITIVE);
        let low_room = ((room as f64 * share) as usize).min(room);
        let here = self.top.nodes.len();
        self.top.nodes.push(Pair::new([Pair::MISSING; 2]));
        let [low, high] = split.parts;
        let children = [
            self.subtree(low, low_room, depth + 1),
            self.subtree(high, room - low_room, depth + 1),
        ];
        self.top.nodes[here] = Pair::new(children);
        ((self.forest.nodes.len() + here) as u32, bounds)
    }

    fn entry(&mut self, part: &Part, depth: u32) -> u32 {
        let instance = &self.instances[part.instance as usize];
        let entry = Entry::new(part.instance, instance, part.node);
        self.top.depth = self.top.depth.max(depth);
        self.top.entries.push(entry);
        leaf_reference(self.top.entries.len() as u32 - 1, 1)
    }

    /// Replaces large parts by their halves, largest first; returns the number of replacements.
    fn open(&self, parts: &mut Vec<Part>, bounds: &Bounds, room: usize) -> usize {
        if parts.iter().all(|part| part.instance == parts[0].instance) {
            // Its own BVH does this better.
            return 0;
        }
        let axis = longest_axis(bounds);
        let size = |part: &Part| part.bounds.extent()[axis];
        let least = LARGE * bounds.extent()[axis];
        let mut large: Vec<usize> = (0..parts.len())
            .filter(|&i| size(&parts[i]) > least)
            .collect();
        large.sort_by(|&a, &b| size(&parts[b]).total_cmp(&size(&parts[a])).then(a.cmp(&b)));
        let mut opened = 0;
        for index in large {
            if opened == room {
                break;
            }
            if let Some([low, high]) = self.halves(&parts[index]) {
                parts[index] = low;
                parts.push(high);
                opened += 1;
            }
        }
        opened
    }
}

fn bounds_of(parts: &[Part]) -> Bounds {
    let boxes = parts.iter().map(|part| &part.bounds);
    boxes.fold(Bounds::EMPTY, |all, bounds| all.union(bounds))
}

fn longest_axis(bounds: &Bounds) -> usize {
    let extent = bounds.extent();
    let by_extent = |a: &usize, b: &usize| extent[*a].total_cmp(&extent[*b]);
    (0..3).max_by(by_extent).unwrap_or(0)
}

/// Parts on two sides of a plane.
struct Split {
    parts: [Vec<Part>; 2],
    bounds: [Bounds; 2],
    /// Sums of the half areas of the parts' boxes.
    areas: [f32; 2],
}

impl Split {
    /// The cheapest bin border by SAH; the median without one or below the SAH depth.
    fn best(parts: &[Part], depth: u32) -> Self {
        let plane = (depth < SAH_DEPTH).then(|| Plane::best(parts)).flatten();
        let sides: [Vec<Part>; 2] = match plane {
            Some(plane) => parts.iter().partition(|part| plane.is_low(part)).into(),
            None => {
                let axis = longest_axis(&bounds_of(parts));
                let mut sorted = parts.to_vec();
                let key = |part: &Part| part.bounds.doubled_centre()[axis];
                // Stable: equal centres keep their order.
                sorted.sort_by(|a, b| key(a).total_cmp(&key(b)));
                let high = sorted.split_off(parts.len() / 2);
                [sorted, high]
            }
        };
        let area = |side: &Vec<Part>| side.iter().map(|part| part.bounds.half_area()).sum();
        Self {
            bounds: [bounds_of(&sides[0]), bounds_of(&sides[1])],
            areas: [area(&sides[0]), area(&sides[1])],
            parts: sides,
        }
    }

    fn halves_overlap(&self) -> bool {
        let [a, b] = &self.bounds;
        (0..3).all(|axis| a.min[axis] < b.max[axis] && b.min[axis] < a.max[axis])
    }
}

/// A bin border: parts with their centre in a lower bin are on the low side.
struct Plane {
    axis: usize,
    origin: f32,
    scale: f32,
    bin: usize,
}

impl Plane {
    fn bin(&self, part: &Part) -> usize {
        let centre = part.bounds.doubled_centre()[self.axis];
        (((centre - self.origin) * self.scale) as usize).min(BINS - 1)
    }

    fn is_low(&self, part: &Part) -> bool {
        self.bin(part) < self.bin
    }

    /// The border of least SAH cost, with entries on both sides; `None` if all centres coincide.
    fn best(parts: &[Part]) -> Option<Self> {
        let centres = parts.iter().fold(Bounds::EMPTY, |all, part| {
            let c = part.bounds.doubled_centre();
            all.union(&Bounds { min: c, max: c })
        });
        let mut best: Option<(f32, Self)> = None;
        for axis in 0..3 {
            let scale = BINS as f32 * (1.0 - 1e-6) / centres.extent()[axis];
            if !(scale > 0.0 && scale.is_finite()) {
                continue;
            }
            let plane = |bin| Self {
                axis,
                origin: centres.min[axis],
                scale,
                bin,
            };
            let mut bins = [(Bounds::EMPTY, 0_u32); BINS];
            for part in parts {
                let bin = &mut bins[plane(0).bin(part)];
                *bin = (bin.0.union(&part.bounds), bin.1 + 1);
            }
            let below = prefixes(bins.iter());
            let above = prefixes(bins.iter().rev());
            for bin in 1..BINS {
                let (low, high) = (&below[bin - 1], &above[BINS - 1 - bin]);
                let cost = low.0.half_area() * low.1 as f32 + high.0.half_area() * high.1 as f32;
                let is_split = low.1 > 0 && high.1 > 0;
                if is_split && best.as_ref().is_none_or(|(least, _)| cost < *least) {
                    best = Some((cost, plane(bin)));
                }
            }
        }
        best.map(|(_, plane)| plane)
    }
}

/// Boxes and counts of the first bin, of the first two, and so on.
fn prefixes<'a>(bins: impl Iterator<Item = &'a (Bounds, u32)>) -> Vec<(Bounds, u32)> {
    bins.scan((Bounds::EMPTY, 0), |sum, bin| {
        *sum = (sum.0.union(&bin.0), sum.1 + bin.1);
        Some(*sum)
    })
    .collect()
}
