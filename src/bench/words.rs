//! Compares the words drawn by a sampler's kernel with the scalar twin over the whole range of a
//! run: every dimension, samples and seeds from first to last, pixels from corner to corner.
//!
//! The words come from the kernel `sampling/dump_stream`, which reads coordinates (pixel, sample,
//! dimension, seed) from a buffer and uses the renderer's modules, constants and table.

use crate::known_words;
use raystone_core::random::Pcg32;
use raystone_gpu::{Composition, Gpu, UniformValues, groups_for};
use raystone_render::with_sampler;
use raystone_sampling::{Coordinate, Sampler};

/// Total number of coordinates compared: those at boundaries, and random ones for the rest.
pub const WORDS: usize = 1 << 16;
/// Edges of decorrelation masks and tiles are multiples of this, pixels.
const TILE: u32 = 64;
/// Pixels and seeds at which every sample is compared in every dimension.
const PLACES: usize = 6;

/// The range that a run draws from one sampler.
#[derive(Debug, Clone)]
pub struct Used {
    /// Samples per pixel.
    pub samples: u32,
    /// Number of dimensions.
    pub dimensions: u32,
    /// Width and height of the image.
    pub size: [u32; 2],
    /// Seeds.
    pub seeds: Vec<u32>,
}

/// Numbers below `end` at which something may change: the first ones, those around powers of two
/// and halfway between, and the last ones.
pub(crate) fn borders(end: u32) -> Vec<u32> {
    let last = end.saturating_sub(1);
    let powers = (1..32).map(|k| 1_u32 << k);
    let around = powers.flat_map(|p| [p - 1, p, p + 1, p + p / 2]);
    let mut out: Vec<u32> = [0, 1, last / 2, last.saturating_sub(1), last].into();
    out.extend(around);
    out.retain(|&i| i <= last);
    out.sort_unstable();
    out.dedup();
    out
}

impl Used {
    /// Pixels at the ends of rows and columns, and next to tile borders.
    fn pixels(&self) -> Vec<u32> {
        let places = |edge: u32| {
            let tiles = [TILE, 2 * TILE].into_iter().flat_map(|t| [t - 1, t]);
            let mut out = vec![0, 1, edge / 2, edge.saturating_sub(1)];
            out.extend(tiles);
            out.retain(|&i| i < edge);
            out
        };
        let [width, height] = self.size;
        let columns = places(width);
        let rows = places(height).into_iter();
        let mut out: Vec<u32> = rows
            .flat_map(|y| columns.iter().map(move |x| y * width + x))
            .collect();
        out.sort_unstable();
        out.dedup();
        out
    }

    /// The coordinates to compare: every boundary sample in every dimension, every boundary pixel
    /// with every seed, and random ones.
    pub fn coordinates(&self) -> Vec<Coordinate> {
        let mut random = Pcg32::new(u64::from(self.samples));
        let mut below = |end: usize| random.below(end.max(1));
        let (samples, pixels) = (borders(self.samples), self.pixels());
        let seed = |i: usize| self.seeds.get(i % self.seeds.len().max(1)).copied();
        let mut out = Vec::with_capacity(WORDS);
        for dimension in 0..self.dimensions {
            for &sample in &samples {
                out.extend((0..PLACES).map(|_| Coordinate {
                    pixel: pixels[below(pixels.len())],
                    sample,
                    dimension,
                    seed: seed(below(self.seeds.len())).unwrap_or(0),
                }));
            }
        }
        for &pixel in &pixels {
            out.extend(self.seeds.iter().map(|&seed| Coordinate {
                pixel,
                sample: samples[below(samples.len())],
                dimension: below(self.dimensions as usize) as u32,
                seed,
            }));
        }
        let [width, height] = self.size.map(|edge| edge as usize);
        while out.len() < WORDS {
            out.push(Coordinate {
                pixel: below(width * height) as u32,
                sample: below(self.samples as usize) as u32,
                dimension: below(self.dimensions as usize) as u32,
                seed: seed(below(self.seeds.len())).unwrap_or(0),
            });
        }
        out
    }
}

/// Compares the kernel's words with the twin's.
///
/// # Errors
/// Words differ: the first one and their number.
pub fn compare(sampler: &Sampler, at: &[Coordinate], words: &[u32]) -> Result<(), String> {
    let differs = |(at, word): &(&Coordinate, &u32)| sampler.sample_u32(**at) != **word;
    let mut wrong = at.iter().zip(words).filter(differs);
    let Some((at, word)) = wrong.next() else {
        return Ok(());
    };
    Err(format!(
        "{} of {} words of {}'s kernel are not those of its twin; first: {at:?}: kernel {word:#010x}, twin {:#010x}",
        1 + wrong.count(),
        words.len(),
        sampler.label(),
        sampler.sample_u32(*at)
    ))
}

fn composition(sampler: &Sampler) -> Composition {
    with_sampler(Composition::new("sampling/dump_stream"), sampler)
}

/// Hash of the `dump_stream` kernel.
///
/// # Errors
/// It does not compose or compile.
pub(crate) fn kernel_hash(gpu: &Gpu, sampler: &Sampler) -> Result<String, String> {
    let pipeline = gpu.pipeline(&composition(sampler), true);
    Ok(pipeline.map_err(|e| e.to_string())?.kernel.hash())
}

/// Compares the kernel's words with the twin's over a run's range, and both with what is known of them
/// ([`known_words`]); returns the number of the former.
///
/// # Errors
/// A word differs, numbers are alike that must not be, or the kernel does not run.
pub fn check_words(gpu: &Gpu, sampler: &Sampler, used: &Used) -> Result<usize, String> {
    let coordinates = used.coordinates();
    let words = dump_stream(gpu, sampler, &coordinates)?;
    compare(sampler, &coordinates, &words)?;
    if let Some((at, word)) = coordinates.last().zip(words.last())
        && compare(sampler, &[*at], &[word ^ 1]).is_ok()
    {
        return Err(format!(
            "the comparison of words is blind: the last bit of one of {} is turned, and not seen",
            sampler.label()
        ));
    }
    known_words::check(gpu, sampler, used)?;
    Ok(words.len())
}

/// The u32 of every coordinate, as computed by the kernel.
///
/// # Errors
/// A dimension beyond those of the sampler, or the kernel does not run.
pub fn dump_stream(
    gpu: &Gpu,
    sampler: &Sampler,
    coordinates: &[Coordinate],
) -> Result<Vec<u32>, String> {
    let highest = coordinates.iter().map(|c| c.dimension).max().unwrap_or(0);
    if highest >= sampler.demand.dimensions {
        return Err(format!(
            "dimension {highest} is asked for, {} was made for {}",
            sampler.label(),
            sampler.demand.dimensions
        ));
    }
    let words: Vec<[u32; 4]> = coordinates
        .iter()
        .map(|c| [c.pixel, c.sample, c.dimension, c.seed])
        .collect();
    let count = words.len() as u32;
    let played = gpu.evaluate(
        &composition(sampler),
        ("dump", UniformValues::new().u32("count", count)),
        &[
            ("coordinates", bytemuck::cast_slice(&words)),
            ("sampler_table", bytemuck::cast_slice(sampler.table.words())),
        ],
        &[("stream", u64::from(count) * 4)],
        groups_for(count),
    );
    let stream = played.and_then(|played| played.download("stream"));
    stream.map_err(|e| e.to_string())
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    fn used(samples: u32, dimensions: u32, size: [u32; 2], seeds: &[u32]) -> Used {
        Used {
            samples,
            dimensions,
            size,
            seeds: seeds.to_vec(),
        }
    }

    #[test]
    fn every_dimension_border_pixel_and_seed_is_among_the_coordinates() {
        let used = used(65_537, 122, [80, 60], &[1, 2, 3, 0xdead_beef]);
        let at = used.coordinates();
        assert!(at.len() >= WORDS && at.len() < 2 * WORDS, "{}", at.len());
        let pairs: BTreeSet<_> = at.iter().map(|c| (c.dimension, c.sample)).collect();
        for dimension in 0..122 {
            for sample in [0, 1, 255, 256, 257, 4095, 4096, 32_768, 65_535, 65_536] {
                assert!(pairs.contains(&(dimension, sample)), "{dimension} {sample}");
            }
        }
        let places: BTreeSet<_> = at.iter().map(|c| (c.pixel, c.seed)).collect();
        for pixel in [0, 1, 63, 64, 79, 80, 80 * 59, 80 * 60 - 1] {
            assert!(
                used.seeds.iter().all(|&s| places.contains(&(pixel, s))),
                "{pixel}"
            );
        }
        let inside = |c: &Coordinate| {
            c.pixel < 80 * 60
                && c.sample < 65_537
                && c.dimension < 122
                && used.seeds.contains(&c.seed)
        };
        assert!(at.iter().all(inside));
    }

    #[test]
    fn the_least_that_can_be_used_is_one_coordinate() {
        let at = used(1, 1, [1, 1], &[7]).coordinates();
        let only = Coordinate {
            pixel: 0,
            sample: 0,
            dimension: 0,
            seed: 7,
        };
        assert!(!at.is_empty() && at.iter().all(|c| *c == only));
    }
}
