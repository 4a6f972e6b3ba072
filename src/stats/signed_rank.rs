//! Wilcoxon's signed-rank test (1945): the permutation test of paired differences over all sign
//! changes, on ranks, robust to single interruptions.
//!
//! In Tukey's form (1949) it counts Walsh averages (means of all pairs of differences, including
//! each with itself): the estimate is their median (Hodges and Lehmann 1963), the interval lies
//! between two of them, and the test counts those above and below zero. The distribution is exact
//! up to `MOST_EXACT` differences.

/// Above this number of differences, the normal approximation has an error below 10⁻⁴.
pub(crate) const MOST_EXACT: usize = 60;

/// Differences of pairs, prepared for testing.
#[derive(Debug, Clone, PartialEq)]
pub struct SignedRank {
    /// Walsh averages, sorted.
    walsh: Vec<f64>,
    count: usize,
    /// Probability of each rank sum if both signs are equally likely; empty beyond [`MOST_EXACT`].
    chances: Vec<f64>,
}

impl SignedRank {
    /// `None` for no differences, or if one is not finite.
    pub fn new(differences: &[f64]) -> Option<Self> {
        if differences.is_empty() || !differences.iter().all(|x| x.is_finite()) {
            return None;
        }
        let count = differences.len();
        let mut walsh = Vec::with_capacity(count * (count + 1) / 2);
        for (i, a) in differences.iter().enumerate() {
            walsh.extend(differences[i..].iter().map(|b| 0.5 * (a + b)));
        }
        walsh.sort_unstable_by(f64::total_cmp);
        Some(Self {
            walsh,
            count,
            chances: if count <= MOST_EXACT {
                chances(count)
            } else {
                Vec::new()
            },
        })
    }

    /// Median of the Walsh averages.
    pub fn estimate(&self) -> f64 {
        let n = self.walsh.len();
        0.5 * (self.walsh[(n - 1) / 2] + self.walsh[n / 2])
    }

    /// Two-sided p-value of symmetry about zero; averages of zero support it.
    pub fn p(&self) -> f64 {
        let above = self.walsh.iter().filter(|x| **x > 0.0).count();
        let below = self.walsh.iter().filter(|x| **x < 0.0).count();
        (2.0 * self.at_least(above.max(below))).min(1.0)
    }

    /// Interval of the points not rejected at level `alpha`; unbounded for too few differences.
    pub fn interval(&self, alpha: f64) -> [f64; 2] {
        let n = self.walsh.len();
        // Largest number of averages that may be omitted at an end.
        let mut left_out = 0;
        while left_out < n && self.at_least(n - left_out) <= 0.5 * alpha {
            left_out += 1;
        }
        match left_out {
            0 => [f64::NEG_INFINITY, f64::INFINITY],
            k => [self.walsh[k - 1], self.walsh[n - k]],
        }
    }

    /// Probability of a rank sum of at least `sum`.
    fn at_least(&self, sum: usize) -> f64 {
        if !self.chances.is_empty() {
            return self.chances.iter().skip(sum).sum::<f64>().min(1.0);
        }
        let n = self.count as f64;
        let mean = n * (n + 1.0) / 4.0;
        let variance = n * (n + 1.0) * (2.0 * n + 1.0) / 24.0;
        let z = (sum as f64 - 0.5 - mean) / variance.sqrt();
        0.5 * statrs::function::erf::erfc(z * std::f64::consts::FRAC_1_SQRT_2)
    }
}

/// Probability of each sum of a random half of the ranks 1 to `count`.
fn chances(count: usize) -> Vec<f64> {
    let mut chances = vec![0.0; count * (count + 1) / 2 + 1];
    chances[0] = 1.0;
    for rank in 1..=count {
        for sum in (0..chances.len()).rev() {
            let without = chances[sum];
            let with = sum.checked_sub(rank).map_or(0.0, |rest| chances[rest]);
            chances[sum] = 0.5 * (without + with);
        }
    }
    chances
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn it_agrees_with_the_published_table() {
        // Hollander and Wolfe, table A.4: P(T+ ≥ 38) is 0.037 for n = 9, P(T+ ≥ 15) 1/32 for n = 5.
        let of = |n: usize| SignedRank::new(&vec![1.0; n]).unwrap();
        assert!((of(9).at_least(38) - 0.037).abs() < 5e-4);
        assert!((of(5).at_least(15) - 1.0 / 32.0).abs() < 1e-12);
        // The normal approximation continues without a step.
        let (exact, normal) = (of(60).at_least(1150), of(61).at_least(1150 + 30));
        assert!((exact / normal - 1.0).abs() < 0.1, "{exact} {normal}");
    }

    #[test]
    fn it_agrees_with_scipy() {
        // scipy 1.17: wilcoxon([.1, .4, -.2, .5, .3, .6, .25, -.05], method="exact").pvalue
        let d = [0.1, 0.4, -0.2, 0.5, 0.3, 0.6, 0.25, -0.05];
        let test = SignedRank::new(&d).unwrap();
        assert!((test.p() - 0.0546875).abs() < 1e-12);
    }

    #[test]
    fn sign_and_scale_do_what_they_should() {
        let d = [0.1, 0.4, -0.2, 0.5, 0.3, 0.6, 0.25, -0.05, 0.31, 0.44];
        let turned: Vec<f64> = d.iter().map(|x| -2.0 * x).collect();
        let [a, b] = [&d[..], &turned].map(|d| SignedRank::new(d).unwrap());
        assert_eq!(a.p(), b.p());
        let ([low, high], [low_b, high_b]) = (a.interval(0.05), b.interval(0.05));
        assert!((low + 0.5 * high_b).abs() < 1e-12 && (high + 0.5 * low_b).abs() < 1e-12);
        assert!(low < a.estimate() && a.estimate() < high);
        // The ends of the interval are just not rejected.
        let shifted = |by: f64| SignedRank::new(&d.map(|x| x - by)).unwrap().p();
        assert!(shifted(low) > 0.05 && shifted(low - 1e-9) <= 0.05);
    }

    #[test]
    fn too_few_reject_nothing_and_no_number_is_no_test() {
        let few = SignedRank::new(&[1.0, 1.0, 1.0]).unwrap();
        assert_eq!(few.p(), 0.25);
        assert_eq!(few.interval(0.05), [f64::NEG_INFINITY, f64::INFINITY]);
        assert!(SignedRank::new(&[]).is_none() && SignedRank::new(&[1.0, f64::NAN]).is_none());
    }
}
