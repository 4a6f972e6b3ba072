//! What a sampler draws, against sources that neither its kernel nor its twin shares: sequences computed
//! anew (`sequences`), digests of words that were checked once, and the independence of pixels, seeds
//! and dimensions (`spread`).
//!
//! A comparison of a kernel with its twin sees no fault that stands in both, such as two dimensions with
//! one scramble, or seeds of which the last bit is ignored.

mod sequences;
mod spread;

use crate::words::{Used, borders, compare, dump_stream};
use raystone_core::params::Variant;
use raystone_core::random::Pcg32;
use raystone_gpu::Gpu;
use raystone_sampling::{Coordinate, Demand, Sampler};
use std::ops::Range;

pub use sequences::fault as fault_of_sequence;

/// Digests of the words of each sampler, one for each of [`RANGES`], and its name. A change of words
/// needs new lines, printed by the test that fails, and a line in the change log, as older results are not
/// comparable.
const PINNED: &str = include_str!("pinned.txt");
/// Dimensions that share a digest: an ordinary path stays within the first two.
const RANGES: [Range<u32>; 4] = [0..8, 8..32, 32..64, 64..122];
/// Samples and the width of the image for which tables of pinned samplers are made.
const SAMPLES: u32 = 4096;
const WIDTH: u32 = 192;
/// Pinned words of a dimension.
const PER_DIMENSION: usize = 128;

/// Compares a sampler with all that is known of it; `used` is what a run draws.
///
/// # Errors
/// What differs, with the dimensions in question; or the kernel does not run.
pub fn check(gpu: &Gpu, sampler: &Sampler, used: &Used) -> Result<(), String> {
    let label = sampler.label();
    let wrong = |fault: String| format!("{label}: {fault}");
    if let Some(fault) = fault_of_sequence(sampler) {
        return Err(wrong(fault));
    }
    check_pinned(gpu, sampler)?;
    let at = spread::coordinates(sampler, used);
    let words = dump_stream(gpu, sampler, &at)?;
    match spread::fault(sampler, used, &words) {
        Some(fault) => Err(wrong(fault)),
        None => Ok(()),
    }
}

/// Name of a sampler in the list: both parts with all parameters.
fn pinned_name(sampler: &Sampler) -> String {
    let part = |variant: &Variant| {
        let set = variant.params.0.iter();
        let set: String = set.map(|(key, value)| format!(" {key}={value}")).collect();
        format!("{}{set}", variant.name)
    };
    let [sequence, decorrelation] = [&sampler.sequence_variant, &sampler.decorrelation_variant];
    format!("{} × {}", part(sequence), part(decorrelation))
}

/// The same sampler with the tables that pinned words are drawn from.
fn as_pinned(sampler: &Sampler) -> Result<Sampler, String> {
    let most = RANGES.last().map_or(0, |range| range.end);
    sampler.with_demand(&Demand {
        samples: Some(SAMPLES),
        dimensions: sampler.most_dimensions().unwrap_or(most).min(most),
        width: Some(WIDTH),
    })
}

/// Pinned coordinates: neighbours and far pixels, consecutive seeds and such with many bits, samples around
/// powers of two and others.
fn pinned_coordinates(dimensions: Range<u32>) -> Vec<Coordinate> {
    let mut random = Pcg32::new(u64::from(dimensions.start));
    let mut below = |end: usize| random.below(end) as u32;
    let samples = borders(SAMPLES);
    let mut at = Vec::new();
    for dimension in dimensions {
        for k in 0..PER_DIMENSION {
            at.push(Coordinate {
                pixel: below(WIDTH as usize * if k % 2 == 0 { 2 } else { 600 }),
                sample: match k % 3 {
                    0 => samples[below(samples.len()) as usize],
                    _ => below(SAMPLES as usize),
                },
                dimension,
                seed: below(4) | below(1 << 16) << [0, 16, 2, 31][k % 4],
            });
        }
    }
    at
}

/// The coordinates of each digest, as far as the sampler has such dimensions.
fn pinned_ranges(sampler: &Sampler) -> impl Iterator<Item = Vec<Coordinate>> {
    let most = sampler.demand.dimensions;
    let within = move |range: Range<u32>| range.start..range.end.min(most);
    RANGES
        .into_iter()
        .map(within)
        .filter(|r| !r.is_empty())
        .map(pinned_coordinates)
}

fn digest(words: &[u32]) -> String {
    let words: Vec<u8> = words.iter().flat_map(|word| word.to_le_bytes()).collect();
    blake3::hash(&words).to_hex()[..12].to_owned()
}

/// The line of a sampler in the list, by its twin.
///
/// # Errors
/// Its tables cannot be made.
pub fn pinned_line(sampler: &Sampler) -> Result<String, String> {
    let sampler = as_pinned(sampler)?;
    let words = |at: Vec<Coordinate>| -> Vec<u32> {
        at.into_iter().map(|c| sampler.sample_u32(c)).collect()
    };
    let digests: Vec<String> = pinned_ranges(&sampler)
        .map(|at| digest(&words(at)))
        .collect();
    Ok(format!("{}: {}", pinned_name(&sampler), digests.join(" ")))
}

/// All lines of the list.
pub fn pinned_lines() -> impl Iterator<Item = &'static str> {
    PINNED.lines()
}

/// Compares the kernel's words with the digests, where the sampler is in the list.
fn check_pinned(gpu: &Gpu, sampler: &Sampler) -> Result<(), String> {
    let name = format!("{}: ", pinned_name(sampler));
    let Some(digests) = pinned_lines().find_map(|line| line.strip_prefix(&name)) else {
        return Ok(());
    };
    let sampler = as_pinned(sampler)?;
    let ranges: Vec<Vec<Coordinate>> = pinned_ranges(&sampler).collect();
    let words = dump_stream(gpu, &sampler, &ranges.concat())?;
    let mut rest = &words[..];
    for (at, pinned) in ranges.iter().zip(digests.split(' ')) {
        let (words, others) = rest.split_at(at.len());
        rest = others;
        if digest(words) == pinned {
            continue;
        }
        compare(&sampler, at, words)?;
        let [first, last] = [at.first(), at.last()].map(|c| c.map_or(0, |c| c.dimension));
        return Err(format!(
            "{}: kernel and twin both draw other words than those that were checked, in dimensions {first} \
             to {last}",
            sampler.label()
        ));
    }
    Ok(())
}
