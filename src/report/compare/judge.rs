//! Compares two pieces of evidence.

use super::taken::Evidence;
use raystone_record::Interval;
use raystone_record::figure::{self, Better, Figure, Shown};
use raystone_stats::comparison::{LEVEL, LogFigure};
use raystone_stats::interval::Spread;
use raystone_stats::signed_rank::SignedRank;
use raystone_stats::statistics::{mean, median};

/// The verdict of a comparison on a figure.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, serde::Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum ChangeVerdict {
    /// Worse by more than the effect that counts, or a new failure.
    Worse,
    /// The noise leaves it open, or there is no comparable figure on the other side.
    Undecided,
    /// A different value of a figure that is neither good nor bad.
    Changed,
    /// Better by more than the effect that counts.
    Better,
    /// Only the candidate has it.
    New,
    /// Measured once: shown without a verdict.
    Told,
    /// Equal, or within the effect that counts.
    Same,
}

impl ChangeVerdict {
    /// Returns the verdict as text.
    pub fn word(self) -> &'static str {
        match self {
            Self::Worse => "worse",
            Self::Undecided => "undecided",
            Self::Changed => "changed",
            Self::Better => "better",
            Self::New => "new",
            Self::Told => "told",
            Self::Same => "same",
        }
    }
}

/// Thresholds of differences that count.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Effects {
    /// Fraction of a time.
    pub time: f64,
    /// Fraction of an error or a discrepancy.
    pub error: f64,
    /// Absolute difference of exponents.
    pub exponent: f64,
    /// Fraction of an exact figure; 0: any difference counts.
    pub exact: f64,
    /// `true` if images may change.
    pub images: bool,
}

impl Default for Effects {
    /// Returns 2 % of times, 0.5 % of errors, 0.02 of exponents, no tolerance of exact figures and images.
    fn default() -> Self {
        Self {
            time: 0.02,
            error: 0.005,
            exponent: 0.02,
            exact: 0.0,
            images: false,
        }
    }
}

/// A noisy difference, positive where the figure's value grew; relative for all figures but exponents.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Measured {
    /// The difference with its 95 % interval.
    pub change: Interval,
    /// Two-sided p-value of the hypothesis of no difference.
    pub p: f64,
    /// The effect that counts.
    pub margin: f64,
    /// The method of the interval.
    pub how: &'static str,
}

/// The result of comparing two pieces of evidence.
#[derive(Debug, Clone, PartialEq)]
pub enum Outcome {
    /// A verdict that needs no statistics, with the reason.
    Known(ChangeVerdict, String),
    /// A difference whose verdict needs the p-values of all others first.
    Tested(Measured),
}

fn known(verdict: ChangeVerdict, why: impl Into<String>) -> Outcome {
    Outcome::Known(verdict, why.into())
}

/// Compares all figures but times, which need more than the samples: see [`TimeRatio`].
pub fn compare(figure: &Figure, a: &Evidence, b: &Evidence, effects: &Effects) -> Outcome {
    match (a, b) {
        (Evidence::Exact(a), Evidence::Exact(b)) => exact(figure, *a, *b, effects),
        (Evidence::Once(a), Evidence::Once(b)) if a == b => known(ChangeVerdict::Same, ""),
        (Evidence::Once(_), Evidence::Once(_)) => known(
            ChangeVerdict::Told,
            "measured once, or recorded without its rounds",
        ),
        (
            Evidence::Fact {
                text: a,
                fails: was,
            },
            Evidence::Fact { text: b, fails: is },
        ) => facts(a, b, [*was, *is]),
        (Evidence::Untrusted(a), Evidence::Untrusted(b)) if a == b => {
            known(ChangeVerdict::Same, "")
        }
        (Evidence::Untrusted(_), _) | (_, Evidence::Untrusted(_)) => known(
            ChangeVerdict::Undecided,
            "the interval is not to be trusted (‡): few pixels decide",
        ),
        (Evidence::Summary(a, m), Evidence::Summary(b, n)) => {
            summaries(figure, (*a, *m), (*b, *n), effects)
        }
        (
            Evidence::Seeds {
                values: a,
                reference: r,
            },
            Evidence::Seeds {
                values: b,
                reference: s,
            },
        ) => seeds(figure, a, b, r == s, effects),
        _ => known(
            ChangeVerdict::Undecided,
            "recorded in two ways, which cannot be compared",
        ),
    }
}

/// Returns 1 if more of a figure is worse, −1 if it is better, 0 if neither.
fn badness(figure: &Figure) -> f64 {
    match figure.better {
        Better::Lower => 1.0,
        Better::Higher => -1.0,
        Better::Neither => 0.0,
    }
}

/// Returns worse, better or changed, for a difference of this sign.
pub(crate) fn direction(figure: &Figure, change: f64) -> ChangeVerdict {
    match badness(figure) * change {
        x if x > 0.0 => ChangeVerdict::Worse,
        x if x < 0.0 => ChangeVerdict::Better,
        _ => ChangeVerdict::Changed,
    }
}

/// Shares of rays that hit: the only figure that ranks nothing and may not change.
const HITS: &Figure = &figure::HIT_SHARE;

fn exact(figure: &Figure, a: f64, b: f64, effects: &Effects) -> Outcome {
    if a == b {
        return known(ChangeVerdict::Same, "");
    }
    if !a.is_finite() || !b.is_finite() {
        return known(ChangeVerdict::Undecided, "a value is no finite number");
    }
    let part = (b - a) / a.abs();
    if part.abs() <= effects.exact {
        return known(ChangeVerdict::Same, "within what --exact allows");
    }
    if figure.id == HITS.id {
        known(ChangeVerdict::Worse, "other rays hit")
    } else {
        known(direction(figure, b - a), "exact")
    }
}

fn facts(a: &str, b: &str, fails: [bool; 2]) -> Outcome {
    match fails {
        [false, true] => known(ChangeVerdict::Worse, b),
        [true, false] => known(ChangeVerdict::Better, format!("before: {a}")),
        _ if a == b => known(ChangeVerdict::Same, ""),
        _ => known(ChangeVerdict::Changed, ""),
    }
}

/// Returns the effect that counts, and `true` if differences of the figure are relative.
fn margin_of(figure: &Figure, effects: &Effects) -> (f64, bool) {
    match figure.shown {
        Shown::Exponent => (effects.exponent, false),
        _ => (effects.error, true),
    }
}

/// Compares values by seed: as pairs if seeds and reference are the same, otherwise as two samples.
fn seeds(
    figure: &Figure,
    a: &[(u32, f64)],
    b: &[(u32, f64)],
    same_reference: bool,
    effects: &Effects,
) -> Outcome {
    if a == b {
        return known(ChangeVerdict::Same, "equal for every seed");
    }
    let (margin, relative) = margin_of(figure, effects);
    let values = |of: &[(u32, f64)]| of.iter().map(|(_, x)| *x).collect::<Vec<f64>>();
    let (old, new) = (values(a), values(b));
    let unit = match (relative, mean(&old)) {
        (false, _) => 1.0,
        (true, Some(mean)) if mean != 0.0 => mean.abs(),
        _ => return known(ChangeVerdict::Undecided, "the base is 0 or no number"),
    };
    let paired = a.iter().map(|(s, _)| s).eq(b.iter().map(|(s, _)| s));
    match (old.len().min(new.len()), paired && same_reference) {
        (0 | 1, _) => known(
            ChangeVerdict::Undecided,
            "one image, of whose spread nothing is known",
        ),
        (_, true) => {
            let gaps: Vec<f64> = old.iter().zip(&new).map(|(x, y)| (y - x) / unit).collect();
            pairs(&gaps, margin)
        }
        (_, false) => two_samples(&old, &new, unit, margin, same_reference),
    }
}

fn pairs(gaps: &[f64], margin: f64) -> Outcome {
    let Some(test) = SignedRank::new(gaps) else {
        return known(ChangeVerdict::Undecided, "a value is no finite number");
    };
    let [low, high] = test.interval(LEVEL);
    Outcome::Tested(Measured {
        change: Interval {
            value: test.estimate(),
            low,
            high,
        },
        p: test.p(),
        margin,
        how: "pairs of equal seeds",
    })
}

fn two_samples(old: &[f64], new: &[f64], unit: f64, margin: f64, same_reference: bool) -> Outcome {
    if !same_reference {
        return known(
            ChangeVerdict::Undecided,
            "the references differ, and what is measured against them shares their noise",
        );
    }
    let side = |values: &[f64]| {
        let scaled: Vec<f64> = values.iter().map(|x| x / unit).collect();
        mean(&scaled).zip(Spread::of_mean(&scaled))
    };
    let Some(((old, a), (new, b))) = side(old).zip(side(new)) else {
        return known(ChangeVerdict::Undecided, "a value is no finite number");
    };
    let spread = Spread::of_difference(a, b);
    Outcome::Tested(student(
        new - old,
        spread,
        margin,
        "two samples of different seeds",
    ))
}

/// Compares intervals recorded without samples, as approximately Student's distribution.
fn summaries(
    figure: &Figure,
    a: (Interval, f64),
    b: (Interval, f64),
    effects: &Effects,
) -> Outcome {
    if a.0 == b.0 {
        return known(ChangeVerdict::Same, "");
    }
    let (margin, relative) = margin_of(figure, effects);
    let unit = if relative { a.0.value.abs() } else { 1.0 };
    let spread = |(i, freedom): (Interval, f64)| {
        Spread::of_half_width(0.5 * (i.high - i.low) / unit, freedom)
    };
    let together = Spread::of_difference(spread(a), spread(b));
    if unit == 0.0 || !together.variance.is_finite() || together.variance == 0.0 {
        return known(ChangeVerdict::Undecided, "nothing is known of its spread");
    }
    let gap = (b.0.value - a.0.value) / unit;
    Outcome::Tested(student(gap, together, margin, "two intervals"))
}

/// Returns Student's test and interval.
fn student(gap: f64, spread: Spread, margin: f64, how: &'static str) -> Measured {
    Measured {
        change: spread.interval(gap),
        p: spread.p(gap),
        margin,
        how,
    }
}

/// The name used instead of a clock where two programs alternated.
pub const IN_TURNS: &str = "processes in turns";

/// Logarithm of the ratio of two times, with the noise of their rounds.
#[derive(Debug, Clone, PartialEq)]
pub struct TimeRatio {
    /// Natural logarithm of candidate over base.
    pub log: f64,
    /// Its noise, estimated from the rounds.
    pub rounds: Spread,
    /// Logarithm for each round, if both were measured in the same rounds.
    pub by_round: Vec<f64>,
    /// The clock, in words.
    pub clock: &'static str,
}

impl TimeRatio {
    /// Returns the ratio of the times of two cells. Rounds are paired if both were measured in the same ones, over which
    /// `compilations` compilations of each side alternated.
    pub fn new(a: &Evidence, b: &Evidence, in_rounds: bool, compilations: usize) -> Option<Self> {
        let (
            Evidence::Times {
                adapter: a,
                processors: c,
            },
            Evidence::Times {
                adapter: b,
                processors: d,
            },
        ) = (a, b)
        else {
            return None;
        };
        let (a, b, clock) = if c.is_empty() || d.is_empty() {
            (a, b, "adapter time")
        } else {
            (
                c,
                d,
                "processor time (the values are by the adapter's clock)",
            )
        };
        if in_rounds && a.len() == b.len() {
            let ratios: Vec<f64> = a.iter().zip(b).map(|(a, b)| b / a).collect();
            let ratio = Self::of_rounds(&ratios, clock)?;
            return Some(ratio.of_compilations(compilations));
        }
        let [a, b] = [a, b].map(|ms| LogFigure::of_times(ms));
        let (a, b) = a.zip(b)?;
        Some(Self {
            log: b.log - a.log,
            rounds: Spread::of_difference(a.spread(), b.spread()),
            by_round: Vec::new(),
            clock,
        })
    }

    /// Returns the ratio from the ratios of each round.
    pub fn of_rounds(ratios: &[f64], clock: &'static str) -> Option<Self> {
        let figure = LogFigure::of_times(ratios)?;
        Some(Self {
            by_round: ratios.iter().map(|x| x.ln()).collect(),
            log: figure.log,
            rounds: figure.spread(),
            clock,
        })
    }

    /// Accounts for `count` compilations of each side, where round r uses compilation r modulo `count`: rounds of one
    /// compilation share the random properties of its code, so that the compilations, not the rounds, may be the observations.
    fn of_compilations(mut self, count: usize) -> Self {
        let of = |k: usize| {
            let rounds = self.by_round.iter().skip(k).step_by(count.max(1));
            median(&rounds.copied().collect::<Vec<_>>())
        };
        let medians: Option<Vec<f64>> = (0..count).map(of).collect();
        let of_compilations = medians.and_then(|medians| Spread::of_mean(&medians));
        if let Some(spread) = of_compilations.filter(|s| s.variance > self.rounds.variance) {
            self.rounds = spread;
        }
        self
    }

    /// Returns the difference of a figure, given the noise of controls, or that of the rounds without it. Paired rounds also
    /// have to pass the permutation test.
    pub fn measured(&self, figure: &Figure, noise: Option<Spread>, margin: f64) -> Measured {
        let spread = noise.unwrap_or(self.rounds);
        let how = match (self.by_round.is_empty(), noise.is_some()) {
            (true, _) => "two runs, widened by what did not change",
            (false, true) => "the same rounds, widened by what did not change",
            (false, false) => "the same rounds",
        };
        let mut measured = student(self.log, spread, margin, how);
        if !self.by_round.is_empty() {
            let test = SignedRank::new(&self.by_round);
            let p = test.map_or(1.0, |test| test.p());
            measured.p = measured.p.max(p);
        }
        // A rate changes by the inverse.
        let Interval { value, low, high } = measured.change;
        let [value, low, high] = match figure.better {
            Better::Higher => [-value, -high, -low],
            _ => [value, low, high],
        };
        measured.change = Interval {
            value: value.exp_m1(),
            low: low.exp_m1(),
            high: high.exp_m1(),
        };
        measured
    }
}
