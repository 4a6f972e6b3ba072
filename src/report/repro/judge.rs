//! Verdicts: an interval against bounds, and how intervals of ratios and slopes are made.
//!
//! The interval of a ratio or of a fitted exponent is that of the *method of variance estimates recovery* on
//! logarithms (Zou & Donner 2008; Donner & Zou 2012): each side's own 95 % interval, asymmetric as it is, gives its
//! part of the spread, and the parts add in squares. It takes both sides for independent; ratios of what was timed in the
//! same rounds are those of [`super::rounds`].

use raystone_record::Interval;
use raystone_record::figure::{Figure, Spread};
use serde::{Deserialize, Serialize};

/// What is found of a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Verdict {
    /// Shown without a judgement.
    Shown,
    /// It cannot be tested where this ran.
    NotTestable,
    /// The whole interval agrees.
    Supported,
    /// The interval reaches across a bound.
    Undecided,
    /// The whole interval disagrees.
    Contradicted,
    /// The expectation itself is wrong: it selects nothing, or too much.
    Faulty,
}

impl Verdict {
    /// What a reader is told.
    pub fn word(self) -> &'static str {
        match self {
            Self::Shown => "shown",
            Self::NotTestable => "not testable here",
            Self::Supported => "supported",
            Self::Undecided => "undecided",
            Self::Contradicted => "contradicted",
            Self::Faulty => "FAULTY",
        }
    }

    /// The verdict on a claim about all places, from those on each: one that contradicts it is enough, and it is
    /// supported where every place that can be tested supports it.
    pub(crate) fn of_all(verdicts: impl IntoIterator<Item = Self>) -> Self {
        verdicts.into_iter().max().unwrap_or(Self::NotTestable)
    }
}

/// What agrees.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub most: f64,
}

impl Bounds {
    /// Both ends; an end that is not given is no bound.
    pub fn new(least: Option<f64>, most: Option<f64>) -> Self {
        Self {
            least: least.unwrap_or(f64::NEG_INFINITY),
            most: most.unwrap_or(f64::INFINITY),
        }
    }

    /// Where both agree.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            least: self.least.max(other.least),
            most: self.most.min(other.most),
        }
    }

    /// An interval against the bounds.
    pub fn judge(self, i: Interval) -> Verdict {
        if ![i.low, i.value, i.high].into_iter().all(|x| !x.is_nan()) {
            return Verdict::Undecided;
        }
        if i.low >= self.least && i.high <= self.most {
            Verdict::Supported
        } else if i.high < self.least || i.low > self.most {
            Verdict::Contradicted
        } else {
            Verdict::Undecided
        }
    }

    /// In words, for instance `≥ 1` or `0.975 … 1.025`.
    pub fn words(self) -> String {
        let text = |x: f64| format!("{}", (x * 1e4).round() / 1e4);
        match (self.least.is_finite(), self.most.is_finite()) {
            (true, true) => format!("{} … {}", text(self.least), text(self.most)),
            (true, false) => format!("≥ {}", text(self.least)),
            (false, true) => format!("≤ {}", text(self.most)),
            (false, false) => "anything".to_owned(),
        }
    }
}

/// How far a figure that was measured once may be off: nothing is known of its spread, and this is assumed.
pub(crate) const ONCE: f64 = 1.5;
/// What may be missing from a time that was measured once, or too much, milliseconds: a turn of the scheduler, the start
/// of threads. Two runs of a build of 0.1 ms differed by 6 ms.
pub(crate) const ONCE_MS: f64 = 10.0;

/// A reading with the spread that is assumed of figures measured once.
pub(crate) fn spread(figure: &Figure, i: Interval) -> Interval {
    let off = if figure.unit == "ms" { ONCE_MS } else { 0.0 };
    match figure.spread == Spread::Single && i.low == i.high && i.value > 0.0 {
        true => Interval {
            value: i.value,
            low: (i.value - off).max(0.0) / ONCE,
            high: (i.value + off) * ONCE,
        },
        false => i,
    }
}

/// Logarithms of an interval; the lower end of one that reaches 0 has none.
fn logs(i: Interval) -> [f64; 3] {
    [i.low.max(0.0).ln(), i.value.ln(), i.high.ln()]
}

/// `Σ wᵢ ln xᵢ` with its interval.
fn combined(terms: impl Iterator<Item = (f64, Interval)>) -> Interval {
    let (mut value, mut below, mut above) = (0.0, 0.0, 0.0);
    for (weight, interval) in terms {
        let [low, at, high] = logs(interval);
        let (down, up) = (weight * (at - low), weight * (high - at));
        // A negative weight turns the ends round.
        let (down, up) = if weight < 0.0 {
            (-up, -down)
        } else {
            (down, up)
        };
        value += weight * at;
        below += down * down;
        above += up * up;
    }
    Interval {
        value,
        low: value - f64::sqrt(below),
        high: value + f64::sqrt(above),
    }
}

/// `a / b`, both positive.
pub fn ratio(a: Interval, b: Interval) -> Interval {
    let log = combined([(1.0, a), (-1.0, b)].into_iter());
    // Not by logarithms: what is exact stays exact.
    let value = a.value / b.value;
    Interval {
        value,
        low: value * (log.low - log.value).exp(),
        high: value * (log.high - log.value).exp(),
    }
}

/// The exponent of a power law through points `(x, y)`, by least squares of logarithms; `None` with fewer than two
/// different x.
pub(crate) fn slope(points: &[(f64, Interval)]) -> Option<Interval> {
    let n = points.len() as f64;
    let mean = points.iter().map(|(x, _)| x.ln()).sum::<f64>() / n;
    let square: f64 = points.iter().map(|(x, _)| (x.ln() - mean).powi(2)).sum();
    let usable = square > 0.0 && points.iter().all(|(x, y)| *x > 0.0 && y.value > 0.0);
    let weight = |x: f64| (x.ln() - mean) / square;
    usable.then(|| combined(points.iter().map(|(x, y)| (weight(*x), *y))))
}

/// Factor from one unit into another; `None` where they measure different things.
pub(crate) fn factor(from: &str, to: &str) -> Option<f64> {
    const UNITS: [(&str, &str, f64); 9] = [
        ("s", "time", 1.0),
        ("ms", "time", 1e-3),
        ("ns", "time", 1e-9),
        ("", "number", 1.0),
        ("%", "number", 1e-2),
        ("Mrays/s", "rate", 1e6),
        ("rays/s", "rate", 1.0),
        ("bytes", "size", 1.0),
        ("KiB", "size", 1024.0),
    ];
    let find = |unit| UNITS.iter().find(|(name, _, _)| *name == unit);
    match (find(from), find(to)) {
        _ if from == to => Some(1.0),
        (Some(a), Some(b)) if a.1 == b.1 => Some(a.2 / b.2),
        _ => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn i(low: f64, value: f64, high: f64) -> Interval {
        Interval { value, low, high }
    }

    #[test]
    fn an_interval_agrees_disagrees_or_spans_the_bound() {
        let at_least = Bounds::new(Some(1.0), None);
        assert_eq!(at_least.judge(i(1.1, 1.2, 1.3)), Verdict::Supported);
        assert_eq!(at_least.judge(i(0.7, 0.8, 0.9)), Verdict::Contradicted);
        assert_eq!(at_least.judge(i(0.9, 1.2, 1.3)), Verdict::Undecided);
        let between = Bounds::new(Some(0.975), Some(1.025));
        assert_eq!(between.judge(i(0.99, 1.0, 1.01)), Verdict::Supported);
        assert_eq!(between.judge(i(1.03, 1.04, 1.05)), Verdict::Contradicted);
        assert_eq!(between.judge(i(0.9, 1.0, 1.1)), Verdict::Undecided);
        assert_eq!(between.judge(i(f64::NAN, 1.0, 1.1)), Verdict::Undecided);
        let at_most = Bounds::new(None, Some(2.0));
        let words = [at_least, at_most, between, Bounds::new(None, None)].map(Bounds::words);
        assert_eq!(words, ["≥ 1", "≤ 2", "0.975 … 1.025", "anything"]);
    }

    #[test]
    fn one_place_that_contradicts_a_claim_is_enough_and_none_proves_nothing() {
        use Verdict::*;
        assert_eq!(
            Verdict::of_all([Supported, Contradicted, Undecided]),
            Contradicted
        );
        assert_eq!(Verdict::of_all([Supported, NotTestable]), Supported);
        assert_eq!(Verdict::of_all([Supported, Undecided]), Undecided);
        assert_eq!(Verdict::of_all([]), NotTestable);
        assert_eq!(Verdict::of_all([Contradicted, Faulty]), Faulty);
    }

    #[test]
    fn a_ratio_has_its_side_up_and_the_spread_of_both_sides() {
        let r = ratio(i(1.8, 2.0, 2.2), i(0.9, 1.0, 1.1));
        assert!((r.value - 2.0).abs() < 1e-12);
        // Each side alone has a lower end 10 % down; together √2 of that on logarithms.
        let down = (f64::ln(2.0 / 1.8).powi(2) + f64::ln(1.1f64).powi(2)).sqrt();
        assert!((r.low - (2f64.ln() - down).exp()).abs() < 1e-12);
        assert!(r.low > 1.8 / 1.1 && r.low < 1.8 && r.high > 2.2);
        assert_eq!(ratio(i(3.0, 3.0, 3.0), i(2.0, 2.0, 2.0)).low, 1.5);
        // An error whose interval reaches 0 has a ratio that may be anything below.
        assert_eq!(ratio(i(0.0, 1.0, 2.0), i(1.0, 1.0, 1.0)).low, 0.0);
    }

    #[test]
    fn a_slope_is_the_exponent_and_an_uncertain_point_makes_it_uncertain() {
        let points: Vec<_> = [8.0f64, 16.0, 32.0, 64.0]
            .map(|n| (n, Interval::exact(3.0 * n.powf(-0.7))))
            .to_vec();
        let exact = slope(&points).expect("a slope");
        assert!((exact.value + 0.7).abs() < 1e-12 && (exact.high - exact.low).abs() < 1e-12);
        let mut wide = points;
        wide[0].1.high *= 1.2;
        let wide = slope(&wide).expect("a slope");
        // A higher first point makes the fall steeper, so the lower end moves.
        assert!(wide.low < exact.low - 0.01 && (wide.high - exact.high).abs() < 1e-12);
        assert!(slope(&[(8.0, Interval::exact(1.0))]).is_none());
    }

    #[test]
    fn units_convert_within_their_kind() {
        assert_eq!(factor("s", "ms"), Some(1000.0));
        assert_eq!(factor("%", ""), Some(0.01));
        assert_eq!(factor("ns", "ms"), Some(1e-6));
        assert_eq!(factor("KiB", "bytes"), Some(1024.0));
        assert_eq!(factor("Mrays/s", "rays/s"), Some(1e6));
        assert_eq!(factor("ms", "Mrays/s"), None);
        assert_eq!(factor("furlongs", "furlongs"), Some(1.0));
    }

    #[test]
    fn what_was_measured_once_is_not_taken_for_exact() {
        use raystone_record::figure::figure;
        let build = spread(figure("build-ms/v1"), Interval::exact(100.0));
        assert_eq!((build.low, build.high), (60.0, 165.0));
        // A build of a millisecond may have taken none: neither is faster than the other.
        let short = |ms| spread(figure("build-ms/v1"), Interval::exact(ms));
        let faster = Bounds::new(Some(1.0), None).judge(ratio(short(6.0), short(0.1)));
        assert_eq!(faster, Verdict::Undecided);
        let nodes = spread(figure("nodes-per-ray/v1"), Interval::exact(3.0));
        assert_eq!(nodes, Interval::exact(3.0));
    }
}
