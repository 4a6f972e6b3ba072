//! Results of a cell: readings of figures, and notes.

use super::tally::Worst;
use raystone_bench::run::Prepared;
use raystone_bench::timing::Samples;
use raystone_record::figure::{self, Figure};
use raystone_record::{Key, Note, Reading};

/// Results of one cell.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Found {
    /// Figures; absent unless they were requested.
    pub readings: Vec<Reading>,
    /// The rays to look at first, failed cases, parts left out.
    pub notes: Vec<Note>,
}

impl Found {
    /// Adds figures of a part of the cell.
    pub fn add<'f>(&mut self, at: &Key, figures: impl IntoIterator<Item = (&'f Figure, f64)>) {
        let reading = |(figure, value)| Reading::exact(figure, value).at(at.clone());
        self.readings.extend(figures.into_iter().map(reading));
    }

    /// Adds a note on a part of the cell.
    pub fn note(&mut self, at: &Key, what: impl Into<String>, text: impl Into<String>) {
        self.notes.push(Note {
            at: at.clone(),
            what: what.into(),
            text: text.into(),
        });
    }

    /// Adds the ray to look at first, if there is one.
    pub fn look_at(&mut self, at: &Key, worst: Option<Worst>) {
        if let Some(worst) = worst {
            self.note(at, worst.what, worst.replay);
        }
    }

    /// Adds failures, and their number.
    pub fn failures(&mut self, at: &Key, failures: Vec<String>) {
        self.add(at, [(&figure::FAILED_CASES, failures.len() as f64)]);
        for failure in failures {
            self.note(at, "failed", failure);
        }
    }
}

impl Prepared for Found {
    fn readings(&self, _: Vec<Samples>) -> Result<Vec<Reading>, String> {
        Ok(self.readings.clone())
    }

    fn notes(&self) -> Vec<Note> {
        self.notes.clone()
    }
}
