//! CPU version of `kernels/integrator/offset/none.wesl`.

use super::RayOffset;

/// No offset.
pub const NONE: RayOffset = RayOffset {
    name: "none",
    description: "rays start at the point that was hit",
    kernel: "integrator/offset/none",
    sources: &[],
    is_unbiased: false,
    offset_point,
};

/// Rays start where the last one ended.
fn offset_point(p: [f32; 3], _n: [f32; 3], _error: [f32; 3]) -> [f32; 3] {
    p
}
