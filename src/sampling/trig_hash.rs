//! The trigonometric hash of shaders, a negative control. CPU version of
//! `kernels/sampling/trig_hash.wesl`.
//!
//! Source: Dufay 2017, Alg. 5.1: per pixel s = 0.0174532·y·W + x; s = s·sin(s); then each pair of
//! numbers takes two steps of 0.1 and is frac(sin(s) · (43758.5453123, 22578.1459123)). The
//! accuracy of `sin` is not specified on devices, so angles are fractions of a turn in 2³², the
//! sine is a Taylor polynomial of degree 11 (error below 1e-7), and everything is integer
//! arithmetic. Two things differ from the printed text, since a draw must depend on its coordinates
//! alone: the linear pixel index replaces y·W and the seed replaces x, and sample i begins 256
//! steps after sample i − 1.

use super::Coordinate;
use super::fixed_point::mul_high;

const HALF_TURN: u32 = 0x8000_0000;
/// 0.0174532 radians.
const PIXEL_STEP: u32 = 11_930_401;
/// 1 radian.
const SEED_STEP: u32 = 683_565_276;
/// 0.1 radians.
const DRAW_STEP: u32 = 68_356_528;
const DRAWS: u32 = 256;
/// 43758.5453123 · 2¹⁶.
const FIRST_FACTOR: u32 = 2_867_760_026;
/// 22578.1459123 · 2¹⁶.
const SECOND_FACTOR: u32 = 1_479_681_371;

/// |sin| of a fraction of a turn; 2³¹ is 1.
fn sine(phase: u32) -> u32 {
    let mut t = phase << 2;
    if phase & 0x4000_0000 != 0 {
        t = !t;
    }
    let squared = mul_high(t, t);
    // (π/2)^k / k! for k = 11, 9, … 1.
    let mut sum = 344_545 - mul_high(squared, 7728);
    sum = 10_053_990 - mul_high(squared, sum);
    sum = 171_138_612 - mul_high(squared, sum);
    sum = 1_387_197_337 - mul_high(squared, sum);
    sum = 3_373_259_426 - mul_high(squared, sum);
    mul_high(t, sum)
}

/// `x` with the sign of the sine of `phase`, modulo 1.
fn signed_fraction(x: u32, phase: u32) -> u32 {
    if phase >= HALF_TURN {
        x.wrapping_neg()
    } else {
        x
    }
}

/// s = 0.0174532 pixel + seed; s = s sin(s), in turns.
fn start_phase(at: Coordinate) -> u32 {
    let pixel = at.pixel.wrapping_mul(PIXEL_STEP);
    let fraction = pixel.wrapping_add(at.seed.wrapping_mul(SEED_STEP));
    let mut whole = mul_high(at.pixel, PIXEL_STEP) + mul_high(at.seed, SEED_STEP);
    if fraction < pixel {
        whole += 1;
    }
    let size = sine(fraction);
    let turns = (whole.wrapping_mul(size) << 1).wrapping_add(mul_high(fraction, size) << 1);
    signed_fraction(turns, fraction)
}

/// frac(sin(s + 0.1 draw) factor).
pub(crate) fn trig_hash(at: Coordinate) -> u32 {
    let draw = at
        .sample
        .wrapping_mul(DRAWS)
        .wrapping_add(at.dimension)
        .wrapping_add(1);
    let phase = start_phase(at).wrapping_add(draw.wrapping_mul(DRAW_STEP));
    let factor = if at.dimension & 1 == 1 {
        SECOND_FACTOR
    } else {
        FIRST_FACTOR
    };
    let size = sine(phase);
    let fraction = (mul_high(size, factor) << 17) | (size.wrapping_mul(factor) >> 15);
    signed_fraction(fraction, phase)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_sine_is_off_by_less_than_a_ten_millionth() {
        for i in 0..=1_000_000_u32 {
            let phase = i.wrapping_mul(4295);
            let exact = (f64::from(phase) * 2.0_f64.powi(-32) * std::f64::consts::TAU)
                .sin()
                .abs();
            let found = f64::from(sine(phase)) * 2.0_f64.powi(-31);
            assert!(
                (found - exact).abs() < 1e-7,
                "{phase}: {found} is not {exact}"
            );
        }
    }

    #[test]
    fn a_draw_follows_the_printed_formula_as_far_as_the_sine_is_exact() {
        let fraction = |x: f64| x - x.floor();
        for (pixel, seed, dimension) in [(0, 0, 0), (10, 2, 5), (50, 1, 1), (100, 0, 40)] {
            let mut s = 0.0174532 * f64::from(pixel) + f64::from(seed);
            s *= s.sin();
            let factor = [43758.5453123, 22578.1459123][dimension as usize % 2];
            let exact = fraction((s + 0.1 * f64::from(dimension + 1)).sin() * factor);
            let at = Coordinate {
                pixel,
                sample: 0,
                dimension,
                seed,
            };
            let found = f64::from(trig_hash(at)) * 2.0_f64.powi(-32);
            let off = (found - exact).abs();
            // 43758 times the errors of the sine and of the rounded steps, times the angle: for
            // large angles nothing is left, and with f32 no sooner.
            assert!(off.min(1.0 - off) < 0.03, "{at:?}: {found} is not {exact}");
        }
    }
}
