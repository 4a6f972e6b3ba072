//! Trees over a row of triangles along each axis: a builder that takes bad splits, or those of another axis, makes a tree
//! that answers right, and a structure that looks slow.

use crate::known_figures::{half_a_square, stats_with};
use crate::{AccelRegistry, StructureStats};
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::params::{ParamValue, Params};

/// The least costs of trees of two, four and eight children over a row of sixteen, by dynamic programming over all splits.
const BINARY: f64 = 178.0 / 46.0;
const OF_FOUR: f64 = 102.0 / 46.0;
const OF_EIGHT: f64 = 88.0 / 46.0;

/// A structure, its builder unless it is the default one, and its cost over an even row: of a BVH the least, which all of them reach.
const ROWS: [(&str, Option<&str>, f64); 10] = [
    ("bvh", None, BINARY),
    ("bvh", Some("sweep"), BINARY),
    ("bvh", Some("longest-axis-sweep"), BINARY),
    ("bvh", Some("sbvh"), BINARY),
    ("bvh", Some("host-ploc"), BINARY),
    ("roped-bvh", None, BINARY),
    ("bvh4", None, OF_FOUR),
    ("cwbvh", None, OF_EIGHT),
    // Four of eight parts list half of the triangles each, for all lie in a border: 1 + 4 · 8 / 4.
    ("octree", None, 9.0),
    // The best split is taken at each level.
    ("kd-tree", None, 244.0 / 46.0),
];
/// Triangles from which a sweep splits at borders of two bins alone, the middle of a node, and its cost over a steep row: where all
/// places are allowed the best is taken at each level, which is not the cheapest tree in the end (both by another program, in whole numbers).
const SWEEPS: [(i64, f64); 2] = [(128, 1865.0 / 631.0), (2, 1784.0 / 631.0)];
/// A kd-tree over a deep row, by another program in whole numbers: with the axis of a split for one of the sides it has 280 / 29.
const DEEP: f64 = 276.0 / 29.0;
/// A kd-tree over an uneven row, by another program in whole numbers: the best plane of each cell, where one that leaves a side empty
/// costs a fifth less, above it as below.
const BONUS: f64 = 809.0 / 169.0;
/// Height and depth of the triangles of a deep row, about half as long as the row.
const HEIGHT: f32 = 20.0;
const DEPTH: f32 = 30.0;
/// Where rows begin: elsewhere along each axis.
const AWAY: Vec3 = Vec3::new(7.0, 40.0, 300.0);
/// Relative error of a cost.
const ROUNDING: f64 = 1e-6;

/// Builds them.
///
/// # Errors
/// One is worse than it should be, or another one along another axis: which, and both values.
pub(crate) fn check() -> Result<(), String> {
    for (structure, builder, least) in ROWS {
        let params = builder.map(|name| ("builder".to_owned(), ParamValue::Name(name.to_owned())));
        let params = Params(params.into_iter().collect());
        let label = builder.map_or(structure.to_owned(), |name| {
            format!("{structure} of {name}")
        });
        costs(structure, &params, &label, (even, least))?;
        if structure.contains("bvh") || structure == "kd-tree" {
            same_along_all_axes(structure, &params, &label, uneven)?;
        }
    }
    deep_kd_tree()?;
    costs("kd-tree", &Params::default(), "kd-tree", (mirrored, BONUS))?;
    for (bins_from, cost) in SWEEPS {
        let builder = ("builder", ParamValue::Name("sweep".to_owned()));
        let bins = ("bins", ParamValue::Integer(2));
        let params = [
            builder,
            bins,
            ("sweep_bins_from", ParamValue::Integer(bins_from)),
        ];
        let params = Params(params.map(|(name, value)| (name.to_owned(), value)).into());
        costs(
            "bvh",
            &params,
            &format!("bvh of sweep with bins from {bins_from}"),
            (steep, cost),
        )?;
    }
    for entry in AccelRegistry::default().entries() {
        same_along_all_axes(&entry.name, &Params::default(), &entry.name, even)?;
    }
    Ok(())
}

/// Where both sides of a split count, as they do not in a flat row.
fn deep_kd_tree() -> Result<(), String> {
    for turn in 0..6 {
        let row = row_of(turn, even, |place| {
            let mut triangle = half_a_square(place);
            triangle.vertices[1].z = DEPTH;
            triangle.vertices[2].y = HEIGHT;
            triangle
        });
        let found = stats_with("kd-tree", &Params::default(), &row)?.sah_cost;
        if found.is_none_or(|found| (found / DEEP - 1.0).abs() > ROUNDING) {
            return Err(wrong("kd-tree", &format!("{found:?}"), &DEEP.to_string()));
        }
    }
    Ok(())
}

/// What a structure over a row costs.
fn costs(
    structure: &str,
    params: &Params,
    label: &str,
    (places, cost): (fn(u32) -> u32, f64),
) -> Result<(), String> {
    let found = stats_with(structure, params, &row(0, places))?.sah_cost;
    let is_as_said = found.is_some_and(|found| (found / cost - 1.0).abs() <= ROUNDING);
    if is_as_said {
        return Ok(());
    }
    Err(wrong(label, &format!("{found:?}"), &cost.to_string()))
}

/// Nothing of a tree depends on the axis of a row and on those of its height and its missing depth, and nothing of a structure on
/// those of an even one.
fn same_along_all_axes(
    structure: &str,
    params: &Params,
    label: &str,
    places: fn(u32) -> u32,
) -> Result<(), String> {
    let x = stats_with(structure, params, &row(0, places))?;
    for turn in 1..6 {
        let other = stats_with(structure, params, &row(turn, places))?;
        if !is_same(&x, &other) {
            return Err(wrong(label, &format!("{other:?}"), &format!("{x:?}")));
        }
    }
    Ok(())
}

fn even(k: u32) -> u32 {
    k
}

/// Gaps between 0 and 7, the greatest far from the middle.
fn uneven(k: u32) -> u32 {
    k * k / 4
}

/// From the other end.
fn mirrored(k: u32) -> u32 {
    uneven(15) - uneven(k)
}

/// Gaps that grow: their half is no place to split at.
fn steep(k: u32) -> u32 {
    k * k * k / 16
}

fn is_same(a: &StructureStats, b: &StructureStats) -> bool {
    let cost = |of: &StructureStats| of.sah_cost.unwrap_or_default();
    let counts = |of: &StructureStats| (of.nodes, of.leaves, of.references, of.depth, of.bytes);
    counts(a) == counts(b) && (cost(a) - cost(b)).abs() <= ROUNDING * cost(a)
}

/// Sixteen triangles along an axis, at these places; along each of the three with their height along either of the others.
fn row(turn: usize, places: fn(u32) -> u32) -> Vec<Triangle> {
    row_of(turn, places, half_a_square)
}

fn row_of(turn: usize, places: fn(u32) -> u32, of: impl Fn(u32) -> Triangle) -> Vec<Triangle> {
    let turned = |v: Vec3| {
        let mut at = v.to_array();
        if turn >= 3 {
            at.swap(1, 2);
        }
        at.rotate_right(turn % 3);
        Vec3::from(at) + AWAY
    };
    let along = |place| Triangle {
        vertices: of(place).vertices.map(turned),
    };
    (0..16).map(places).map(along).collect()
}

fn wrong(label: &str, found: &str, expected: &str) -> String {
    format!(
        "the SAH cost or the size of a {label} over a known row is {found}, and should be {expected} along each axis: this \
         program builds other trees than it says; build it anew, and report what stays wrong"
    )
}

#[cfg(test)]
mod tests {
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}
