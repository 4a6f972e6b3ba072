//! A checked experiment: every value in range, every name known, axes expanded into variants.

use super::axis::{Axis, AxisMap};
use super::error::Place;
use super::pattern::Pattern;
use super::sections::{Animation, Coherence, Discrepancy, Gate, Reference, Run, StopRule, Timing};
use super::settings::Settings;
use super::{Catalogue, ConfigError, parse};
use raystone_core::geometry::Camera;
use raystone_core::params::{Params, Variant};
use raystone_core::text::plain_text;
use raystone_sampling::hash::pcg_hash;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// What is run. Keys, ranges and defaults of settings stand in their structs, and in `docs/experiments.md`.
// Many fields: one for each section of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the run.
    pub name: String,
    /// The file as the user named it.
    pub source: String,
    /// The file's text, with the overrides appended as comments.
    pub text: String,
    /// The overrides.
    pub overrides: Vec<String>,
    /// What all measurements share.
    pub run: Run,
    /// When a sampler is ended before the most samples.
    pub stop: Option<StopRule>,
    /// Camera for all scenes; `None` leaves it to each scene.
    pub camera: Option<Camera>,
    /// What is varied.
    pub axes: Axes,
    /// Cells left out …
    pub excludes: Vec<CellSet>,
    /// … but these.
    pub includes: Vec<CellSet>,
    /// Variants that go with some cells only.
    pub conditions: Vec<Condition>,
    /// The image that errors are taken against.
    pub reference: Reference,
    /// The timing protocol.
    pub timing: Timing,
    /// The gate.
    pub gate: Gate,
    /// Star discrepancy of the streams.
    pub discrepancy: Discrepancy,
    /// The model of coherence; `None` if nothing is to be modelled.
    pub coherence: Option<Coherence>,
    /// What moves; `None` if nothing does.
    pub animation: Option<Animation>,
    /// What is written of sections that others added to the catalogue, see [`Experiment::settings`].
    pub further: BTreeMap<String, Params>,
}

impl Experiment {
    /// Width of an image over its height.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.run.resolution;
        width as f32 / height as f32
    }
}

/// The axes of the product, each with at least one variant.
pub type Axes = AxisMap<Vec<Variant>>;

/// A variant that goes with some cells only.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its axis.
    pub axis: Axis,
    /// Its label.
    pub label: String,
    /// The cells: any of these sets.
    pub cells: Vec<CellSet>,
}

/// Cells that fit a pattern on every axis named.
#[derive(Debug, Clone, PartialEq)]
pub struct CellSet {
    /// Where it was written.
    pub at: Place,
    /// Patterns by axis: any one of an axis' patterns has to fit. Never empty.
    pub patterns: Vec<(Axis, Vec<Pattern>)>,
    /// Whether it may fit nothing without being a mistake: an axis that it names was replaced on
    /// the command line.
    pub lenient: bool,
}

impl fmt::Display for CellSet {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        for (i, (axis, patterns)) in self.patterns.iter().enumerate() {
            let separator = if i == 0 { "" } else { ", " };
            let patterns: Vec<_> = patterns.iter().map(Pattern::to_string).collect();
            write!(f, "{separator}{axis} = {}", patterns.join(" or "))?;
        }
        Ok(())
    }
}

/// A reference is rendered in this many independent parts: its halves make error estimates
/// unbiased, its parts are the other side of the bias check.
pub const REFERENCE_PARTS: u32 = 8;

/// Every seed that images of an experiment are rendered with.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    /// Of the replicates, in their order.
    pub replicates: Vec<u32>,
    /// Of the parts of every reference, in their order.
    pub reference_parts: Vec<u32>,
}

impl Seeds {
    /// The first seed that a replicate shares with a part of the reference.
    pub fn shared(&self) -> Option<u32> {
        let shared = |seed: &&u32| self.reference_parts.contains(seed);
        self.replicates.iter().find(shared).copied()
    }
}

impl Experiment {
    /// Reads the file at `path`, applies `overrides` (each `section.key=value`, the last one of a
    /// key wins) and checks the result against `catalogue`.
    ///
    /// # Errors
    /// Everything that [`ConfigError`] lists; messages name the key, the file and line or the
    /// override, and for unknown names the nearest known one.
    pub fn load(
        path: &Path,
        overrides: &[String],
        catalogue: &Catalogue,
    ) -> Result<Self, ConfigError> {
        let bytes = std::fs::read(path).map_err(|source| ConfigError::Read {
            path: path.to_owned(),
            source,
        })?;
        let file = path.display().to_string();
        let text = plain_text(bytes).map_err(|error| ConfigError::Syntax {
            at: Place::File {
                file: file.as_str().into(),
                line: error.line,
            },
            message: "it is not UTF-8 text".to_owned(),
        })?;
        Self::parse(&text, &file, overrides, catalogue)
    }

    /// The same as [`Experiment::load`] for a text; `file` is what messages call it.
    ///
    /// # Errors
    /// As [`Experiment::load`].
    pub fn parse(
        text: &str,
        file: &str,
        overrides: &[String],
        catalogue: &Catalogue,
    ) -> Result<Self, ConfigError> {
        parse::parse(text, file, overrides, catalogue)
    }

    /// The settings of a section that was added to the catalogue; `None` where the experiment does not write it.
    pub fn settings<S: Settings>(&self) -> Option<S> {
        self.further.get(S::SECTION).map(S::from_checked)
    }

    /// The seeds that renders use, modulo 2³²: consecutive integers from `run.seed` on for replicates,
    /// from a hash of `reference.seed` on for the parts of a reference, so that neighbouring numbers in
    /// the file do not meet.
    pub fn seeds(&self) -> Seeds {
        let from = |first: u32, count| (0..count).map(|i| first.wrapping_add(i)).collect();
        Seeds {
            replicates: from(self.run.seed, self.run.replicates),
            reference_parts: from(pcg_hash(self.reference.seed), REFERENCE_PARTS),
        }
    }
}
