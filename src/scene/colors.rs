//! Vertex colours, which multiply the material's base colour: three 16-bit numbers each. Twin:
//! `kernels/shading/colors.wesl`.

use glam::{DVec3, Vec3};

/// The encoding of white, which leaves the base colour unchanged.
pub const WHITE: [u32; 2] = [0xffff_ffff, 0xffff];

const LARGEST: f32 = 65_535.0;

/// Packs a linear colour in 0 to 1: red in the low and green in the high half of the first word,
/// blue in the second. 8- and 16-bit file values survive exactly; NaN becomes 0.
pub fn encode_color(color: Vec3) -> [u32; 2] {
    let [r, g, b] = color
        .to_array()
        .map(|x| (x.clamp(0.0, 1.0) * LARGEST).round() as u32);
    [r | g << 16, b]
}

/// Inverse of [`encode_color`].
pub fn decode_color([first, second]: [u32; 2]) -> DVec3 {
    let part = |bits: u32| f64::from(bits & 0xffff) / f64::from(LARGEST);
    DVec3::new(part(first), part(first >> 16), part(second))
}

/// Converts an sRGB component to linear (IEC 61966-2-1).
fn linear(encoded: f32) -> f32 {
    if encoded <= 0.04045 {
        encoded / 12.92
    } else {
        ((encoded + 0.055) / 1.055).powf(2.4)
    }
}

/// True if all components are within 0 to 1.
pub(super) fn is_color(color: Vec3) -> bool {
    let is_part = |x: &f32| (0.0..=1.0).contains(x);
    color.to_array().iter().all(is_part)
}

/// Converts an sRGB colour to linear; components beyond 0 to 1 are taken as 0 or 1.
pub(super) fn shown(color: Vec3) -> Vec3 {
    let clamped = color.clamp(Vec3::ZERO, Vec3::ONE);
    Vec3::from(clamped.to_array().map(linear))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn bytes_and_sixteen_bits_come_back_and_floats_within_rounding() {
        for k in 0..=255_u8 {
            let value = f32::from(k) / 255.0;
            let back = decode_color(encode_color(Vec3::new(value, 1.0, 0.0)));
            assert!((back - DVec3::new(f64::from(k) / 255.0, 1.0, 0.0)).length() < 1e-15);
        }
        let color = Vec3::new(0.123_456, 0.5, 0.999);
        let back = decode_color(encode_color(color));
        assert!((back - color.as_dvec3()).abs().max_element() <= 0.5 / 65_535.0 + 1e-7);
        assert_eq!(encode_color(Vec3::ONE), WHITE);
        assert_eq!(encode_color(Vec3::new(f32::NAN, -1.0, 2.0)), [0, 0xffff]);
    }

    #[test]
    fn what_is_meant_for_a_screen_becomes_light() {
        assert_eq!((linear(0.0), linear(1.0)), (0.0, 1.0));
        // Grey 188 of 255 carries half the light of white.
        assert!((linear(188.0 / 255.0) - 0.502_886_5).abs() < 1e-5);
    }
}
