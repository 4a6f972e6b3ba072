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

/// The point of a lattice that is shifted.
fn on_lattice(k: u32, shift: [f64; 4]) -> [f64; 4] {
    std::array::from_fn(|d| (shift[d] + f64::from(k) * GOLDEN.powi(-1 - d as i32)).fract())
}

/// Rays that tell whether a pixel is at a silhouette, and how much farther than the next of them one is there.
const PROBES: u32 = 64;
const GAP: f64 = 1.1;

/// Which pixels are at a silhouette: of their rays, in order of distance, two neighbours end at distances that differ by
/// more than a tenth.
pub fn silhouettes(lens: &Lens, pixels: u32) -> Vec<bool> {
    let is_edge = |pixel: u32| {
        let ends = (0..PROBES).map(|k| {
            let hit = lens.hit(pixel, on_lattice(k, [0.5; 4]));
            hit.map_or(f64::INFINITY, |hit| hit.0)
        });
        let mut ends: Vec<f64> = ends.collect();
        ends.sort_by(f64::total_cmp);
        ends.windows(2).any(|pair| pair[1] > GAP * pair[0])
    };
    (0..pixels).into_par_iter().map(is_edge).collect()
}

/// The variance over frames of a pixel's error, mean of channels and pixels; its expectation is that against true pictures.
/// Each frame has its reference and its picture.
pub fn shimmer(frames: &[(&Truth, Vec<DVec3>)]) -> f64 {
    let [(_, first), ..] = frames else {
        return 0.0;
    };
    let count = frames.len() as f64;
    let of_pixel = |pixel: usize| {
        let errors = |half: usize| {
            let each = frames.iter();
            let each = each.map(|(truth, picture)| picture[pixel] - truth.halves[half][pixel]);
            let each: Vec<DVec3> = each.collect();
            let mean = each.iter().sum::<DVec3>() / count;
            each.into_iter().map(move |error| error - mean)
        };
        let products = errors(0).zip(errors(1)).map(|(a, b)| a.dot(b) / 3.0);
        products.sum::<f64>() / (count - 1.0)
    };
    (0..first.len()).map(of_pixel).sum::<f64>() / first.len() as f64
}

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
        let half = |which: u64| {
            let each = (0..pixels).into_par_iter().map(|pixel| {
                let mut random = Pcg32::with_stream(seed, 2 * u64::from(pixel) + which);
                let shift = [(); 4].map(|()| random.uniform());
                let count = samples / 2;
                let sum = (0..count).map(|k| lens.sample(pixel, on_lattice(k, shift)));
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
        self.error_where(picture, |_| true)
    }

    /// That of some pixels; NaN if there are none.
    pub fn error_where(&self, picture: &[DVec3], counts: impl Fn(usize) -> bool) -> f64 {
        let counted = (0..picture.len()).filter(|pixel| counts(*pixel));
        let (sum, count) = counted.fold((0.0, 0.0), |(sum, count), pixel| {
            (sum + self.square(pixel, picture[pixel]), count + 1.0)
        });
        sum / count
    }

    /// The mean square of the error of one half, from the difference of both.
    pub fn noise(&self) -> f64 {
        self.noise_where(|_| true)
    }

    /// That of some pixels; NaN if there are none.
    pub fn noise_where(&self, counts: impl Fn(usize) -> bool) -> f64 {
        let [a, b] = &self.halves;
        let counted = (0..a.len()).filter(|pixel| counts(*pixel));
        let (sum, count) = counted.fold((0.0, 0.0), |(sum, count), pixel| {
            (
                sum + (a[pixel] - b[pixel]).length_squared() / 6.0,
                count + 1.0,
            )
        });
        sum / count
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn noise_of_the_reference_cancels_in_what_changes() {
        let truth = |half: f64, other: f64| Truth {
            halves: [vec![DVec3::splat(half)], vec![DVec3::splat(other)]],
        };
        let picture = || vec![DVec3::ONE];
        let frames = [truth(0.0, 0.0), truth(0.2, -0.2)];
        let frames = frames.each_ref().map(|truth| (truth, picture()));
        // About their means the errors are 0.1, -0.1 by one half and -0.1, 0.1 by the other.
        let found = shimmer(&frames);
        assert!((found + 0.02).abs() < 1e-12, "{found}");
    }
}
