//! Choices by one number, in integers: each of the 2²⁴ values of a draw belongs to one choice,
//! whose probability is its number of values over 2²⁴. The probability used as a divisor is thus
//! exact, and no light has probability zero. Also in `kernels/shading/light/units.wesl`.

/// Values of a draw.
pub(super) const UNITS: u32 = 1 << 24;

/// The probability of this many values.
pub(super) fn unit_share(units: u32) -> f32 {
    units as f32 / UNITS as f32
}

/// The number of values of each of these weights, which are finite and not negative: at least one
/// for each above 0, the rest by rounded cumulative weights. Equal shares if all are 0.
pub(super) fn shared_out(weights: &[f64]) -> Vec<u32> {
    let total: f64 = weights.iter().sum();
    let alike = vec![1.0; weights.len()];
    let (weights, total) = if total > 0.0 {
        (weights, total)
    } else {
        (&alike[..], weights.len() as f64)
    };
    let some = weights.iter().filter(|weight| **weight > 0.0).count() as u32;
    let spare = f64::from(UNITS.saturating_sub(some));
    let (mut below, mut end, mut begin) = (0.0, 0, 0);
    let mut share = |weight: &f64| {
        if *weight > 0.0 {
            below += weight;
            end += 1;
        }
        let upto = end + (spare * (below / total)).round() as u32;
        let units = upto - begin;
        begin = upto;
        units
    };
    weights.iter().map(&mut share).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    #[test]
    fn all_values_are_shared_out_and_nothing_that_has_weight_goes_without() {
        let mut random = Pcg32::new(5);
        for count in [1, 2, 3, 1000, 100_000] {
            let mut weights: Vec<f64> = (0..count).map(|_| random.uniform().powi(12)).collect();
            weights[count / 2] = if count > 2 { 0.0 } else { 1.0 };
            let total: f64 = weights.iter().sum();
            let shares = shared_out(&weights);
            assert_eq!(shares.iter().sum::<u32>(), UNITS);
            for (units, weight) in shares.iter().zip(&weights) {
                assert_eq!(*units > 0, *weight > 0.0);
                // One each, and rounding at both ends.
                let exact = weight / total * f64::from(UNITS);
                assert!((f64::from(*units) - exact).abs() <= 2.0 + exact * count as f64 / 1.6e7);
            }
        }
        assert_eq!(shared_out(&[0.0, 0.0]), [UNITS / 2; 2]);
    }
}
