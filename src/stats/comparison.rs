//! Compares positive figures by a test of their difference, which accounts for the uncertainty of
//! each, not by overlap of their intervals.

use crate::hypothesis::holm;
use crate::interval::ALPHA;
pub use crate::log_figure::{Difference, LogFigure};

/// Probability of a false difference in a comparison of several figures.
pub const LEVEL: f64 = ALPHA;

/// All pairs of some figures, with p-values corrected by Holm's method: the probability of calling
/// any two equal figures different is at most [`LEVEL`].
#[derive(Debug, Clone, PartialEq)]
pub struct Pairs {
    figures: usize,
    log_ratios: Vec<f64>,
    corrected: Vec<f64>,
}

impl Pairs {
    /// Compares every figure with every other.
    pub fn of(figures: &[&LogFigure]) -> Self {
        let pair = |(i, a): (usize, &&LogFigure)| -> Vec<Difference> {
            let after = figures[i + 1..].iter();
            after.map(|b| a.compared_with(b)).collect()
        };
        let found: Vec<Difference> = figures.iter().enumerate().flat_map(pair).collect();
        Self {
            figures: figures.len(),
            log_ratios: found.iter().map(|pair| pair.log_ratio).collect(),
            corrected: holm(&found.iter().map(|pair| pair.p).collect::<Vec<_>>()),
        }
    }

    /// Number of comparisons.
    pub fn count(&self) -> usize {
        self.corrected.len()
    }

    /// True if two figures differ.
    pub fn differ(&self, i: usize, j: usize) -> bool {
        let p = self.corrected.get(self.place(i, j));
        p.is_some_and(|p| *p <= LEVEL)
    }

    /// The figure that is smaller than every other by the pairwise comparisons, not necessarily the
    /// smallest by itself: figures measured in the same rounds are compared more precisely. If the
    /// pairs are cyclic, the one that is smaller most often.
    pub fn least(&self) -> Option<usize> {
        let wins = |i: &usize| {
            let others = (0..self.figures).filter(|j| j != i);
            others.filter(|j| self.log_ratio(*i, *j) < 0.0).count()
        };
        (0..self.figures).rev().max_by_key(wins)
    }

    /// Logarithm of the ratio of two figures.
    pub fn log_ratio(&self, i: usize, j: usize) -> f64 {
        let sign = if i < j { 1.0 } else { -1.0 };
        sign * self.log_ratios[self.place(i, j)]
    }

    fn place(&self, i: usize, j: usize) -> usize {
        let (i, j) = (i.min(j), i.max(j));
        i * (2 * self.figures - i - 1) / 2 + j - i - 1
    }
}

/// Position of a point with two figures, of which less is better.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Place {
    /// On the Pareto front: better in one of the figures than every other point.
    Front,
    /// Undecided due to noise.
    Open,
    /// Dominated: another point is better in one figure, and better or equal in the other.
    Beaten,
}

/// The place of each point. Each statement is wrong with probability at most [`LEVEL`]: being on
/// the front requires tests against all other points to hold, which needs no correction (Berger
/// 1982); being beaten requires one, with Bonferroni's correction.
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
    let Difference { log_ratio, p, .. } = a.compared_with(b);
    if log_ratio < 0.0 {
        0.5 * p
    } else {
        1.0 - 0.5 * p
    }
}

/// True if two figures are identical: images, and so their errors, are equal across structures.
fn is_same(a: &LogFigure, b: &LogFigure) -> bool {
    a == b
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::interval::Spread;

    #[test]
    fn of_many_rivals_one_is_less_by_chance_and_beats_nobody() {
        // 3 % by chance: the quantile of a normal number is 1.8808.
        let rival = LogFigure::exact((-0.18808_f64).exp()).with_noise(Some(Spread {
            variance: 0.01,
            freedom: f64::INFINITY,
        }));
        let place_among = |rivals: usize| {
            let mut points = vec![[LogFigure::exact(1.0), LogFigure::exact(1.0)]];
            points.extend((0..rivals).map(|_| [rival.clone(), rival.clone()]));
            places(&points)[0]
        };
        assert_eq!(place_among(1), Place::Beaten);
        assert_eq!(place_among(5), Place::Open);
    }
}
