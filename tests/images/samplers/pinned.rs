//! Sampler output is part of results: checked words must not change, including late dimensions and
//! samples. Kernels equal these twins.

use super::*;

/// Name of each sampler and the digest of its words. An intentional change needs a new line,
/// printed by the failing test, and a line in the change log, as older results are not comparable.
const PINNED: &str = include_str!("pinned.txt");

/// Digest of 512 coordinates per dimension, spread over samples, pixels and seeds.
fn digest(sampler: &Sampler) -> String {
    let samples = sampler.demand.samples.expect("known");
    let mut words = blake3::Hasher::new();
    for dimension in 0..sampler.demand.dimensions {
        for k in 0..512_u32 {
            let word = sampler.sample_u32(Coordinate {
                pixel: k.wrapping_mul(104_729) % (WIDTH * 144),
                sample: k.wrapping_mul(0x9e37_79b9) % samples,
                dimension,
                seed: k.wrapping_mul(if k % 2 == 0 { 1 } else { 0x85eb_ca6b }),
            });
            words.update(&word.to_le_bytes());
        }
    }
    words.finalize().to_hex()[..16].to_owned()
}

#[test]
fn words_of_every_sampler_are_those_that_were_checked() {
    let registry = SamplerRegistry::default();
    let (sequences, decorrelations) = (
        registry.sequence_entries(),
        registry.decorrelation_entries(),
    );
    let none = variant(&decorrelations, "none", &[]);
    let sobol = variant(&sequences, "sobol", &[]);
    let mut pairs: Vec<(Variant, Variant)> = Vec::new();
    pairs.extend(
        sequences
            .iter()
            .flat_map(variants)
            .map(|s| (s, none.clone())),
    );
    pairs.extend(
        decorrelations
            .iter()
            .map(|d| (sobol.clone(), d.default_variant())),
    );
    let mut found = Vec::new();
    for (sequence, decorrelation) in &pairs {
        let facts = registry.facts(sequence).expect("registered");
        let demand = demand(1 << 16, facts.dimensions.unwrap_or(122).min(122));
        let made = registry.sampler(sequence, decorrelation, &demand);
        let sampler = made.unwrap_or_else(|e| panic!("{e}"));
        found.push(format!("{} {}", digest(&sampler), sampler.label()));
    }
    assert!(found.len() >= 20, "{} samplers", found.len());
    let pinned: Vec<&str> = PINNED.lines().collect();
    let other: Vec<&String> = found
        .iter()
        .filter(|l| !pinned.contains(&l.as_str()))
        .collect();
    assert!(
        other.is_empty() && pinned.len() == found.len(),
        "now:\n{}",
        found.join("\n")
    );
}
