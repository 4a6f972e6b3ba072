//! Comparisons of positive figures: by a test of their difference, which knows how well each is known, and not by
//! whether their intervals overlap.
//!
//! Everything is on logarithms, since errors and times are positive, skewed, and compared by their ratio; the
//! logarithm of an error per second is the sum of those of the error and of the time, and so is its variance.
//! Figures are taken as independent but for what they say to share. That holds for samplers of equal seeds: over
//! 400 seeds (Cornell box, 80 × 60, 16 samples) the logarithms of relMSE of any two of four samplers have a correlation
//! between −0.01 and 0.04, so that pairs would gain nothing. Times of one round share
//! the machine's drift; to take them as independent makes differences look less certain than they are.

use crate::hypothesis::{holm, student_t_quantile, student_t_two_sided};
use crate::interval::Interval;
use crate::statistics::{Spread, variance};

/// Probability with which a comparison of several figures may name any difference that there is not.
pub const LEVEL: f64 = 0.05;

/// Of sorted times, the share that is left out at each end.
const TRIMMED: f64 = 0.2;

/// A positive figure, known by its logarithm and what makes that uncertain.
#[derive(Debug, Clone, PartialEq)]
pub struct LogFigure {
    /// Natural logarithm of the figure; −∞ for an exact 0.
    pub log: f64,
    /// Noise of this figure alone, as of its replicates or times, on the logarithm.
    pub own: Vec<Spread>,
    /// Noise that it shares with the figures it is compared with: for each source, as for the halves of a reference,
    /// the logarithm without each of its parts, in an order that is the same for all figures.
    pub shared: Vec<Vec<f64>>,
}

/// A difference of two figures.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Difference {
    /// Logarithm of the ratio of the first to the second.
    pub log_ratio: f64,
    /// Probability of one this large or larger in either direction if the figures are equal.
    pub p: f64,
}

impl LogFigure {
    /// From the logarithm, and logarithms that leave out each part of each source of noise.
    ///
    /// `None` if anything is not finite, but for figures that are 0 with whatever is left out.
    pub fn new(log: f64, own: &[Vec<f64>], shared: Vec<Vec<f64>>) -> Option<Self> {
        let all = || own.iter().chain(&shared).flatten().chain([&log]);
        if all().all(|x| *x == f64::NEG_INFINITY) {
            return Some(Self {
                log,
                own: Vec::new(),
                shared: Vec::new(),
            });
        }
        let is_finite = all().all(|x| x.is_finite());
        is_finite.then(|| Self {
            log,
            own: own.iter().filter_map(|s| Spread::jackknife(s)).collect(),
            shared,
        })
    }

    /// Of times of the same work: the mean of their logarithms without the least and the greatest fifth, which
    /// single interruptions do not move. Its variance is that of the winsorised sample (Tukey and McLaughlin 1963,
    /// Yuen 1974). `None` below two samples that would be left, and for samples that are not all positive and finite.
    pub fn of_times(times: &[f64]) -> Option<Self> {
        if !times.iter().all(|time| *time > 0.0 && time.is_finite()) {
            return None;
        }
        let mut logs: Vec<f64> = times.iter().map(|time| time.ln()).collect();
        logs.sort_unstable_by(f64::total_cmp);
        let cut = (TRIMMED * logs.len() as f64) as usize;
        let kept = logs
            .get(cut..logs.len() - cut)
            .filter(|kept| kept.len() > 1)?;
        let (least, greatest) = (kept[0], kept[kept.len() - 1]);
        let log = kept.iter().sum::<f64>() / kept.len() as f64;
        let (n, h) = (logs.len() as f64, kept.len() as f64);
        for log in &mut logs {
            *log = log.clamp(least, greatest);
        }
        Some(Self {
            log,
            own: vec![Spread {
                variance: variance(&logs)? * (n - 1.0) / (h * (h - 1.0)),
                freedom: h - 1.0,
            }],
            shared: Vec::new(),
        })
    }

    /// One over it.
    #[must_use]
    pub fn inverse(mut self) -> Self {
        self.log = -self.log;
        for log in self.shared.iter_mut().flatten() {
            *log = -*log;
        }
        self
    }

    /// The same with further noise of its own.
    #[must_use]
    pub fn with_noise(mut self, noise: Option<Spread>) -> Self {
        self.own.extend(noise);
        self
    }

    /// The same times a number that is known.
    #[must_use]
    pub fn scaled(mut self, factor: f64) -> Self {
        self.log += factor.ln();
        for log in self.shared.iter_mut().flatten() {
            *log += factor.ln();
        }
        self
    }

    /// All its noise.
    fn spread(&self) -> Spread {
        let shared = self.shared.iter().filter_map(|s| Spread::jackknife(s));
        Spread::together(&self.own.iter().copied().chain(shared).collect::<Vec<_>>())
    }

    /// The figure with its 95 % interval.
    pub fn interval(&self) -> Interval {
        let value = self.log.exp();
        let spread = self.spread();
        if self.is_exact(spread) {
            return Interval::exact(value);
        }
        let half = student_t_quantile(0.05, spread.freedom) * spread.variance.sqrt();
        Interval {
            value,
            low: (self.log - half).exp(),
            high: (self.log + half).exp(),
        }
    }

    /// What the figure exceeds with probability `chance` at most: the upper end of the interval that misses with
    /// that chance on either side together. Skewed figures are missed almost only where they lie above.
    pub fn upper(&self, chance: f64) -> f64 {
        let spread = self.spread();
        if self.is_exact(spread) {
            return self.log.exp();
        }
        let half = student_t_quantile(chance, spread.freedom) * spread.variance.sqrt();
        (self.log + half).exp()
    }

    fn is_exact(&self, spread: Spread) -> bool {
        !self.log.is_finite() || is_rounding(spread, self.log)
    }

    /// Welch's test of the difference, with all sources of noise of both.
    pub fn compared_with(&self, other: &Self) -> Difference {
        let log_ratio = self.log - other.log;
        let equal = self.log == other.log || log_ratio.abs() <= 8.0 * f64::EPSILON;
        let known = |p| Difference {
            log_ratio: if equal { 0.0 } else { log_ratio },
            p,
        };
        let spread = Spread::together(&self.differing(other));
        if !log_ratio.is_finite() || is_rounding(spread, self.log.abs().max(other.log.abs())) {
            return known(if equal { 1.0 } else { 0.0 });
        }
        let t = log_ratio / spread.variance.sqrt();
        known(student_t_two_sided(t, spread.freedom))
    }

    /// The sources of noise of the difference. What is shared is taken of the difference itself.
    fn differing(&self, other: &Self) -> Vec<Spread> {
        let mut sources = [&self.own[..], &other.own].concat();
        let lengths = |figure: &Self| figure.shared.iter().map(Vec::len).collect::<Vec<_>>();
        if lengths(self) == lengths(other) {
            for (ours, theirs) in self.shared.iter().zip(&other.shared) {
                let gaps: Vec<f64> = ours.iter().zip(theirs).map(|(a, b)| a - b).collect();
                sources.extend(Spread::jackknife(&gaps));
            }
        } else {
            let shared = self.shared.iter().chain(&other.shared);
            sources.extend(shared.filter_map(|s| Spread::jackknife(s)));
        }
        sources
    }
}

/// Whether a spread is no more than the rounding of sums makes of logarithms of this size.
fn is_rounding(spread: Spread, size: f64) -> bool {
    let digits = 8.0 * f64::EPSILON * size.abs().max(1.0);
    spread.variance.sqrt() <= digits
}

/// All pairs of some figures, with p-values corrected for their number by Holm's method: the probability that any
/// two equal figures are said to differ is at most [`LEVEL`].
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    figures: usize,
    corrected: Vec<f64>,
}

impl Pairs {
    /// Compares every figure with every other.
    pub fn of(figures: &[&LogFigure]) -> Self {
        let pair = |(i, a): (usize, &&LogFigure)| -> Vec<f64> {
            let after = figures[i + 1..].iter();
            after.map(|b| a.compared_with(b).p).collect()
        };
        let p: Vec<f64> = figures.iter().enumerate().flat_map(pair).collect();
        Self {
            figures: figures.len(),
            corrected: holm(&p),
        }
    }

    /// How many comparisons were made.
    pub fn count(&self) -> usize {
        self.corrected.len()
    }

    /// Whether two different figures differ.
    pub fn differ(&self, i: usize, j: usize) -> bool {
        let (i, j) = (i.min(j), i.max(j));
        let before = i * (2 * self.figures - i - 1) / 2;
        let p = self.corrected.get(before + j - i - 1);
        p.is_some_and(|p| *p <= LEVEL)
    }
}

/// Where a point lies that has two figures, of which less is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// On the Pareto front: against every other point, it is better in one of the figures.
    Front,
    /// The noise leaves that open.
    Open,
    /// Beaten: another point is better in one figure, and better or equal in the other.
    Beaten,
}

/// The place of each point. What is said of one point is wrong with probability at most [`LEVEL`]: that it is on the
/// front needs a test against every other point, each of which has to hold, so that they need no
/// correction for their number (Berger 1982); that it is beaten needs one of them, with Bonferroni's correction.
pub fn places(points: &[[LogFigure; 2]]) -> Vec<Place> {
    let others = points.len().saturating_sub(1).max(1) as f64;
    let place = |i: usize| {
        let rivals = || (0..points.len()).filter(|j| *j != i).map(|j| &points[j]);
        let is_beaten_by = |other: &[LogFigure; 2]| {
            let worse = [0, 1].map(|k| chance_that_less(&other[k], &points[i][k]));
            let equal = [0, 1].map(|k| is_same(&other[k], &points[i][k]));
            let holds = |k: usize| equal[k] || worse[k] <= LEVEL / others;
            !(equal[0] && equal[1]) && holds(0) && holds(1)
        };
        let is_ahead_of = |other: &[LogFigure; 2]| {
            let same = |k: usize| is_same(&points[i][k], &other[k]);
            let level = if same(0) || same(1) {
                LEVEL
            } else {
                0.5 * LEVEL
            };
            let better = |k: usize| chance_that_less(&points[i][k], &other[k]) <= level;
            same(0) && same(1) || better(0) || better(1)
        };
        if rivals().any(is_beaten_by) {
            Place::Beaten
        } else if rivals().all(is_ahead_of) {
            Place::Front
        } else {
            Place::Open
        }
    };
    (0..points.len()).map(place).collect()
}

/// One-sided p-value of the first being less.
fn chance_that_less(a: &LogFigure, b: &LogFigure) -> f64 {
    let Difference { log_ratio, p } = a.compared_with(b);
    match log_ratio < 0.0 {
        true => 0.5 * p,
        false => 1.0 - 0.5 * p,
    }
}

/// Whether two figures are one: images are equal across structures, and so are their errors.
fn is_same(a: &LogFigure, b: &LogFigure) -> bool {
    a == b
}
