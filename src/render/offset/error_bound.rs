//! CPU version of `kernels/integrator/offset/error_bound.wesl`.

use super::RayOffset;

/// By the error bound of the point.
pub const ERROR_BOUND: RayOffset = RayOffset {
    name: "error-bound",
    description: "the rounding error of the point, from its triangle and the instances' transforms",
    kernel: "integrator/offset/error_bound",
    sources: &[],
    is_unbiased: true,
    offset_point,
};

/// The next number away from zero if the coordinate moved outwards, towards zero if inwards.
fn next(x: f32, step: f32) -> f32 {
    let bits = x.to_bits() as i32;
    if step == 0.0 || bits & 0x7fff_ffff == 0 {
        return x;
    }
    let away = (step > 0.0) == (bits >= 0);
    f32::from_bits(bits.wrapping_add(if away { 1 } else { -1 }) as u32)
}

/// Out of the error box of the point, then one representable number farther. Source: M. Pharr, W.
/// Jakob, G. Humphreys, "Physically Based Rendering", 4th edition, 6.8.6.
fn offset_point(p: [f32; 3], n: [f32; 3], error: [f32; 3]) -> [f32; 3] {
    let distance = n[0].abs() * error[0] + n[1].abs() * error[1] + n[2].abs() * error[2];
    let step = n.map(|n| n * distance);
    [0, 1, 2].map(|a| next(p[a] + step[a], step[a]))
}
