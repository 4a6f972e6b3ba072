//! The checks that a fault has to get past.

mod frames;
mod hits;
mod images;
mod paths;
mod projections;
mod streams;

pub use images::{REFERENCE, cornell_images, plain_path_tracing};

use crate::world::World;
use crate::{CheckError, Plant, Subject};
use raystone::gpu::Gpu;
use serde::Serialize;
use std::fmt;

/// A check of the project.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum Check {
    /// Hits on integer-grid soups equal those of brute force to the bit.
    Lattice,
    /// The gate on built-in scenes.
    Gate,
    /// Nodes, box tests, triangle tests and stack of every ray equal those of the scalar twin.
    Work,
    /// Hits are right where the stack is full.
    Stacks,
    /// The words of a sampler's kernel equal those of its twin.
    Stream,
    /// Words of kernel and twin are those computed anew or checked before, and no two seeds, pixels or dimensions
    /// are alike.
    Known,
    /// The image of an integrand equals that of the twins to the bit.
    Integrand,
    /// Star discrepancy, net quality and projections of the stream are those of good points.
    Discrepancy,
    /// The mean of an integrand over seeds and pixels is its integral.
    Integral,
    /// Both furnaces have the radiance that they must have.
    Furnace,
    /// Nothing is occluded before a convex body, everything in a closed box.
    Occlusion,
    /// No light comes through the walls of a closed box as thin as a few ray offsets.
    ThinWalls,
    /// The image of the Cornell box has the mean of plain path tracing, tile by tile.
    Bias,
    /// Single paths are those of the oracle for images.
    Paths,
    /// So are those through media.
    Media,
    /// So are pixels of a large image, and paths in queues that are full; sums are those of single samples.
    Frames,
    /// Rays are counted as the oracle for images counts them.
    Counts,
}

impl Check {
    /// Name in tables and records.
    pub fn name(self) -> &'static str {
        match self {
            Self::Lattice => "lattice",
            Self::Gate => "gate",
            Self::Work => "work",
            Self::Stacks => "stacks",
            Self::Stream => "stream",
            Self::Known => "known",
            Self::Integrand => "integrand",
            Self::Discrepancy => "discrepancy",
            Self::Integral => "integral",
            Self::Furnace => "furnace",
            Self::Occlusion => "occlusion",
            Self::ThinWalls => "thin-walls",
            Self::Bias => "bias",
            Self::Paths => "paths",
            Self::Media => "media",
            Self::Frames => "frames",
            Self::Counts => "counts",
        }
    }

    /// Returns `true` if an adapter can pass it: where `a*b + c` is fused or division is inexact, work and images do
    /// not equal the host's to the bit.
    pub fn is_possible(self, exact: bool) -> bool {
        exact || !matches!(self, Self::Work | Self::Integrand)
    }
}

impl fmt::Display for Check {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.pad(self.name())
    }
}

/// The finding of a check: evidence of a fault, or nothing.
type Finding = Result<Option<String>, CheckError>;

/// A device with the kernels of one mutant, and the place of its fault outside the kernels.
pub struct Bench<'a> {
    pub gpu: &'a Gpu,
    /// True if the adapter computes like the host.
    pub exact: bool,
    pub world: &'a World,
    pub plant: &'a Plant,
}

impl<'a> Bench<'a> {
    pub fn new(gpu: &'a Gpu, exact: bool, world: &'a World, plant: &'a Plant) -> Self {
        Self {
            gpu,
            exact,
            world,
            plant,
        }
    }

    /// Carries out one check on a subject; checks that do not apply to it find nothing.
    pub fn carry_out(&self, check: Check, subject: &Subject) -> Finding {
        if !check.is_possible(self.exact) {
            return Ok(None);
        }
        match *subject {
            Subject::Structure { name, changes } => match check {
                Check::Lattice => hits::same_hits(self, name, changes, &self.world.soups),
                Check::Gate => hits::same_hits(self, name, changes, &self.world.scenes),
                Check::Work => hits::same_work(self, name, changes),
                Check::Stacks => hits::full_stack(self, name, changes),
                _ => Ok(None),
            },
            Subject::Sampler {
                sequence,
                changes,
                decorrelation,
            } => {
                let sampler = (sequence, changes, decorrelation);
                match check {
                    Check::Stream => streams::same_words(self, sampler),
                    Check::Known => streams::known_words(self, sampler),
                    Check::Integrand => streams::same_image(self, sampler),
                    Check::Discrepancy => streams::discrepancy(self, sampler),
                    Check::Integral => streams::integral(self, sampler),
                    _ => Ok(None),
                }
            }
            Subject::Integrators => match check {
                Check::Furnace => images::furnace(self),
                Check::Occlusion => images::occlusion(self),
                Check::ThinWalls => images::thin_walls(self),
                Check::Bias => images::bias(self),
                _ => Ok(None),
            },
            Subject::Paths => paths::paths(self),
            Subject::Media => paths::media(self),
            Subject::Organised(organisation) => match check {
                Check::Frames => frames::frames(self, organisation),
                Check::Counts => frames::counts(self, organisation),
                _ => Ok(None),
            },
        }
    }
}
