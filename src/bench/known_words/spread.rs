//! Whether pixels, seeds and dimensions draw numbers of their own, whatever they are.

use crate::words::Used;
use raystone_core::params::ParamValue;
use raystone_sampling::{Coordinate, Sampler, Seeding};
use std::collections::BTreeMap;
use std::f64::consts::TAU;

/// Edge of the tile of pixels that are compared, and the fewest for which limits are meant.
const EDGE: u32 = 16;
const FEWEST: usize = 64;
/// Pixels and dimensions that tell two seeds apart.
const PIXELS: u32 = 8;
const DIMENSIONS: u32 = 4;
/// Limit of the mean of n turns e^(2πi (x − y)) of independent numbers, times √n: it exceeds r with
/// probability e^(−r²), here 10⁻¹³.
const MOST: f64 = 5.5;

/// Seeds whose numbers are looked at.
struct Seeds {
    /// Those of the run, those after them, and partners that differ in one bit: none may draw the same.
    all: Vec<u32>,
    /// The first one and partners, whose tiles are compared.
    of_tiles: Vec<u32>,
}

impl Seeds {
    fn new(used: &Used) -> Self {
        let partners = |seed: u32| {
            [
                seed,
                seed.wrapping_add(1),
                seed ^ 1,
                seed ^ 1 << 16,
                seed ^ 1 << 31,
            ]
        };
        let mut all: Vec<u32> = used.seeds.iter().flat_map(|&seed| partners(seed)).collect();
        all.sort_unstable();
        all.dedup();
        let first = used.seeds.first().copied().unwrap_or(0);
        let mut of_tiles = partners(first)[..3].to_vec();
        of_tiles.dedup();
        Self { all, of_tiles }
    }
}

/// Width and height of the tile.
fn tile(used: &Used) -> [u32; 2] {
    used.size.map(|edge| edge.clamp(1, EDGE))
}

/// The samples at which tiles are compared: the first one, which many sequences put into a corner, and the
/// last one.
fn samples(used: &Used) -> Vec<u32> {
    let mut samples = vec![0, used.samples.saturating_sub(1)];
    samples.dedup();
    samples
}

/// Whether every number of the sampler is uniform and independent of those of other pixels, seeds and
/// dimensions. Masks repeat, shared seeds are shared, and `trig` is the negative control.
fn is_independent(sampler: &Sampler) -> bool {
    let (sequence, decorrelation) = (&sampler.sequence, &sampler.decorrelation);
    let own = [sequence.seeding(), decorrelation.seeding()];
    let is_control =
        sampler.sequence_variant.params.0.get("hash") == Some(&ParamValue::Name("trig".to_owned()));
    (sequence.facts().random || decorrelation.is_unbiased())
        && own
            .iter()
            .all(|seeding| matches!(seeding, Seeding::PixelSample))
        && !decorrelation.by_width()
        && !is_control
}

/// The coordinates that [`fault`] looks at: tiles by seed, sample and dimension, then places of all seeds.
pub(super) fn coordinates(sampler: &Sampler, used: &Used) -> Vec<Coordinate> {
    let seeds = Seeds::new(used);
    let [width, height] = tile(used);
    let mut at = Vec::new();
    if is_independent(sampler) {
        for &seed in &seeds.of_tiles {
            for sample in samples(used) {
                for dimension in 0..used.dimensions {
                    for place in 0..width * height {
                        let pixel = place / width * used.size[0] + place % width;
                        at.push(Coordinate {
                            pixel,
                            sample,
                            dimension,
                            seed,
                        });
                    }
                }
            }
        }
    }
    if sampler.is_random() {
        at.extend(seeds.all.iter().flat_map(|&seed| places(used, seed)));
    }
    at
}

/// Places at which two seeds must not draw the same.
fn places(used: &Used, seed: u32) -> impl Iterator<Item = Coordinate> {
    let pixels = used.size[0] * used.size[1];
    let step = (pixels / PIXELS).max(1);
    let dimensions = used.dimensions.min(DIMENSIONS);
    (0..PIXELS.min(pixels)).flat_map(move |k| {
        (0..dimensions).map(move |dimension| Coordinate {
            pixel: k * step,
            sample: 0,
            dimension,
            seed,
        })
    })
}

/// A number as a point of the circle.
fn turn(word: u32) -> [f64; 2] {
    let (sin, cos) = (TAU * f64::from(word) * 2.0_f64.powi(-32)).sin_cos();
    [cos, sin]
}

/// Cosine of the difference of two numbers, on average over pairs; 0 where they are independent, 1 where they
/// are always the same apart.
fn likeness(pairs: impl Iterator<Item = ([f64; 2], [f64; 2])>) -> (f64, usize) {
    let mut sums = [0.0, 0.0];
    let mut n = 0;
    for ([a, b], [c, d]) in pairs {
        sums[0] += a * c + b * d;
        sums[1] += a * d - b * c;
        n += 1;
    }
    (sums[0].hypot(sums[1]) / n.max(1) as f64, n)
}

/// A fault if the numbers of pairs are more alike than chance explains.
fn alike(
    what: impl FnOnce() -> String,
    pairs: impl Iterator<Item = ([f64; 2], [f64; 2])>,
) -> Option<String> {
    let (found, n) = likeness(pairs);
    let most = MOST / (n.max(1) as f64).sqrt();
    (n >= FEWEST && found > most).then(|| {
        format!(
            "{} are alike: {found:.3} of {n} pairs, by chance at most {most:.3}",
            what()
        )
    })
}

/// The first fault of words drawn at [`coordinates`].
pub(super) fn fault(sampler: &Sampler, used: &Used, words: &[u32]) -> Option<String> {
    let seeds = Seeds::new(used);
    let [width, height] = tile(used).map(|edge| edge as usize);
    let pixels = width * height;
    let samples = samples(used);
    let (mut tiles, mut rest): (Vec<&[u32]>, &[u32]) = (Vec::new(), words);
    if is_independent(sampler) {
        let (of_tiles, others) = words
            .split_at(seeds.of_tiles.len() * samples.len() * used.dimensions as usize * pixels);
        rest = others;
        tiles = of_tiles.chunks_exact(pixels).collect();
    }
    let turns: Vec<Vec<[f64; 2]>> = tiles
        .iter()
        .map(|tile| tile.iter().map(|&word| turn(word)).collect())
        .collect();
    let per_seed = samples.len() * used.dimensions as usize;
    let of_first = &turns[..per_seed.min(turns.len())];
    for (place, tile) in of_first.iter().enumerate() {
        let (sample, dimension) = (
            place / used.dimensions as usize,
            place % used.dimensions as usize,
        );
        let where_ = || format!("in dimension {dimension} of sample {}", samples[sample]);
        let found = of_neighbours(tile, width).map(|fault| format!("{fault}, {}", where_()));
        let found = found.or_else(|| {
            (1..seeds.of_tiles.len()).find_map(|k| {
                let pairs = tile
                    .iter()
                    .copied()
                    .zip(turns[k * per_seed + place].iter().copied());
                let [a, b] = [0, k].map(|k| seeds.of_tiles[k]);
                alike(|| format!("seeds {a} and {b} {}", where_()), pairs)
            })
        });
        let found = found.or_else(|| {
            let later = dimension + 1..used.dimensions as usize;
            later.into_iter().find_map(|other| {
                let others = &of_first[place - dimension + other];
                let pairs = tile.iter().copied().zip(others.iter().copied());
                let sample = samples[sample];
                alike(
                    || format!("dimensions {dimension} and {other} of sample {sample}"),
                    pairs,
                )
            })
        });
        if found.is_some() {
            return found;
        }
    }
    same_seeds(sampler, used, &seeds.all, rest)
}

/// Neighbours along x, along y and on both diagonals.
fn of_neighbours(tile: &[[f64; 2]], width: usize) -> Option<String> {
    for (name, dx, dy) in [
        ("rows", 1, 0),
        ("columns", 0, 1),
        ("diagonals", 1, 1),
        ("diagonals", -1, 1),
    ] {
        let pairs = (0..tile.len()).filter_map(|i| {
            let x = (i % width).checked_add_signed(dx).filter(|&x| x < width)?;
            Some((tile[i], *tile.get((i / width + dy) * width + x)?))
        });
        if let Some(fault) = alike(|| format!("neighbours in {name}"), pairs) {
            return Some(fault);
        }
    }
    None
}

/// Two seeds that draw the same.
fn same_seeds(sampler: &Sampler, used: &Used, seeds: &[u32], words: &[u32]) -> Option<String> {
    let first = *seeds.first()?;
    let count = places(used, first).count();
    if !sampler.is_random() || count == 0 {
        return None;
    }
    let mut known = BTreeMap::new();
    for (seed, drawn) in seeds.iter().zip(words.chunks_exact(count)) {
        if let Some(other) = known.insert(drawn, seed) {
            return Some(format!("seeds {other} and {seed} draw the same numbers"));
        }
    }
    None
}
