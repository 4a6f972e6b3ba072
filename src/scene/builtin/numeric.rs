//! Bit-exact sines on every platform: `sin` of the standard library depends on the system.

use std::f64::consts::TAU;

/// Ratios of successive terms of the Taylor series of sine and cosine over the squared angle, up to
/// the 19th power: 1 / ((k+2)(k+3)) and 1 / ((k+1)(k+2)) for even k.
const SERIES: [[f64; 2]; 10] = {
    let mut series = [[0.0; 2]; 10];
    let mut i = 0;
    while i < series.len() {
        let k = 2.0 * i as f64;
        series[i] = [1.0 / ((k + 2.0) * (k + 3.0)), 1.0 / ((k + 1.0) * (k + 2.0))];
        i += 1;
    }
    series
};

/// Sine and cosine of `turns` full turns, error below 1e-15, by IEEE additions and multiplications
/// in fixed order.
pub(crate) fn sin_cos_turns(turns: f64) -> (f64, f64) {
    let turns = turns - turns.floor();
    // Within an eighth of a turn of a quarter point, where the series converges fast.
    let quarter = (4.0 * turns).round();
    let angle = (turns - 0.25 * quarter) * TAU;
    let squared = angle * angle;
    let (mut sin, mut cos) = (0.0, 0.0);
    for &[for_sin, for_cos] in SERIES.iter().rev() {
        sin = 1.0 - squared * for_sin * sin;
        cos = 1.0 - squared * for_cos * cos;
    }
    sin *= angle;
    match quarter as i64 % 4 {
        0 => (sin, cos),
        1 => (cos, -sin),
        2 => (-sin, -cos),
        _ => (-cos, sin),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn sines_agree_with_the_standard_library() {
        for k in -1000..=1000 {
            let turns = f64::from(k) * 0.0037;
            let (sin, cos) = sin_cos_turns(turns);
            let (s, c) = (turns * TAU).sin_cos();
            assert!(
                (sin - s).abs() < 1e-13 && (cos - c).abs() < 1e-13,
                "{turns}"
            );
        }
        assert_eq!(sin_cos_turns(0.25), (1.0, 0.0));
        assert_eq!(sin_cos_turns(1.5), (0.0, -1.0));
    }
}
