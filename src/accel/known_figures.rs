//! Costs and shapes of trees over a few triangles, a phase of a build, and the box of a placed object, computed anew: rays show whether a tree is right, and
//! not whether its figures are, nor whether its boxes have the room that their proof asks for.

use crate::bounds::Bounds;
use crate::instancing::BoxMap;
use crate::known_cells;
use crate::known_parameters;
use crate::known_rows;
use crate::known_trees;
use crate::tree::{NodeKind, Tree, TreeNode};
use crate::{AccelRegistry, BuildLog, StructureStats, TriangleSoup, triangle::TriangleRecord};
use glam::Vec3;
use raystone_core::clock::Instant;
use raystone_core::geometry::Triangle;
use raystone_core::params::Params;
use raystone_scene::{Assembly, Instance, Transform};
use std::time::Duration;

/// Structures, and their cost by the surface area heuristic with both constants 1: the root, 1, and two leaves of a triangle
/// each, (1 + 1) / 4, for halves of the boxes' surfaces are 1, 1 and 4.
const COSTS: [(&str, f64); 3] = [("bvh", 1.5), ("bvh4", 1.5), ("cwbvh", 1.5)];

/// The object's box from (−1, −2, −1) to (1, 1, 3), placed at (3, −1, 2) by the columns (2, 0, 0), (1, 1, 0) and (0, 0, ½):
/// low corner (−1, −3, 3/2) and high corner (6, 0, 7/2), each 2⁻¹⁹ (3 · (3 + 4) + 6 · 6) farther out, for the norms of the map
/// and its inverse are 2 and 3, of the translation to the object 4, of the box 3 there and 6 here; and the growth of 2⁻¹⁹ · 6.
const WORLD_BOX: [[f64; 3]; 2] = [[-1.0, -3.0, 1.5], [6.0, 0.0, 3.5]];
const PAD: f64 = 57.0 / 524_288.0;
const GROWTH: f64 = 6.0 / 524_288.0;
/// What rounding to f32 may add, outwards.
const OF_BOX: f64 = 1.5e-6;

/// Computes them.
///
/// # Errors
/// One is not what it should be: of which, and both values.
pub fn check() -> Result<(), String> {
    costs()?;
    shapes()?;
    overlaps_of_copies()?;
    overlap_of_a_part()?;
    crate::tree::check_spread()?;
    known_rows::check()?;
    known_cells::check()?;
    known_trees::check()?;
    phases()?;
    known_parameters::check()?;
    crate::wide::check_octants()?;
    crate::tracer::refill::check()?;
    raystone_advice::check_known()?;
    box_agrees(&BoxMap::new(&placed()?))
}

fn box_agrees(map: &BoxMap) -> Result<(), String> {
    let object = Bounds {
        min: [-1.0, -2.0, -1.0],
        max: [1.0, 1.0, 3.0],
    };
    let (found, growth) = (map.world_box(&object), map.growth());
    let grown = |at: f64, out: f64| at + out * PAD;
    let low = WORLD_BOX[0].map(|at| grown(at, -1.0));
    let high = WORLD_BOX[1].map(|at| grown(at, 1.0));
    let room = |outside: f64| (0.0..=OF_BOX).contains(&outside);
    let is_box = (0..3).all(|axis| {
        room(low[axis] - f64::from(found.min[axis]))
            && room(f64::from(found.max[axis]) - high[axis])
    });
    let is_growth = room(f64::from(growth) / GROWTH - 1.0);
    (is_box && is_growth).then_some(()).ok_or_else(|| {
        format!(
            "the box of a known copy is {found:?} and grows by {growth:e}, and should be {low:?} to {high:?} and {GROWTH:e}: \
             this program may lose hits; build it anew, and report what stays wrong"
        )
    })
}

/// The sheared copy.
fn placed() -> Result<Instance, String> {
    let columns = [[2.0, 0.0, 0.0], [1.0, 1.0, 0.0], [0.0, 0.0, 0.5]];
    let to_world = Transform::new(columns.map(Vec3::from), Vec3::new(3.0, -1.0, 2.0));
    let mut assembly = Assembly::default();
    let placed = assembly
        .add_object(vec![half_a_square(0)])
        .and_then(|object| assembly.place(object, to_world));
    placed.map_err(|e| e.to_string())
}

fn costs() -> Result<(), String> {
    let triangles = [0, 1].map(half_a_square);
    COSTS.into_iter().try_for_each(|(name, expected)| {
        let found = stats(name, &triangles)?.sah_cost;
        let agrees = found.is_some_and(|found| (found - expected).abs() < 1e-6);
        agrees.then_some(()).ok_or_else(|| {
            format!(
                "the SAH cost of a known {name} is {found:?}, and should be {expected}: this program computes wrong figures; \
                 build it anew, and report what stays wrong"
            )
        })
    })
}

/// Two triangles of areas 8 and √10/2, of which the box of the second holds a unit square of the first: a root and two leaves,
/// and an end-point overlap of 1 / (8 + √10/2).
fn shapes() -> Result<(), String> {
    let found = stats("bvh", &two_shapes())?;
    let counts = [found.nodes, found.leaves, found.references];
    let epo = 1.0 / (8.0 + 10f64.sqrt() / 2.0);
    let is_right = counts == [3, 2, 2]
        && found.depth == Some(1)
        && found.epo.is_some_and(|found| (found - epo).abs() < 1e-9);
    is_right.then_some(()).ok_or_else(|| {
        format!(
            "a known bvh has {found:?}, and should have 3 nodes, 2 leaves and references, a depth of 1 and an overlap of {epo}: \
             this program computes wrong figures; build it anew, and report what stays wrong"
        )
    })
}

/// The same two triangles and a copy of the first, of which a leaf of both lists the first once more: a spatial split has such
/// references, and a scene may have such copies. All of the first, 8, lies in the copy's leaf; all of the copy in the first's,
/// and a unit square of it in that of both, whose box is that of the second. They weigh 1, 1 and 2; areas are 2 · 8 + √10/2.
fn overlaps_of_copies() -> Result<(), String> {
    let [first, second] = two_shapes();
    let soup = soup_of(&[first, second, first]);
    let [a, b] = [0, 1].map(|at| soup.records[at].bounds());
    let leaf = |bounds, first, count| (bounds, NodeKind::Leaf { first, count });
    let inner = |bounds, left, right| (bounds, NodeKind::Inner { left, right });
    let all = a.union(&b);
    let nodes = [
        inner(all, 1, 2),
        leaf(a, 0, 1),
        inner(all, 3, 4),
        leaf(b, 1, 2),
        leaf(a, 3, 1),
    ];
    let nodes = nodes.map(|(bounds, kind)| TreeNode { bounds, kind });
    let tree = Tree {
        nodes: nodes.to_vec(),
        order: vec![0, 1, 0, 2],
        epo: None,
    };
    let (found, expected) = (
        tree.epo(&soup, u64::MAX),
        18.0 / (16.0 + 10f64.sqrt() / 2.0),
    );
    ((found - expected).abs() < 1e-9)
        .then_some(())
        .ok_or_else(|| {
            format!(
                "the overlap of a known tree with a triangle in two leaves and a copy of it is {found}, and should be {expected}: \
                 this program computes wrong figures; build it anew, and report what stays wrong"
            )
        })
}

/// Half of 256 triangles, all alike, lie in the box of the leaf of the others, which weighs 128: an overlap of 64. Of the first 128, which are
/// spread over all, about as many do.
fn overlap_of_a_part() -> Result<(), String> {
    let all: Vec<Triangle> = (0..256).map(|k| half_a_square(k / 128)).collect();
    let soup = soup_of(&all);
    let [low, high] = [0, 255].map(|at| soup.records[at].bounds());
    let leaf = |first| NodeKind::Leaf { first, count: 128 };
    let nodes = [
        (low.union(&high), NodeKind::Inner { left: 1, right: 2 }),
        (low.union(&high), leaf(0)),
        (high, leaf(128)),
    ];
    let tree = Tree {
        nodes: nodes
            .map(|(bounds, kind)| TreeNode { bounds, kind })
            .to_vec(),
        order: (0..256).collect(),
        epo: None,
    };
    let found = tree.epo(&soup, 1);
    ((found / 64.0 - 1.0).abs() < 0.05).then_some(()).ok_or_else(|| {
        format!(
            "the overlap of a part of known triangles is {found}, and should be about 64: this program computes wrong figures; \
             build it anew, and report what stays wrong"
        )
    })
}

/// A phase that waits takes at least as long, and no longer than the clock around it says.
fn phases() -> Result<(), String> {
    const WAIT: Duration = Duration::from_micros(300);
    let around = Instant::now();
    let mut log = BuildLog::default();
    log.phase("known", || {
        let started = Instant::now();
        while started.elapsed() < WAIT {}
    });
    let (told, most) = (log.total_ms(), around.elapsed().as_secs_f64() * 1e3);
    let least = WAIT.as_secs_f64() * 1e3;
    (least..=most).contains(&told).then_some(()).ok_or_else(|| {
        format!(
            "a phase of {least} ms and more in {most} ms is measured as {told} ms: this program computes wrong figures; build \
             it anew, and report what stays wrong"
        )
    })
}

fn two_shapes() -> [Triangle; 2] {
    let corners = [
        [[0.0, 0.0, 0.0], [4.0, 0.0, 0.0], [0.0, 4.0, 0.0]],
        [[0.0, 0.0, 0.0], [1.0, 0.0, 3.0], [1.0, 1.0, 3.0]],
    ];
    corners.map(|corners| Triangle {
        vertices: corners.map(Vec3::from),
    })
}

pub(crate) fn soup_of(triangles: &[Triangle]) -> TriangleSoup {
    let records = (0..).zip(triangles);
    let records: Vec<TriangleRecord> = records
        .map(|(id, t)| TriangleRecord::new(t, id, 0))
        .collect();
    TriangleSoup::from(records)
}

fn stats(structure: &str, triangles: &[Triangle]) -> Result<StructureStats, String> {
    stats_with(structure, &Params::default(), triangles)
}

/// What a structure with these parameters says of itself over these triangles.
pub(crate) fn stats_with(
    structure: &str,
    params: &Params,
    triangles: &[Triangle],
) -> Result<StructureStats, String> {
    stats_of(structure, params, &soup_of(triangles))
}

/// The same over a soup, which may have copies.
pub(crate) fn stats_of(
    structure: &str,
    params: &Params,
    soup: &TriangleSoup,
) -> Result<StructureStats, String> {
    let registry = AccelRegistry::default();
    let kind = registry.named("structure", structure)?;
    let mut log = BuildLog::default().noting_quality();
    let built = kind.build(soup, params, &mut log);
    Ok(built.map_err(|e| e.to_string())?.stats())
}

/// Of a row of squares along x with a gap of two between them.
pub(crate) fn half_a_square(place: u32) -> Triangle {
    let x = 3.0 * place as f32;
    Triangle {
        vertices: [[x, 0.0, 0.0], [x + 1.0, 0.0, 0.0], [x, 1.0, 0.0]].map(Into::into),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn boxes_with_another_pad_are_told() {
        let placed = placed().expect("a copy");
        for share in [0.0, 0.98, 1.02] {
            let map = BoxMap::with_pad(&placed, share / 524_288.0);
            assert!(box_agrees(&map).is_err(), "{share}");
        }
    }
}
