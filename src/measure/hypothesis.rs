//! Tests of hypotheses: Welch's t and the Benjamini–Hochberg correction for many tests.

use super::statistics::{mean, variance};
use statrs::function::{beta::checked_beta_reg, erf::erfc, gamma::ln_gamma};

/// Result of Welch's two-sided t-test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WelchTest {
    /// t statistic; infinite if two samples without any spread differ.
    pub t: f64,
    /// Welch–Satterthwaite degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Probability of a `|t|` this large or larger if the means are equal.
    pub p: f64,
}

/// Welch's t-test of equal means (Welch 1947): the variances need not be equal.
///
/// Samples without any spread are compared as they are: p = 1 if equal, p = 0 if not. `None` if
/// either side has fewer than two samples or one that is not finite.
pub fn welch_t_test(a: &[f64], b: &[f64]) -> Option<WelchTest> {
    welch_t_test_beyond(a, b, 0.0)
}

/// Like [`welch_t_test`], for the hypothesis that the means differ by at most `margin ≥ 0` (in the
/// unit of the samples): the difference is shortened by the margin first.
pub fn welch_t_test_beyond(a: &[f64], b: &[f64], margin: f64) -> Option<WelchTest> {
    let gap = mean(a)? - mean(b)?;
    let gap = gap.signum() * (gap.abs() - margin).max(0.0);
    let (va, vb) = (variance(a)? / a.len() as f64, variance(b)? / b.len() as f64);
    let (freedom_a, freedom_b) = ((a.len() - 1) as f64, (b.len() - 1) as f64);
    if va + vb == 0.0 {
        let (t, p) = match gap == 0.0 {
            true => (0.0, 1.0),
            false => (gap * f64::INFINITY, 0.0),
        };
        let degrees_of_freedom = freedom_a + freedom_b;
        return Some(WelchTest {
            t,
            degrees_of_freedom,
            p,
        });
    }
    let t = gap / (va + vb).sqrt();
    // As shares of the whole variance, so that tiny variances do not underflow when squared.
    let (share_a, share_b) = (va / (va + vb), vb / (va + vb));
    let degrees_of_freedom = 1.0 / (share_a * share_a / freedom_a + share_b * share_b / freedom_b);
    let p = student_t_two_sided(t, degrees_of_freedom);
    Some(WelchTest {
        t,
        degrees_of_freedom,
        p,
    })
}

/// Probability that `|T| ≥ |t|` for Student's t with `degrees_of_freedom > 0` (not always whole).
pub fn student_t_two_sided(t: f64, degrees_of_freedom: f64) -> f64 {
    let n = degrees_of_freedom;
    checked_beta_reg(0.5 * n, 0.5, n / (n + t * t)).unwrap_or(f64::NAN)
}

/// The t that `|T|` exceeds with probability `p` in (0, 1): the inverse of [`student_t_two_sided`].
/// (That of `statrs` answers an eighth of the t for one degree of freedom and p = 1e-9.)
pub fn student_t_quantile(p: f64, degrees_of_freedom: f64) -> f64 {
    let (mut low, mut high) = (-30.0f64, 60.0f64);
    // Bisection of ln t: 90·2⁻⁶⁰ is below the last digit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        match student_t_two_sided(middle.exp(), degrees_of_freedom) > p {
            true => low = middle,
            false => high = middle,
        }
    }
    (0.5 * (low + high)).exp()
}

/// Probability that a two-sided t-test at level `alpha` finds a difference of `effect` standard
/// errors, with the sign it has: the upper tail of the noncentral t distribution, integrated over the
/// distribution of the sample's standard deviation (error below 1e-4).
pub fn t_test_power(effect: f64, alpha: f64, degrees_of_freedom: f64) -> f64 {
    const STEPS: u32 = 400;
    let n = degrees_of_freedom;
    let critical = student_t_quantile(alpha, n);
    let log_scale = std::f64::consts::LN_2 + 0.5 * n * (0.5 * n).ln() - ln_gamma(0.5 * n);
    // s, the standard deviation over its expectation: n s² is distributed as χ².
    let density = |s: f64| (log_scale + (n - 1.0) * s.ln() - 0.5 * n * s * s).exp();
    let widest = 1.0 + 8.0 / n.sqrt();
    let width = widest / f64::from(STEPS);
    let found = |i| {
        let s = (f64::from(i) + 0.5) * width;
        density(s) * width * normal_above(critical * s - effect)
    };
    (0..STEPS).map(found).sum()
}

/// Probability that a standard normal number lies above `x`.
fn normal_above(x: f64) -> f64 {
    0.5 * erfc(x * std::f64::consts::FRAC_1_SQRT_2)
}

/// Which hypotheses to reject so that the expected share of false ones among the rejected is at most
/// `alpha` (Benjamini and Hochberg 1995, step-up). Same order as `p_values`.
pub fn benjamini_hochberg(p_values: &[f64], alpha: f64) -> Vec<bool> {
    let mut sorted = p_values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let m = sorted.len() as f64;
    let threshold = sorted
        .iter()
        .enumerate()
        .rev()
        .find(|&(k, &p)| p <= alpha * (k + 1) as f64 / m)
        .map_or(-1.0, |(_, &p)| p);
    p_values.iter().map(|&p| p <= threshold).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;
    use std::f64::consts::PI;

    #[track_caller]
    fn assert_close(actual: f64, expected: f64, relative: f64) {
        let error = (actual - expected).abs();
        assert!(
            error <= relative * expected.abs(),
            "{actual} is not {expected}"
        );
    }

    #[test]
    fn student_t_has_its_closed_forms_and_tabled_values() {
        for t in [1e-6, 0.1, 1.0, 2.5, 12.0, 300.0] {
            // The complement of the arctangent keeps its digits in the tail.
            assert_close(
                student_t_two_sided(t, 1.0),
                2.0 / PI * (1.0 / t).atan(),
                1e-12,
            );
            let root: f64 = (2.0 + t * t).sqrt();
            assert_close(
                student_t_two_sided(t, 2.0),
                2.0 / (root * (root + t)),
                1e-12,
            );
        }
        for (freedom, t, p) in [
            (10.0, 2.228_138_851_986_3, 0.05),
            (10.0, 3.169_272_672_616_951, 0.01),
            (30.0, 2.042_272_456_301, 0.05),
            (5.0, 4.032_142_983_555_227, 0.01),
        ] {
            assert_close(student_t_two_sided(t, freedom), p, 1e-9);
            assert_close(student_t_two_sided(-t, freedom), p, 1e-9);
        }
        assert_close(normal_above(1.959_963_984_540_054), 0.025, 1e-9);
        assert_close(normal_above(-3.0), 0.998_650_101_968_369_9, 1e-9);
    }

    #[test]
    fn welch_agrees_with_a_worked_example() {
        let a = [
            27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7,
            21.4,
        ];
        let b = [
            27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 20.5,
            24.4,
        ];
        let test = welch_t_test(&a, &b).unwrap();
        assert_close(test.t, -2.455356398286006, 1e-9);
        assert_close(test.degrees_of_freedom, 24.98852929023142, 1e-9);
        assert_close(test.p, 0.02137800146286698, 1e-7);
        let swapped = welch_t_test(&b, &a).unwrap();
        assert_eq!((swapped.t, swapped.p), (-test.t, test.p));
    }

    #[test]
    fn samples_without_spread_are_equal_or_not() {
        let same = welch_t_test(&[2.0, 2.0], &[2.0, 2.0, 2.0]).unwrap();
        assert_eq!((same.t, same.p), (0.0, 1.0));
        let different = welch_t_test(&[2.0, 2.0], &[2.1, 2.1]).unwrap();
        assert_eq!((different.t, different.p), (f64::NEG_INFINITY, 0.0));
        let within = welch_t_test_beyond(&[2.0, 2.0], &[2.1, 2.1], 0.2).unwrap();
        assert_eq!(within.p, 1.0);
        assert_eq!(welch_t_test(&[1.0], &[1.0, 2.0]), None);
        assert_eq!(welch_t_test(&[1.0, f64::NAN], &[1.0, 2.0]), None);
    }

    #[test]
    fn p_values_are_uniform_when_the_means_are_equal_and_small_when_not() {
        let mut generator = Pcg32::new(3);
        let mut normal = |mean: f64| -> Vec<f64> {
            let mut draw = || mean + (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0;
            (0..8).map(|_| draw()).collect()
        };
        let share_below =
            |p: &[f64], x: f64| p.iter().filter(|&&p| p < x).count() as f64 / p.len() as f64;
        let equal: Vec<f64> = (0..2000)
            .map(|_| welch_t_test(&normal(0.0), &normal(0.0)).unwrap().p)
            .collect();
        for x in [0.05, 0.25, 0.5, 0.75] {
            let share = share_below(&equal, x);
            let sd = (x * (1.0 - x) / 2000.0f64).sqrt();
            assert!(
                (share - x).abs() < 4.0 * sd,
                "{share} of p-values below {x}"
            );
        }
        let apart: Vec<f64> = (0..200)
            .map(|_| welch_t_test(&normal(0.0), &normal(2.0)).unwrap().p)
            .collect();
        assert!(share_below(&apart, 0.05) > 0.9);
    }

    #[test]
    fn quantiles_of_t_are_tabled_ones() {
        for (p, n, t) in [
            (0.05, 1.0, 12.706204736174698),
            (0.05, 7.0, 2.364624251592784),
            (0.01, 7.0, 3.4994832973505026),
            (0.001, 30.0, 3.6459586350420214),
        ] {
            assert_close(student_t_quantile(p, n), t, 1e-9);
        }
    }

    #[test]
    fn the_power_of_a_t_test_is_what_trials_have() {
        let mut generator = Pcg32::new(4);
        let trials = 4000;
        for (effect, alpha) in [(5.0, 0.005), (2.0, 0.05), (0.0, 0.05)] {
            let found = (0..trials).filter(|_| {
                let mut normal = || {
                    (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0 + effect / 8f64.sqrt()
                };
                let samples: Vec<f64> = (0..8).map(|_| normal()).collect();
                let error = (variance(&samples).unwrap() / 8.0).sqrt();
                mean(&samples).unwrap() / error > student_t_quantile(alpha, 7.0)
            });
            let share = found.count() as f64 / f64::from(trials);
            let power = t_test_power(effect, alpha, 7.0);
            assert!((share - power).abs() < 0.025, "{share}, not {power}");
        }
    }

    #[test]
    fn benjamini_hochberg_steps_up() {
        // The example of the paper's section 3.2: four of fifteen at 0.05.
        let p = [
            0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
            0.5719, 0.6528, 0.7590, 1.0,
        ];
        let rejected = benjamini_hochberg(&p, 0.05);
        assert_eq!(rejected, [vec![true; 4], vec![false; 11]].concat());
        // A larger p that passes carries the smaller ones with it, in whatever order they come.
        assert_eq!(
            benjamini_hochberg(&[0.04, 0.9, 0.035], 0.06),
            [true, false, true]
        );
        assert_eq!(benjamini_hochberg(&[0.5, 0.2], 0.05), [false, false]);
        assert!(benjamini_hochberg(&[], 0.05).is_empty());
    }
}
