//! Tests of hypotheses: Welch's t, and the corrections of Holm and of Benjamini and Hochberg for many tests.

use crate::interval::Spread;
use crate::statistics::mean;
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
    /// Standard error of the difference of the means.
    pub standard_error: f64,
}

/// Welch's t-test (1947) of means that differ by at most `margin ≥ 0` (in the unit of the samples): the difference is
/// shortened by the margin first. The degrees of freedom are no more than `a` has by itself.
///
/// Few samples of `a` may lie close together by chance. Welch and Satterthwaite then take their variance for
/// small and count the degrees of freedom of `b` instead: for two samples against eight that are three times as even, p ≤ 1e-4
/// came up in 1.8 % of all cases. With the cap p-values are no smaller than they should be if `b` has less noise than `a`;
/// where that is not known, [`Spread::of_difference`] is the test.
///
/// Samples without any spread are compared as they are: p = 1 if equal, p = 0 if not. `None` if
/// either side has fewer than two samples or one that is not finite.
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

/// Probability that `|T| ≥ |t|` for Student's t with `degrees_of_freedom > 0` (not always whole; of infinitely many it
/// is a normal number).
pub fn student_t_two_sided(t: f64, degrees_of_freedom: f64) -> f64 {
    let (tt, n) = (t * t, degrees_of_freedom);
    if n.is_infinite() {
        return 2.0 * normal_above(t.abs());
    }
    let p = match tt < 1.0 {
        // Near 1 the other argument keeps its digits.
        true => checked_beta_reg(0.5, 0.5 * n, tt / (n + tt)).map(|rest| 1.0 - rest),
        false => checked_beta_reg(0.5 * n, 0.5, n / (n + tt)),
    };
    p.unwrap_or(f64::NAN)
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

/// The least effect, in standard errors, that a two-sided t-test at level `alpha` finds with probability `power`
/// in (0, 1): the inverse of [`t_test_power`], to 10⁻⁴.
pub fn t_test_effect(power: f64, alpha: f64, degrees_of_freedom: f64) -> f64 {
    let finds = |effect: f64| t_test_power(effect, alpha, degrees_of_freedom) >= power;
    let (mut low, mut high) = (0.0, 1.0);
    // With one degree of freedom and tiny levels, thousands of standard errors are needed.
    while !finds(high) && high < 1e9 {
        (low, high) = (high, 2.0 * high);
    }
    while high - low > 1e-4 * high {
        let middle = 0.5 * (low + high);
        match finds(middle) {
            true => high = middle,
            false => low = middle,
        }
    }
    high
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

/// The least `alpha` at which [`benjamini_hochberg`] rejects any of these hypotheses; 1 of none.
pub(crate) fn least_rate(p_values: &[f64]) -> f64 {
    let mut sorted = p_values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let m = sorted.len() as f64;
    let rates = (1u32..)
        .zip(sorted)
        .map(|(rank, p)| p * m / f64::from(rank));
    rates.fold(1.0, f64::min)
}

/// The p-values corrected for their number, in their order: rejecting those of at most `alpha` rejects any true
/// hypothesis with probability at most `alpha`, however the tests depend on each other (Holm 1979, step-down).
/// NaN counts as 1.
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
