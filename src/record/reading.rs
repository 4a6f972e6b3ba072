//! Readings: figures as the code that measures them writes them.

use super::{Interval, Key};
use crate::figure::Figure;
use serde::{Deserialize, Serialize};

/// A figure of something, with the samples that it was made of.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Reading {
    /// [`Figure::id`].
    pub figure: String,
    /// Its subject beyond the key of its line, for instance a class of rays; empty for the whole line.
    #[serde(default, skip_serializing_if = "Key::is_empty")]
    pub at: Key,
    /// The value with its 95 % interval, which has no width where the figure is exact or was measured once.
    pub value: Interval,
    /// The samples behind the value.
    #[serde(default, skip_serializing_if = "Samples::is_once")]
    pub samples: Samples,
    /// Description of the work, equal for two readings of the same work.
    #[serde(default, skip_serializing_if = "String::is_empty")]
    pub work: String,
}

/// Samples of a reading, all in the unit of its figure.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Samples {
    /// It was computed, counted, or measured once.
    #[default]
    Once,
    /// One for each round, in the order of the rounds; all that was timed in the same rounds has as many.
    Rounds {
        /// By the clock of the adapter, or the wall clock where it has none.
        adapter: Vec<f64>,
        /// By the wall clock.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        wall: Vec<f64>,
        /// In time of the processors, all threads of the process together; empty on adapters that work elsewhere.
        #[serde(default, skip_serializing_if = "Vec::is_empty")]
        processors: Vec<f64>,
    },
    /// A sum over another for each group of a sample, for instance predicted cycles over rays: the figure is the quotient of the
    /// totals.
    Groups(Vec<[f64; 2]>),
}

impl Samples {
    fn is_once(&self) -> bool {
        *self == Self::Once
    }
}

impl Reading {
    /// Creates a value with no more than its interval known.
    pub fn new(figure: &Figure, value: Interval) -> Self {
        Self {
            figure: figure.id.to_string(),
            at: Key::default(),
            value,
            samples: Samples::Once,
            work: String::new(),
        }
    }

    /// Creates a value that is exact or was measured once.
    pub fn exact(figure: &Figure, value: f64) -> Self {
        Self::new(figure, Interval::exact(value))
    }

    /// Returns the known ones of these figures.
    pub fn known<'f, T: Into<Interval>>(
        figures: impl IntoIterator<Item = (&'f Figure, Option<T>)>,
    ) -> Vec<Self> {
        let known = figures.into_iter();
        let known = known.filter_map(|(figure, value)| Some(Self::new(figure, value?.into())));
        known.collect()
    }

    /// Returns the same reading for a part of its line's subject.
    #[must_use]
    pub fn at(mut self, at: Key) -> Self {
        self.at = at;
        self
    }

    /// Returns the same reading of this work.
    #[must_use]
    pub fn of_work(mut self, work: impl Into<String>) -> Self {
        self.work = work.into();
        self
    }

    /// Returns the same reading with its samples.
    #[must_use]
    pub fn with_samples(mut self, samples: Samples) -> Self {
        self.samples = samples;
        self
    }

    /// Returns the value in each round by the clock of the adapter; empty unless it was timed in rounds.
    pub fn rounds(&self) -> &[f64] {
        match &self.samples {
            Samples::Rounds { adapter, .. } => adapter,
            Samples::Once | Samples::Groups(_) => &[],
        }
    }
}

/// The part of a measurement of a cell beside its [readings](Reading).
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct MeasuredRecord {
    /// Name of the measurement, for instance `compaction`.
    pub measurement: String,
    /// The reason why there are no readings.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub failure: Option<String>,
    /// Findings that are no figures.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub notes: Vec<Note>,
    /// A picture of what was found: a PNG file relative to the run's folder.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub picture: Option<String>,
}

/// Something that was found, in words.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Note {
    /// Its subject beyond the key of its line.
    #[serde(default, skip_serializing_if = "Key::is_empty")]
    pub at: Key,
    /// Its kind.
    pub what: String,
    /// The words: a reason, or a command that shows it.
    pub text: String,
}
