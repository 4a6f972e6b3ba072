//! The honest comparison of two sets of records: per cell and figure whether the candidate is better, worse or the same,
//! or whether the noise leaves it open. `docs/compare.md` has the rules.
//!
//! Data flows one way: [`side`] reads, [`taken`] finds the evidence behind each figure, [`judge`] compares two pieces of it,
//! [`drift`] knows what the machine makes of what did not change, this module corrects for the number of tests and gives
//! verdicts, and [`show`] writes them.

pub mod drift;
mod facts;
pub mod judge;
pub mod show;
pub mod side;
pub mod taken;
mod work;

use judge::{Effects, Measured, TimeRatio, Verdict};
use raystone_record::Key;
use raystone_record::figure::Figure;
use raystone_stats::comparison::LEVEL;
use side::Side;
use std::collections::BTreeMap;
use work::Work;

/// How to compare.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Options {
    /// Bound on the share of false alarms among the alarms (Benjamini and Hochberg), and so on the chance of any where
    /// nothing differs.
    pub alpha: f64,
    /// Which differences count.
    pub effects: Effects,
    /// Whether times decide; else they are told.
    pub judge_times: bool,
}

impl Default for Options {
    fn default() -> Self {
        Self {
            alpha: LEVEL,
            effects: Effects::default(),
            judge_times: true,
        }
    }
}

/// What was found of one figure of one cell.
#[derive(Debug, Clone, PartialEq)]
pub struct Finding {
    /// What it is of.
    pub key: Key,
    /// The figure.
    pub figure: Figure,
    /// What base and candidate say; `None` where one has no such figure.
    pub shown: [Option<String>; 2],
    /// The difference with its 95 % interval, where it has one.
    pub measured: Option<Measured>,
    /// The part by which an exact figure changed.
    pub exact_change: Option<f64>,
    /// What is said of it.
    pub verdict: Verdict,
    /// Why, in words; empty where that is plain.
    pub why: String,
    /// Whether it is a time.
    pub is_time: bool,
    /// Whether kernels and work are equal on both sides, so that it shows what the machine does.
    pub is_control: bool,
    /// Whether it is a time of two runs that grew by more than the effect that counts, however uncertain.
    pub looks_worse: bool,
}

/// Everything that a comparison found.
#[derive(Debug, Clone, PartialEq)]
pub struct Comparison {
    /// What base and candidate are called.
    pub names: [String; 2],
    /// Figure by figure, the worst verdicts first.
    pub findings: Vec<Finding>,
    /// What a reader must know first: refused times, cut lines, drift.
    pub notes: Vec<String>,
    /// How many differences were tested together.
    pub tests: usize,
    /// What is said with: see [`Options::alpha`].
    pub alpha: f64,
}

impl Comparison {
    /// How many findings have this verdict.
    pub fn count(&self, verdict: Verdict) -> usize {
        self.findings
            .iter()
            .filter(|f| f.verdict == verdict)
            .count()
    }

    /// Times of two runs that look worse and are not known to be the same.
    pub fn suspects(&self) -> impl Iterator<Item = &Finding> {
        let open = |f: &&Finding| matches!(f.verdict, Verdict::Worse | Verdict::Undecided);
        self.findings.iter().filter(|f| f.looks_worse).filter(open)
    }

    /// Says of times that look worse why nothing confirms them.
    pub fn not_confirmed(&mut self, why: &str) {
        for finding in self
            .findings
            .iter_mut()
            .filter(|f| f.looks_worse && f.verdict == Verdict::Worse)
        {
            finding.why += "; not confirmed";
        }
        if self.suspects().next().is_some() {
            self.notes
                .push(format!("What looks slower was not measured again: {why}."));
        }
    }

    /// What all findings say together: worse, undecided, better or same.
    pub fn verdict(&self) -> Verdict {
        let decisive = [Verdict::Worse, Verdict::Undecided, Verdict::Better];
        let found = decisive.into_iter().find(|v| self.count(*v) > 0);
        found.unwrap_or(Verdict::Same)
    }
}

/// What tells a figure of a cell from all others: labels of the cell, id of the figure.
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
