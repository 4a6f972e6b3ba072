//! Radical inverses at large indices against exact rationals.

use super::{Gauge, NumericsError, rig};
use raystone_bench::run::dump_stream;
use raystone_gpu::Gpu;
use raystone_sampling::Coordinate;

/// Dimensions of `halton`.
const DIMENSIONS: u32 = 256;

/// Measures the distance of the adapter's words of `halton` from the exact points, for indices up to 2³² − 1.
pub(super) fn figures(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let sampler = rig::sampler("halton", DIMENSIONS)?;
    let step = if quick { 16 } else { 1 };
    let coordinates: Vec<Coordinate> = (0..DIMENSIONS)
        .step_by(step)
        .chain([DIMENSIONS - 1])
        .flat_map(|dimension| {
            indices(sampler.table.sequence_word(2 * dimension))
                .map(move |sample| (dimension, sample))
        })
        .map(|(dimension, sample)| Coordinate {
            pixel: 0,
            sample,
            dimension,
            seed: 0,
        })
        .collect();
    let words = dump_stream(gpu, &sampler, &coordinates).map_err(NumericsError::Stream)?;
    let (mut other, mut lost, mut worst_base) = (0_u64, 0.0_f64, 0);
    for (at, word) in coordinates.iter().zip(&words) {
        other += u64::from(sampler.sample_u32(*at) != *word);
        let base = sampler.table.sequence_word(2 * at.dimension);
        let below = shortfall(at.sample, base, *word);
        if below.abs() > lost {
            (lost, worst_base) = (below.abs(), base);
        }
    }
    let tried = format!(
        "{} indices and dimensions, the largest index 2³² − 1",
        words.len()
    );
    let resolved = format!("in base {worst_base}; rounded down once, to 2⁻³²");
    Ok(vec![
        Gauge::new(
            "Halton words that differ from the host's",
            other as f64,
            tried,
        )
        .at_most(0.0)
        .in_unit("words"),
        Gauge::new("largest error of a Halton point", lost, resolved)
            .at_most(1.0)
            .in_unit("2⁻³²"),
    ])
}

/// Indices with many digits in `base`: the ends of the range, and the powers of the base with their
/// neighbours.
fn indices(base: u32) -> impl Iterator<Item = u32> {
    let powers = std::iter::successors(Some(base), move |power| power.checked_mul(base));
    let around = powers.flat_map(move |power| {
        [
            power - 1,
            power,
            power.saturating_add(1),
            power.wrapping_mul(base).wrapping_sub(1),
        ]
    });
    let spread = (0..64_u32).map(|k| k.wrapping_mul(0x9e37_79b9) ^ 0xf000_0000);
    around.chain(spread).chain([0, 1, u32::MAX - 1, u32::MAX])
}

/// Returns the distance by which `word` · 2⁻³² lies below the radical inverse of `n`, in units of 2⁻³²; from integers
/// alone until the last division.
fn shortfall(n: u32, base: u32, word: u32) -> f64 {
    let base = u128::from(base);
    // The radical inverse is `mirrored / power`.
    let (mut rest, mut mirrored, mut power) = (u128::from(n), 0_u128, 1_u128);
    while rest > 0 {
        mirrored = mirrored * base + rest % base;
        power *= base;
        rest /= base;
    }
    let exact = mirrored << 32;
    let found = u128::from(word) * power;
    let sign = if exact >= found { 1.0 } else { -1.0 };
    sign * exact.abs_diff(found) as f64 / power as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_exact_point_has_no_shortfall_and_its_neighbours_have_one_unit() {
        // 0.101 in base 2 is 5/8; 0.12 in base 3 is 5/9, which no word is.
        let word = 5 << 29;
        assert_eq!(shortfall(5, 2, word), 0.0);
        assert_eq!(shortfall(5, 2, word - 1), 1.0);
        assert_eq!(shortfall(5, 2, word + 1), -1.0);
        let below = (5_u64 << 32) / 9;
        let shortfall = shortfall(7, 3, below as u32);
        assert!((0.0..1.0).contains(&shortfall), "{shortfall}");
    }
}
