//! Samplers: sequences and decorrelations as two independent axes, each with a kernel and a scalar
//! twin that equals it to the bit on the u32 before the conversion to float.

mod cranley_patterson;
pub mod dimensions;
mod halton;
pub mod hash;
mod no_decorrelation;
mod pixel_hash;
mod registry;
mod sobol;

pub use cranley_patterson::CranleyPatterson;
pub use halton::Halton;
pub use no_decorrelation::NoDecorrelation;
pub use pixel_hash::PixelHash;
pub use registry::SamplerRegistry;
pub use sobol::Sobol;

use crate::config::{ParameterSchema, Params, Variant};

/// Dimensions that table-driven sequences hold.
pub const TABLE_DIMENSIONS: u32 = 128;

/// What one coordinate is asked for.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Coordinate {
    /// Linear pixel index.
    pub pixel: u32,
    /// Sample within the pixel.
    pub sample: u32,
    /// Dimension, see [`dimensions`].
    pub dimension: u32,
    /// Seed of the replicate.
    pub seed: u32,
}

/// A sequence of points; one static per sequence, one line in the registry.
pub trait Sequence: Sync {
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it is and where it comes from.
    fn description(&self) -> &'static str;
    /// Module of the kernel, relative to the kernel folder.
    fn kernel(&self) -> &'static str;
    /// Parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Whether the points depend on pixel and seed.
    fn is_random(&self) -> bool {
        false
    }
    /// Dimensions it has; `None` is any number.
    fn max_dimensions(&self) -> Option<u32> {
        Some(TABLE_DIMENSIONS)
    }
    /// Words that the kernel reads as `sampler_table`.
    fn table(&self, _params: &Params) -> Vec<u32> {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self, _params: &Params) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Twin of the kernel's `sequence`: a fraction of 2³².
    fn sequence(&self, params: &Params, table: &[u32], at: Coordinate) -> u32;
}

/// A decorrelation of pixels; one static per scheme, one line in the registry.
pub trait Decorrelation: Sync {
    /// Name as a user types it.
    fn name(&self) -> &'static str;
    /// One line: what it is and where it comes from.
    fn description(&self) -> &'static str;
    /// Module of the kernel, relative to the kernel folder.
    fn kernel(&self) -> &'static str;
    /// Parameters.
    fn parameters(&self) -> ParameterSchema {
        Vec::new()
    }
    /// Whether the result depends on pixel and seed.
    fn is_random(&self) -> bool;
    /// Twin of the kernel's `decorrelate`: moves the fraction `x` of 2³².
    fn decorrelate(&self, x: u32, at: Coordinate) -> u32;
}

/// A sequence and a decorrelation with their parameters: what a kernel draws from.
#[derive(Clone)]
pub struct Sampler {
    /// The sequence.
    pub sequence: &'static dyn Sequence,
    /// Its parameters.
    pub sequence_variant: Variant,
    /// The decorrelation.
    pub decorrelation: &'static dyn Decorrelation,
    /// Its parameters.
    pub decorrelation_variant: Variant,
    /// The sequence's table.
    pub table: Vec<u32>,
}

impl Sampler {
    /// Whether seeds give different points; a deterministic sampler has one replicate.
    pub fn is_random(&self) -> bool {
        self.sequence.is_random() || self.decorrelation.is_random()
    }

    /// `sequence × decorrelation`, for people.
    pub fn label(&self) -> String {
        format!(
            "{} × {}",
            self.sequence_variant.label, self.decorrelation_variant.label
        )
    }

    /// The u32 that the kernel computes for this coordinate.
    pub fn sample_u32(&self, at: Coordinate) -> u32 {
        let x = self
            .sequence
            .sequence(&self.sequence_variant.params, &self.table, at);
        self.decorrelation.decorrelate(x, at)
    }
}

/// The float that kernels make of a u32: the upper 24 bits, so that 1.0 is never reached and no
/// rounding is involved. Twin of `to_unit` in `kernels/sampling/sampler.wesl`.
pub fn to_unit(x: u32) -> f32 {
    (x >> 8) as f32 * 2.0_f32.powi(-24)
}
