//! The registries of sequences and decorrelations: one line each.

use super::{
    BlueNoise, CranleyPatterson, Decorrelation, Demand, DigitalShift, DiscRotation, Halton,
    Hammersley, IndexOffset, MicroJitter, NoDecorrelation, OwenHash, OwenSobol, Partner, PixelHash,
    Pmj02, R2, Rank1Lattice, Sampler, SamplerError, SamplerTable, Seeding, Sequence, Sobol,
    VanDerCorput,
};
use crate::config::{Entry, Parameter, Variant};

/// Everything that can be named on the `sequence` and `decorrelation` axes.
#[derive(Clone)]
pub struct SamplerRegistry {
    sequences: Vec<&'static dyn Sequence>,
    decorrelations: Vec<&'static dyn Decorrelation>,
}

impl Default for SamplerRegistry {
    fn default() -> Self {
        Self {
            sequences: vec![
                &PixelHash,
                &VanDerCorput,
                &Hammersley,
                &Halton,
                &Sobol,
                &OwenSobol,
                &Pmj02,
                &Rank1Lattice,
                &R2,
            ],
            decorrelations: vec![
                &NoDecorrelation,
                &DiscRotation,
                &IndexOffset,
                &CranleyPatterson,
                &DigitalShift,
                &OwenHash,
                &MicroJitter,
                &BlueNoise,
            ],
        }
    }
}

/// `sequence × decorrelation`, for messages.
fn pair(sequence: &Variant, decorrelation: &Variant) -> String {
    format!("{sequence} × {decorrelation}")
}

/// A variant with the defaults of its entry for the parameters that it lacks.
fn completed(variant: &Variant, schema: &[Parameter]) -> Result<Variant, SamplerError> {
    let params = variant.params.completed(schema);
    Ok(Variant {
        params: params.map_err(|error| SamplerError::Parameter {
            name: variant.name.clone(),
            error,
        })?,
        ..variant.clone()
    })
}

impl SamplerRegistry {
    /// Adds a sequence; it replaces one of the same name.
    pub fn register_sequence(&mut self, sequence: &'static dyn Sequence) {
        self.sequences.retain(|s| s.name() != sequence.name());
        self.sequences.push(sequence);
    }

    /// Adds a decorrelation; it replaces one of the same name.
    pub fn register_decorrelation(&mut self, decorrelation: &'static dyn Decorrelation) {
        self.decorrelations
            .retain(|d| d.name() != decorrelation.name());
        self.decorrelations.push(decorrelation);
    }

    /// All sequences.
    pub fn sequences(&self) -> impl Iterator<Item = &'static dyn Sequence> + '_ {
        self.sequences.iter().copied()
    }

    /// All decorrelations.
    pub fn decorrelations(&self) -> impl Iterator<Item = &'static dyn Decorrelation> + '_ {
        self.decorrelations.iter().copied()
    }

    fn find(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<(&'static dyn Sequence, &'static dyn Decorrelation), SamplerError> {
        let unknown = |axis, variant: &Variant| SamplerError::Unknown {
            axis,
            name: variant.name.clone(),
        };
        let first = self.sequences().find(|s| s.name() == sequence.name);
        let second = self
            .decorrelations()
            .find(|d| d.name() == decorrelation.name);
        Ok((
            first.ok_or_else(|| unknown("sequence", sequence))?,
            second.ok_or_else(|| unknown("decorrelation", decorrelation))?,
        ))
    }

    /// Whether seeds change what this pair draws. No table is made.
    ///
    /// # Errors
    /// An unknown name, or a pair that makes no sense.
    pub fn is_random(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
    ) -> Result<bool, SamplerError> {
        let (first, second) = self.find(sequence, decorrelation)?;
        let sequence = &completed(sequence, &first.parameters())?;
        let decorrelation = &completed(decorrelation, &second.parameters())?;
        let facts = first.facts(&sequence.params);
        let partner = Partner {
            name: &sequence.name,
            facts,
        };
        match second.refusal(&decorrelation.params, &partner) {
            None => Ok(facts.random || second.is_random()),
            Some(reason) => Err(SamplerError::Pair {
                pair: pair(sequence, decorrelation),
                reason,
            }),
        }
    }

    /// Whether the mean over seeds is the integral at any number of samples: the sequence is random by
    /// itself, or the decorrelation sees to it. False for unknown names.
    pub fn is_unbiased(&self, sequence: &Variant, decorrelation: &Variant) -> bool {
        let claims = |(first, second): (&dyn Sequence, &dyn Decorrelation)| {
            first.facts(&sequence.params).random || second.is_unbiased(&decorrelation.params)
        };
        self.find(sequence, decorrelation).is_ok_and(claims)
    }

    /// The sampler of two variants, with tables for what is demanded.
    ///
    /// # Errors
    /// An unknown name, a pair that makes no sense, a demand beyond a limit (which the message names),
    /// or a table that cannot be made.
    pub fn sampler(
        &self,
        sequence: &Variant,
        decorrelation: &Variant,
        demand: &Demand,
    ) -> Result<Sampler, SamplerError> {
        self.is_random(sequence, decorrelation)?;
        let (first, second) = self.find(sequence, decorrelation)?;
        let sequence = &completed(sequence, &first.parameters())?;
        let decorrelation = &completed(decorrelation, &second.parameters())?;
        let partner = Partner {
            name: &sequence.name,
            facts: first.facts(&sequence.params),
        };
        let pair = || pair(sequence, decorrelation);
        let facts = partner.facts;
        let [dimensions, samples] = second.limits(&decorrelation.params);
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
        let by_count = facts.by_count || second.by_count(&decorrelation.params);
        let unknown = [
            (by_count && demand.samples.is_none()).then_some("the number of samples"),
            (second.by_width() && demand.width.is_none()).then_some("the width of the image"),
        ];
        if let Some(what) = unknown.into_iter().flatten().next() {
            return Err(SamplerError::NotKnown { pair: pair(), what });
        }
        let words = second.table(&decorrelation.params, &partner, demand);
        let words = words.map_err(|reason| SamplerError::Table {
            pair: pair(),
            reason,
        })?;
        Ok(Sampler {
            sequence: first,
            table: SamplerTable::new(&first.table(&sequence.params, demand), &words),
            sequence_variant: sequence.clone(),
            decorrelation: second,
            decorrelation_variant: decorrelation.clone(),
            demand: *demand,
            shared_by_pixels: [sequence, decorrelation]
                .map(|variant| Seeding::of(&variant.params) == Seeding::Sample),
        })
    }

    /// Names, descriptions and parameters of the sequences.
    pub fn sequence_entries(&self) -> Vec<Entry> {
        let entry = |s: &'static dyn Sequence| Entry {
            name: s.name().to_owned(),
            description: s.description().to_owned(),
            schema: s.parameters(),
        };
        self.sequences().map(entry).collect()
    }

    /// Names, descriptions and parameters of the decorrelations.
    pub fn decorrelation_entries(&self) -> Vec<Entry> {
        let entry = |d: &'static dyn Decorrelation| Entry {
            name: d.name().to_owned(),
            description: d.description().to_owned(),
            schema: d.parameters(),
        };
        self.decorrelations().map(entry).collect()
    }
}
