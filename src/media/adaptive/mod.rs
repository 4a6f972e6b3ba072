//! Photons where they matter: pilots find where light changes, a map of importance of the light's square follows, and a
//! filter widens where photons are few (Pfeuti 2009, §3.6).

mod choice;
mod map;
mod smooth;

pub use choice::break_even;
pub use map::importance;
pub(crate) use smooth::{Cell as SmoothCell, Smoothed, Smoother};

use crate::photons::Warp;
use glam::DVec3;
use raystone_core::parameters;

parameters! {
    /// How photons are spread over the light's square.
    pub enum Mode {
        /// evenly (the thesis's reference pipeline)
        Reference = "reference",
        /// by a map of importance from pilot photons
        Adaptive = "adaptive",
        /// by a map of importance from that number of photons on from which pilots pay with the filter
        Auto = "auto",
    }

    /// How the grid of radiance is smoothed before a view gathers it.
    pub enum Filter {
        /// not at all
        None = "none",
        /// by a Gaussian over 3³ voxels (the thesis's reference pipeline)
        Blur = "blur",
        /// by one level of a pyramid
        Constant = "constant",
        /// by the finest level whose cell holds enough photons: nearest neighbours
        Count = "count",
        /// wider while the next width changes less
        Surround = "surround",
        /// wider where photons stand for more light
        Weight = "weight",
        /// the narrower of surround and weight (the thesis's adaptive pipeline)
        Both = "both",
    }
}

impl Filter {
    /// All of them.
    pub const ALL: [Self; 7] = [
        Self::None,
        Self::Blur,
        Self::Constant,
        Self::Count,
        Self::Surround,
        Self::Weight,
        Self::Both,
    ];

    /// The word in `kernels/media/adaptive/smooth.wesl`.
    const fn word(self) -> u32 {
        self as u32
    }

    /// Whether it reads how many photons crossed a voxel, and their weights.
    pub(crate) const fn counts(self) -> bool {
        matches!(self, Self::Count | Self::Weight | Self::Both)
    }
}

/// How a grid is smoothed, with the numbers of each rule.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Smoothing {
    /// The rule.
    pub filter: Filter,
    /// The level of [`Filter::Constant`].
    pub level: u32,
    /// Photons that a cell of [`Filter::Count`] has to hold.
    pub least: u32,
    /// Weight for which a level is added, where an even photon has a weight of 1.
    pub weight_step: f64,
    /// The coarsest level.
    pub most: u32,
}

impl Default for Smoothing {
    /// None, with the numbers of the others.
    fn default() -> Self {
        Self {
            filter: Filter::None,
            level: 1,
            least: 1,
            weight_step: 1.0,
            most: 4,
        }
    }
}

/// How pilots make a map of importance.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adaptive {
    /// Pilots along each axis of the light's square, and cells of the map: a power of two.
    pub pilots: u32,
    /// Cells of the pilots' grid of radiance along each axis.
    pub cells: u32,
    /// The share of lit cells that count as edges: those with the greatest gradients.
    pub edges: f64,
    /// The share of lit cells that count as shadows: those with the least radiance.
    pub shadows: f64,
    /// What every cell of the map has beside the discs of selected cells, each of height 1.
    pub background: f64,
    /// The greatest density, relative to even photons; 0 for any (Pfeuti 2009, §4.3).
    pub most_density: f64,
    /// Above 0, the map's complement: what it leaves of even photons, so many times as many as follow it (Pfeuti 2009, §4.3).
    pub complement: f64,
    /// How points follow the map.
    pub warp: Warp,
    /// Seed of the pilots' places.
    pub seed: u64,
}

/// What pilots left in a cell.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Pilots {
    /// Photons that crossed it.
    pub count: u32,
    /// Sums of the columns and rows of the light's square that they came from.
    pub sum: [u32; 2],
    /// Sums of their squares.
    pub squares: [u32; 2],
    /// Sum of energy of the three colours.
    pub radiance: f64,
}

impl Pilots {
    /// The mean place on the light's square, in its cells, and the deviations along both axes.
    fn origin(&self) -> (DVec3, [f64; 2]) {
        let count = f64::from(self.count.max(1));
        let mean = self.sum.map(|sum| f64::from(sum) / count);
        let deviation = [0, 1].map(|axis: usize| {
            let square = f64::from(self.squares[axis]) / count;
            (square - mean[axis] * mean[axis]).max(0.0).sqrt()
        });
        // A cell's middle.
        (DVec3::new(mean[0] + 0.5, mean[1] + 0.5, 0.0), deviation)
    }
}
