//! The points that a sampler gives a pixel, in two dimensions.

use raystone_discrepancy::star_2d;
use raystone_sampling::dimensions::pair_purpose;
use raystone_sampling::{Coordinate, Sampler};

/// Points of a pixel in two of a sampler's dimensions.
#[derive(Debug, Clone, PartialEq)]
pub struct SamplePoints {
    /// Column and row of the pixel.
    pub pixel: [u32; 2],
    /// The dimensions.
    pub dimensions: [u32; 2],
    /// What a path draws from them.
    pub purpose: String,
    /// The points, in [0, 1)², in order of the samples.
    pub points: Vec<[f64; 2]>,
    /// Their star discrepancy.
    pub star: Option<f64>,
}

impl SamplePoints {
    /// The first `count` points of a pixel, as the sampler's twin computes them.
    ///
    /// # Errors
    /// A dimension that the sampler was not made for, or a pixel outside of the image.
    pub(crate) fn of(
        sampler: &Sampler,
        (pixel, size): ([u32; 2], [u32; 2]),
        dimensions: [u32; 2],
        (count, seed): (u32, u32),
    ) -> Result<Self, String> {
        let known = sampler.demand.dimensions;
        if let Some(beyond) = dimensions.into_iter().find(|d| *d >= known) {
            return Err(format!(
                "the integrator draws {known} dimensions, from 0 on: there is no {beyond}"
            ));
        }
        if pixel[0] >= size[0] || pixel[1] >= size[1] {
            return Err(format!("pixel {pixel:?} is outside of the image"));
        }
        let fraction = |sample, dimension| {
            let at = Coordinate {
                pixel: pixel[1] * size[0] + pixel[0],
                sample,
                dimension,
                seed,
            };
            f64::from(sampler.sample_u32(at)) * 0.5_f64.powi(32)
        };
        let points: Vec<[f64; 2]> = (0..count)
            .map(|sample| dimensions.map(|dimension| fraction(sample, dimension)))
            .collect();
        Ok(Self {
            pixel,
            dimensions,
            purpose: pair_purpose(dimensions),
            star: star_2d(&points).ok(),
            points,
        })
    }
}
