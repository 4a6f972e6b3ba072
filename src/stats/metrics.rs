//! Versioned metrics of image error.

use crate::shown::Shown;
use raystone_image::{
    Image, ImageError, NON_FINITE_COLOUR, Picture, automatic_exposure, is_finite, luminance,
};
use std::collections::BTreeMap;
use std::fmt;
use std::sync::{Arc, OnceLock};

/// Added to the squared reference in relative metrics, against dominance of dark pixels.
pub const RELATIVE_EPSILON: f64 = 1e-2;

/// A reference: its mean image, and its independent parts and their two halves if available.
#[derive(Clone)]
pub struct Reference {
    mean: Image,
    halves: Option<[Image; 2]>,
    parts: Vec<Image>,
    /// The tone-mapped reference, computed on first use.
    shown: OnceLock<Arc<Shown>>,
}

impl fmt::Debug for Reference {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (width, height) = (self.mean.width, self.mean.height);
        write!(
            f,
            "a reference of {width}×{height} pixels in {} parts",
            self.parts.len()
        )
    }
}

impl Reference {
    /// A reference with a single image: metrics that need two halves are absent.
    ///
    /// # Errors
    /// [`ImageError::NonFiniteReference`].
    pub fn single(mean: Image) -> Result<Self, ImageError> {
        if let Some(i) = mean.pixels.iter().position(|p| !is_finite(p)) {
            return Err(ImageError::NonFiniteReference {
                count: mean.non_finite_pixels(),
                x: i % mean.width as usize,
                y: i / mean.width as usize,
            });
        }
        Ok(Self {
            mean,
            halves: None,
            parts: Vec::new(),
            shown: OnceLock::new(),
        })
    }

    /// A reference from independent renders of equal sample counts (other seeds): the first half
    /// against the second; the last of an odd number is ignored.
    ///
    /// # Errors
    /// [`ImageError::TooFew`] below two parts, [`ImageError::SizeMismatch`],
    /// [`ImageError::NonFiniteReference`].
    pub fn from_parts(mut parts: Vec<Image>) -> Result<Self, ImageError> {
        let half = parts.len() / 2;
        if half == 0 {
            return Err(ImageError::TooFew { needed: 2 });
        }
        parts.truncate(2 * half);
        let mut reference = Self::single(Image::mean_of(&parts)?)?;
        let (a, b) = parts.split_at(half);
        reference.halves = Some([Image::mean_of(a)?, Image::mean_of(b)?]);
        reference.parts = parts;
        Ok(reference)
    }

    /// The independent parts, those of the first half first; empty for a single image.
    pub fn parts(&self) -> &[Image] {
        &self.parts
    }

    /// Number of [`ErrorReport::without_part`] estimates; halves of one part have none.
    fn estimates(&self) -> usize {
        if self.parts.len() < 4 {
            0
        } else {
            self.parts.len()
        }
    }

    /// The reference image.
    pub fn image(&self) -> &Image {
        &self.mean
    }

    /// Exposure used to display the reference and images compared with it.
    pub fn exposure(&self) -> f32 {
        automatic_exposure(&self.mean)
    }

    /// Estimated mean squared error of the reference itself, mean (A − B)² / 4 over pixels and
    /// channels; absent without halves.
    pub fn own_mse(&self) -> Option<f64> {
        self.own_error(|_| 1.0)
    }

    /// [`Self::own_mse`] relative: each square over ((A + B) / 2)² + 0.01.
    pub fn own_relmse(&self) -> Option<f64> {
        self.own_error(|mean| mean * mean + RELATIVE_EPSILON)
    }

    fn own_error(&self, scale: impl Fn(f64) -> f64) -> Option<f64> {
        let [a, b] = self.halves.as_ref()?;
        let pairs = a.pixels.iter().flatten().zip(b.pixels.iter().flatten());
        let pairs = pairs.map(|(&a, &b)| (f64::from(a), f64::from(b)));
        let term = |(a, b): (f64, f64)| (a - b).powi(2) / scale(0.5 * (a + b));
        let sum: f64 = pairs.map(term).sum();
        Some(sum / 4.0 / (3 * a.pixels.len()) as f64)
    }
}

pub(super) struct Sample {
    channel: usize,
    value: f64,
    reference: f64,
    half_a: f64,
    half_b: f64,
}

enum Rule {
    /// Mean of a term over pixels and channels, and a function of the mean.
    Mean {
        term: fn(&Sample) -> f64,
        finish: fn(f64) -> f64,
    },
    /// From two finite images; `None` if there is no finite value.
    Whole(fn(&Comparison) -> Option<f64>),
}

/// An error metric.
pub struct Metric {
    /// Name with constants and version, as in records.
    pub id: &'static str,
    /// One line: formula and use. `v` the image, `r` the reference, A and B its halves.
    pub description: &'static str,
    /// True if it needs a reference with halves.
    pub needs_halves: bool,
    rule: Rule,
}

impl Metric {
    const fn mean(id: &'static str, description: &'static str, term: fn(&Sample) -> f64) -> Self {
        Self {
            id,
            description,
            needs_halves: false,
            rule: Rule::Mean {
                term,
                finish: |mean| mean,
            },
        }
    }

    const fn unbiased(self) -> Self {
        Self {
            needs_halves: true,
            ..self
        }
    }

    const fn whole(
        id: &'static str,
        description: &'static str,
        value: fn(&Comparison) -> Option<f64>,
    ) -> Self {
        Self {
            id,
            description,
            needs_halves: false,
            rule: Rule::Whole(value),
        }
    }
}

/// All metrics in table order. A changed formula gets a new version in its id.
#[rustfmt::skip]
pub const METRICS: &[Metric] = &[
    Metric::mean("mse/v1", "mean (v − r)²", Sample::squared_error),
    Metric {
        id: "rmse/v1",
        description: "√ mean (v − r)²",
        needs_halves: false,
        rule: Rule::Mean { term: Sample::squared_error, finish: f64::sqrt },
    },
    Metric::mean("mae/v1", "mean |v − r|", |s| (s.value - s.reference).abs()),
    Metric::mean("relmse/eps=1e-2/v1", "mean (v − r)² / (r² + 0.01)", Sample::relative_squared_error),
    Metric::mean("mse-unbiased/v1", "mean (v − A)(v − B): free of the reference's own noise, may be negative",
        |s| (s.value - s.half_a) * (s.value - s.half_b)).unbiased(),
    Metric::mean("relmse-unbiased/eps=1e-2/v1", "mean (v − A)(v − B) / (((A + B) / 2)² + 0.01), may be negative",
        Sample::unbiased_relative_error).unbiased(),
    Metric::mean("mse-red/v1", "mse of the red channel", |s| s.squared_error_of(0)),
    Metric::mean("mse-green/v1", "mse of the green channel", |s| s.squared_error_of(1)),
    Metric::mean("mse-blue/v1", "mse of the blue channel", |s| s.squared_error_of(2)),
    Metric::whole("mse-luminance/v1", "mse of luminance", |c| c.mean_of_luminance(|v, r| (v - r).powi(2))),
    Metric::whole("relmse-luminance/eps=1e-2/v1", "relmse of luminance",
        |c| c.mean_of_luminance(|v, r| (v - r).powi(2) / (r * r + RELATIVE_EPSILON))),
    Metric::whole("relmse-trimmed/top=0.1%/eps=1e-2/v1",
        "relmse without the 0.1 % greatest terms: what it is but for a few outliers", |c| c.trimmed()),
    Metric::mean("smape/eps=1e-2/v1", "mean |v − r| / (|v| + |r| + 0.01) (Vogels et al. 2018)",
        |s| (s.value - s.reference).abs() / (s.value.abs() + s.reference.abs() + RELATIVE_EPSILON)),
    Metric::whole("psnr/tone-mapped/v1", "10 log10 (1 / MSE) of the tone-mapped pictures, dB; absent for equal ones",
        |c| Some(c.shown.psnr(c.shown_reference))),
    Metric::whole("ssim/tone-mapped/v1",
        "mean structural similarity of the luma of the tone-mapped pictures, Gaussian window σ = 1.5 (Wang et al. 2004)",
        |c| c.shown.ssim(c.shown_reference)),
    Metric::whole("flip/tone-mapped/ppd=67/v1",
        "mean FLIP of the tone-mapped pictures at 67 pixels per degree (Andersson et al. 2020)",
        |c| Some(c.shown.flip(c.shown_reference))),
];

/// Fraction of terms that the trimmed metric omits.
const TRIMMED: f64 = 1e-3;

struct Comparison<'a> {
    image: &'a Image,
    reference: &'a Reference,
    shown: Shown,
    shown_reference: &'a Shown,
}

impl<'a> Comparison<'a> {
    fn new(image: &'a Image, reference: &'a Reference) -> Self {
        let exposure = reference.exposure();
        let of_reference = || Arc::new(Shown::new(&reference.mean, exposure));
        Self {
            image,
            reference,
            shown: Shown::new(image, exposure),
            shown_reference: reference.shown.get_or_init(of_reference),
        }
    }

    fn mean_of_luminance(&self, term: fn(f64, f64) -> f64) -> Option<f64> {
        let pairs = self.image.pixels.iter().zip(&self.reference.mean.pixels);
        let sum: f64 = pairs.map(|(v, r)| term(luminance(v), luminance(r))).sum();
        Some(sum / self.image.pixels.len() as f64)
    }

    /// Rejects outliers like SimpleImageIO (P. Grittmann): terms of pixels and channels by size.
    fn trimmed(&self) -> Option<f64> {
        let mut terms = Vec::with_capacity(3 * self.image.pixels.len());
        for (i, pixel) in self.image.pixels.iter().enumerate() {
            let term = |c: usize| {
                self.reference
                    .sample(i, c, pixel[c])
                    .relative_squared_error()
            };
            terms.extend([0, 1, 2].map(term));
        }
        terms.sort_unstable_by(f64::total_cmp);
        terms.truncate(terms.len() - (terms.len() as f64 * TRIMMED) as usize);
        Some(terms.iter().sum::<f64>() / terms.len() as f64)
    }
}

impl Sample {
    /// (v − r)².
    fn squared_error(&self) -> f64 {
        (self.value - self.reference).powi(2)
    }

    /// (v − A)(v − B) / (r² + ε).
    pub(super) fn unbiased_relative_error(&self) -> f64 {
        (self.value - self.half_a) * (self.value - self.half_b) / self.relative_scale()
    }

    /// Term whose mean over all channels is this channel's mean squared error.
    fn squared_error_of(&self, channel: usize) -> f64 {
        if self.channel == channel {
            3.0 * self.squared_error()
        } else {
            0.0
        }
    }

    /// (v − r)² / (r² + ε).
    pub(super) fn relative_squared_error(&self) -> f64 {
        self.squared_error() / self.relative_scale()
    }

    fn relative_scale(&self) -> f64 {
        self.reference * self.reference + RELATIVE_EPSILON
    }
}

/// Error of one image.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct ErrorReport {
    /// Metric values by id, over the finite pixels; metrics that cannot be computed are absent.
    pub metrics: BTreeMap<String, f64>,
    /// Values by id of metrics that need halves, against the reference without its first part,
    /// without its second, …: their spread shows how the reference's own noise affects the metric.
    /// Empty without at least two parts in each half.
    pub without_part: BTreeMap<String, Vec<f64>>,
    /// Number of NaN or infinite pixels, which enter no mean. Any is a renderer failure.
    pub non_finite_pixels: usize,
}

/// Evaluates every metric of `image`. Non-finite pixels exclude whole-image metrics.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn measure(image: &Image, reference: &Reference) -> Result<ErrorReport, ImageError> {
    measure_those(image, reference, |_| true)
}

/// [`measure`] for the chosen metrics alone.
///
/// # Errors
/// As [`measure`].
pub fn measure_those(
    image: &Image,
    reference: &Reference,
    chosen: impl Fn(&Metric) -> bool,
) -> Result<ErrorReport, ImageError> {
    reference.mean.check_size(image, "the measured image")?;
    let present = |m: &&Metric| chosen(m) && (!m.needs_halves || reference.halves.is_some());
    let means: Vec<_> = METRICS
        .iter()
        .filter(present)
        .filter_map(Metric::term)
        .collect();
    let mut sums = vec![0.0; means.len()];
    let mut without = vec![vec![0.0; means.len()]; reference.estimates()];
    let mut finite = 0usize;
    for (i, pixel) in image.pixels.iter().enumerate() {
        if !is_finite(pixel) {
            continue;
        }
        finite += 1;
        for (c, &value) in pixel.iter().enumerate() {
            let sample = reference.sample(i, c, value);
            for (sum, (_, term, _)) in sums.iter_mut().zip(&means) {
                *sum += term(&sample);
            }
            for (part, sums) in without.iter_mut().enumerate() {
                let sample = reference.without(part, i, c, &sample);
                let halves = sums
                    .iter_mut()
                    .zip(&means)
                    .filter(|(_, (m, ..))| m.needs_halves);
                for (sum, (_, term, _)) in halves {
                    *sum += term(&sample);
                }
            }
        }
    }
    let mut report = ErrorReport {
        non_finite_pixels: image.pixels.len() - finite,
        ..ErrorReport::default()
    };
    if finite == 0 {
        return Ok(report);
    }
    for (k, (metric, _, finish)) in means.iter().enumerate() {
        let value = |sums: &Vec<f64>| finish(sums[k] / (3 * finite) as f64);
        report.metrics.insert(metric.id.to_owned(), value(&sums));
        if metric.needs_halves && !without.is_empty() {
            let values = without.iter().map(value).collect();
            report.without_part.insert(metric.id.to_owned(), values);
        }
    }
    let whole = |m: &&Metric| chosen(m) && matches!(m.rule, Rule::Whole(_));
    if report.non_finite_pixels == 0 && METRICS.iter().any(|m| whole(&m)) {
        let compared = Comparison::new(image, reference);
        for metric in METRICS.iter().filter(whole) {
            let Rule::Whole(value) = &metric.rule else {
                continue;
            };
            let value = value(&compared).filter(|value| value.is_finite());
            let value = value.map(|value| (metric.id.to_owned(), value));
            report.metrics.extend(value);
        }
    }
    Ok(report)
}

/// A mean metric, its term, and the function of the mean.
type MeanMetric = (&'static Metric, fn(&Sample) -> f64, fn(f64) -> f64);

impl Metric {
    fn term(&'static self) -> Option<MeanMetric> {
        match self.rule {
            Rule::Mean { term, finish } => Some((self, term, finish)),
            Rule::Whole(_) => None,
        }
    }
}

impl Reference {
    pub(super) fn sample(&self, pixel: usize, channel: usize, value: f32) -> Sample {
        let at = |image: &Image| f64::from(image.pixels[pixel][channel]);
        let reference = at(&self.mean);
        let (half_a, half_b) = match &self.halves {
            Some([a, b]) => (at(a), at(b)),
            None => (reference, reference),
        };
        Sample {
            channel,
            value: f64::from(value),
            reference,
            half_a,
            half_b,
        }
    }

    /// The sample against the reference without one of its parts.
    fn without(&self, part: usize, pixel: usize, channel: usize, sample: &Sample) -> Sample {
        let half = (self.parts.len() / 2) as f64;
        let value = f64::from(self.parts[part].pixels[pixel][channel]);
        let rest = |mean: f64| mean + (mean - value) / (half - 1.0);
        let (half_a, half_b) = if 2 * part < self.parts.len() {
            (rest(sample.half_a), sample.half_b)
        } else {
            (sample.half_a, rest(sample.half_b))
        };
        Sample {
            channel,
            value: sample.value,
            reference: 0.5 * (half_a + half_b),
            half_a,
            half_b,
        }
    }
}

/// Picture of the error: per pixel √ of the mean over channels of (v − r)² / (r² + 0.01), divided
/// by `full_scale`, clamped to `[0, 1]` and coloured by `colour`.
///
/// # Errors
/// [`ImageError::SizeMismatch`].
pub fn error_map(
    image: &Image,
    reference: &Reference,
    full_scale: f32,
    colour: impl Fn(f32) -> [u8; 3],
) -> Result<Picture, ImageError> {
    reference.image().check_size(image, "the measured image")?;
    let map = |(i, pixel): (usize, &[f32; 3])| {
        let term = |c: usize| {
            let sample = reference.sample(i, c, pixel[c]);
            sample.relative_squared_error()
        };
        let error = ((term(0) + term(1) + term(2)) / 3.0).sqrt() as f32;
        if error.is_finite() {
            colour((error / full_scale).clamp(0.0, 1.0))
        } else {
            NON_FINITE_COLOUR
        }
    };
    Ok(Picture {
        width: image.width,
        height: image.height,
        pixels: image.pixels.iter().enumerate().map(map).collect(),
    })
}

#[cfg(test)]
#[path = "metrics_tests.rs"]
mod tests;
