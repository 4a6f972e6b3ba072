//! Distributed rays in the place of a cone: their picture without noise, errors of samplers, and the samples at which
//! these are as good as the cone.

use crate::rays::Lens;
use glam::DVec3;
use rayon::prelude::*;
use raystone_core::random::Pcg32;
use raystone_sampling::{Coordinate, Sampler, to_unit};

/// Numbers that choose a ray.
pub const DIMENSIONS: u32 = 4;
/// The samples at which errors are known: powers of two.
pub const POWERS: usize = 9;
/// Most of them.
pub const MOST: u32 = 1 << (POWERS - 1);

/// A picture twice, from samples that have nothing in common, so that squares of errors have no noise of their own.
#[derive(Debug, Clone)]
pub struct Truth {
    halves: [Vec<DVec3>; 2],
}

/// The number of which 1/g, 1/g², 1/g³, 1/g⁴ fill four dimensions evenly: g⁵ = g + 1 (Roberts 2018).
const GOLDEN: f64 = 1.167_303_978_261_418_7;

impl Truth {
    /// Half of `samples` each, a lattice with its own shift for each pixel.
    pub fn new(lens: &Lens, pixels: u32, samples: u32, seed: u64) -> Self {
        let step = [1, 2, 3, 4].map(|k| GOLDEN.powi(-k));
        let half = |which: u64| {
            let each = (0..pixels).into_par_iter().map(|pixel| {
                let mut random = Pcg32::with_stream(seed, 2 * u64::from(pixel) + which);
                let shift = [(); 4].map(|()| random.uniform());
                let count = samples / 2;
                let sum = (0..count).map(|k| {
                    let at = |d: usize| (shift[d] + f64::from(k) * step[d]).fract();
                    lens.sample(pixel, [at(0), at(1), at(2), at(3)])
                });
                sum.sum::<DVec3>() / f64::from(count)
            });
            each.collect()
        };
        Self {
            halves: [half(0), half(1)],
        }
    }

    /// The picture.
    pub fn mean(&self) -> Vec<DVec3> {
        let [a, b] = &self.halves;
        a.iter().zip(b).map(|(a, b)| (*a + *b) * 0.5).collect()
    }

    /// The square of a pixel's error, mean of its channels; its expectation is that against the true picture.
    pub fn square(&self, pixel: usize, value: DVec3) -> f64 {
        let [a, b] = &self.halves;
        (value - a[pixel]).dot(value - b[pixel]) / 3.0
    }

    /// The mean square of a picture's error.
    pub fn error(&self, picture: &[DVec3]) -> f64 {
        let each = picture
            .iter()
            .enumerate()
            .map(|(k, value)| self.square(k, *value));
        each.sum::<f64>() / picture.len() as f64
    }

    /// The mean square of the error of one half, from the difference of both.
    pub fn noise(&self) -> f64 {
        let [a, b] = &self.halves;
        let each = a
            .iter()
            .zip(b)
            .map(|(a, b)| (*a - *b).length_squared() / 6.0);
        each.sum::<f64>() / a.len() as f64
    }
}

/// What a sampler's pixels are after each power of two, and after as many samples as a footprint asks for.
pub struct Sampled {
    /// Pictures, each after twice the samples of the one before.
    pub powers: Vec<Vec<DVec3>>,
    /// The picture with a number of samples of its own for each pixel.
    pub adaptive: Option<Vec<DVec3>>,
}

/// Draws rays of a pixel.
fn draw(lens: &Lens, sampler: &Sampler, pixel: u32, sample: u32, seed: u32) -> DVec3 {
    let u = [0, 1, 2, 3].map(|dimension| {
        f64::from(to_unit(sampler.sample_u32(Coordinate {
            pixel,
            sample,
            dimension,
            seed,
        })))
    });
    lens.sample(pixel, u)
}

/// Pictures by a sampler. `samplers` has one for each power where points depend on their number, or a single one.
/// `budget` has samples of each pixel, at most [`MOST`].
pub fn sampled(
    lens: &Lens,
    samplers: &[Sampler],
    pixels: u32,
    seed: u32,
    budget: Option<&[u32]>,
) -> Sampled {
    let each = (0..pixels).into_par_iter().map(|pixel| {
        let mut sums = [DVec3::ZERO; POWERS];
        let mut own = DVec3::ZERO;
        if let [sampler] = samplers {
            let mut sum = DVec3::ZERO;
            for sample in 0..MOST {
                sum += draw(lens, sampler, pixel, sample, seed);
                let count = sample + 1;
                if count.is_power_of_two() {
                    sums[count.trailing_zeros() as usize] = sum / f64::from(count);
                }
                if budget.is_some_and(|budget| budget[pixel as usize] == count) {
                    own = sum / f64::from(count);
                }
            }
        } else {
            for (k, sampler) in samplers.iter().enumerate() {
                let count = 1_u32 << k;
                let all = (0..count).map(|sample| draw(lens, sampler, pixel, sample, seed));
                sums[k] = all.sum::<DVec3>() / f64::from(count);
            }
        }
        (sums, own)
    });
    let all: Vec<([DVec3; POWERS], DVec3)> = each.collect();
    let is_adaptive = budget.is_some() && samplers.len() == 1;
    Sampled {
        powers: (0..POWERS)
            .map(|k| all.iter().map(|pixel| pixel.0[k]).collect())
            .collect(),
        adaptive: is_adaptive.then(|| all.iter().map(|pixel| pixel.1).collect()),
    }
}

/// Samples of each pixel in proportion to a weight: at least one, at most [`MOST`], `mean` on average.
pub fn budget(weights: &[f64], mean: u32) -> Vec<u32> {
    let total = f64::from(mean) * weights.len() as f64;
    let sum_of = |scale: f64| {
        weights
            .iter()
            .map(|w| (w * scale).clamp(1.0, f64::from(MOST)))
            .sum::<f64>()
    };
    // The scale at which bounded samples are as many as there are to spend.
    let (mut low, mut high) = (0.0, 1.0);
    while sum_of(high) < total && high < 1e12 {
        high *= 2.0;
    }
    for _ in 0..100 {
        let middle = 0.5 * (low + high);
        if sum_of(middle) < total {
            low = middle;
        } else {
            high = middle;
        }
    }
    let mut carried = 0.0;
    let each = weights.iter().map(|w| {
        let wanted = (w * high).clamp(1.0, f64::from(MOST)) + carried;
        let samples = wanted.round().clamp(1.0, f64::from(MOST));
        carried = wanted - samples;
        samples as u32
    });
    each.collect()
}

/// When a sampler is as good as a cone.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Crossing {
    /// With so many samples, between powers of two on a line of logarithms.
    At(f64),
    /// With more than all.
    Beyond,
}

/// Where errors (mean squares, after 1, 2, 4, … samples) fall to a floor for good.
pub fn crossing(errors: &[f64], floor: f64) -> Crossing {
    let Some(last) = errors.iter().rposition(|error| *error > floor) else {
        return Crossing::At(1.0);
    };
    let Some(below) = errors.get(last + 1) else {
        return Crossing::Beyond;
    };
    // Below what the reference resolves an error may be no positive number.
    let (above, below) = (errors[last].ln(), below.max(1e-3 * floor).ln());
    let part = (above - floor.ln()) / (above - below);
    Crossing::At((last as f64 + part).exp2())
}
