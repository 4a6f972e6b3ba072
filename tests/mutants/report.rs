//! The findings of a mutation run.

use crate::plan::LEAST_KILLED;
use crate::world::World;
use crate::{Check, Mutant, Subject};
use serde::Serialize;
use std::fmt::Write;
use std::path::Path;

/// The fate of a mutant.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Verdict {
    /// A check turned red.
    Killed {
        /// The check.
        by: Check,
        /// Its evidence.
        evidence: String,
    },
    /// The device did not finish, or was lost: that is no answer of the check.
    TimedOut {
        /// The check that waited.
        by: Check,
        /// The device's error.
        evidence: String,
    },
    /// No check saw it.
    Survived,
    /// A check is red without any fault: its red means nothing.
    Distrusted {
        /// The check.
        by: Check,
    },
}

/// One mutant, decided.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// The mutant.
    pub mutant: Mutant,
    /// Its fate.
    pub verdict: Verdict,
    /// Milliseconds until then by the wall clock, with device and compilation.
    pub ms: f64,
}

impl Outcome {
    pub fn new(mutant: &Mutant, verdict: Verdict, ms: f64) -> Self {
        Self {
            mutant: *mutant,
            verdict,
            ms,
        }
    }

    /// The check that killed it.
    pub fn killed_by(&self) -> Option<Check> {
        match &self.verdict {
            Verdict::Killed { by, .. } => Some(*by),
            Verdict::TimedOut { by, .. } if self.mutant.hangs => Some(*by),
            _ => None,
        }
    }

    /// As a record.
    pub fn record(&self, adapter: &str) -> MutantRecord {
        let (verdict, evidence) = match &self.verdict {
            Verdict::Killed { evidence, .. } => ("killed", Some(evidence.clone())),
            Verdict::TimedOut { evidence, .. } => ("timed-out", Some(evidence.clone())),
            Verdict::Survived => ("survived", self.mutant.equivalent.map(str::to_owned)),
            Verdict::Distrusted { by } => {
                ("distrusted", Some(format!("{by} is red without a fault")))
            }
        };
        MutantRecord {
            kind: "mutant".to_owned(),
            adapter: adapter.to_owned(),
            name: self.mutant.name.to_owned(),
            what: self.mutant.what.to_owned(),
            place: self.mutant.plant.place(),
            subject: self.mutant.subject.label(),
            verdict: verdict.to_owned(),
            expected: self.mutant.expected,
            killed_by: self.killed_by(),
            evidence,
            ms: self.ms,
        }
    }
}

/// One mutant as a line of JSON.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct MutantRecord {
    /// Always `mutant`.
    pub kind: String,
    /// Adapter name as the driver gives it.
    pub adapter: String,
    /// Name of the mutant.
    pub name: String,
    /// The fault.
    pub what: String,
    /// The place of the fault.
    pub place: String,
    /// The subject of the checks.
    pub subject: String,
    /// `killed`, `timed-out`, `survived`, or `distrusted`.
    pub verdict: String,
    /// The check that should turn red.
    pub expected: Check,
    /// The check that did.
    pub killed_by: Option<Check>,
    /// The evidence of the check; for a survivor the reason why none can see it.
    pub evidence: Option<String>,
    /// Milliseconds until then.
    pub ms: f64,
}

/// A sound subject under every check.
#[derive(Debug, Clone)]
pub struct ControlOutcome {
    /// The subject of the checks.
    pub subject: Subject,
    /// Checks that were green.
    pub green: Vec<Check>,
    /// Checks that were not, with their evidence.
    pub red: Vec<(Check, String)>,
    /// Milliseconds by the wall clock.
    pub ms: f64,
}

impl ControlOutcome {
    pub fn new(subject: &Subject) -> Self {
        Self {
            subject: *subject,
            green: Vec::new(),
            red: Vec::new(),
            ms: 0.0,
        }
    }
}

/// A whole run.
#[derive(Debug, Clone)]
pub struct Report {
    /// Adapter name.
    pub adapter: String,
    /// Every subject without a fault.
    pub controls: Vec<ControlOutcome>,
    /// Every mutant, in the order of the table.
    pub mutants: Vec<Outcome>,
    /// Wall time of the run.
    pub seconds: f64,
}

impl Report {
    pub fn new(world: &World) -> Self {
        Self {
            adapter: world.adapter.clone(),
            controls: Vec::new(),
            mutants: Vec::new(),
            seconds: 0.0,
        }
    }

    /// Withdraws every kill by a check that is red without a fault.
    pub fn distrust_red_controls(&mut self) {
        for outcome in &mut self.mutants {
            let Some(by) = outcome.killed_by() else {
                continue;
            };
            let own = |c: &&ControlOutcome| c.subject == outcome.mutant.subject;
            let control = self.controls.iter().find(own);
            if control.is_none_or(|c| !c.green.contains(&by)) {
                outcome.verdict = Verdict::Distrusted { by };
            }
        }
    }

    /// Returns the number of mutants killed.
    pub fn killed(&self) -> usize {
        let killed = self.mutants.iter().filter(|m| m.killed_by().is_some());
        killed.count()
    }

    /// Mutants that no check saw.
    pub fn survivors(&self) -> impl Iterator<Item = &Outcome> {
        let survived = |m: &&Outcome| m.killed_by().is_none();
        self.mutants.iter().filter(survived)
    }

    /// Returns `true` if every control is green, at least [`LEAST_KILLED`] of the mutants were killed, and every
    /// survivor is explained.
    pub fn is_passed(&self) -> bool {
        let green = self.controls.iter().all(|c| c.red.is_empty());
        let enough = self.killed() as f64 >= LEAST_KILLED * self.mutants.len() as f64;
        let explained = self
            .survivors()
            .all(|m| m.verdict == Verdict::Survived && m.mutant.equivalent.is_some());
        !self.mutants.is_empty() && green && enough && explained
    }

    /// Returns name, place, killing check and milliseconds; then survivors, red controls and the verdict.
    pub fn table(&self) -> String {
        let mut out = String::new();
        let width = |get: fn(&Outcome) -> String| {
            let lengths = self.mutants.iter().map(|m| get(m).chars().count());
            lengths.max().unwrap_or(0)
        };
        let names = width(|m| m.mutant.name.to_owned());
        let places = width(|m| m.mutant.plant.place());
        // Writing to a string cannot fail.
        let _ = writeln!(
            out,
            "{:names$}  {:places$}  killed by    {:>7}",
            "mutant", "where", "ms"
        );
        for m in &self.mutants {
            let by = match &m.verdict {
                Verdict::Killed { by, .. } => by.name(),
                Verdict::TimedOut { .. } => "timed out",
                Verdict::Survived => "-",
                Verdict::Distrusted { .. } => "distrusted",
            };
            let (name, place) = (m.mutant.name, m.mutant.plant.place());
            let _ = writeln!(out, "{name:names$}  {place:places$}  {by:11}  {:7.0}", m.ms);
        }
        self.write_exceptions(&mut out);
        out
    }

    fn write_exceptions(&self, out: &mut String) {
        for m in self.survivors() {
            let (name, what) = (m.mutant.name, m.mutant.what);
            // Writing to a string cannot fail.
            let _ = match &m.verdict {
                Verdict::TimedOut { by, evidence } => {
                    writeln!(out, "timed out {name}: {what}: {by}: {evidence}")
                }
                _ => {
                    let why = m.mutant.equivalent.unwrap_or("no check saw it");
                    writeln!(out, "survivor {name}: {what}: {why}")
                }
            };
        }
        for m in self.mutants.iter() {
            if let Some(by) = m.killed_by().filter(|by| *by != m.mutant.expected) {
                let (name, expected) = (m.mutant.name, m.mutant.expected);
                let _ = writeln!(out, "{name}: {expected} was expected to see it, {by} did");
            }
        }
        for control in &self.controls {
            for (check, evidence) in &control.red {
                let subject = control.subject.label();
                let _ = writeln!(out, "{subject} without a fault: {check} is red: {evidence}");
            }
        }
        let _ = writeln!(out, "{}", self.verdict());
    }

    /// Returns the number of kills, and the verdict.
    pub fn verdict(&self) -> String {
        let (killed, all) = (self.killed(), self.mutants.len());
        let verdict = if self.is_passed() { "passed" } else { "failed" };
        format!(
            "{killed} of {all} faults killed, {} subjects green without a fault, {:.0} s on {}: {verdict}",
            self.controls.iter().filter(|c| c.red.is_empty()).count(),
            self.seconds,
            self.adapter
        )
    }

    /// Writes the records to `mutants.jsonl` and, last of all, the table to `mutants.txt`.
    pub fn write(&self, folder: &Path) -> std::io::Result<()> {
        let mut lines = String::new();
        for record in self.records() {
            lines += &serde_json::to_string(&record)?;
            lines.push('\n');
        }
        std::fs::write(folder.join("mutants.jsonl"), lines)?;
        std::fs::write(folder.join("mutants.txt"), self.table())
    }

    /// Records, one for each mutant.
    pub fn records(&self) -> Vec<MutantRecord> {
        let record = |m: &Outcome| m.record(&self.adapter);
        self.mutants.iter().map(record).collect()
    }
}
