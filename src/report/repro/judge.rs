//! Verdicts: an interval against bounds. Intervals of ratios and exponents come from [`raystone_stats::comparison`].

use raystone_record::Interval;
use raystone_record::figure::{Figure, Spread};
use serde::{Deserialize, Serialize};

/// The verdict on a claim.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ClaimVerdict {
    /// Shown without a verdict.
    Shown,
    /// It cannot be tested in this run.
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

impl ClaimVerdict {
    /// Returns the verdict as text.
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

    /// Combines the verdicts on all places of a claim: one contradiction is enough, and the claim is supported if every
    /// testable place supports it.
    pub(crate) fn of_all(verdicts: impl IntoIterator<Item = Self>) -> Self {
        verdicts.into_iter().max().unwrap_or(Self::NotTestable)
    }
}

/// The range of values that agree with a claim.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Least value.
    pub least: f64,
    /// Greatest value.
    pub most: f64,
}

impl Bounds {
    /// Returns the range between both ends; a missing end is no bound.
    pub fn new(least: Option<f64>, most: Option<f64>) -> Self {
        Self {
            least: least.unwrap_or(f64::NEG_INFINITY),
            most: most.unwrap_or(f64::INFINITY),
        }
    }

    /// Returns the intersection of both.
    #[must_use]
    pub fn and(self, other: Self) -> Self {
        Self {
            least: self.least.max(other.least),
            most: self.most.min(other.most),
        }
    }

    /// Compares an interval with the bounds.
    pub fn judge(self, i: Interval) -> ClaimVerdict {
        if ![i.low, i.value, i.high].into_iter().all(|x| !x.is_nan()) {
            return ClaimVerdict::Undecided;
        }
        if i.low >= self.least && i.high <= self.most {
            ClaimVerdict::Supported
        } else if i.high < self.least || i.low > self.most {
            ClaimVerdict::Contradicted
        } else {
            ClaimVerdict::Undecided
        }
    }

    /// Returns the bounds as text, for instance `≥ 1` or `0.975 … 1.025`.
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

/// Assumed factor by which a figure measured once may be off, since its spread is unknown.
pub(crate) const ONCE: f64 = 1.5;
/// Assumed absolute error of a time measured once, in milliseconds: a turn of the scheduler, the start of threads. Two
/// runs of a build of 0.1 ms differed by 6 ms.
pub(crate) const ONCE_MS: f64 = 10.0;

/// Returns a reading with the spread assumed for figures measured once.
pub(crate) fn spread(figure: &Figure, i: Interval) -> Interval {
    let off = if figure.unit == "ms" { ONCE_MS } else { 0.0 };
    if figure.spread == Spread::Single && i.low == i.high && i.value > 0.0 {
        Interval {
            value: i.value,
            low: (i.value - off).max(0.0) / ONCE,
            high: (i.value + off) * ONCE,
        }
    } else {
        i
    }
}

/// Returns the factor from one unit to another; `None` if they measure different things.
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
        assert_eq!(at_least.judge(i(1.1, 1.2, 1.3)), ClaimVerdict::Supported);
        assert_eq!(at_least.judge(i(0.7, 0.8, 0.9)), ClaimVerdict::Contradicted);
        assert_eq!(at_least.judge(i(0.9, 1.2, 1.3)), ClaimVerdict::Undecided);
        let between = Bounds::new(Some(0.975), Some(1.025));
        assert_eq!(between.judge(i(0.99, 1.0, 1.01)), ClaimVerdict::Supported);
        assert_eq!(
            between.judge(i(1.03, 1.04, 1.05)),
            ClaimVerdict::Contradicted
        );
        assert_eq!(between.judge(i(0.9, 1.0, 1.1)), ClaimVerdict::Undecided);
        assert_eq!(
            between.judge(i(f64::NAN, 1.0, 1.1)),
            ClaimVerdict::Undecided
        );
        let narrow = Bounds::new(Some(0.99), Some(1.1)).and(between);
        assert_eq!((narrow.least, narrow.most), (0.99, 1.025));
        let other = between.and(Bounds::new(None, Some(2.0)));
        assert_eq!((other.least, other.most), (0.975, 1.025));
        let at_most = Bounds::new(None, Some(2.0));
        let words = [at_least, at_most, between, Bounds::new(None, None)].map(Bounds::words);
        assert_eq!(words, ["≥ 1", "≤ 2", "0.975 … 1.025", "anything"]);
    }

    #[test]
    fn one_place_that_contradicts_a_claim_is_enough_and_none_proves_nothing() {
        use ClaimVerdict::*;
        assert_eq!(
            ClaimVerdict::of_all([Supported, Contradicted, Undecided]),
            Contradicted
        );
        assert_eq!(ClaimVerdict::of_all([Supported, NotTestable]), Supported);
        assert_eq!(ClaimVerdict::of_all([Supported, Undecided]), Undecided);
        assert_eq!(ClaimVerdict::of_all([]), NotTestable);
        assert_eq!(ClaimVerdict::of_all([Contradicted, Faulty]), Faulty);
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
        use raystone_record::figure;
        use raystone_stats::comparison::LogFigure;
        let build = spread(&figure::BUILD_MS, Interval::exact(100.0));
        assert_eq!((build.low, build.high), (60.0, 165.0));
        // A build of a millisecond may read as no time at all: neither is faster than the other.
        let short = |ms| spread(&figure::BUILD_MS, Interval::exact(ms));
        let [slow, fast] =
            [6.0, 0.1].map(|ms| LogFigure::of_interval(short(ms), f64::INFINITY).expect("a time"));
        let faster = Bounds::new(Some(1.0), None).judge(slow.compared_with(&fast).ratio);
        assert_eq!(faster, ClaimVerdict::Undecided);
        let nodes = spread(&figure::NODES_PER_RAY, Interval::exact(3.0));
        assert_eq!(nodes, Interval::exact(3.0));
    }
}
