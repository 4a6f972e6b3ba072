//! Parameters of structures that have to change what is built over a few triangles: one that is read and not used makes a
//! sweep without an effect, which looks like a finding.

use crate::{AccelRegistry, BuildLog, TriangleSoup, triangle::TriangleRecord};
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::params::{ParamValue, Params};
use raystone_core::random::Pcg32;

/// A parameter's value.
type Setting = (&'static str, Value);

#[derive(Clone, Copy)]
enum Value {
    Number(f64),
    Integer(i64),
    Flag(bool),
    Name(&'static str),
}
use Value::{Flag, Integer, Name, Number};

/// A structure, what else is set, and another value of a parameter than its default.
type Row = (&'static str, &'static [Setting], Setting);

const ROWS: [Row; 34] = [
    ("bvh", &[], ("leaf_size", Integer(1))),
    ("bvh", &[], ("min_leaf_size", Integer(4))),
    ("bvh", &[], ("traversal_cost", Number(8.0))),
    ("bvh", &[], ("intersection_cost", Number(8.0))),
    ("bvh", &[("builder", Name("binned"))], ("bins", Integer(2))),
    (
        "bvh",
        &[("builder", Name("sweep"))],
        ("sweep_bins_from", Integer(2)),
    ),
    (
        "bvh",
        &[("builder", Name("sbvh"))],
        ("spatial_alpha", Number(1.0)),
    ),
    (
        "bvh",
        &[("builder", Name("sbvh"))],
        ("spatial_bins", Integer(2)),
    ),
    (
        "bvh",
        &[("builder", Name("sbvh"))],
        ("spatial_clip", Flag(false)),
    ),
    ("bvh", &[], ("builder", Name("longest-axis-sweep"))),
    ("bvh", &[], ("reinsertion", Integer(2))),
    (
        "bvh",
        &[("reinsertion", Integer(1))],
        ("reinsertion_share", Number(0.01)),
    ),
    (
        "bvh",
        &[("builder", Name("host-ploc"))],
        ("search_radius", Integer(1)),
    ),
    ("bvh", &[], ("node_order", Name("breadth-first"))),
    ("bvh", &[], ("triangles", Name("indexed"))),
    ("bvh4", &[], ("leaf_size", Integer(1))),
    ("cwbvh", &[], ("leaf_size", Integer(1))),
    ("uniform-grid", &[], ("lambda", Number(1.0))),
    ("uniform-grid", &[], ("skip", Name("chebyshev"))),
    ("uniform-grid", &[], ("exact_overlap", Flag(false))),
    ("two-level-grid", &[], ("lambda1", Number(1.0))),
    ("two-level-grid", &[], ("lambda2", Number(20.0))),
    ("irregular-grid", &[], ("lambda1", Number(1.0))),
    ("irregular-grid", &[], ("lambda2", Number(20.0))),
    ("irregular-grid", &[], ("alpha", Number(0.0))),
    ("irregular-grid", &[], ("expansions", Integer(0))),
    ("octree", &[], ("max_depth", Integer(1))),
    ("octree", &[], ("leaf_size", Integer(1))),
    ("octree", &[], ("traversal_cost", Number(20.0))),
    ("octree", &[], ("clip", Flag(false))),
    ("kd-tree", &[], ("max_depth", Integer(2))),
    ("kd-tree", &[], ("traversal_cost", Number(20.0))),
    ("kd-tree", &[], ("intersection_cost", Number(20.0))),
    ("kd-tree", &[], ("empty_bonus", Number(0.9))),
];

/// Structures with two costs.
const SCALED: [&str; 2] = ["bvh", "kd-tree"];

/// Triangles of many sizes.
const TRIANGLES: usize = 160;

/// Builds all of them.
///
/// # Errors
/// A parameter changes nothing, or nothing is built: of which structure.
pub(crate) fn check() -> Result<(), String> {
    let soup = soup();
    ROWS.iter().try_for_each(|row| changes(row, &soup))?;
    SCALED
        .iter()
        .try_for_each(|structure| scales(structure, &soup))
}

/// Costs are compared with each other alone: 32 times both, which is exact in floats, is the same tree.
fn scales(structure: &str, soup: &TriangleSoup) -> Result<(), String> {
    let costs = |scale: f64| {
        [
            ("traversal_cost", Number(2.0 * scale)),
            ("intersection_cost", Number(scale)),
        ]
    };
    if built(structure, &costs(0.25), soup)? == built(structure, &costs(8.0), soup)? {
        return Ok(());
    }
    Err(format!(
        "a known {structure} is another one where both of its costs are 32 times as high: this program weighs them \
         otherwise than it says; build it anew, and report what stays wrong"
    ))
}

fn changes((structure, given, changed): &Row, soup: &TriangleSoup) -> Result<(), String> {
    let before = built(structure, given, soup)?;
    let after = built(structure, &[*given, &[*changed]].concat(), soup)?;
    if before != after {
        return Ok(());
    }
    Err(format!(
        "`{}` of {structure} changes nothing over known triangles: this program builds other structures than it says; build \
         it anew, and report what stays wrong",
        changed.0
    ))
}

fn soup() -> TriangleSoup {
    let mut random = Pcg32::new(11);
    let mut point = |size: f64| {
        Vec3::new(
            (size * random.signed()) as f32,
            (size * random.signed()) as f32,
            (size * random.signed()) as f32,
        )
    };
    let each = (0..TRIANGLES as u32).map(|id| {
        let size = [0.02, 0.1, 0.4, 1.5][id as usize % 4];
        let middle = point(2.0);
        let triangle = Triangle {
            vertices: [
                middle + point(size),
                middle + point(size),
                middle + point(size),
            ],
        };
        TriangleRecord::new(&triangle, id, 0)
    });
    TriangleSoup::from(each.collect::<Vec<_>>())
}

/// A digest of what kernels read.
fn built(
    structure: &str,
    settings: &[Setting],
    soup: &TriangleSoup,
) -> Result<blake3::Hash, String> {
    let registry = AccelRegistry::default();
    let kind = registry.named("structure", structure)?;
    let values = settings.iter().map(|(name, value)| {
        let value = match value {
            Number(x) => ParamValue::Number(*x),
            Integer(n) => ParamValue::Integer(*n),
            Flag(is_set) => ParamValue::Flag(*is_set),
            Name(name) => ParamValue::Name((*name).to_owned()),
        };
        ((*name).to_owned(), value)
    });
    let params = Params(values.collect());
    let built = kind.build(soup, &params, &mut BuildLog::default());
    let built = built.map_err(|e| format!("a known {structure}: {e}"))?;
    let buffers = built.buffers();
    let mut hash = blake3::Hasher::new();
    for array in &buffers.arrays {
        hash.update(bytemuck::cast_slice(&array.words));
    }
    hash.update(format!("{:?} {:?}", buffers.features, buffers.constants).as_bytes());
    Ok(hash.finalize())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_parameter_of_the_table_changes_what_is_built() {
        let soup = soup();
        let wrong = ROWS.iter().filter_map(|row| changes(row, &soup).err());
        assert_eq!(wrong.collect::<Vec<_>>(), Vec::<String>::new());
    }

    #[test]
    fn only_the_ratio_of_costs_counts() {
        for structure in SCALED {
            assert_eq!(scales(structure, &soup()), Ok(()));
        }
    }
}
