//! Costs of trees over two triangles, computed anew: rays show whether a tree is right, and not whether its figures are.

use crate::{AccelRegistry, BuildLog, TriangleSoup, triangle::TriangleRecord};
use raystone_core::geometry::Triangle;
use raystone_core::params::Params;

/// Structures, and their cost by the surface area heuristic with both constants 1: the root, 1, and two leaves of a triangle
/// each, (1 + 1) / 4, for halves of the boxes' surfaces are 1, 1 and 4.
const COSTS: [(&str, f64); 3] = [("bvh", 1.5), ("bvh4", 1.5), ("cwbvh", 1.5)];

/// Builds them.
///
/// # Errors
/// A cost is not what it should be: of which, and both values.
pub fn check() -> Result<(), String> {
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
    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(super::check(), Ok(()));
    }
}
