//! Tests if two renderers have made the same image.

use raystone::image::{Image, luminance};
use raystone::measure::hypothesis::student_t_two_sided;

pub struct Replicates(pub Vec<Image>);

/// Mean luminances with the variances of these means, and the number of replicates.
pub struct Moments {
    pub mean: Vec<f64>,
    pub variance: Vec<f64>,
    pub replicates: usize,
}

impl Replicates {
    pub fn moments(&self) -> Moments {
        let n = self.0.len() as f64;
        let pixels = self.0[0].pixels.len();
        let values = |i: usize| self.0.iter().map(move |image| luminance(&image.pixels[i]));
        let mean: Vec<f64> = (0..pixels).map(|i| values(i).sum::<f64>() / n).collect();
        let spread = |i: usize| {
            let squares: f64 = values(i).map(|v| (v - mean[i]).powi(2)).sum();
            squares / (n - 1.0) / n
        };
        Moments {
            variance: (0..pixels).map(spread).collect(),
            mean,
            replicates: self.0.len(),
        }
    }
}

impl Replicates {
    /// [`Self`] averaged over tiles of `edge` × `edge` pixels.
    pub fn tiled(&self, edge: u32) -> Self {
        let tiled = |image: &Image| {
            let [width, height] = [image.width, image.height].map(|n| n / edge);
            let mean = |tile: u32| {
                let (x, y) = (tile % width * edge, tile / width * edge);
                let places = (0..edge * edge).map(|k| (y + k / edge) * image.width + x + k % edge);
                let mut sum = [0.0; 3];
                for pixel in places.map(|at| image.pixels[at as usize]) {
                    sum = [0, 1, 2].map(|c| sum[c] + pixel[c] / (edge * edge) as f32);
                }
                sum
            };
            let tiles = (0..width * height).map(mean).collect();
            Image::new(width, height, tiles).expect("whole tiles")
        };
        Self(self.0.iter().map(tiled).collect())
    }
}

impl Moments {
    /// Averages over tiles of pixels with independent noise.
    pub fn tiled(&self, width: usize, edge: usize) -> Self {
        let across = width / edge;
        let tiles = across * (self.mean.len() / width / edge);
        let over = |values: &[f64], tile: usize| -> f64 {
            let first = tile / across * edge * width + tile % across * edge;
            let places = (0..edge * edge).map(|k| first + k / edge * width + k % edge);
            places.map(|at| values[at]).sum::<f64>() / (edge * edge) as f64
        };
        let mean = (0..tiles).map(|tile| over(&self.mean, tile)).collect();
        let share = (edge * edge) as f64;
        let variance = (0..tiles).map(|tile| over(&self.variance, tile) / share);
        Self {
            mean,
            variance: variance.collect(),
            replicates: self.replicates,
        }
    }

    pub fn total(&self) -> f64 {
        self.mean.iter().sum::<f64>() / self.mean.len() as f64
    }

    /// The share of pixels whose difference Welch's test accepts at the joint Šidák level `alpha`.
    pub fn accepted(&self, other: &Self, alpha: f64) -> f64 {
        let level = 1.0 - (1.0 - alpha).powf(1.0 / self.mean.len() as f64);
        let accepted = (0..self.mean.len()).filter(|&i| self.p(other, i) >= level);
        accepted.count() as f64 / self.mean.len() as f64
    }

    fn p(&self, other: &Self, i: usize) -> f64 {
        let (a, b) = (self.variance[i], other.variance[i]);
        let difference = (self.mean[i] - other.mean[i]).abs();
        // Rounding of f32 sums, in pixels that are the same in every replicate.
        let rounding = 1e-5 * self.mean[i].abs().max(other.mean[i].abs());
        if difference <= rounding {
            return 1.0;
        }
        let freedom = |n: usize| n as f64 - 1.0;
        let parts = a * a / freedom(self.replicates) + b * b / freedom(other.replicates);
        if parts == 0.0 {
            return 0.0;
        }
        student_t_two_sided(difference / (a + b).sqrt(), (a + b).powi(2) / parts)
    }
}
