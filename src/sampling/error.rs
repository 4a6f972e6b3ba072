//! Why a sampler cannot be had.

use raystone_core::params::ParamError;
use thiserror::Error;

/// Why a sequence and a decorrelation do not make a sampler; every message names the limit or what to
/// take instead.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SamplerError {
    /// A name that is not registered.
    #[error("no {axis} is called `{name}`")]
    Unknown {
        /// `sequence` or `decorrelation`.
        axis: &'static str,
        /// What was asked for.
        name: String,
    },
    /// A parameter that one of the two does not have, or a value that it does not allow.
    #[error("{name}: {error}")]
    Parameter {
        /// The sequence or decorrelation.
        name: String,
        /// What is wrong.
        error: ParamError,
    },
    /// The two make no sense together.
    #[error("{pair} makes no sense: {reason}")]
    Pair {
        /// `sequence × decorrelation`.
        pair: String,
        /// Why.
        reason: String,
    },
    /// More dimensions than there are.
    #[error(
        "{asked} dimensions are needed, {pair} has {limit}: lower max_depth or take a sequence with \
         more (pixel-hash has any number)"
    )]
    Dimensions {
        /// `sequence × decorrelation`.
        pair: String,
        /// Dimensions asked for.
        asked: u32,
        /// Dimensions there are.
        limit: u32,
    },
    /// More samples than there are.
    #[error("{asked} samples are asked for, {pair} has {limit}")]
    Samples {
        /// `sequence × decorrelation`.
        pair: String,
        /// Samples asked for.
        asked: u32,
        /// Samples there are.
        limit: u32,
    },
    /// Something that has to be known beforehand is not.
    #[error("{pair} depends on {what}, which is not known here")]
    NotKnown {
        /// `sequence × decorrelation`.
        pair: String,
        /// What has to be known.
        what: &'static str,
    },
    /// A table cannot be made.
    #[error("{pair}: {reason}")]
    Table {
        /// `sequence × decorrelation`.
        pair: String,
        /// Why.
        reason: String,
    },
}
