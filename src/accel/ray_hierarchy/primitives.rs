//! What the tree over rays is tested against: triangles, or clusters of neighbours.

use super::layout::tree_over;
use super::node::{Bounding, Node, meets_ball, meets_box};
use super::{Bound, Options};
use crate::bounds::Bounds;
use crate::tree::parallel::morton::{cell_of, grid_scale, morton_code};
use crate::triangle::TriangleRecord;
use crate::{AccelError, TriangleSoup};
use bytemuck::{Pod, Zeroable};
use glam::Vec3;
use rayon::prelude::*;
use raystone_core::geometry::Triangle;

/// A ball and a box around some triangles, and where their indices lie. 48 bytes, as in
/// `kernels/accel/ray_hierarchy/tree.wesl`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub(crate) struct Primitive {
    pub centre: [f32; 3],
    pub radius: f32,
    pub low: [f32; 3],
    pub first: u32,
    pub high: [f32; 3],
    pub end: u32,
}

impl Primitive {
    /// A ball around a box, not around its triangles: a hit is clamped into the box, and by tests that
    /// are not watertight it may lie off the triangle.
    fn new(bounds: &Bounds, first: usize, end: usize) -> Self {
        let corners = [bounds.min, bounds.max].map(|corner| corner.map(f64::from));
        let centre = [0, 1, 2].map(|a| (0.5 * (corners[0][a] + corners[1][a])) as f32);
        let reaches = [0, 1, 2].map(|a| {
            let [low, high] = corners.map(|corner| (corner[a] - f64::from(centre[a])).abs());
            low.max(high)
        });
        let radius = reaches.iter().map(|x| x * x).sum::<f64>().sqrt();
        Self {
            centre,
            radius: ((radius * (1.0 + f64::from(f32::EPSILON))) as f32).next_up(),
            low: bounds.min,
            first: first as u32,
            high: bounds.max,
            end: end as u32,
        }
    }

    /// The primitive around neighbours.
    fn around(children: &[Self]) -> Self {
        let bounds = children.iter().map(Self::bounds);
        let bounds = bounds.fold(Bounds::EMPTY, |all, b| all.union(&b));
        let [first, end] = [children[0].first, children[children.len() - 1].end];
        Self::new(&bounds, first as usize, end as usize)
    }

    pub(crate) fn bounds(&self) -> Bounds {
        Bounds {
            min: self.low,
            max: self.high,
        }
    }

    /// True if a ray of the node may hit one of the triangles. CPU version of `meets`.
    pub(crate) fn meets(&self, node: &Node, bound: Bound, bounding: &Bounding) -> bool {
        node.radius >= 0.0
            && (bound == Bound::Box || meets_ball(node, self.centre, self.radius, bounding))
            && (bound == Bound::Sphere || meets_box(node, self.low, self.high, bounding))
    }

    /// Distance of the farthest corner of a box from the centre, f64.
    pub(super) fn farthest(&self, bounds: &Bounds) -> f64 {
        let reach = |a: usize| {
            let [low, high] = [bounds.min[a], bounds.max[a]];
            let off = |x: f32| (f64::from(x) - f64::from(self.centre[a])).abs();
            off(low).max(off(high))
        };
        [0, 1, 2]
            .map(|a| reach(a) * reach(a))
            .iter()
            .sum::<f64>()
            .sqrt()
    }
}

/// All primitives, and the words that the kernels read.
pub(crate) struct Primitives {
    /// Those that have triangles.
    pub count: usize,
    /// These, and the levels of the tree over them.
    pub total: usize,
    /// Three rows a primitive, then the indices of triangles, four a row.
    pub rows: Vec<[u32; 4]>,
}

impl Primitives {
    pub(crate) fn new(soup: &TriangleSoup, options: &Options) -> Self {
        let cluster = options.cluster as usize;
        let order = ordered(soup, cluster > 1 || options.dual > 0);
        let of_cluster = |(at, ids): (usize, &[u32])| {
            let boxes = ids.iter().map(|id| soup.records[*id as usize].bounds());
            let bounds = boxes.fold(Bounds::EMPTY, |all, b| all.union(&b));
            Primitive::new(&bounds, at * cluster, at * cluster + ids.len())
        };
        let mut made: Vec<Primitive> = order
            .par_chunks(cluster)
            .enumerate()
            .map(of_cluster)
            .collect();
        let count = made.len();
        // Each level but the last has parents.
        for [first, many] in &tree_over(count, options)[..options.dual as usize] {
            let children = made[*first as usize..(*first + *many) as usize].to_vec();
            let parents = children.chunks(options.branching as usize);
            made.extend(parents.map(Primitive::around));
        }
        let mut rows: Vec<[u32; 4]> = bytemuck::cast_slice(&made).to_vec();
        let padded = |ids: &[u32]| std::array::from_fn(|k| ids.get(k).copied().unwrap_or(0));
        rows.extend(order.chunks(4).map(padded));
        Self {
            count,
            total: made.len(),
            rows,
        }
    }

    /// Those that have triangles.
    pub(crate) fn all(&self) -> &[Primitive] {
        &self.levels()[..self.count]
    }

    /// Those of all levels.
    pub(crate) fn levels(&self) -> &[Primitive] {
        bytemuck::cast_slice(&self.rows[..3 * self.total])
    }

    /// The indices of triangles; behind the last primitive's they are padding.
    pub(crate) fn order(&self) -> &[u32] {
        self.rows[3 * self.total..].as_flattened()
    }

    /// The triangles of a primitive.
    pub(crate) fn triangles(&self, primitive: &Primitive) -> &[u32] {
        &self.order()[primitive.first as usize..primitive.end as usize]
    }

    pub(crate) fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let mut listed = vec![false; soup.records.len()];
        for (at, primitive) in self.levels().iter().enumerate() {
            let range = primitive.first as usize..primitive.end as usize;
            let ids = self.order().get(range).unwrap_or_default();
            ensure!(!ids.is_empty(), "primitive {at} lists no triangles");
            for &id in ids {
                let record = soup.records.get(id as usize);
                let bounds = record.map_or(Bounds::EVERYTHING, |r| r.bounds());
                let inside = primitive.bounds().contains(&bounds);
                ensure!(inside, "primitive {at}: its box lacks triangle {id}");
                let reach = primitive.farthest(&bounds);
                let inside = reach <= f64::from(primitive.radius);
                ensure!(inside, "primitive {at}: its ball lacks triangle {id}");
                let first = at >= self.count || !std::mem::replace(&mut listed[id as usize], true);
                ensure!(first, "triangle {id} is listed twice");
            }
        }
        let missing = listed.iter().position(|listed| !listed);
        ensure!(missing.is_none(), "triangle {missing:?} is not listed");
        Ok(())
    }
}

/// Triangles along a Morton curve, if neighbours are to be side by side.
fn ordered(soup: &TriangleSoup, by_place: bool) -> Vec<u32> {
    let mut order: Vec<u32> = (0..soup.records.len() as u32).collect();
    if !by_place {
        return order;
    }
    let centres = soup.records.par_iter().map(|r| r.bounds().doubled_centre());
    let centres: Vec<[f32; 3]> = centres.collect();
    let around = |all: Bounds, c: &[f32; 3]| all.union(&Bounds { min: *c, max: *c });
    let all = centres.iter().fold(Bounds::EMPTY, around);
    let longest = all.extent().into_iter().fold(0.0, f32::max);
    let scale = grid_scale(longest);
    let code = |id: &u32| {
        let centre = centres[*id as usize];
        let cell = std::array::from_fn(|a| cell_of(centre[a], all.min[a], scale));
        (morton_code(cell), *id)
    };
    order.par_sort_unstable_by_key(code);
    order
}

/// Orders a triangle in each corner of a cube: x counts most, then y, then z.
///
/// # Errors
/// They come otherwise: both orders.
pub(crate) fn check_order() -> Result<(), String> {
    let in_corner = |(id, corner): (u32, &u32)| {
        let [x, y, z] = [4, 2, 1].map(|bit| f32::from(u8::from(corner & bit != 0)));
        let low = Vec3::new(5.0 + x, y, z);
        let vertices = [low, low + 0.25 * Vec3::X, low + 0.25 * Vec3::Y];
        TriangleRecord::new(&Triangle { vertices }, id, 0)
    };
    let corners = [6, 1, 4, 3, 7, 0, 5, 2];
    let records: Vec<TriangleRecord> = (0..).zip(&corners).map(in_corner).collect();
    let found = ordered(&TriangleSoup::from(records), true);
    let found: Vec<u32> = found.iter().map(|id| corners[*id as usize]).collect();
    if found.iter().copied().eq(0..8) {
        return Ok(());
    }
    Err(format!(
        "triangles in the corners of a cube are ordered as {found:?}, and should be from 0 to 7: clusters of `ray-hierarchy` are larger than \
         they need to be; build this program anew, and report what stays wrong"
    ))
}
