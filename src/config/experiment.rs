//! A checked experiment: every value in range, every name known, axes expanded into variants.

use super::axis_map::AxisMap;
use super::error::Place;
use super::keys::Axis;
use super::pattern::Pattern;
use super::{Catalogue, ConfigError, parse};
use raystone_core::geometry::Camera;
use raystone_core::params::Variant;
use raystone_core::text::plain_text;
use raystone_sampling::hash::pcg_hash;
use serde::{Deserialize, Serialize};
use std::fmt;
use std::path::{Path, PathBuf};

/// What is run. Keys, ranges and defaults stand in [`super::keys::KEYS`] and
/// `docs/experiments.md`.
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
    /// Independent seeds per randomised sampler.
    pub replicates: u32,
    /// Seed of the first replicate.
    pub seed: u32,
    /// Width and height of every image, pixels.
    pub resolution: [u32; 2],
    /// Samples per pixel at which errors are taken.
    pub spp: SppCounts,
    /// When a sampler is ended before the most samples.
    pub stop: Option<StopRule>,
    /// Whether kernels keep the bounds checks and loop bounds of the driver layer.
    pub runtime_checks: bool,
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
}

/// Ends a sampler at one of the numbers of samples where its relMSE is below a target.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct StopRule {
    /// Target, positive.
    pub relmse: f64,
    /// Probability with which a sampler that is ended has it, in (0, 1).
    pub confidence: f64,
    /// Edge of the tiles that end on their own, pixels, a multiple of 8; without it, the image ends as a whole.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub tile: Option<u32>,
}

/// Numbers of samples per pixel: at least one, ascending.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct SppCounts(Vec<u32>);

impl Experiment {
    /// Width of an image over its height.
    pub fn aspect(&self) -> f32 {
        let [width, height] = self.resolution;
        width as f32 / height as f32
    }
}

impl SppCounts {
    /// These numbers, if there is one, none is 0 and each is greater than the one before.
    pub(super) fn new(counts: Vec<u32>) -> Option<Self> {
        let ascend = counts.is_sorted_by(|a, b| a < b);
        (ascend && counts.first().is_some_and(|least| *least > 0)).then_some(Self(counts))
    }

    /// The numbers of samples per pixel, ascending.
    pub fn counts(&self) -> impl Iterator<Item = u32> {
        self.0.iter().copied()
    }

    /// The greatest number of samples per pixel: what one render takes.
    pub fn max(&self) -> u32 {
        self.0.last().copied().unwrap_or(1)
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

/// Where the reference image comes from.
#[derive(Debug, Clone, PartialEq)]
pub struct Reference {
    /// A file that holds it, so that none is rendered.
    pub file: Option<PathBuf>,
    /// Samples per pixel of both halves together.
    pub spp: u32,
    /// Its sequence, with default parameters.
    pub sequence: Variant,
    /// Its decorrelation, with default parameters.
    pub decorrelation: Variant,
    /// What the seeds of its parts are made from, see [`Experiment::seeds`].
    pub seed: u32,
}

/// How long and how often things are timed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Timing {
    /// Timed rounds.
    pub rounds: u32,
    /// Samples per pixel of each timed render.
    pub spp: u32,
    /// Least warm-up, milliseconds.
    pub min_warmup_ms: u32,
    /// Greatest warm-up, milliseconds; not less than the least.
    pub max_warmup_ms: u32,
    /// Rays per class and dispatch.
    pub rays: u32,
    /// Whether full cells are also rendered in orders of passes.
    pub orders: bool,
}

/// How much the gate checks.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Gate {
    /// Rays per class.
    pub rays: u32,
    /// Ray–triangle tests spent on checking the judge against brute force.
    pub brute_force_tests: u64,
    /// Rays of the judge decided again in double precision.
    pub oracle_rays: u32,
    /// Length of recorded AO rays, scene units; 0 is a tenth of the scene's diagonal.
    pub ao_length: f32,
    /// Distance from their surface at which recorded rays start, scene units; 0 is 1e-5 of the
    /// scene's diagonal.
    pub offset: f32,
    /// Whether shadow rays are recorded from their lights and light by light, too.
    pub shadow_orders: bool,
}

/// Which star discrepancies are taken.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Discrepancy {
    /// Greatest number of points, a power of two.
    pub points: u32,
    /// Pairs of dimensions of the path's table.
    pub pairs: Vec<[u32; 2]>,
    /// Seeds measured where the stream is randomised.
    pub seeds: u32,
}

/// How a scene moves from frame to frame.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Animation {
    /// What moves.
    pub motion: Motion,
    /// Frames; the first is the scene as it was loaded.
    pub frames: u32,
    /// Amplitude of the wave, or the way of each instance until the last frame, radii of the scene.
    pub amplitude: f64,
    /// Wavelength of the wave, radii of the scene.
    pub wavelength: f64,
}

/// What moves.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Motion {
    /// Every vertex, in a wave that travels through the scene.
    Deform,
    /// Every instance, straight on in a direction of its own.
    Instances,
}

impl Animation {
    /// Time of a frame: 0 of the first, 1 of the last.
    pub fn time(&self, frame: u32) -> f64 {
        f64::from(frame) / f64::from(self.frames - 1)
    }
}

/// What the model of coherence looks at, and the machine.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Coherence {
    /// Width and height of the image, pixels.
    pub resolution: [u32; 2],
    /// Samples per pixel that samplers are made for, ascending.
    pub spp: Vec<u32>,
    /// Groups of warps, spread over the image; each has a cache of its own.
    pub groups: u32,
    /// Warps of a group, neighbours in the image.
    pub warps: u32,
    /// Width and height of a warp, pixels: divisors of 8.
    pub warp: [u32; 2],
    /// Samples of each pixel that are looked at, spread over all.
    pub samples: u32,
    /// How the lanes of a warp go on.
    pub rule: Rule,
    /// Bytes of a cache line.
    pub line_bytes: u32,
    /// Size of the cache of a group, KiB.
    pub l1_kib: u32,
    /// Its associativity; 0: fully associative.
    pub l1_ways: u32,
    /// Size of the cache of all groups, KiB.
    pub l2_kib: u32,
    /// Its associativity; 0: fully associative.
    pub l2_ways: u32,
}

/// How a turn of a warp goes on after its visits of nodes.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Rule {
    /// While any lane has a triangle to test, those that have one test it; then comes the next turn. This is how the
    /// kernels are written: visit a node, test the triangles of its leaves.
    Loop,
    /// Lanes that had a triangle to test when the turn began test one; then comes the next turn ("if-if").
    IfIf,
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

    /// The seeds that renders use, modulo 2³²: consecutive integers from `run.seed` on for replicates,
    /// from a hash of `reference.seed` on for the parts of a reference, so that neighbouring numbers in
    /// the file do not meet.
    pub fn seeds(&self) -> Seeds {
        let from = |first: u32, count| (0..count).map(|i| first.wrapping_add(i)).collect();
        Seeds {
            replicates: from(self.seed, self.replicates),
            reference_parts: from(pcg_hash(self.reference.seed), REFERENCE_PARTS),
        }
    }
}
