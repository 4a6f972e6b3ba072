//! A blue-noise dither mask.
//!
//! Source: R. Ulichney, "The void-and-cluster method for dither array generation", SPIE 1913, 1993,
//! with a Gaussian of σ = 1.5 on the torus. Weights are integers, so that sums do not depend on the
//! order and masks not on the machine.

use super::hash::pcg_hash;
use std::sync::OnceLock;

pub(super) const SIZE: usize = 64;
const PIXELS: usize = SIZE * SIZE;
const SIGMA: f64 = 1.5;
const FIRST: usize = PIXELS / 10;

/// The set pixels, and the blurred pattern.
#[derive(Clone)]
struct Pattern {
    set: Vec<bool>,
    energy: Vec<u64>,
    weights: Vec<u64>,
}

impl Pattern {
    fn new() -> Self {
        let distance = |i: usize| i.min(SIZE - i) as f64;
        let weight = |i: usize| {
            let squared = distance(i % SIZE).powi(2) + distance(i / SIZE).powi(2);
            ((-squared / (2.0 * SIGMA * SIGMA)).exp() * 1e9).round() as u64
        };
        Self {
            set: vec![false; PIXELS],
            energy: vec![0; PIXELS],
            weights: (0..PIXELS).map(weight).collect(),
        }
    }

    fn flip(&mut self, pixel: usize) {
        self.set[pixel] = !self.set[pixel];
        let (x, y) = (pixel % SIZE, pixel / SIZE);
        for (i, energy) in self.energy.iter_mut().enumerate() {
            let dx = (i % SIZE + SIZE - x) % SIZE;
            let dy = (i / SIZE + SIZE - y) % SIZE;
            let weight = self.weights[dy * SIZE + dx];
            *energy = if self.set[pixel] {
                *energy + weight
            } else {
                *energy - weight
            };
        }
    }

    /// The set pixel with the most set pixels around it; the first of several.
    fn cluster(&self) -> usize {
        let set = (0..PIXELS).filter(|&i| self.set[i]);
        set.max_by_key(|&i| (self.energy[i], std::cmp::Reverse(i)))
            .unwrap_or(0)
    }

    /// The empty pixel with the fewest set pixels around it; the first of several.
    fn void(&self) -> usize {
        let empty = (0..PIXELS).filter(|&i| !self.set[i]);
        empty.min_by_key(|&i| (self.energy[i], i)).unwrap_or(0)
    }
}

/// Moves of clusters into voids, at most: each makes the pattern more even, and some hundred suffice. Weights that are not those of a
/// torus may never settle.
const MOVES: usize = PIXELS;

/// A random pattern, with clusters moved into voids until nothing changes.
fn first_pattern() -> Pattern {
    let mut pattern = Pattern::new();
    let mut pixels = (0..).map(|i| pcg_hash(i) as usize % PIXELS);
    for _ in 0..FIRST {
        let free = pixels.by_ref().find(|&pixel| !pattern.set[pixel]);
        free.into_iter().for_each(|pixel| pattern.flip(pixel));
    }
    for _ in 0..MOVES {
        let cluster = pattern.cluster();
        pattern.flip(cluster);
        let void = pattern.void();
        pattern.flip(void);
        if cluster == void {
            break;
        }
    }
    pattern
}

fn generate() -> Vec<u32> {
    let first = first_pattern();
    let mut ranks = vec![0; PIXELS];
    let mut pattern = first.clone();
    for rank in (0..FIRST).rev() {
        let cluster = pattern.cluster();
        pattern.flip(cluster);
        ranks[cluster] = rank as u32;
    }
    let mut pattern = first;
    for rank in FIRST..PIXELS {
        let void = pattern.void();
        pattern.flip(void);
        ranks[void] = rank as u32;
    }
    ranks
}

/// The rank 0 … SIZE² − 1 of each pixel, row by row; generated once per process.
pub(super) fn ranks() -> &'static [u32] {
    static RANKS: OnceLock<Vec<u32>> = OnceLock::new();
    RANKS.get_or_init(generate)
}
