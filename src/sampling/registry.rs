//! The registries of sequences and decorrelations: one line each.

use super::{
    BlueNoise, CranleyPatterson, CranleyPattersonMicroJitter, Decorrelation, Demand, DigitalShift,
    DiscRotation, Facts, Halton, Hammersley, IndexOffset, Jittered, LinearScramble, MicroJitter,
    NoDecorrelation, OwenHash, OwenSobol, Partner, PixelHash, Pmj02, R2, Rank1Lattice, Sampler,
    SamplerError, SamplerTable, Seeding, Sequence, Sobol, VanDerCorput,
};
use crate::{decorrelation_kind, sequence_kind};
use raystone_core::params::{Entry, Params, Registry, Variant};
use std::sync::Arc;

/// The values of the `sequence` and `decorrelation` axes; more can be added.
#[derive(Clone)]
pub struct SamplerRegistry {
    /// The sequences.
    pub sequences: Registry<dyn Sequence>,
    /// The decorrelations.
    pub decorrelations: Registry<dyn Decorrelation>,
}

impl Default for SamplerRegistry {
    fn default() -> Self {
        Self {
            sequences: Registry::new(vec![
                sequence_kind::<PixelHash>("pixel-hash"),
                sequence_kind::<Jittered>("jittered"),
                sequence_kind::<VanDerCorput>("van-der-corput"),
                sequence_kind::<Hammersley>("hammersley"),
                sequence_kind::<Halton>("halton"),
                sequence_kind::<Sobol>("sobol"),
                sequence_kind::<OwenSobol>("owen-sobol"),
                sequence_kind::<Pmj02>("pmj02"),
                sequence_kind::<Rank1Lattice>("rank1-lattice"),
                sequence_kind::<R2>("r2"),
            ]),
            decorrelations: Registry::new(vec![
                decorrelation_kind::<NoDecorrelation>("none"),
                decorrelation_kind::<DiscRotation>("disc-rotation"),
                decorrelation_kind::<IndexOffset>("index-offset"),
                decorrelation_kind::<CranleyPatterson>("cranley-patterson"),
                decorrelation_kind::<DigitalShift>("digital-shift"),
                decorrelation_kind::<LinearScramble>("linear-scramble"),
                decorrelation_kind::<OwenHash>("owen-hash"),
                decorrelation_kind::<MicroJitter>("micro-jitter"),
                decorrelation_kind::<CranleyPattersonMicroJitter>("cranley-patterson-micro-jitter"),
                decorrelation_kind::<BlueNoise>("blue-noise"),
            ]),
        }
    }
}

/// `sequence × decorrelation`, for messages.
fn pair(sequence: &Variant, decorrelation: &Variant) -> String {
    format!("{sequence} × {decorrelation}")
}

/// The kind of `registry` named by `variant`, with its parameters, and the full variant.
fn configured<T: ?Sized>(
    registry: &Registry<T>,
    axis: &'static str,
    variant: &Variant,
) -> Result<(Arc<T>, Variant), SamplerError> {
    let kind = registry
        .find(&variant.name)
        .ok_or_else(|| SamplerError::Unknown {
            axis,
            name: variant.name.clone(),
        })?;
    let complete =
        |params: &Params| Ok((kind.make(params)?, params.completed(&kind.entry.schema)?));
    let (made, params) = complete(&variant.params).map_err(|error| SamplerError::Parameter {
        name: variant.name.clone(),
        error,
    })?;
    let variant = Variant {
        params,
        ..variant.clone()
    };
    Ok((made, variant))
}

type Pair = (Arc<dyn Sequence>, Arc<dyn Decorrelation>);

impl SamplerRegistry {
    /// The two kinds with their parameters, if they can be combined.
    fn pair(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<(Pair, [Variant; 2]), SamplerError> {
        let (first, sequence) = configured(&self.sequences, "sequence", sequence)?;
        let (second, decorrelation) =
            configured(&self.decorrelations, "decorrelation", decorrelation)?;
        let partner = Partner {
            name: &sequence.name,
            facts: first.facts(),
        };
        if let Some(reason) = second.refusal(&partner) {
            return Err(SamplerError::Pair {
                pair: pair(&sequence, &decorrelation),
                reason,
            });
        }
        Ok(((first, second), [sequence, decorrelation]))
    }

    /// The properties of a sequence.
    ///
    /// # Errors
    /// An unknown name or parameter, or a value out of its range.
    pub fn facts(&self, sequence: &Variant) -> Result<Facts, SamplerError> {
        Ok(configured(&self.sequences, "sequence", sequence)?.0.facts())
    }

    /// True if seeds change the draws of this pair. No table is generated.
    ///
    /// # Errors
    /// An unknown name, or a pair that cannot be combined.
    pub fn is_random(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<bool, SamplerError> {
        let ((first, second), _) = self.pair(sequence, decorrelation)?;
        Ok(first.facts().random || second.is_random())
    }

    /// True if the mean over seeds is the integral at any number of samples, by a random sequence
    /// or by the decorrelation. False for unknown names.
    pub fn is_unbiased(&self, sequence: &Variant, decorrelation: &Variant) -> bool {
        let pair = self.pair(sequence, decorrelation);
        pair.is_ok_and(|((first, second), _)| first.facts().random || second.is_unbiased())
    }

    /// The sampler of two variants, with tables for the demand.
    ///
    /// # Errors
    /// An unknown name, a pair that cannot be combined, a demand beyond a limit (which the message
    /// names), or a table that cannot be generated.
    pub fn sampler(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
        demand: &Demand,
    ) -> Result<Sampler, SamplerError> {
        let ((first, second), [sequence, decorrelation]) = self.pair(sequence, decorrelation)?;
        let facts = first.facts();
        let pair = || pair(&sequence, &decorrelation);
        let [dimensions, samples] = second.limits();
        for limit in facts.dimensions.into_iter().chain(dimensions) {
            if demand.dimensions > limit {
                return Err(SamplerError::Dimensions {
                    pair: pair(),
                    asked: demand.dimensions,
                    limit,
                });
            }
        }
        for limit in facts.samples.into_iter().chain(samples) {
            if let Some(asked) = demand.samples.filter(|&n| n > limit) {
                return Err(SamplerError::Samples {
                    pair: pair(),
                    asked,
                    limit,
                });
            }
        }
        let by_count = facts.by_count || second.by_count();
        let seeding = [first.seeding(), second.seeding()];
        let by_width = second.by_width() || seeding.into_iter().any(Seeding::by_width);
        let unknown = [
            (by_count && demand.samples.is_none()).then_some("the number of samples"),
            (by_width && demand.width.is_none()).then_some("the width of the image"),
        ];
        if let Some(what) = unknown.into_iter().flatten().next() {
            return Err(SamplerError::NotKnown { pair: pair(), what });
        }
        let pair = pair();
        let without_table = Sampler {
            table: SamplerTable::new(&[], 0, &[]),
            seeding,
            sequence: first,
            sequence_variant: sequence,
            decorrelation: second,
            decorrelation_variant: decorrelation,
            demand: *demand,
        };
        let made = without_table.with_demand(demand);
        made.map_err(|reason| SamplerError::Table { pair, reason })
    }

    /// Names, descriptions and parameters of the sequences.
    pub fn sequence_entries(&self) -> Vec<Entry> {
        self.sequences.entries()
    }

    /// Names, descriptions and parameters of the decorrelations.
    pub fn decorrelation_entries(&self) -> Vec<Entry> {
        self.decorrelations.entries()
    }
}
