//! Samplers: sequences and decorrelations as two independent axes, each with a kernel and a scalar
//! CPU version that is bit-identical on the u32 before the conversion to float.
//!
//! A decorrelation acts twice: it chooses the index of the point (`index`), the sequence computes
//! the point's coordinate, and the decorrelation moves that (`decorrelate`).
#![warn(missing_docs)]

mod blue_noise;
mod cranley_patterson;
mod cranley_patterson_micro_jitter;
mod decorrelation;
mod digital_shift;
pub mod dimensions;
mod disc_rotation;
mod error;
mod fixed_point;
mod halton;
mod hammersley;
pub mod hash;
mod index_offset;
mod jittered;
mod lattice_search;
mod linear_scramble;
mod micro_jitter;
mod no_decorrelation;
pub(crate) mod owen;
mod owen_hash;
mod owen_sobol;
mod pixel_hash;
mod pmj02;
mod pmj02_points;
pub mod primes;
mod r2;
mod radical_inverse;
mod rank1_lattice;
mod registry;
mod seeding;
mod sequence;
mod sobol;
mod state;
mod trig_hash;
mod van_der_corput;
mod void_and_cluster;

pub(crate) use blue_noise::BlueNoise;
pub(crate) use cranley_patterson::CranleyPatterson;
pub(crate) use cranley_patterson_micro_jitter::CranleyPattersonMicroJitter;
pub use decorrelation::{Decorrelation, Partner, decorrelation_kind};
pub(crate) use digital_shift::DigitalShift;
pub(crate) use disc_rotation::DiscRotation;
pub use error::SamplerError;
pub(crate) use halton::Halton;
pub(crate) use hammersley::Hammersley;
pub(crate) use index_offset::IndexOffset;
pub(crate) use jittered::Jittered;
pub(crate) use linear_scramble::LinearScramble;
pub(crate) use micro_jitter::MicroJitter;
pub(crate) use no_decorrelation::NoDecorrelation;
pub(crate) use owen_hash::OwenHash;
pub(crate) use owen_sobol::OwenSobol;
pub(crate) use pixel_hash::PixelHash;
pub(crate) use pmj02::Pmj02;
pub(crate) use r2::R2;
pub(crate) use rank1_lattice::Rank1Lattice;
pub use registry::SamplerRegistry;
pub(crate) use seeding::Seeded;
pub use seeding::{Seeding, paired};
pub use sequence::{Facts, Sequence, sequence_kind};
pub(crate) use sobol::Sobol;
pub use state::{Coordinate, SamplerTable};
pub(crate) use van_der_corput::VanDerCorput;

use raystone_core::params::Variant;
use std::sync::Arc;

/// The intended draws: tables are made for these, and no longer than needed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Demand {
    /// Total samples per pixel; `None` if not known beforehand.
    pub samples: Option<u32>,
    /// Upper bound (exclusive) of the dimensions.
    pub dimensions: u32,
    /// Width of the image, pixels; `None` if pixels are not in an image.
    pub width: Option<u32>,
}

/// A sequence and a decorrelation with their parameters, from which a kernel draws.
#[derive(Clone)]
pub struct Sampler {
    /// The sequence.
    pub sequence: Arc<dyn Sequence>,
    /// Its parameters.
    pub sequence_variant: Variant,
    /// The decorrelation.
    pub decorrelation: Arc<dyn Decorrelation>,
    /// Its parameters.
    pub decorrelation_variant: Variant,
    /// The demand it was made for.
    pub demand: Demand,
    /// The words of both.
    pub table: SamplerTable,
    /// Which pixels draw the same from the sequence, and from the decorrelation.
    seeding: [Seeding; 2],
}

impl Sampler {
    /// The same sampler with tables for another demand.
    ///
    /// # Errors
    /// The table of the decorrelation cannot be made.
    pub fn with_demand(&self, demand: &Demand) -> Result<Self, String> {
        let partner = Partner {
            name: &self.sequence_variant.name,
            facts: self.sequence.facts(),
        };
        let words = self.decorrelation.table(&partner, demand)?;
        let width = demand.width.unwrap_or(0);
        Ok(Self {
            table: SamplerTable::new(&self.sequence.table(demand), width, &words),
            demand: *demand,
            ..self.clone()
        })
    }

    /// The most dimensions that both parts have; `None` is unlimited.
    pub fn most_dimensions(&self) -> Option<u32> {
        let [own, _] = self.decorrelation.limits();
        own.into_iter()
            .chain(self.sequence.facts().dimensions)
            .min()
    }

    /// True if seeds give different points; a deterministic sampler has one replicate.
    pub fn is_random(&self) -> bool {
        self.sequence.facts().random || self.decorrelation.is_random()
    }

    /// True if each number of samples has its own points, rather than a prefix of a longer set.
    pub fn by_count(&self) -> bool {
        self.sequence.facts().by_count || self.decorrelation.by_count()
    }

    /// `sequence × decorrelation`, for display.
    pub fn label(&self) -> String {
        format!(
            "{} × {}",
            self.sequence_variant.label, self.decorrelation_variant.label
        )
    }

    /// Kernel modules of sequence and decorrelation.
    pub fn kernels(&self) -> [String; 2] {
        let module = |own: Option<&str>, variant: &Variant| match own {
            Some(module) => module.to_owned(),
            None => format!("sampling/{}", variant.name.replace('-', "_")),
        };
        [
            module(self.sequence.kernel(), &self.sequence_variant),
            module(self.decorrelation.kernel(), &self.decorrelation_variant),
        ]
    }

    /// Constants of `package::active::constants`.
    pub fn constants(&self) -> Vec<(&'static str, u32)> {
        let [sequence, decorrelation] = self.seeding.map(Seeding::number);
        let mut out = self.sequence.constants();
        out.extend(self.decorrelation.constants());
        out.push(("SEQUENCE_SEEDING", sequence));
        out.push(("DECORRELATION_SEEDING", decorrelation));
        out
    }

    /// Spacing of a workgroup's pixels for which they draw the same: see [`paired`].
    pub fn stride(&self) -> u32 {
        let [sequence, decorrelation] = self.seeding.map(Seeding::stride);
        sequence.max(decorrelation)
    }

    /// The u32 that the kernel computes for this coordinate.
    ///
    /// # Panics
    /// A dimension beyond the demand, if there is a table.
    pub fn sample_u32(&self, at: Coordinate) -> u32 {
        let width = self.table.image_width();
        let [mut point, own] = self.seeding.map(|seeding| Coordinate {
            pixel: seeding.seed_pixel(at.pixel, width),
            ..at
        });
        point.sample = self.decorrelation.index(&self.table, own);
        let x = self.sequence.sequence(&self.table, point);
        self.decorrelation.decorrelate(x, &self.table, own)
    }
}

/// The float that kernels make of a u32: the upper 24 bits, so that 1.0 is never reached and
/// nothing is rounded. CPU version of `to_unit` in `kernels/sampling/sampler.wesl`.
pub fn to_unit(x: u32) -> f32 {
    (x >> 8) as f32 * 2.0_f32.powi(-24)
}
