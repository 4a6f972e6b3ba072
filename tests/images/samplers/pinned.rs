//! Sampler output is part of results: checked words must not change, including late dimensions and
//! samples. Runs compare kernels with the same list.

use super::*;
use raystone::measure::known_words::{fault_of_sequence, pinned_line, pinned_lines};

/// Every sequence without and one with every decorrelation, with every parameter, and all other pairs.
fn samplers() -> Vec<Sampler> {
    let registry = SamplerRegistry::default();
    let (sequences, decorrelations) = (
        registry.sequence_entries(),
        registry.decorrelation_entries(),
    );
    let none = variant(&decorrelations, "none", &[]);
    let sobol = variant(&sequences, "sobol", &[]);
    let mut pairs: Vec<(Variant, Variant)> = Vec::new();
    let plain = sequences.iter().flat_map(variants);
    pairs.extend(plain.map(|s| (s, none.clone())));
    let moved = decorrelations.iter().flat_map(variants);
    // A 64th root is not the same on all machines.
    let moved = moved.filter(|d| d.params.0.get("s") != Some(&ParamValue::Integer(64)));
    pairs.extend(moved.map(|d| (sobol.clone(), d)));
    for sequence in sequences.iter().map(Entry::default_variant) {
        let of_it = decorrelations.iter().map(Entry::default_variant);
        pairs.extend(of_it.map(|d| (sequence.clone(), d)));
    }
    let sampler = |(sequence, decorrelation): (Variant, Variant)| {
        let facts = registry.facts(&sequence).expect("registered");
        let demand = demand(1 << 10, facts.dimensions.unwrap_or(122).min(122));
        match registry.sampler(&sequence, &decorrelation, &demand) {
            Ok(sampler) => Some(sampler),
            Err(SamplerError::Pair { .. } | SamplerError::Table { .. }) => None,
            Err(error) => panic!("{error}"),
        }
    };
    pairs.into_iter().filter_map(sampler).collect()
}

#[test]
fn words_of_every_sampler_are_those_that_were_checked() {
    let lines = samplers().into_iter().map(|sampler| {
        let line = pinned_line(&sampler);
        line.unwrap_or_else(|e| panic!("{}: {e}", sampler.label()))
    });
    let mut found: Vec<String> = lines.collect();
    found.sort();
    found.dedup();
    assert!(found.len() >= 70, "{} samplers", found.len());
    let pinned: Vec<&str> = pinned_lines().collect();
    assert!(pinned == found, "now:\n{}", found.join("\n"));
}

#[test]
fn sequences_are_those_computed_anew_in_every_dimension() {
    for sampler in samplers() {
        assert_eq!(fault_of_sequence(&sampler), None, "{}", sampler.label());
    }
}
