//! The cells of the keys by which rays are sorted, see `kernels/accel/ray_hierarchy/passes/keys.wesl`.

use crate::bounds::Bounds;

/// Cells of the scene's longest side, and of the range of a component of a direction.
const CELLS: f32 = 64.0;

/// Minimum corner of the cells, and cells per unit of length.
pub(super) fn extent(bounds: &Bounds) -> ([f32; 3], f32) {
    let longest = bounds.extent().into_iter().fold(0.0, f32::max);
    let low = bounds.min.map(|x| if x.is_finite() { x } else { 0.0 });
    (low, CELLS / longest.max(1e-30))
}
