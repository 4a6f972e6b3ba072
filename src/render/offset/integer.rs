//! CPU version of `kernels/integrator/offset/integer.wesl`.

use super::RayOffset;

/// C. Wächter, N. Binder, "A fast and robust method for avoiding self-intersection", 2019.
pub(crate) const INTEGER: RayOffset = RayOffset {
    name: "integer",
    description: "up to 256 representable numbers along the normal (Wächter, Binder 2019)",
    kernel: "integrator/offset/integer",
    sources: &[],
    is_unbiased: false,
    offset_point,
};

/// Coordinate below which the fixed step is larger, scene units.
const SMALL: f32 = 0.03125;
const SMALL_STEP: f32 = 1.525_878_9e-5;
const STEPS: f32 = 256.0;

/// As many representable numbers as the normal has 256ths. Source: C. Wächter, N. Binder, "A fast
/// and robust method for avoiding self-intersection", Ray Tracing Gems, chapter 6, 2019.
fn offset_point(p: [f32; 3], n: [f32; 3], _error: [f32; 3]) -> [f32; 3] {
    [0, 1, 2].map(|a| {
        if p[a].abs() < SMALL {
            return p[a] + n[a] * SMALL_STEP;
        }
        let steps = (STEPS * n[a]) as i32;
        let away = if p[a] < 0.0 { -steps } else { steps };
        f32::from_bits((p[a].to_bits() as i32).wrapping_add(away) as u32)
    })
}
