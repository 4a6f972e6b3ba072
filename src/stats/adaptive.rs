//! Two-stage choice of the samples per tile for a requested error (C. Stein, "A two-sample test for
//! a linear hypothesis whose power is independent of the variance", 1945).
//!
//! Stopping where an estimate looks good is biased: an image without its fireflies is too dark,
//! with little variance. Here the replicates form two groups. The first samples of each group
//! determine, once and per tile, how many the *other* group takes. A group's samples are
//! independent of their number, so means of its images, or of both groups, are unbiased.

use crate::comparison::LogFigure;
use crate::metrics::RELATIVE_EPSILON;
use raystone_image::Image;

/// Minimum number of replicates in a group to estimate their spread.
pub const LEAST_GROUP: usize = 4;

/// Square tiles of an image, cropped at the right and lower edges.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Tiles {
    /// Width and height of the image, pixels.
    pub size: [u32; 2],
    /// Edge of a tile, pixels.
    pub edge: u32,
}

impl Tiles {
    /// Number of columns and rows of tiles.
    pub fn counts(self) -> [u32; 2] {
        self.size.map(|pixels| pixels.div_ceil(self.edge))
    }

    /// Number of tiles.
    pub fn len(self) -> usize {
        let [columns, rows] = self.counts();
        columns as usize * rows as usize
    }

    /// True if there are no tiles.
    pub fn is_empty(self) -> bool {
        self.len() == 0
    }

    /// Index of the tile that contains a pixel index.
    pub fn of_pixel(self, pixel: usize) -> usize {
        let (width, edge) = (self.size[0] as usize, self.edge as usize);
        let [x, y] = [pixel % width, pixel / width].map(|at| at / edge);
        y * self.counts()[0] as usize + x
    }

    /// Pixel indices of a tile.
    pub fn pixels(self, tile: usize) -> Vec<usize> {
        let [width, height] = self.size.map(|edge| edge as usize);
        let (columns, edge) = (self.counts()[0] as usize, self.edge as usize);
        let [left, top] = [tile % columns, tile / columns].map(|at| at * edge);
        let rows = top..height.min(top + edge);
        let row = |y: usize| (left..width.min(left + edge)).map(move |x| y * width + x);
        rows.flat_map(row).collect()
    }
}

/// relMSE of a tile of one replicate, estimated without a reference from the differences between
/// replicates: the mean over pixels and channels of variance / (mean² + 0.01). A jackknife over the
/// replicates gives its uncertainty. Noise in the denominator biases it upwards, by 4 · variance /
/// (n · mean²) to first order: on the safe side. `None` below [`LEAST_GROUP`] images, or if a value
/// is not finite.
pub fn tile_error(images: &[&Image], pixels: &[usize]) -> Option<LogFigure> {
    if images.len() < LEAST_GROUP {
        return None;
    }
    let without = |left_out: usize| {
        let kept = (images.iter().enumerate()).filter(|(i, _)| *i != left_out);
        let kept: Vec<&Image> = kept.map(|(_, image)| *image).collect();
        relative_variance(&kept, pixels).ln()
    };
    let by_replicate = (0..images.len()).map(without).collect();
    LogFigure::new(without(usize::MAX), &[by_replicate], Vec::new())
}

fn relative_variance(images: &[&Image], pixels: &[usize]) -> f64 {
    let n = images.len() as f64;
    let of = |pixel: usize, channel: usize| {
        let values = || {
            images
                .iter()
                .map(|image| f64::from(image.pixels[pixel][channel]))
        };
        let mean = values().sum::<f64>() / n;
        let variance = values().map(|value| (value - mean).powi(2)).sum::<f64>() / (n - 1.0);
        // The square of a noisy mean is too large by the noise.
        let square = (mean * mean - variance / n).max(0.0);
        variance / (square + RELATIVE_EPSILON)
    };
    let all = pixels.iter().flat_map(|p| (0..3).map(move |c| of(*p, c)));
    all.sum::<f64>() / (3 * pixels.len()).max(1) as f64
}

/// Samples that a tile needs: the smallest of `counts` (ascending) for which its relMSE is below
/// `target` with this confidence, assuming it falls as 1/samples from `error` at the first count.
/// The largest if none suffices or nothing is known. Good samplers need fewer.
pub fn samples_needed(
    error: Option<&LogFigure>,
    counts: &[u32],
    target: f64,
    confidence: f64,
) -> u32 {
    let (first, most) = (counts.first(), counts.last());
    let Some(((error, first), most)) = error.zip(first).zip(most) else {
        return most.copied().unwrap_or(0);
    };
    // One side of the interval, so twice its error probability.
    let worst = error.upper(2.0 * (1.0 - confidence));
    let is_enough = |count: &&u32| worst * f64::from(*first) / f64::from(**count) <= target;
    counts.iter().find(is_enough).copied().unwrap_or(*most)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    fn image(size: [u32; 2], pixel: impl FnMut(usize) -> [f32; 3]) -> Image {
        let pixels = (0..(size[0] * size[1]) as usize).map(pixel).collect();
        Image {
            width: size[0],
            height: size[1],
            pixels,
        }
    }

    #[test]
    fn every_pixel_is_in_one_tile() {
        let tiles = Tiles {
            size: [37, 20],
            edge: 16,
        };
        assert_eq!((tiles.counts(), tiles.len()), ([3, 2], 6));
        let mut seen = vec![0; 37 * 20];
        for tile in 0..tiles.len() {
            for pixel in tiles.pixels(tile) {
                assert_eq!(tiles.of_pixel(pixel), tile);
                seen[pixel] += 1;
            }
        }
        assert!(seen.iter().all(|count| *count == 1));
    }

    /// Images of mean 1 with uniform noise of this relative variance.
    fn noisy(rng: &mut Pcg32, variance: f64, count: usize) -> Vec<Image> {
        let half = (3.0 * variance).sqrt();
        let mut value = || (1.0 + half * (2.0 * rng.uniform() - 1.0)) as f32;
        (0..count)
            .map(|_| image([8, 8], |_| [value(), value(), value()]))
            .collect()
    }

    #[test]
    fn the_error_of_a_tile_is_its_variance_and_the_confidence_holds() {
        let mut rng = Pcg32::new(3);
        let pixels: Vec<usize> = (0..64).collect();
        let (mut sum, mut too_low) = (0.0, 0);
        // Low noise, so that the mean of the quotient is at most 0.1 % too high.
        let variance = 0.0025;
        let truth = variance / (1.0 + RELATIVE_EPSILON);
        for _ in 0..400 {
            let images = noisy(&mut rng, variance, 8);
            let images: Vec<&Image> = images.iter().collect();
            let error = tile_error(&images, &pixels).expect("eight images");
            sum += error.log.exp();
            too_low += usize::from(error.upper(0.1) < truth);
        }
        assert!((sum / 400.0 / truth - 1.0).abs() < 0.01, "{}", sum / 400.0);
        // 5 % may lie below: 20 of 400, within four standard deviations.
        assert!((3..=38).contains(&too_low), "{too_low}");
    }

    #[test]
    fn the_square_of_a_noisy_mean_is_not_taken_for_that_of_the_true_mean() {
        // Of 0, 0, 2 and 2 the mean is 1 and the variance 4/3; the square of the mean is 4/3 / 4 too great on average.
        let images = [0.0, 0.0, 2.0, 2.0].map(|value| image([1, 1], |_| [value; 3]));
        let images: Vec<&Image> = images.iter().collect();
        let found = tile_error(&images, &[0]).expect("four images").log.exp();
        let expected = 4.0 / 3.0 / (2.0 / 3.0 + RELATIVE_EPSILON);
        assert!((found / expected - 1.0).abs() < 1e-9, "{found}");
    }

    #[test]
    fn a_tile_takes_the_fewest_samples_that_are_enough() {
        let exact = LogFigure::exact;
        let counts = [4, 8, 16, 32];
        let needed = |error| samples_needed(Some(&exact(error)), &counts, 0.01, 0.95);
        assert_eq!(
            [0.009, 0.019, 0.039, 0.041, 5.0].map(needed),
            [4, 8, 16, 32, 32]
        );
        assert_eq!(needed(0.0), 4);
        assert_eq!(samples_needed(None, &counts, 0.01, 0.95), 32);
        let few = noisy(&mut Pcg32::new(1), 0.1, LEAST_GROUP - 1);
        assert!(tile_error(&few.iter().collect::<Vec<_>>(), &[0, 1]).is_none());
    }
}
