//! Cells of grids over known triangles, and the layouts of known nodes: another density, cells left apart that could be one, wider planes
//! or another order of nodes make a structure that answers right, and looks slow.

use crate::bvh::check_orders;
use crate::known_figures::stats_with;
use crate::wide::check_planes;
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::params::{ParamValue, Params};

/// A structure, its parameters, and its cells over 64 triangles, one in each cell of 8 × 4 × 2 of edge 2.
type Row = (&'static str, &'static [(&'static str, f64)], u64);

/// Cleary's rule: edges of cbrt(volume / (λ · triangles)), here cbrt(512 / 64 λ); of parts cbrt(8 / λ).
const LATTICE: [Row; 4] = [
    ("uniform-grid", &[("lambda", 1.0)], 64),
    ("uniform-grid", &[("lambda", 8.0)], 512),
    (
        "two-level-grid",
        &[("lambda1", 1.0), ("lambda2", 64.0)],
        64 + 64 * 64,
    ),
    (
        "irregular-grid",
        &[("lambda1", 1.0), ("lambda2", 0.001), ("alpha", 0.0)],
        64,
    ),
];
/// Eight cells in a row, of which the first and the last hold eight triangles each: those between become one.
const ENDS: Row = ("irregular-grid", &[("lambda1", 0.5), ("lambda2", 0.001)], 3);

/// A triangle across 4³ cells of edge 1 overlaps 28 of them, by separating axes in whole fractions; without its plane 39.
const SLANTED: [[f32; 3]; 3] = [[0.0, 0.3, 4.0], [4.0, 0.0, 0.2], [0.3, 4.0, 0.0]];
const OVERLAPPED: u64 = 28;

/// Computes them.
///
/// # Errors
/// One is not what it should be: of which, and both values.
pub(crate) fn check() -> Result<(), String> {
    let lattice: Vec<Triangle> = (0..64)
        .map(|k| in_cell([k % 8, k / 8 % 4, k / 32]))
        .collect();
    let ends: Vec<Triangle> = (0..16).map(at_end).collect();
    let of_lattice = LATTICE.iter().map(|row| (row, &lattice));
    for ((structure, params, expected), triangles) in of_lattice.chain([(&ENDS, &ends)]) {
        let set = params.iter();
        let set = set.map(|(name, value)| ((*name).to_owned(), ParamValue::Number(*value)));
        let found = stats_with(structure, &Params(set.collect()), triangles)?.nodes;
        if found != *expected {
            return Err(format!(
                "a {structure} with {params:?} over known triangles has {found} cells, and should have {expected}: this program \
                 builds others than it says; build it anew, and report what stays wrong"
            ));
        }
    }
    let params = Params([("lambda".to_owned(), ParamValue::Number(64.0))].into());
    let slanted = Triangle::from(SLANTED.map(Vec3::from));
    let found = stats_with("uniform-grid", &params, &[slanted])?.references;
    if found != OVERLAPPED {
        return Err(format!(
            "a known triangle is in {found} cells of a uniform-grid, and should be in {OVERLAPPED}: this program lists triangles where they \
             are not; build it anew, and report what stays wrong"
        ));
    }
    check_planes()?;
    check_orders()
}

/// In a cell of edge 2; the first and last along an axis end where all cells do.
fn in_cell(cell: [u32; 3]) -> Triangle {
    let [x, y, z] = [0, 1, 2].map(|axis| {
        let most = [7.0, 3.0, 1.0][axis];
        cell[axis] as f32 * (2.0 * most + 1.0) / most
    });
    let low = Vec3::new(x, y, z);
    Triangle {
        vertices: [low, low + Vec3::new(1.0, 0.0, 1.0), low + Vec3::Y],
    }
}

/// Half of them in the first unit of a box of 16 × 2 × 2, the others in the last.
fn at_end(k: u32) -> Triangle {
    let low = Vec3::X * (15.0 * (k % 2) as f32);
    Triangle {
        vertices: [low, low + Vec3::new(1.0, 0.0, 2.0), low + 2.0 * Vec3::Y],
    }
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }

    #[test]
    fn neighbours_stay_apart_where_a_box_around_both_costs_more() {
        use super::*;
        // Two cubes with a triangle each cost 2 · 3 · (1 + 1) in half areas, and as one box 5 · (2 + 1).
        let lattice: Vec<Triangle> = (0..64)
            .map(|k| in_cell([k % 8, k / 8 % 4, k / 32]))
            .collect();
        let set = [("lambda1", 1.0), ("lambda2", 0.001)];
        let set = set.map(|(name, value)| (name.to_owned(), ParamValue::Number(value)));
        let found = stats_with("irregular-grid", &Params(set.into()), &lattice).unwrap();
        assert_eq!(found.nodes, 64);
    }
}
