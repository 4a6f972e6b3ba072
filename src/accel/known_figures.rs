//! Costs of trees over two triangles, and the box of a placed object, computed anew: rays show whether a tree is right, and
//! not whether its figures are, nor whether its boxes have the room that their proof asks for.

use crate::bounds::Bounds;
use crate::instancing::BoxMap;
use crate::{AccelRegistry, BuildLog, TriangleSoup, triangle::TriangleRecord};
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::params::Params;
use raystone_scene::{Assembly, Instance, Transform};

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
    let registry = AccelRegistry::default();
    let records: Vec<TriangleRecord> = (0..2)
        .map(|id| TriangleRecord::new(&half_a_square(id), id, 0))
        .collect();
    let soup = TriangleSoup::from(records);
    COSTS.into_iter().try_for_each(|(name, expected)| {
        let kind = registry.named("structure", name)?;
        let built = kind.build(&soup, &Params::default(), &mut BuildLog::default());
        let found = built.map_err(|e| e.to_string())?.stats().sah_cost;
        let agrees = found.is_some_and(|found| (found - expected).abs() < 1e-6);
        agrees.then_some(()).ok_or_else(|| {
            format!(
                "the SAH cost of a known {name} is {found:?}, and should be {expected}: this program computes wrong figures; \
                 build it anew, and report what stays wrong"
            )
        })
    })
}

/// Of a row of squares with a gap of two between them.
fn half_a_square(place: u32) -> Triangle {
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
