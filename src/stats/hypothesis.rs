//! Hypothesis tests: Welch's t, and the corrections of Holm, and of Benjamini and Hochberg.

use crate::interval::Spread;
use crate::statistics::mean;
use statrs::function::{beta::checked_beta_reg, erf::erfc, gamma::ln_gamma};

/// Result of Welch's two-sided t-test.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct WelchTest {
    /// t statistic; infinite if two samples without spread differ.
    pub t: f64,
    /// Welch–Satterthwaite degrees of freedom.
    pub degrees_of_freedom: f64,
    /// Probability of a `|t|` at least this large if the means are equal.
    pub p: f64,
    /// Standard error of the difference of the means.
    pub standard_error: f64,
}

/// Welch's t-test (1947) of means that may differ by `margin ≥ 0` (in the samples' unit): the
/// difference is first reduced by the margin. Degrees of freedom are capped at `a`'s.
///
/// A few samples of `a` may lie close together by chance. Welch and Satterthwaite then take their
/// variance for small and use the degrees of freedom of `b`: for two samples against eight that are
/// three times as even, p ≤ 1e-4 occurred in 1.8 % of cases. With the cap, p-values are not too
/// small if `b` has less noise than `a`; if that is not known, use [`Spread::of_difference`].
///
/// Samples without spread are compared directly: p = 1 if equal, p = 0 if not. `None` if either
/// side has fewer than two samples or a non-finite one.
pub fn capped_t_test(a: &[f64], b: &[f64], margin: f64) -> Option<WelchTest> {
    let gap = mean(a)? - mean(b)?;
    let gap = gap.signum() * (gap.abs() - margin).max(0.0);
    let own = Spread::of_mean(a)?;
    let both = Spread::together(&[own, Spread::of_mean(b)?]);
    let degrees_of_freedom = both.freedom.min(own.freedom);
    let standard_error = both.variance.sqrt();
    let (t, p) = if both.variance > 0.0 {
        let t = gap / standard_error;
        (t, student_t_two_sided(t, degrees_of_freedom))
    } else if gap == 0.0 {
        (0.0, 1.0)
    } else {
        (gap * f64::INFINITY, 0.0)
    };
    Some(WelchTest {
        t,
        degrees_of_freedom,
        p,
        standard_error,
    })
}

/// Probability that `|T| ≥ |t|` for Student's t with `degrees_of_freedom > 0` (not necessarily
/// integer; infinitely many give the normal distribution).
pub fn student_t_two_sided(t: f64, degrees_of_freedom: f64) -> f64 {
    let (tt, n) = (t * t, degrees_of_freedom);
    if n.is_infinite() {
        return 2.0 * normal_above(t.abs());
    }
    let p = if tt < 1.0 {
        // Near 1 the complementary argument preserves digits.
        checked_beta_reg(0.5, 0.5 * n, tt / (n + tt)).map(|rest| 1.0 - rest)
    } else {
        checked_beta_reg(0.5 * n, 0.5, n / (n + tt))
    };
    p.unwrap_or(f64::NAN)
}

/// The t that `|T|` exceeds with probability `p` in (0, 1): the inverse of [`student_t_two_sided`].
/// (`statrs` returns an eighth of it for one degree of freedom and p = 1e-9.)
pub fn student_t_quantile(p: f64, degrees_of_freedom: f64) -> f64 {
    let (mut low, mut high) = (-30.0f64, 60.0f64);
    // Bisection of ln t: 90·2⁻⁶⁰ is below the last digit.
    for _ in 0..60 {
        let middle = 0.5 * (low + high);
        if student_t_two_sided(middle.exp(), degrees_of_freedom) > p {
            low = middle;
        } else {
            high = middle;
        }
    }
    (0.5 * (low + high)).exp()
}

/// Probability that a two-sided t-test at level `alpha` finds a difference of `effect` standard
/// errors with the correct sign: the upper tail of the noncentral t distribution, integrated over
/// the distribution of the sample's standard deviation (error below 1e-4).
pub fn t_test_power(effect: f64, alpha: f64, degrees_of_freedom: f64) -> f64 {
    const STEPS: u32 = 400;
    let n = degrees_of_freedom;
    let critical = student_t_quantile(alpha, n);
    let log_scale = std::f64::consts::LN_2 + 0.5 * n * (0.5 * n).ln() - ln_gamma(0.5 * n);
    // s, the standard deviation over its expectation: n s² is χ² distributed.
    let density = |s: f64| (log_scale + (n - 1.0) * s.ln() - 0.5 * n * s * s).exp();
    let widest = 1.0 + 8.0 / n.sqrt();
    let width = widest / f64::from(STEPS);
    let found = |i| {
        let s = (f64::from(i) + 0.5) * width;
        density(s) * width * normal_above(critical * s - effect)
    };
    (0..STEPS).map(found).sum()
}

/// The smallest effect, in standard errors, that a two-sided t-test at level `alpha` finds with
/// probability `power` in (0, 1): the inverse of [`t_test_power`], to 10⁻⁴.
pub fn t_test_effect(power: f64, alpha: f64, degrees_of_freedom: f64) -> f64 {
    let finds = |effect: f64| t_test_power(effect, alpha, degrees_of_freedom) >= power;
    let (mut low, mut high) = (0.0, 1.0);
    // One degree of freedom and tiny levels need thousands of standard errors.
    while !finds(high) && high < 1e9 {
        (low, high) = (high, 2.0 * high);
    }
    while high - low > 1e-4 * high {
        let middle = 0.5 * (low + high);
        if finds(middle) {
            high = middle;
        } else {
            low = middle;
        }
    }
    high
}

fn normal_above(x: f64) -> f64 {
    0.5 * erfc(x * std::f64::consts::FRAC_1_SQRT_2)
}

/// Selects hypotheses to reject so that the expected share of false rejections is at most `alpha`
/// (Benjamini and Hochberg 1995, step-up). Same order as `p_values`.
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

/// The smallest `alpha` at which [`benjamini_hochberg`] rejects any hypothesis, or 1.
pub(crate) fn least_rate(p_values: &[f64]) -> f64 {
    let mut sorted = p_values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let m = sorted.len() as f64;
    let rates = (1u32..)
        .zip(sorted)
        .map(|(rank, p)| p * m / f64::from(rank));
    rates.fold(1.0, f64::min)
}

/// Corrected p-values, in order: rejecting those of at most `alpha` rejects any true hypothesis
/// with probability at most `alpha`, however dependent (Holm 1979, step-down). NaN counts as 1.
pub fn holm(p_values: &[f64]) -> Vec<f64> {
    let p = |i: usize| {
        if p_values[i].is_nan() {
            1.0
        } else {
            p_values[i]
        }
    };
    let mut order: Vec<usize> = (0..p_values.len()).collect();
    order.sort_by(|&i, &j| p(i).total_cmp(&p(j)));
    let mut corrected = vec![1.0; p_values.len()];
    let mut largest: f64 = 0.0;
    for (rank, &i) in order.iter().enumerate() {
        let left = (p_values.len() - rank) as f64;
        largest = largest.max((left * p(i)).min(1.0));
        corrected[i] = largest;
    }
    corrected
}
