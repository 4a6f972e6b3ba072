//! Errors of samplers.

use raystone_core::params::ParamError;
use thiserror::Error;

/// The reason why a sequence and a decorrelation do not form a sampler; every message names the
/// limit or an alternative.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum SamplerError {
    /// A name that is not registered.
    #[error("no {axis} is called `{name}`")]
    Unknown {
        /// `sequence` or `decorrelation`.
        axis: &'static str,
        /// The requested name.
        name: String,
    },
    /// An unknown parameter, or a value that is not allowed.
    #[error("{name}: {error}")]
    Parameter {
        /// The sequence or decorrelation.
        name: String,
        /// The error.
        error: ParamError,
    },
    /// The two cannot be combined.
    #[error("{pair} makes no sense: {reason}")]
    Pair {
        /// `sequence × decorrelation`.
        pair: String,
        /// The reason.
        reason: String,
    },
    /// Too many dimensions.
    #[error(
        "{asked} dimensions are needed, {pair} has {limit}: lower max_depth or take a sequence with \
         more (pixel-hash has any number)"
    )]
    Dimensions {
        /// `sequence × decorrelation`.
        pair: String,
        /// Requested dimensions.
        asked: u32,
        /// Available dimensions.
        limit: u32,
    },
    /// Too many samples.
    #[error("{asked} samples are asked for, {pair} has {limit}")]
    Samples {
        /// `sequence × decorrelation`.
        pair: String,
        /// Requested samples.
        asked: u32,
        /// Available samples.
        limit: u32,
    },
    /// A required quantity is not known beforehand.
    #[error("{pair} depends on {what}, which is not known here")]
    NotKnown {
        /// `sequence × decorrelation`.
        pair: String,
        /// The quantity.
        what: &'static str,
    },
    /// A table cannot be generated.
    #[error("{pair}: {reason}")]
    Table {
        /// `sequence × decorrelation`.
        pair: String,
        /// The reason.
        reason: String,
    },
}
