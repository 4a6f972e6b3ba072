//! Records of the time of full cells.

use super::{Interval, Key, Reading, Samples, axis};
use crate::figure;
use raystone_core::structure::{RAY_COUNT_CLASSES, RAY_QUERIES, TRACED_CLASSES};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Time of a full cell whose pixels are rendered in an order of passes: see `Order`.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct OrderTime {
    /// The order.
    pub order: String,
    /// Passes of a sample, each a submission of its own.
    pub passes: usize,
    /// Wall milliseconds per sample per pixel for the whole image, median with interval.
    pub ms_per_spp: Option<Interval>,
    /// Wall milliseconds until the first picture without a gap, median with interval.
    pub first_picture_ms: Option<Interval>,
}

/// Paths that begin at rasterised triangles, compared with rays through the same points that go on with the same
/// samples.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct PrimaryRecord {
    /// Pixels that were compared.
    pub pixels: u64,
    /// Those that see another triangle.
    pub other_triangle: u64,
    /// Those whose value is another.
    pub other_value: u64,
    /// Of these, those that see the same triangle.
    pub unexplained: u64,
    /// Mean of the differences of all channels, over the mean by rays.
    pub mean_difference: f64,
    /// Root of the mean of their squares, over the mean by rays.
    pub rms_difference: f64,
    /// Wall milliseconds to rasterise all pixels, median with interval.
    pub raster_ms: Option<Interval>,
    /// Wall milliseconds to trace a ray through each, median with interval.
    pub traced_ms: Option<Interval>,
}

/// Time of a full cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct TimeRecord {
    /// Image size in pixels.
    pub resolution: [u32; 2],
    /// Samples per pixel of each timed render.
    pub spp: u32,
    /// Every sample after warm-up, milliseconds per render on the GPU clock.
    pub ms: Vec<f64>,
    /// The same renders by the wall clock, milliseconds.
    pub wall_ms: Vec<f64>,
    /// The same in time of the processors, all threads of the process together; empty on adapters that work elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cpu_ms: Vec<f64>,
    /// Milliseconds per sample per pixel for the whole image, median with interval; absent if the
    /// cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub ms_per_spp: Option<Interval>,
    /// Rays of each class in one render, from a separate counting run of the same seed.
    pub rays: BTreeMap<String, u64>,
    /// All rays over time, million per second; absent if the cell failed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub mrays_s: Option<Interval>,
    /// Paths of one render that sent a ray from the camera, after one bounce, …; empty for integrators without paths.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub live_paths: Vec<u64>,
    /// GPU milliseconds of each stage of a render, medians; only where the passes are several.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub stages: BTreeMap<String, f64>,
    /// The same cell in orders of passes; empty where these were not asked for.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub orders: Vec<OrderTime>,
    /// Effect of paths that begin at rasterised triangles.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub primary: Option<PrimaryRecord>,
    /// BLAKE3 of the image.
    pub image_hash: String,
    /// True if the image equals to the bit that of the scene's first gated structure.
    pub image_equal: bool,
    /// The reason why there are no figures.
    pub failure: Option<String>,
}

impl OrderTime {
    /// Returns its figures; `one_pass` is the time of the order with one pass.
    fn readings(&self, one_pass: Option<Interval>) -> Vec<Reading> {
        let ratio = self.ms_per_spp.zip(one_pass);
        let ratio = ratio.map(|(ms, one)| Interval::exact(ms.value / one.value));
        let at = Key::default().with(axis::SUBJECT, &self.order);
        let readings = Reading::known([
            (
                &figure::ORDER_PASSES,
                Some(Interval::exact(self.passes as f64)),
            ),
            (&figure::ORDER_MS, self.ms_per_spp),
            (&figure::ORDER_RATIO, ratio),
            (&figure::FIRST_PICTURE_MS, self.first_picture_ms),
        ]);
        readings
            .into_iter()
            .map(|reading| reading.at(at.clone()))
            .collect()
    }
}

impl PrimaryRecord {
    /// Returns its figures.
    pub fn readings(&self) -> Vec<Reading> {
        let exact = |x: f64| Some(Interval::exact(x));
        let share = |pixels: u64| exact(pixels as f64 / self.pixels.max(1) as f64);
        Reading::known([
            (&figure::PRIMARY_OTHER_TRIANGLE, share(self.other_triangle)),
            (&figure::PRIMARY_OTHER_VALUE, share(self.other_value)),
            (
                &figure::PRIMARY_MEAN_DIFFERENCE,
                exact(self.mean_difference),
            ),
            (&figure::PRIMARY_RMS_DIFFERENCE, exact(self.rms_difference)),
            (&figure::RASTER_MS, self.raster_ms),
            (&figure::TRACED_PRIMARY_MS, self.traced_ms),
        ])
    }
}

impl TimeRecord {
    /// Returns `true` if the time may be used: the cell completed, and its image is that of all structures.
    pub fn is_valid(&self) -> bool {
        self.failure.is_none() && self.image_equal && self.ms_per_spp.is_some()
    }

    /// Returns the number of rays that a render traces: `rays` also count those that were left out because they could change
    /// nothing.
    pub fn traced_rays(&self) -> u64 {
        let classes = RAY_COUNT_CLASSES[..TRACED_CLASSES].iter();
        classes.filter_map(|class| self.rays.get(*class)).sum()
    }

    /// Returns the share of ray queries in the time of all stages, if stages were timed.
    pub fn query_share(&self) -> Option<f64> {
        let all: f64 = self.stages.values().sum();
        let queries = RAY_QUERIES
            .iter()
            .filter_map(|stage| self.stages.get(*stage));
        (all > 0.0).then(|| queries.sum::<f64>() / all)
    }

    /// Returns its figures, if it is [valid](Self::is_valid).
    pub fn readings(&self) -> Vec<Reading> {
        if !self.is_valid() {
            return Vec::new();
        }
        let [width, height] = self.resolution;
        let work = format!("{width} × {height} pixels, {} spp", self.spp);
        let traced = self.traced_rays() as f64;
        let in_rounds = |of: &dyn Fn(f64) -> f64| {
            let each = |ms: &[f64]| ms.iter().map(|ms| of(*ms)).collect();
            Samples::Rounds {
                adapter: each(&self.ms),
                wall: each(&self.wall_ms),
                processors: each(&self.cpu_ms),
            }
        };
        let timed = |figure, value: Option<Interval>, samples| {
            let reading = Reading::new(figure, value?).of_work(&work);
            Some(reading.with_samples(samples))
        };
        let per_spp = in_rounds(&|ms| ms / f64::from(self.spp));
        let mut readings: Vec<Reading> = timed(&figure::MS_PER_SPP, self.ms_per_spp, per_spp)
            .into_iter()
            .collect();
        let rate = in_rounds(&|ms| traced / ms * 1e-3);
        readings.extend(timed(&figure::CELL_MRAYS_PER_S, self.mrays_s, rate));
        readings.extend(Reading::known([(
            &figure::RAY_QUERY_SHARE,
            self.query_share(),
        )]));
        let one_pass = self.orders.first().and_then(|order| order.ms_per_spp);
        readings.extend(
            self.orders
                .iter()
                .flat_map(|order| order.readings(one_pass)),
        );
        readings.extend(self.primary.iter().flat_map(PrimaryRecord::readings));
        readings
    }
}
