//! Compares two sets of records: per cell and figure the candidate is better, worse, the same, or undecided because of
//! noise. `docs/compare.md` has the rules.
//!
//! Data flows one way: [`side`] reads, [`taken`] collects the evidence of each figure, [`judge`] compares two pieces of it,
//! [`drift`] estimates the machine's drift from unchanged cells, this module corrects for the number of tests and gives
//! verdicts, and [`show`] writes them.

pub mod drift;
pub(crate) mod facts;
pub mod judge;
pub mod show;
pub mod side;
pub mod taken;
mod work;

use judge::{ChangeVerdict, Effects, Measured, TimeRatio};
use raystone_record::Key;
use raystone_record::figure::Figure;
use raystone_stats::comparison::LEVEL;
use side::Side;
use std::collections::BTreeMap;
use work::Work;

/// Options of a comparison.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Bound on the share of false alarms among the alarms (Benjamini and Hochberg), and so on the chance of any alarm where
    /// nothing differs.
    pub alpha: f64,
    /// Thresholds of differences that count.
    pub effects: Effects,
    /// `true` if times decide; otherwise they are only shown.
    pub times_decide: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            alpha: LEVEL,
            effects: Effects::default(),
            times_decide: true,
        }
    }
}

/// The finding on one figure of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// The cell.
    pub key: Key,
    /// The figure.
    pub figure: Figure,
    /// Values of base and candidate as text; `None` where one lacks the figure.
    pub shown: [Option<String>; 2],
    /// The difference with its 95 % interval, if it has one.
    pub measured: Option<Measured>,
    /// The fraction by which an exact figure changed.
    pub exact_change: Option<f64>,
    /// The verdict.
    pub verdict: ChangeVerdict,
    /// The reason in words; empty if it is obvious.
    pub why: String,
    /// `true` for a time.
    pub is_time: bool,
    /// `true` if kernels and work are equal on both sides, so that it shows the machine's drift.
    pub is_control: bool,
    /// `true` for a time of two runs that grew by more than the effect that counts, however uncertain.
    pub looks_worse: bool,
}

/// The result of a comparison.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// Names of base and candidate.
    pub names: [String; 2],
    /// Figure by figure, the worst verdicts first.
    pub findings: Vec<Finding>,
    /// Notes to read first: refused times, cut lines, drift.
    pub notes: Vec<String>,
    /// Number of differences tested together.
    pub tests: usize,
    /// The level: see [`Options::alpha`].
    pub alpha: f64,
}

impl Comparison {
    /// Returns the number of findings with this verdict.
    pub fn count(&self, verdict: ChangeVerdict) -> usize {
        self.findings
            .iter()
            .filter(|f| f.verdict == verdict)
            .count()
    }

    /// Returns times of two runs that look worse and are not known to be the same.
    pub fn suspects(&self) -> impl Iterator<Item = &Finding> {
        let open =
            |f: &&Finding| matches!(f.verdict, ChangeVerdict::Worse | ChangeVerdict::Undecided);
        self.findings.iter().filter(|f| f.looks_worse).filter(open)
    }

    /// Adds the reason why times that look worse were not confirmed.
    pub fn not_confirmed(&mut self, why: &str) {
        for finding in self
            .findings
            .iter_mut()
            .filter(|f| f.looks_worse && f.verdict == ChangeVerdict::Worse)
        {
            finding.why += "; not confirmed";
        }
        if self.suspects().next().is_some() {
            self.notes
                .push(format!("What looks slower was not measured again: {why}."));
        }
    }

    /// Returns the verdict of all findings together: worse, undecided, better or same.
    pub fn verdict(&self) -> ChangeVerdict {
        let decisive = [
            ChangeVerdict::Worse,
            ChangeVerdict::Undecided,
            ChangeVerdict::Better,
        ];
        let found = decisive.into_iter().find(|v| self.count(*v) > 0);
        found.unwrap_or(ChangeVerdict::Same)
    }
}

/// Identifies a figure of a cell: labels of the cell, id of the figure.
pub type Identity = (String, String);

/// Times measured again, side by side.
pub type Confirmed = BTreeMap<Identity, TimeRatio>;

/// Compares two sides.
pub fn compare_sides(
    base: &Side,
    candidate: &Side,
    options: &Options,
    confirmed: &Confirmed,
) -> Comparison {
    let mut work = Work::new(base, candidate, options);
    work.find(base, candidate);
    work.measure_times(confirmed);
    let tests = work.decide();
    work.warn_of_compilations();
    let Work {
        mut findings,
        mut notes,
        ..
    } = work;
    findings.sort_by_key(|f| f.finding.verdict);
    notes.dedup();
    Comparison {
        names: [base, candidate].map(|side| side.name.clone()),
        findings: findings.into_iter().map(|f| f.finding).collect(),
        notes,
        tests,
        alpha: options.alpha,
    }
}
