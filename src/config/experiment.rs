//! A checked experiment: every value in range, every name known, axes expanded into variants.

use super::axis::{Axis, AxisMap};
use super::error::Place;
use super::pattern::Pattern;
use super::sections::{
    Animation, Coherence, Discrepancy, Gate, Reference, Run, StopRule, Timing, Window,
};
use super::settings::Settings;
use super::variants::has_model_ending;
use super::{Catalogue, ConfigError, parse};
use raystone_core::geometry::Camera;
use raystone_core::params::{Params, Variant};
use raystone_core::text::plain_text;
use raystone_sampling::hash::pcg_hash;
use std::collections::BTreeMap;
use std::fmt;
use std::path::Path;

/// A checked experiment. For keys, ranges and defaults see `docs/experiments.md`.
// Many fields: one for each section of the file.
#[derive(Debug, Clone, PartialEq)]
pub struct Experiment {
    /// Name of the run.
    pub name: String,
    /// The file as named by the user.
    pub source: String,
    /// The file's text with the overrides appended as comments.
    pub text: String,
    /// The overrides.
    pub overrides: Vec<String>,
    /// Settings shared by all measurements.
    pub run: Run,
    /// Rule for stopping a sampler early.
    pub stop: Option<StopRule>,
    /// Camera for all scenes; `None` uses each scene's own.
    pub camera: Option<Camera>,
    /// The varied axes.
    pub axes: Axes,
    /// Excluded cells.
    pub excludes: Vec<CellSet>,
    /// Exceptions from the excludes.
    pub includes: Vec<CellSet>,
    /// Variants restricted to some cells.
    pub conditions: Vec<Condition>,
    /// The reference image for errors.
    pub reference: Reference,
    /// The timing protocol.
    pub timing: Timing,
    /// Settings of the correctness check.
    pub gate: Gate,
    /// Settings of the streams' star discrepancy.
    pub discrepancy: Discrepancy,
    /// The coherence model; `None` without one.
    pub coherence: Option<Coherence>,
    /// Animation settings; `None` without motion.
    pub animation: Option<Animation>,
    /// How a window shows images.
    pub window: Window,
    /// Values of sections added to the catalogue by others, see [`Experiment::settings`].
    pub further: BTreeMap<String, Params>,
}

impl Experiment {
    /// Aspect ratio of an image, width over height.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.run.resolution;
        width as f32 / height as f32
    }
}

/// The axes of the product, each with at least one variant.
pub type Axes = AxisMap<Vec<Variant>>;

/// A variant restricted to some cells.
#[derive(Debug, Clone, PartialEq)]
pub struct Condition {
    /// Its axis.
    pub axis: Axis,
    /// Its label.
    pub label: String,
    /// The cells: any of these sets.
    pub cells: Vec<CellSet>,
}

/// Cells that match a pattern on every axis named.
#[derive(Debug, Clone, PartialEq)]
pub struct CellSet {
    /// The place in the file.
    pub at: Place,
    /// Patterns by axis, of which one per axis must match. Never empty.
    pub patterns: Vec<(Axis, Vec<Pattern>)>,
    /// True if matching nothing is allowed, because the command line replaced one of its axes.
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

/// Number of independent parts of a reference: its halves make error estimates unbiased, and the
/// bias check compares against the parts.
pub const REFERENCE_PARTS: u32 = 8;

/// All image seeds of an experiment.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Seeds {
    /// Seeds of the replicates, in order.
    pub replicates: Vec<u32>,
    /// Seeds of each reference's parts, in order.
    pub reference_parts: Vec<u32>,
}

impl Seeds {
    /// The first seed shared by a replicate and a reference part.
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
    /// Any [`ConfigError`]; messages name the key, the file and line or the override, and for
    /// unknown names the nearest known one.
    pub fn load(
        path: &Path,
        overrides: &[String],
        catalogue: &Catalogue,
    ) -> Result<Self, ConfigError> {
        if has_model_ending(path) {
            let path = path.to_owned();
            return Err(ConfigError::Model { path });
        }
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

    /// [`Experiment::load`] for a text; `file` is its name in messages.
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

    /// Settings of a section added to the catalogue; `None` if the experiment does not contain it.
    pub fn settings<S: Settings>(&self) -> Option<S> {
        self.further.get(S::SECTION).map(S::from_checked)
    }

    /// Render seeds, modulo 2³²: consecutive integers from `run.seed` on for replicates, and from a
    /// hash of `reference.seed` on for reference parts, so neighbouring numbers do not collide.
    pub fn seeds(&self) -> Seeds {
        let from = |first: u32, count| (0..count).map(|i| first.wrapping_add(i)).collect();
        Seeds {
            replicates: from(self.run.seed, self.run.replicates),
            reference_parts: from(pcg_hash(self.reference.seed), REFERENCE_PARTS),
        }
    }
}
