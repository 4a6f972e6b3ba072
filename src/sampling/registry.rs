//! The registries of sequences and decorrelations: one line each.

use super::{
    CranleyPatterson, Decorrelation, Halton, NoDecorrelation, PixelHash, Sampler, Sequence, Sobol,
};
use crate::config::{Entry, Variant};

/// Everything that can be named on the `sequence` and `decorrelation` axes.
#[derive(Clone)]
pub struct SamplerRegistry {
    sequences: Vec<&'static dyn Sequence>,
    decorrelations: Vec<&'static dyn Decorrelation>,
}

impl Default for SamplerRegistry {
    fn default() -> Self {
        Self {
            sequences: vec![&PixelHash, &Halton, &Sobol],
            decorrelations: vec![&NoDecorrelation, &CranleyPatterson],
        }
    }
}

impl SamplerRegistry {
    /// All sequences.
    pub fn sequences(&self) -> impl Iterator<Item = &'static dyn Sequence> + '_ {
        self.sequences.iter().copied()
    }

    /// All decorrelations.
    pub fn decorrelations(&self) -> impl Iterator<Item = &'static dyn Decorrelation> + '_ {
        self.decorrelations.iter().copied()
    }

    /// The sampler of two variants; `None` if a name is not registered.
    pub fn sampler(&self, sequence: &Variant, decorrelation: &Variant) -> Option<Sampler> {
        let found = self.sequences().find(|s| s.name() == sequence.name)?;
        Some(Sampler {
            sequence: found,
            table: found.table(&sequence.params),
            sequence_variant: sequence.clone(),
            decorrelation: self
                .decorrelations()
                .find(|d| d.name() == decorrelation.name)?,
            decorrelation_variant: decorrelation.clone(),
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
