//! CPU version of `kernels/integrator/offset/fixed.wesl`.

use super::RayOffset;

pub(crate) const FIXED: RayOffset = RayOffset {
    name: "fixed",
    description: "1e-4 scene units along the normal, whatever the scale",
    kernel: "integrator/offset/fixed",
    sources: &[],
    is_unbiased: false,
    offset_point,
};

/// Scene units.
const DISTANCE: f32 = 1e-4;

/// The same distance everywhere, suitable for one scale of scenes.
fn offset_point(p: [f32; 3], n: [f32; 3], _error: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|a| p[a] + n[a] * DISTANCE)
}
