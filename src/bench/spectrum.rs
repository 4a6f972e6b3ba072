//! Structure of an image's error beyond its size: its distribution over spatial frequencies, and
//! the error after blurring. Decorrelation changes these but not the RMSE.
//!
//! The error is signed luminance, image minus reference. Over replicates, the spectra of single
//! images form an ensemble, whose outliers show what a mean hides (fireflies raise all frequencies
//! of a few images). Sources: Celarek, Jakob, Wimmer & Lehtinen, "Quantifying the error of light
//! transport algorithms", EGSR 2019 (the error spectrum ensemble); Georgiev & Fajardo 2016 and the
//! filter curves of OpenQMC (error after a Gaussian).

use raystone_image::{Image, ImageError, luminance};
use raystone_record::{FilteredError, OUTLIER_QUANTILES, PowerAt};
use raystone_stats::statistics::mean_interval;
use std::f64::consts::TAU;

/// Standard deviations of the Gaussian filters, pixels; 0 is no filter.
pub(crate) const SIGMAS: [f64; 6] = [0.0, 0.5, 1.0, 2.0, 4.0, 8.0];
/// Upper limit of low frequencies, cycles per pixel: waves of eight pixels and longer.
pub(crate) const LOW_FREQUENCY: f64 = 0.125;
/// Maximum points of a radial spectrum.
const MOST_RINGS: usize = 48;
/// A variance below this fraction of the squared mean is rounding: the error is constant.
const CONSTANT: f64 = 1e-20;

/// The error of one image in space and frequency.
#[derive(Debug, Clone, PartialEq)]
pub struct ErrorSpectrum {
    /// `(frequency, power)` by increasing frequency, cycles per pixel up to 1/2: mean over a ring,
    /// relative to the mean over all frequencies but 0, so that white noise has power 1 everywhere.
    /// Empty for a constant error.
    pub power: Vec<(f64, f64)>,
    /// Variance of the error over the pixels: the unit of `power`.
    pub variance: f64,
    /// Mean power up to `LOW_FREQUENCY`; white noise has 1.
    pub low_frequency: Option<f64>,
    /// Maximum power of any frequency but 0; n pixels of white noise have about ln(n/2) + 0.58.
    /// Repetition and uniformity raise it.
    pub loudest: Option<f64>,
    /// Correlation with the error of the pixel to the right or below, −1 to 1; 0 for white noise.
    pub autocorrelation: Option<f64>,
    /// Root mean square error, with the mean, after a Gaussian filter of each of `SIGMAS`.
    pub filtered: Vec<f64>,
}

/// Analyses the signed luminance error of every pixel.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub(crate) fn spectrum_of(image: &Image, reference: &Image) -> Result<ErrorSpectrum, ImageError> {
    reference.check_size(image, "the image of an error spectrum")?;
    let pairs = image.pixels.iter().zip(&reference.pixels);
    let error: Vec<f64> = pairs.map(|(a, b)| luminance(a) - luminance(b)).collect();
    let size = [image.width, image.height].map(|edge| edge as usize);
    Ok(error_spectrum(&error, size))
}

/// Analyses errors of `width * height` pixels, row by row.
///
/// # Panics
/// If the number of errors does not match, or is 0.
pub fn error_spectrum(error: &[f64], [width, height]: [usize; 2]) -> ErrorSpectrum {
    assert!(error.len() == width * height && !error.is_empty());
    let n = error.len() as f64;
    let mean = error.iter().sum::<f64>() / n;
    let rest: Vec<f64> = error.iter().map(|e| e - mean).collect();
    let squares: f64 = rest.iter().map(|e| e * e).sum();
    let filtered = SIGMAS.map(|sigma| root_mean_square(&gaussian(error, width, sigma)));
    let mut found = ErrorSpectrum {
        power: Vec::new(),
        variance: squares / n,
        low_frequency: None,
        loudest: None,
        autocorrelation: None,
        filtered: filtered.to_vec(),
    };
    if squares <= CONSTANT * n * mean * mean || squares == 0.0 {
        return found;
    }
    // Parseval: the powers of all frequencies but 0 have the mean 1.
    let scale = (n - 1.0) / (n * squares);
    let mut rings = Rings::new(width.min(height));
    let mut loudest = 0.0_f64;
    for (index, value) in fourier(&rest, width).iter().enumerate().skip(1) {
        let cycles = |k: usize, size: usize| k.min(size - k) as f64 / size as f64;
        let frequency = cycles(index % width, width).hypot(cycles(index / width, height));
        let [re, im] = value;
        let power = (re * re + im * im) * scale;
        rings.add(frequency, power);
        loudest = loudest.max(power);
    }
    found.loudest = Some(loudest);
    found.power = rings.means();
    found.low_frequency = (rings.low[1] > 0.0).then(|| rings.low[0] / rings.low[1]);
    found.autocorrelation = autocorrelation(&rest, width, squares / n);
    found
}

struct Rings {
    /// Sums of frequency and power, and counts.
    sums: Vec<[f64; 3]>,
    /// Sum and count up to [`LOW_FREQUENCY`].
    low: [f64; 2],
}

impl Rings {
    /// Rings at least as wide as the coarser frequency spacing.
    fn new(shorter_edge: usize) -> Self {
        let count = (shorter_edge / 2).clamp(1, MOST_RINGS);
        Self {
            sums: vec![[0.0; 3]; count],
            low: [0.0; 2],
        }
    }

    fn add(&mut self, frequency: f64, power: f64) {
        let ring = (frequency * 2.0 * self.sums.len() as f64) as usize;
        if let Some(sums) = self.sums.get_mut(ring) {
            *sums = [sums[0] + frequency, sums[1] + power, sums[2] + 1.0];
        }
        if frequency <= LOW_FREQUENCY {
            self.low = [self.low[0] + power, self.low[1] + 1.0];
        }
    }

    fn means(&self) -> Vec<(f64, f64)> {
        let filled = self.sums.iter().filter(|sums| sums[2] > 0.0);
        filled.map(|s| (s[0] / s[2], s[1] / s[2])).collect()
    }
}

type Complex = [f64; 2];

fn product([a, b]: Complex, [c, d]: Complex) -> Complex {
    [a * c - b * d, a * d + b * c]
}

/// Unscaled 2D discrete Fourier transform.
fn fourier(values: &[f64], width: usize) -> Vec<Complex> {
    let height = values.len() / width;
    let lines = |values: Vec<Complex>, length: usize| -> Vec<Complex> {
        let roots = roots_of_one(length);
        let line = |line| transform(line, &roots);
        values.chunks_exact(length).flat_map(line).collect()
    };
    let turned = |values: &[Complex], length: usize| -> Vec<Complex> {
        let others = values.len() / length;
        let at = |i: usize| values[i % others * length + i / others];
        (0..values.len()).map(at).collect()
    };
    let rows = lines(values.iter().map(|&v| [v, 0.0]).collect(), width);
    turned(&lines(turned(&rows, width), height), height)
}

/// `exp(−2πi k / n)` for each k below n.
fn roots_of_one(n: usize) -> Vec<Complex> {
    let root = |k: usize| {
        let (sin, cos) = (TAU * k as f64 / n as f64).sin_cos();
        [cos, -sin]
    };
    (0..n).map(root).collect()
}

/// Transforms one line (Cooley & Tukey 1965, any length): splits by the smallest prime factor p
/// into p lines of every p-th value. `roots` are those of the line or of a multiple of its length.
fn transform(line: &[Complex], roots: &[Complex]) -> Vec<Complex> {
    let n = line.len();
    let p = (2..=n).find(|p| n.is_multiple_of(*p)).unwrap_or(1);
    if p == 1 {
        return line.to_vec();
    }
    let part = |r: usize| {
        let every: Vec<Complex> = line.iter().skip(r).step_by(p).copied().collect();
        transform(&every, roots)
    };
    let parts: Vec<Vec<Complex>> = (0..p).map(part).collect();
    let stride = roots.len() / n;
    let value = |k: usize| {
        parts.iter().enumerate().fold([0.0; 2], |sum, (r, part)| {
            let term = product(roots[r * k % n * stride], part[k % part.len()]);
            [sum[0] + term[0], sum[1] + term[1]]
        })
    };
    (0..n).map(value).collect()
}

/// Correlation with the next pixel in x and in y; `None` for a single pixel.
fn autocorrelation(rest: &[f64], width: usize, variance: f64) -> Option<f64> {
    let right = (0..rest.len()).filter(|i| (i + 1) % width != 0);
    let products = right.map(|i| rest[i] * rest[i + 1]);
    let below = rest.iter().zip(rest.iter().skip(width)).map(|(a, b)| a * b);
    let (mut sum, mut count) = (0.0, 0.0);
    for product in products.chain(below) {
        sum += product;
        count += 1.0;
    }
    (count > 0.0).then(|| sum / count / variance)
}

/// Convolution with a Gaussian truncated at 4 σ. At the border the weights inside the image are
/// normalised, which preserves constants.
fn gaussian(values: &[f64], width: usize, sigma: f64) -> Vec<f64> {
    if sigma == 0.0 {
        return values.to_vec();
    }
    let height = values.len() / width;
    let across = filter_lines(values, sigma, (height, width), (width, 1));
    filter_lines(&across, sigma, (width, height), (1, width))
}

/// Filters `lines` lines of `length` values; the steps are those between lines and values.
fn filter_lines(
    values: &[f64],
    sigma: f64,
    (lines, length): (usize, usize),
    (line_step, step): (usize, usize),
) -> Vec<f64> {
    let reach = (4.0 * sigma).ceil() as usize;
    let weights: Vec<f64> = (0..=reach)
        .map(|d| (-0.5 * (d as f64 / sigma).powi(2)).exp())
        .collect();
    let mut out = vec![0.0; values.len()];
    for line in 0..lines {
        let at = |k: usize| line * line_step + k * step;
        for k in 0..length {
            let (mut sum, mut total) = (0.0, 0.0);
            for other in k.saturating_sub(reach)..(k + reach + 1).min(length) {
                let weight = weights[k.abs_diff(other)];
                sum += weight * values[at(other)];
                total += weight;
            }
            out[at(k)] = sum / total;
        }
    }
    out
}

fn root_mean_square(values: &[f64]) -> f64 {
    (values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64).sqrt()
}

/// Quantile `q` by linear interpolation between sorted values (Hyndman and Fan's type 7; NumPy).
fn quantile(values: &[f64], q: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_unstable_by(f64::total_cmp);
    let place = q * (sorted.len() - 1) as f64;
    let below = place as usize;
    let above = (below + 1).min(sorted.len() - 1);
    sorted[below] + (sorted[above] - sorted[below]) * (place - below as f64)
}

/// Means of the spectra over replicates with intervals, by frequency, and quantiles of single
/// images. Replicates without a spectrum are ignored.
pub(crate) fn mean_power(spectra: &[ErrorSpectrum]) -> Vec<PowerAt> {
    let with_power: Vec<_> = spectra.iter().filter(|s| !s.power.is_empty()).collect();
    let Some(first) = with_power.first() else {
        return Vec::new();
    };
    let variances = with_power.iter().map(|s| s.variance);
    let variance = variances.sum::<f64>() / with_power.len() as f64;
    let at = |(i, &(frequency, _)): (usize, &(f64, f64))| {
        let values: Vec<f64> = with_power.iter().map(|s| s.power[i].1).collect();
        let absolute = with_power
            .iter()
            .map(|s| s.power[i].1 * s.variance / variance);
        let absolute: Vec<f64> = absolute.collect();
        mean_interval(&values).map(|power| PowerAt {
            frequency,
            power,
            quantiles: (absolute.len() > 1)
                .then(|| OUTLIER_QUANTILES.map(|q| quantile(&absolute, q))),
        })
    };
    first.power.iter().enumerate().filter_map(at).collect()
}

/// Means over replicates of the error after each filter.
pub(crate) fn mean_filtered(spectra: &[ErrorSpectrum]) -> Vec<FilteredError> {
    let at = |(i, sigma): (usize, f64)| {
        let values: Vec<f64> = spectra.iter().map(|s| s.filtered[i]).collect();
        mean_interval(&values).map(|rmse| FilteredError { sigma, rmse })
    };
    SIGMAS.into_iter().enumerate().filter_map(at).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    const SIZE: [usize; 2] = [96, 64];

    fn white(generator: &mut Pcg32) -> Vec<f64> {
        let noise = (0..SIZE[0] * SIZE[1]).map(|_| generator.uniform() - 0.5);
        noise.collect()
    }

    #[test]
    fn the_spectrum_of_white_noise_is_flat_at_one() {
        let mut generator = Pcg32::new(3);
        let spectra: Vec<_> = (0..24)
            .map(|_| error_spectrum(&white(&mut generator), SIZE))
            .collect();
        let power = mean_power(&spectra);
        assert_eq!(power.len(), 32);
        for at in &power {
            let error = at.power.value - 1.0;
            assert!(error.abs() < 0.25, "{at:?}");
        }
        let tail = &power[8..];
        let flat = tail.iter().map(|at| (at.power.value - 1.0).abs());
        assert!(flat.fold(0.0, f64::max) < 0.08, "{tail:?}");
        let low: Vec<f64> = spectra.iter().filter_map(|s| s.low_frequency).collect();
        let lag: Vec<f64> = spectra.iter().filter_map(|s| s.autocorrelation).collect();
        let mean = |v: &[f64]| v.iter().sum::<f64>() / v.len() as f64;
        assert!((mean(&low) - 1.0).abs() < 0.06, "{low:?}");
        assert!(mean(&lag).abs() < 0.01, "{lag:?}");
        // The maximum of n/2 exponential variates.
        let loudest: Vec<f64> = spectra.iter().filter_map(|s| s.loudest).collect();
        let expected = (0.5 * (SIZE[0] * SIZE[1]) as f64).ln() + 0.5772;
        assert!((mean(&loudest) - expected).abs() < 1.0, "{loudest:?}");
        // A Gaussian leaves 1 / (2 σ √π) of white noise, except at borders.
        let filtered = mean_filtered(&spectra);
        let share = filtered[3].rmse.value / filtered[0].rmse.value;
        let theory = 1.0 / (4.0 * std::f64::consts::PI.sqrt());
        assert!((share / theory - 1.0).abs() < 0.1, "{share} vs {theory}");
    }

    #[test]
    fn an_outlier_among_images_shows_in_the_upper_quantiles_alone() {
        // numpy.quantile([3, 1, 4, 1, 5], …)
        let values = [3.0, 1.0, 4.0, 1.0, 5.0];
        let found = OUTLIER_QUANTILES.map(|q| quantile(&values, q));
        for (found, expected) in found.into_iter().zip([3.0, 4.0, 4.8, 5.0]) {
            assert!((found - expected).abs() < 1e-12, "{found} {expected}");
        }
        let mut generator = Pcg32::new(6);
        let mut images: Vec<Vec<f64>> = (0..16).map(|_| white(&mut generator)).collect();
        let spectra = |images: &[Vec<f64>]| -> Vec<ErrorSpectrum> {
            images
                .iter()
                .map(|image| error_spectrum(image, SIZE))
                .collect()
        };
        let calm = mean_power(&spectra(&images));
        // A firefly is as bright at all frequencies.
        images[3][1000] += 300.0;
        let wild = mean_power(&spectra(&images));
        for (calm, wild) in calm.iter().zip(&wild).skip(8) {
            let ([.., calm_most], [middle, .., most]) =
                (calm.quantiles.unwrap(), wild.quantiles.unwrap());
            assert!(
                calm_most < 2.0 && most > 10.0 && middle < 0.2,
                "{calm:?} {wild:?}"
            );
            assert!(
                (wild.power.value - 1.0).abs() < 0.3,
                "each mean is of its own image"
            );
        }
        assert!(mean_power(&spectra(&images[..1]))[0].quantiles.is_none());
    }

    #[test]
    fn a_single_wave_is_one_ring_and_blurred_noise_is_low() {
        let wave = |i: usize| (std::f64::consts::TAU * 12.0 * (i % 96) as f64 / 96.0).sin();
        let values: Vec<f64> = (0..96 * 64).map(wave).collect();
        let found = error_spectrum(&values, SIZE);
        let loud: Vec<_> = found.power.iter().filter(|p| p.1 > 1e-9).collect();
        assert!(
            loud.len() == 1 && (loud[0].0 - 0.125).abs() < 1.0 / 64.0,
            "{loud:?}"
        );
        // A wave and its mirror image share all power.
        let all = (96.0 * 64.0 - 1.0) / 2.0;
        assert!(
            found
                .loudest
                .is_some_and(|loudest| (loudest / all - 1.0).abs() < 1e-9)
        );
        // Noise with a period of eight pixels: 63 waves share the power.
        let noise = white(&mut Pcg32::new(9));
        let tiled: Vec<f64> = (0..96 * 64)
            .map(|i| noise[i / 96 % 8 * 8 + i % 8])
            .collect();
        let tiled = error_spectrum(&tiled, SIZE).loudest;
        assert!(tiled.is_some_and(|loudest| loudest > 96.0), "{tiled:?}");
        let blurred = gaussian(&white(&mut Pcg32::new(8)), 96, 2.0);
        let found = error_spectrum(&blurred, SIZE);
        assert!(found.low_frequency.is_some_and(|low| low > 4.0));
        assert!(found.autocorrelation.is_some_and(|lag| lag > 0.8));
    }

    #[test]
    fn a_filter_keeps_a_constant_and_a_constant_has_no_spectrum() {
        let found = error_spectrum(&vec![-0.3; 96 * 64], SIZE);
        assert!(found.filtered.iter().all(|rmse| (rmse - 0.3).abs() < 1e-12));
        assert!(found.power.is_empty() && found.low_frequency.is_none());
        assert_eq!(found.autocorrelation, None);
    }

    #[test]
    fn the_transform_of_any_length_is_the_sum_that_defines_it() {
        let mut generator = Pcg32::new(4);
        for n in [1, 2, 7, 12, 30, 49] {
            let line: Vec<Complex> = (0..n).map(|_| [generator.uniform(), 0.5]).collect();
            let roots = roots_of_one(n);
            let found = transform(&line, &roots);
            for (k, found) in found.iter().enumerate() {
                let terms = (0..n).map(|i| product(roots[i * k % n], line[i]));
                let sum = terms.fold([0.0; 2], |s, t| [s[0] + t[0], s[1] + t[1]]);
                let apart = (sum[0] - found[0]).hypot(sum[1] - found[1]);
                assert!(apart < 1e-11, "{n}, {k}: {apart}");
            }
        }
    }

    #[test]
    fn powers_of_all_frequencies_have_the_mean_one() {
        // Odd sizes, without symmetry.
        let values: Vec<f64> = white(&mut Pcg32::new(5))[..35 * 21].to_vec();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        let rest: Vec<f64> = values.iter().map(|v| v - mean).collect();
        let squares: f64 = rest.iter().map(|v| v * v).sum();
        let sum: f64 = fourier(&rest, 35).iter().flatten().map(|f| f * f).sum();
        assert!((sum / (squares * values.len() as f64) - 1.0).abs() < 1e-12);
    }
}
