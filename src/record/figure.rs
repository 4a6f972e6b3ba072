//! The table of figures: what each is called, in which unit, which direction is better, how it is shown and
//! how its interval was made. Pages, tables, plots and exports read it; adding a figure is a row here (or,
//! from outside, in the registry of figures) and the code that measures it.

use Better::{Higher, Lower, Neither};
use Shown::{Bytes, Count, Digits, Exponent, Percent};
use Spread::{Exact, Jackknife, Mean, Median, Single};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;

/// Which values are better.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Better {
    /// Rates.
    Higher,
    /// Errors, times, sizes.
    Lower,
    /// It describes, and does not rank.
    Neither,
}

/// How a value is written.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Shown {
    /// With so many significant digits.
    Digits(u8),
    /// As a whole number.
    Count,
    /// In bytes with a binary unit.
    Bytes,
    /// A share as percent.
    Percent,
    /// An exponent, with two decimals.
    Exponent,
}

/// How an interval was made.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
#[serde(rename_all = "kebab-case")]
pub enum Spread {
    /// Median with the 95 % interval of its order statistics.
    Median,
    /// Mean with Student's 95 % interval.
    Mean,
    /// Jackknife over replicates and the reference's parts, with Student's 95 % interval.
    Jackknife,
    /// Counted or computed: no interval.
    Exact,
    /// Measured once: nothing is known of its spread.
    Single,
}

impl Spread {
    /// What a reader is told.
    pub fn words(self) -> &'static str {
        match self {
            Median => "median, 95 % interval of order statistics",
            Mean => "mean, Student's 95 % interval",
            Jackknife => "jackknife, Student's 95 % interval",
            Exact => "exact",
            Single => "measured once",
        }
    }
}

/// A figure.
#[derive(Debug, Clone, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Figure {
    /// Name with version, for instance `sah-cost/v1`: another definition is another version.
    pub id: Cow<'static, str>,
    /// What it is called.
    pub title: Cow<'static, str>,
    /// Its unit; empty for plain numbers and for units that are written with the value.
    pub unit: Cow<'static, str>,
    /// Which values are better.
    pub better: Better,
    /// How it is written.
    pub shown: Shown,
    /// How its interval was made.
    pub spread: Spread,
}

impl Figure {
    /// A row of the table.
    pub const fn new(
        id: &'static str,
        title: &'static str,
        unit: &'static str,
        better: Better,
        shown: Shown,
        spread: Spread,
    ) -> Self {
        Self {
            id: Cow::Borrowed(id),
            title: Cow::Borrowed(title),
            unit: Cow::Borrowed(unit),
            better,
            shown,
            spread,
        }
    }

    /// Title and unit, as the head of a column.
    pub fn heading(&self) -> String {
        match self.unit.is_empty() {
            true => self.title.to_string(),
            false => format!("{}, {}", self.title, self.unit),
        }
    }
}

/// Three significant digits.
const THREE: Shown = Digits(3);

/// All figures that this crate measures.
#[rustfmt::skip]
pub static FIGURES: [Figure; 142] = [
    // A structure and a class of rays.
    Figure::new("mrays-per-s/v1", "speed", "Mrays/s", Higher, THREE, Median),
    Figure::new("rays/v1", "rays", "", Neither, Count, Exact),
    Figure::new("hit-share/v1", "hit", "", Neither, Percent, Exact),
    Figure::new("unlike-shadow/v1", "unlike the shadow ray", "per million", Neither, THREE, Exact),
    Figure::new("nodes-per-ray/v1", "nodes/ray", "", Lower, THREE, Exact),
    Figure::new("box-tests-per-ray/v1", "box tests/ray", "", Lower, THREE, Exact),
    Figure::new("triangle-tests-per-ray/v1", "triangle tests/ray", "", Lower, THREE, Exact),
    Figure::new("deepest-stack/v1", "deepest stack", "", Lower, Count, Exact),
    // Ray casters of others, and structures beside them.
    Figure::new("cpu-ns-per-ray/v1", "time of the processors", "ns per ray", Lower, THREE, Median),
    Figure::new("cpu-over-peer/v1", "time of the processors over a peer's", "", Lower, THREE, Median),
    Figure::new("peer-mrays-per-s/v1", "speed of a peer", "Mrays/s", Higher, THREE, Median),
    Figure::new("unlike-judge/v1", "unlike the judge", "per million", Neither, THREE, Exact),
    Figure::new("farthest-distance/v1", "farthest distance", "", Neither, THREE, Exact),
    // A structure.
    Figure::new("build-ms/v1", "build", "ms", Lower, THREE, Single),
    Figure::new("build-rate/v1", "build", "Mtris/s", Higher, THREE, Single),
    Figure::new("build-peak-bytes/v1", "peak memory", "", Lower, Bytes, Single),
    Figure::new("update-ms/v1", "update", "ms", Lower, THREE, Single),
    Figure::new("bytes/v1", "size", "", Lower, Bytes, Exact),
    Figure::new("bytes-per-triangle/v1", "bytes/triangle", "", Lower, THREE, Exact),
    Figure::new("nodes/v1", "nodes", "", Neither, Count, Exact),
    Figure::new("leaves/v1", "leaves", "", Neither, Count, Exact),
    Figure::new("references/v1", "references", "", Lower, Count, Exact),
    Figure::new("references-per-triangle/v1", "references/triangle", "", Lower, THREE, Exact),
    Figure::new("depth/v1", "depth", "", Lower, Count, Exact),
    Figure::new("sah-cost/v1", "SAH cost", "", Lower, THREE, Exact),
    Figure::new("epo/v1", "EPO", "", Lower, THREE, Exact),
    Figure::new("leaf-share/v1", "share of the leaves", "", Neither, Percent, Exact),
    Figure::new("break-even/v1", "break-even", "thousand rays", Lower, THREE, Single),
    // Full cells.
    Figure::new("ms-per-spp/v1", "time per sample per pixel", "ms", Lower, THREE, Median),
    Figure::new("ray-query-share/v1", "time in ray queries", "", Neither, Percent, Exact),
    Figure::new("against-single-kernel/v1", "time over that of single-kernel", "", Lower, THREE, Median),
    Figure::new("cell-mrays-per-s/v1", "speed of the whole cell", "Mrays/s", Higher, THREE, Median),
    Figure::new("order-passes/v1", "passes per sample", "", Neither, Count, Exact),
    Figure::new("order-ms/v1", "time per sample per pixel", "ms", Lower, THREE, Median),
    Figure::new("order-ratio/v1", "over one pass", "", Lower, THREE, Single),
    Figure::new("first-picture-ms/v1", "time to the first picture", "ms", Lower, THREE, Median),
    Figure::new("primary-other-triangle/v1", "see another triangle", "", Neither, Percent, Exact),
    Figure::new("primary-other-value/v1", "have another value", "", Neither, Percent, Exact),
    Figure::new("primary-mean-difference/v1", "difference of the mean, over the mean", "", Neither, THREE, Exact),
    Figure::new("primary-rms-difference/v1", "RMS difference, over the mean", "", Neither, THREE, Exact),
    Figure::new("raster-ms/v1", "rasterised", "ms", Lower, THREE, Median),
    Figure::new("traced-primary-ms/v1", "traced", "ms", Lower, THREE, Median),
    Figure::new("specialisation/v1", "time over that of the specialised kernel", "", Neither, THREE, Mean),
    Figure::new("time-to-image/v1", "build and rendering", "ms", Lower, THREE, Single),
    Figure::new("error-seconds/v1", "unbiased relMSE × seconds", "", Lower, THREE, Jackknife),
    Figure::new("error-at-time/v1", "unbiased relMSE at equal time", "", Lower, THREE, Jackknife),
    Figure::new("spp-to-error/v1", "samples per pixel to an error", "", Lower, THREE, Jackknife),
    Figure::new("seconds-to-error/v1", "time to an error", "s", Lower, THREE, Jackknife),
    // Coherence, by a model.
    Figure::new("simt-efficiency/v1", "SIMT efficiency", "", Higher, Percent, Exact),
    Figure::new("lines-per-issue/v1", "cache lines/issue", "", Lower, THREE, Exact),
    Figure::new("l1-hits/v1", "found in L1", "", Higher, Percent, Exact),
    Figure::new("l2-hits/v1", "of the rest in L2", "", Higher, Percent, Exact),
    Figure::new("issues-per-ray/v1", "issues/ray", "", Lower, THREE, Exact),
    Figure::new("asked-bytes-per-ray/v1", "bytes asked for/ray", "", Lower, THREE, Exact),
    Figure::new("l2-bytes-per-ray/v1", "bytes from L2/ray", "", Lower, THREE, Exact),
    Figure::new("memory-bytes-per-ray/v1", "bytes from memory/ray", "", Lower, THREE, Exact),
    Figure::new("cycles-per-ray/v1", "predicted cycles/ray", "", Lower, THREE, Exact),
    Figure::new("cycles-per-path/v1", "predicted cycles/path", "", Lower, THREE, Exact),
    // Errors of samplers.
    Figure::new("relmse-unbiased/v1", "unbiased relMSE", "", Lower, THREE, Jackknife),
    Figure::new("rmse-unbiased/v1", "unbiased RMSE", "", Lower, THREE, Jackknife),
    Figure::new("relmse-slope/v1", "slope of relMSE", "", Lower, Exponent, Jackknife),
    Figure::new("rmse-slope/v1", "slope of RMSE", "", Lower, Exponent, Jackknife),
    Figure::new("mae/v1", "MAE", "", Lower, THREE, Mean),
    Figure::new("relmse-trimmed/v1", "relMSE without the 0.1 % worst", "", Lower, THREE, Mean),
    Figure::new("mse-luminance/v1", "MSE of luminance", "", Lower, THREE, Mean),
    Figure::new("smape/v1", "SMAPE", "", Lower, THREE, Mean),
    Figure::new("psnr/v1", "PSNR", "dB", Higher, THREE, Mean),
    Figure::new("ssim/v1", "SSIM", "", Higher, THREE, Mean),
    Figure::new("flip/v1", "FLIP", "", Lower, THREE, Mean),
    Figure::new("bias-tiles/v1", "tiles", "", Neither, Count, Exact),
    Figure::new("bias-rejected/v1", "rejected", "", Lower, Count, Exact),
    Figure::new("bias-least-p/v1", "smallest p of a tile", "", Neither, THREE, Exact),
    Figure::new("bias-z/v1", "z of the image", "", Neither, THREE, Exact),
    Figure::new("bias-p/v1", "p of the image", "", Neither, THREE, Exact),
    Figure::new("bias-freedom/v1", "degrees of freedom", "", Neither, THREE, Exact),
    Figure::new("bias-weighted-p/v1", "p of the weighted mean", "", Neither, THREE, Exact),
    Figure::new("bias-weighted-freedom/v1", "its degrees of freedom", "", Neither, THREE, Exact),
    Figure::new("bias-detectable/v1", "bias found in 90 % of cases", "%", Lower, Digits(2), Exact),
    Figure::new("low-frequency-power/v1", "low-frequency power", "", Lower, THREE, Mean),
    Figure::new("loudest-wave/v1", "loudest wave", "", Lower, THREE, Mean),
    Figure::new("neighbour-correlation/v1", "correlation", "", Lower, THREE, Mean),
    Figure::new("luminance-rmse/v1", "RMSE", "", Lower, THREE, Single),
    Figure::new("filtered-share/v1", "share of the RMSE after a filter", "", Lower, Percent, Single),
    Figure::new("reference-mse/v1", "MSE of the reference", "", Lower, THREE, Single),
    // Point sets.
    Figure::new("star-discrepancy/v1", "D*, star discrepancy", "", Lower, THREE, Mean),
    Figure::new("l2-star/v1", "L2-star discrepancy (root)", "", Lower, THREE, Mean),
    Figure::new("centered/v1", "Centered discrepancy (square)", "", Lower, THREE, Mean),
    Figure::new("star-exponent/v1", "D* exponent", "", Lower, Exponent, Mean),
    Figure::new("l2-star-exponent/v1", "L2-star exponent", "", Lower, Exponent, Mean),
    Figure::new("integral-rmse/v1", "RMSE of an integral", "", Lower, THREE, Mean),
    Figure::new("integral-exponent/v1", "exponent of that RMSE", "", Lower, Exponent, Mean),
    Figure::new("neighbour-angle/v1", "angle", "degrees", Neither, THREE, Exact),
    Figure::new("coverage/v1", "coverage", "", Higher, Percent, Exact),
    Figure::new("ns-per-sample/v1", "ns per sample", "", Lower, THREE, Median),
    Figure::new("loop-ns/v1", "empty loop", "ns", Neither, THREE, Median),
    // Compactions of streams.
    Figure::new("compaction-ns/v1", "time per element", "ns", Lower, THREE, Median),
    Figure::new("compaction-melements-per-s/v1", "speed", "Melements/s", Higher, THREE, Median),
    Figure::new("compaction-gb-per-s/v1", "least traffic over time", "GB/s", Higher, THREE, Median),
    Figure::new("compaction-ratio/v1", "time over that of roger", "", Lower, THREE, Median),
    Figure::new("compaction-passes/v1", "passes", "", Lower, Count, Exact),
    Figure::new("compaction-scratch/v1", "memory between passes", "", Lower, Bytes, Exact),
    Figure::new("growth-linear/v1", "residual of a + b·n", "", Lower, Percent, Median),
    Figure::new("growth-linearithmic/v1", "residual of a + b·n·log n", "", Lower, Percent, Median),
    Figure::new("growth-difference/v1", "criterion of n less that of n log n", "", Neither, THREE, Median),
    // A structure in a frame of a moving scene.
    Figure::new("frame-sah-refitted/v1", "SAH, refitted", "", Lower, THREE, Exact),
    Figure::new("frame-sah-rebuilt/v1", "SAH, rebuilt", "", Lower, THREE, Exact),
    Figure::new("frame-sah-ratio/v1", "SAH, refitted over rebuilt", "", Lower, THREE, Exact),
    Figure::new("frame-refit-ms/v1", "refit", "ms", Lower, THREE, Median),
    Figure::new("frame-refit-host-ms/v1", "refit on the host", "ms", Lower, THREE, Median),
    Figure::new("frame-rebuild-ms/v1", "rebuild", "ms", Lower, THREE, Median),
    Figure::new("frame-judged/v1", "judged rays", "", Neither, Count, Exact),
    Figure::new("frame-nodes-ratio/v1", "nodes/ray, refitted over rebuilt", "", Lower, THREE, Exact),
    Figure::new("frame-time-ratio/v1", "time of rays, refitted over rebuilt", "", Lower, THREE, Median),
    Figure::new("frame-break-even/v1", "rebuilding pays from", "million rays", Neither, THREE, Single),
    // Hard scenes and rays, judged exactly.
    Figure::new("false-misses/v1", "false misses", "", Lower, Count, Exact),
    Figure::new("unexplained-misses/v1", "unexplained misses", "", Lower, Count, Exact),
    Figure::new("cracks/v1", "cracks", "", Lower, Count, Exact),
    Figure::new("false-hits/v1", "false hits", "", Lower, Count, Exact),
    Figure::new("unexplained-hits/v1", "unexplained hits", "", Lower, Count, Exact),
    Figure::new("wrong-triangle/v1", "wrong triangle", "", Lower, Count, Exact),
    Figure::new("not-nearest/v1", "not nearest", "", Lower, Count, Exact),
    Figure::new("borderline/v1", "borderline", "", Neither, Count, Exact),
    Figure::new("differing/v1", "differing from brute force", "", Lower, Count, Exact),
    Figure::new("any-differing/v1", "any hits differing from brute force", "", Lower, Count, Exact),
    Figure::new("ties/v1", "ties", "", Neither, Count, Exact),
    Figure::new("slowdown/v1", "slowdown", "", Lower, THREE, Single),
    Figure::new("t-ulp-p99/v1", "99th percentile of the error of t", "ulp", Lower, Digits(2), Exact),
    Figure::new("point-ulp-p99/v1", "99th percentile of the error of the point", "ulp", Lower, Digits(2), Exact),
    Figure::new("triangles/v1", "triangles", "", Neither, Count, Exact),
    Figure::new("misses/v1", "misses", "", Lower, Count, Exact),
    Figure::new("confirmed-misses/v1", "confirmed misses", "", Lower, Count, Exact),
    Figure::new("lost-hits/v1", "lost", "", Lower, Count, Exact),
    Figure::new("pad-ulps/v1", "pad", "ulp", Neither, Count, Exact),
    Figure::new("self-intersections/v1", "self-intersections", "", Lower, Count, Exact),
    Figure::new("leaks/v1", "leaks", "", Lower, Count, Exact),
    Figure::new("farthest-begin/v1", "farthest begin", "bounds of the point's error", Lower, THREE, Exact),
    Figure::new("test-bytes/v1", "bytes", "", Lower, Count, Exact),
    Figure::new("ns-per-test/v1", "ns per test", "", Lower, THREE, Single),
    Figure::new("traversal-ratio/v1", "traversal against moeller-trumbore", "", Lower, THREE, Single),
    Figure::new("tests-per-ray/v1", "tests per ray", "", Lower, THREE, Exact),
    Figure::new("numerics/v1", "value", "", Lower, THREE, Single),
    Figure::new("alarm/v1", "alarm", "", Neither, THREE, Exact),
];

/// The figure of this crate with this id.
///
/// # Panics
/// There is none: the table and the code that measures do not fit.
pub fn figure(id: &str) -> &'static Figure {
    let found = FIGURES.iter().find(|figure| figure.id == id);
    found.unwrap_or_else(|| panic!("the table of figures has no row {id}"))
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeSet;

    #[test]
    fn every_figure_has_an_id_of_its_own_with_a_version() {
        let ids: BTreeSet<_> = FIGURES.iter().map(|figure| &figure.id).collect();
        assert_eq!(ids.len(), FIGURES.len());
        assert!(ids.iter().all(|id| id.contains("/v")));
        assert_eq!(figure("sah-cost/v1").heading(), "SAH cost");
        assert_eq!(figure("mrays-per-s/v1").heading(), "speed, Mrays/s");
    }
}
