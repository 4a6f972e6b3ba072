//! Energy of photons added to a grid of radiance, by strategies (Pfeuti 2009, §3.5.3 and §3.5.4).
//! Kernels: `kernels/media/scatter/`.
//!
//! A voxel has six sums: energy in red, green and blue, and direction times the mean of the three, which may be left out. They come
//! out as floats whatever the strategy adds.

mod known;
mod record;

pub use known::fault_of_strategy;
pub use record::{Deposit, Scatter, scatter_list, sums_in_f64};

use raystone_core::parameters;
use raystone_gpu::GpuError;

parameters! {
    /// How energy is added to a grid that many photons write to.
    pub enum Strategy {
        /// whole numbers of one word, which may go round: counted
        Fixed32 = "fixed-32",
        /// whole numbers of two words with a carry
        Fixed64 = "fixed-64",
        /// floats by a loop that compares and swaps their bits
        Swap = "swap",
        /// a list that is sorted by voxels and summed
        Sort = "sort",
        /// a table for each workgroup, then whole numbers of two words
        Tiles = "tiles",
    }
}

impl Strategy {
    /// Words of a sum in the grid that is added to; 0 for none.
    const fn words(self) -> u64 {
        match self {
            Self::Fixed64 | Self::Tiles => 2,
            Self::Sort => 0,
            _ => 1,
        }
    }

    fn module(self) -> &'static str {
        match self {
            Self::Fixed32 => "media/scatter/fixed_32",
            Self::Fixed64 => "media/scatter/fixed_64",
            Self::Swap => "media/scatter/swap",
            Self::Sort => "media/scatter/append",
            Self::Tiles => "media/scatter/tiles",
        }
    }
}

/// A strategy with its numbers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Adding {
    /// The strategy.
    pub strategy: Strategy,
    /// The largest deposit has 2^bits units of a whole number, at most 24.
    pub bits: u32,
    /// Attempts to compare and swap; 0 for as many as it takes.
    pub attempts: u32,
    /// Deposits that a list has room for.
    pub capacity: u32,
    /// False to leave out the three sums of directions, which come out as 0.
    pub directed: bool,
}

impl Adding {
    /// Words of a voxel in the grid that is added to.
    const fn words(&self) -> u64 {
        let sums = if self.directed { 6 } else { 3 };
        sums * self.strategy.words()
    }

    /// A strategy with the numbers that suit it: 2^12 units for one word, which leaves room for 2^20 of the largest
    /// deposits, and 2^24 for two; as many attempts as it takes.
    pub fn new(strategy: Strategy, capacity: u32) -> Self {
        let bits = if strategy == Strategy::Fixed32 {
            12
        } else {
            24
        };
        Self {
            strategy,
            bits,
            attempts: 0,
            capacity,
            directed: true,
        }
    }
}

/// What was counted while energy was added.
#[derive(Debug, Clone, Copy, PartialEq, Default)]
pub struct Tallies {
    /// Deposits.
    pub deposits: u64,
    /// Attempts beyond the first; of tiles, deposits whose entry another voxel had.
    pub retries: u64,
    /// Deposits of which something was dropped.
    pub drops: u64,
    /// Numbers that went round.
    pub wraps: u64,
    /// Energy that was dropped, of red, green and blue together.
    pub dropped: f64,
}

/// Reasons why energy cannot be added.
#[derive(Debug, thiserror::Error)]
pub enum ScatterError {
    /// A number of the strategy is not allowed.
    #[error("{what} of a strategy is {value}: it has to be {range}")]
    Value {
        /// The number.
        what: &'static str,
        /// Its value.
        value: f64,
        /// What is allowed.
        range: &'static str,
    },
    /// A deposit is no energy or lies outside the grid.
    #[error("deposit {at} {problem}")]
    Deposit {
        /// Its place in the list.
        at: usize,
        /// What is wrong.
        problem: String,
    },
    /// The list is too short.
    #[error(
        "a list of {capacity} deposits cannot take {needed}: give a capacity of {needed} or fewer photons"
    )]
    Full {
        /// Its room.
        capacity: u32,
        /// What is needed.
        needed: u64,
    },
    /// Numbers of one word went round.
    #[error(
        "{wraps} sums went round in whole numbers of one word: take fewer than {bits} bits for the largest deposit, or `fixed-64`"
    )]
    WentRound {
        /// How many.
        wraps: u64,
        /// Bits of the largest deposit.
        bits: u32,
    },
    /// The kernel does not run.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}
