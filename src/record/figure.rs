//! The table of figures: the title, unit, better direction, format and interval of each. Pages, tables, plots and
//! exports read it; adding a figure is a row here (or, from outside, in the registry of figures) and the code that
//! measures it.

use Better::{Higher, Lower, Neither};
use Shown::{Bytes, Count, Digits, Exponent, Percent};
use Spread::{Exact, Jackknife, Mean, Median, Single};
use serde::{Deserialize, Serialize};
use std::borrow::Cow;
use std::collections::HashMap;
use std::sync::LazyLock;

/// The direction of better values.
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

/// The format of a value.
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

/// The method behind an interval.
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
    /// Returns the description shown to readers.
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
    /// Its title.
    pub title: Cow<'static, str>,
    /// Its unit; empty for plain numbers and for units that are written with the value.
    pub unit: Cow<'static, str>,
    /// The direction of better values.
    pub better: Better,
    /// Its format.
    pub shown: Shown,
    /// The method behind its interval.
    pub spread: Spread,
}

impl Figure {
    /// Returns a row of the table.
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

    /// Returns title and unit, as the head of a column.
    pub fn heading(&self) -> String {
        if self.unit.is_empty() {
            self.title.to_string()
        } else {
            format!("{}, {}", self.title, self.unit)
        }
    }
}

/// Three significant digits.
const THREE: Shown = Digits(3);

/// Declares figures, each a static of its own, and the list of all of them.
macro_rules! figures {
    ($($name:ident = $id:literal, $title:literal, $unit:literal, $better:expr, $shown:expr, $spread:expr;)*) => {
        $(
            #[doc = $title]
            pub static $name: Figure = Figure::new($id, $title, $unit, $better, $shown, $spread);
        )*

        /// All figures of this program.
        pub static FIGURES: &[&Figure] = &[$(&$name),*];
    };
}

#[rustfmt::skip]
figures! {
    // A structure and a class of rays.
    MRAYS_PER_S = "mrays-per-s/v1", "speed", "Mrays/s", Higher, THREE, Median;
    RAYS = "rays/v1", "rays", "", Neither, Count, Exact;
    HIT_SHARE = "hit-share/v1", "hit", "", Neither, Percent, Exact;
    UNLIKE_SHADOW = "unlike-shadow/v1", "unlike the shadow ray", "per million", Neither, THREE, Exact;
    NODES_PER_RAY = "nodes-per-ray/v1", "nodes/ray", "", Lower, THREE, Exact;
    BOX_TESTS_PER_RAY = "box-tests-per-ray/v1", "box tests/ray", "", Lower, THREE, Exact;
    TRIANGLE_TESTS_PER_RAY = "triangle-tests-per-ray/v1", "triangle tests/ray", "", Lower, THREE, Exact;
    DEEPEST_STACK = "deepest-stack/v1", "deepest stack", "", Lower, Count, Exact;
    // External ray casters, and structures beside them.
    CPU_NS_PER_RAY = "cpu-ns-per-ray/v1", "time of the processors", "ns per ray", Lower, THREE, Median;
    CPU_OVER_PEER = "cpu-over-peer/v1", "time of the processors over a peer's", "", Lower, THREE, Median;
    PRICE_OF_EXACTNESS = "price-of-exactness/v1", "time over that with a test that is not exact", "", Lower, THREE, Median;
    PEER_MRAYS_PER_S = "peer-mrays-per-s/v1", "speed of a peer", "Mrays/s", Higher, THREE, Median;
    UNLIKE_JUDGE = "unlike-judge/v1", "unlike the reference tracer", "per million", Neither, THREE, Exact;
    FARTHEST_DISTANCE = "farthest-distance/v1", "farthest distance", "", Neither, THREE, Exact;
    // A structure.
    BUILD_MS = "build-ms/v1", "build", "ms", Lower, THREE, Single;
    BUILD_RATE = "build-rate/v1", "build", "Mtris/s", Higher, THREE, Single;
    BUILD_PEAK_BYTES = "build-peak-bytes/v1", "peak memory", "", Lower, Bytes, Single;
    UPDATE_MS = "update-ms/v1", "update", "ms", Lower, THREE, Single;
    BYTES = "bytes/v1", "size", "", Lower, Bytes, Exact;
    BYTES_PER_TRIANGLE = "bytes-per-triangle/v1", "bytes/triangle", "", Lower, THREE, Exact;
    NODES = "nodes/v1", "nodes", "", Neither, Count, Exact;
    LEAVES = "leaves/v1", "leaves", "", Neither, Count, Exact;
    REFERENCES = "references/v1", "references", "", Lower, Count, Exact;
    REFERENCES_PER_TRIANGLE = "references-per-triangle/v1", "references/triangle", "", Lower, THREE, Exact;
    DEPTH = "depth/v1", "depth", "", Lower, Count, Exact;
    SAH_COST = "sah-cost/v1", "SAH cost", "", Lower, THREE, Exact;
    EPO = "epo/v1", "EPO", "", Lower, THREE, Exact;
    LEAF_SHARE = "leaf-share/v1", "share of the leaves", "", Neither, Percent, Exact;
    BREAK_EVEN = "break-even/v1", "break-even", "thousand rays", Lower, THREE, Single;
    // Full cells.
    MS_PER_SPP = "ms-per-spp/v1", "time per sample per pixel", "ms", Lower, THREE, Median;
    RAY_QUERY_SHARE = "ray-query-share/v1", "time in ray queries", "", Neither, Percent, Exact;
    AGAINST_SINGLE_KERNEL = "against-single-kernel/v1", "time over that of single-kernel", "", Lower, THREE, Median;
    CELL_MRAYS_PER_S = "cell-mrays-per-s/v1", "speed of the whole cell", "Mrays/s", Higher, THREE, Median;
    ORDER_PASSES = "order-passes/v1", "passes per sample", "", Neither, Count, Exact;
    ORDER_MS = "order-ms/v1", "time per sample per pixel", "ms", Lower, THREE, Median;
    ORDER_RATIO = "order-ratio/v1", "over one pass", "", Lower, THREE, Single;
    FIRST_PICTURE_MS = "first-picture-ms/v1", "time to the first picture", "ms", Lower, THREE, Median;
    PRIMARY_OTHER_TRIANGLE = "primary-other-triangle/v1", "see another triangle", "", Neither, Percent, Exact;
    PRIMARY_OTHER_VALUE = "primary-other-value/v1", "have another value", "", Neither, Percent, Exact;
    PRIMARY_MEAN_DIFFERENCE = "primary-mean-difference/v1", "difference of the mean, over the mean", "", Neither, THREE, Exact;
    PRIMARY_RMS_DIFFERENCE = "primary-rms-difference/v1", "RMS difference, over the mean", "", Neither, THREE, Exact;
    RASTER_MS = "raster-ms/v1", "rasterised", "ms", Lower, THREE, Median;
    TRACED_PRIMARY_MS = "traced-primary-ms/v1", "traced", "ms", Lower, THREE, Median;
    SPECIALISATION = "specialisation/v1", "time over that of the specialised kernel", "", Neither, THREE, Mean;
    TIME_TO_IMAGE = "time-to-image/v1", "build and rendering", "ms", Lower, THREE, Single;
    ERROR_SECONDS = "error-seconds/v1", "unbiased relMSE × seconds", "", Lower, THREE, Jackknife;
    ERROR_AT_TIME = "error-at-time/v1", "unbiased relMSE at equal time", "", Lower, THREE, Jackknife;
    SPP_TO_ERROR = "spp-to-error/v1", "samples per pixel to an error", "", Lower, THREE, Jackknife;
    SECONDS_TO_ERROR = "seconds-to-error/v1", "time to an error", "s", Lower, THREE, Jackknife;
    // Coherence, by a model.
    SIMT_EFFICIENCY = "simt-efficiency/v1", "SIMT efficiency", "", Higher, Percent, Exact;
    LINES_PER_ISSUE = "lines-per-issue/v1", "cache lines/issue", "", Lower, THREE, Exact;
    L1_HITS = "l1-hits/v1", "found in L1", "", Higher, Percent, Exact;
    L2_HITS = "l2-hits/v1", "of the rest in L2", "", Higher, Percent, Exact;
    ISSUES_PER_RAY = "issues-per-ray/v1", "issues/ray", "", Lower, THREE, Exact;
    ASKED_BYTES_PER_RAY = "asked-bytes-per-ray/v1", "bytes asked for/ray", "", Lower, THREE, Exact;
    L2_BYTES_PER_RAY = "l2-bytes-per-ray/v1", "bytes from L2/ray", "", Lower, THREE, Exact;
    MEMORY_BYTES_PER_RAY = "memory-bytes-per-ray/v1", "bytes from memory/ray", "", Lower, THREE, Exact;
    CYCLES_PER_RAY = "cycles-per-ray/v1", "predicted cycles/ray", "", Lower, THREE, Exact;
    CYCLES_PER_PATH = "cycles-per-path/v1", "predicted cycles/path", "", Lower, THREE, Exact;
    // Errors of samplers.
    RELMSE_UNBIASED = "relmse-unbiased/v1", "unbiased relMSE", "", Lower, THREE, Jackknife;
    RMSE_UNBIASED = "rmse-unbiased/v1", "unbiased RMSE", "", Lower, THREE, Jackknife;
    RELMSE = "relmse/v1", "relMSE", "", Lower, THREE, Jackknife;
    RMSE = "rmse/v1", "RMSE", "", Lower, THREE, Jackknife;
    RELMSE_SLOPE = "relmse-slope/v1", "slope of relMSE", "", Lower, Exponent, Jackknife;
    RMSE_SLOPE = "rmse-slope/v1", "slope of RMSE", "", Lower, Exponent, Jackknife;
    MAE = "mae/v1", "MAE", "", Lower, THREE, Mean;
    RELMSE_TRIMMED = "relmse-trimmed/v1", "relMSE without the 0.1 % worst", "", Lower, THREE, Mean;
    MSE_LUMINANCE = "mse-luminance/v1", "MSE of luminance", "", Lower, THREE, Mean;
    SMAPE = "smape/v1", "SMAPE", "", Lower, THREE, Mean;
    PSNR = "psnr/v1", "PSNR", "dB", Higher, THREE, Mean;
    SSIM = "ssim/v1", "SSIM", "", Higher, THREE, Mean;
    FLIP = "flip/v1", "FLIP", "", Lower, THREE, Mean;
    BIAS_TILES = "bias-tiles/v1", "tiles", "", Neither, Count, Exact;
    BIAS_REJECTED = "bias-rejected/v1", "rejected", "", Lower, Count, Exact;
    BIAS_LEAST_P = "bias-least-p/v1", "smallest p of a tile", "", Neither, THREE, Exact;
    BIAS_Z = "bias-z/v1", "z of the image", "", Neither, THREE, Exact;
    BIAS_P = "bias-p/v1", "p of the image", "", Neither, THREE, Exact;
    BIAS_FREEDOM = "bias-freedom/v1", "degrees of freedom", "", Neither, THREE, Exact;
    BIAS_WEIGHTED_P = "bias-weighted-p/v1", "p of the weighted mean", "", Neither, THREE, Exact;
    BIAS_WEIGHTED_FREEDOM = "bias-weighted-freedom/v1", "its degrees of freedom", "", Neither, THREE, Exact;
    BIAS_DETECTABLE = "bias-detectable/v1", "bias found in 90 % of cases", "%", Lower, Digits(2), Exact;
    LOW_FREQUENCY_POWER = "low-frequency-power/v1", "low-frequency power", "", Lower, THREE, Mean;
    LOUDEST_WAVE = "loudest-wave/v1", "loudest wave", "", Lower, THREE, Mean;
    NEIGHBOUR_CORRELATION = "neighbour-correlation/v1", "correlation", "", Lower, THREE, Mean;
    LUMINANCE_RMSE = "luminance-rmse/v1", "RMSE", "", Lower, THREE, Mean;
    FILTERED_SHARE = "filtered-share/v1", "share of the RMSE after a filter", "", Lower, Percent, Single;
    REFERENCE_MSE = "reference-mse/v1", "MSE of the reference", "", Lower, THREE, Single;
    // Point sets.
    STAR_DISCREPANCY = "star-discrepancy/v1", "D*, star discrepancy", "", Lower, THREE, Mean;
    L2_STAR = "l2-star/v1", "L2-star discrepancy (root)", "", Lower, THREE, Mean;
    CENTERED = "centered/v1", "Centered discrepancy (square)", "", Lower, THREE, Mean;
    STAR_EXPONENT = "star-exponent/v1", "D* exponent", "", Lower, Exponent, Mean;
    L2_STAR_EXPONENT = "l2-star-exponent/v1", "L2-star exponent", "", Lower, Exponent, Mean;
    INTEGRAL_RMSE = "integral-rmse/v1", "RMSE of an integral", "", Lower, THREE, Mean;
    INTEGRAL_EXPONENT = "integral-exponent/v1", "exponent of that RMSE", "", Lower, Exponent, Mean;
    NEIGHBOUR_ANGLE = "neighbour-angle/v1", "angle", "degrees", Neither, THREE, Exact;
    COVERAGE = "coverage/v1", "coverage", "", Higher, Percent, Exact;
    NS_PER_SAMPLE = "ns-per-sample/v1", "ns per sample", "", Lower, THREE, Median;
    LOOP_NS = "loop-ns/v1", "empty loop", "ns", Neither, THREE, Median;
    // Compactions of streams.
    COMPACTION_NS = "compaction-ns/v1", "time per element", "ns", Lower, THREE, Median;
    COMPACTION_MELEMENTS_PER_S = "compaction-melements-per-s/v1", "speed", "Melements/s", Higher, THREE, Median;
    COMPACTION_GB_PER_S = "compaction-gb-per-s/v1", "least traffic over time", "GB/s", Higher, THREE, Median;
    COMPACTION_RATIO = "compaction-ratio/v1", "time over that of roger", "", Lower, THREE, Median;
    COMPACTION_PASSES = "compaction-passes/v1", "passes", "", Lower, Count, Exact;
    COMPACTION_KEPT = "compaction-kept/v1", "elements that stay", "", Neither, Count, Exact;
    COMPACTION_LEAST_BYTES = "compaction-least-bytes/v1", "least traffic", "", Neither, Bytes, Exact;
    COMPACTION_SCRATCH = "compaction-scratch/v1", "memory between passes", "", Lower, Bytes, Exact;
    GROWTH_LINEAR = "growth-linear/v1", "residual of a + b·n", "", Lower, Percent, Median;
    GROWTH_LINEARITHMIC = "growth-linearithmic/v1", "residual of a + b·n·log n", "", Lower, Percent, Median;
    GROWTH_DIFFERENCE = "growth-difference/v1", "criterion of n less that of n log n", "", Neither, THREE, Median;
    // A structure in a frame of a moving scene.
    FRAME_SAH_REFITTED = "frame-sah-refitted/v1", "SAH, refitted", "", Lower, THREE, Exact;
    FRAME_SAH_REBUILT = "frame-sah-rebuilt/v1", "SAH, rebuilt", "", Lower, THREE, Exact;
    FRAME_SAH_RATIO = "frame-sah-ratio/v1", "SAH, refitted over rebuilt", "", Lower, THREE, Exact;
    FRAME_REFIT_MS = "frame-refit-ms/v1", "refit", "ms", Lower, THREE, Median;
    FRAME_REFIT_HOST_MS = "frame-refit-host-ms/v1", "refit on the host", "ms", Lower, THREE, Median;
    FRAME_REBUILD_MS = "frame-rebuild-ms/v1", "rebuild", "ms", Lower, THREE, Median;
    FRAME_JUDGED = "frame-judged/v1", "checked rays", "", Neither, Count, Exact;
    FRAME_NODES_RATIO = "frame-nodes-ratio/v1", "nodes/ray, refitted over rebuilt", "", Lower, THREE, Exact;
    FRAME_TIME_RATIO = "frame-time-ratio/v1", "time of rays, refitted over rebuilt", "", Lower, THREE, Median;
    FRAME_BREAK_EVEN = "frame-break-even/v1", "rebuilding pays from", "million rays", Neither, THREE, Single;
    // Hard scenes and rays, checked exactly.
    FALSE_MISSES = "false-misses/v1", "false misses", "", Lower, Count, Exact;
    UNEXPLAINED_MISSES = "unexplained-misses/v1", "unexplained misses", "", Lower, Count, Exact;
    CRACKS = "cracks/v1", "cracks", "", Lower, Count, Exact;
    FALSE_HITS = "false-hits/v1", "false hits", "", Lower, Count, Exact;
    UNEXPLAINED_HITS = "unexplained-hits/v1", "unexplained hits", "", Lower, Count, Exact;
    WRONG_TRIANGLE = "wrong-triangle/v1", "wrong triangle", "", Lower, Count, Exact;
    NOT_NEAREST = "not-nearest/v1", "not nearest", "", Lower, Count, Exact;
    BORDERLINE = "borderline/v1", "borderline", "", Neither, Count, Exact;
    DIFFERING = "differing/v1", "differing from brute force", "", Lower, Count, Exact;
    UNEQUAL = "unequal/v1", "closest and any hits that differ from brute force", "", Lower, Count, Exact;
    ANY_DIFFERING = "any-differing/v1", "any hits differing from brute force", "", Lower, Count, Exact;
    TIES = "ties/v1", "ties", "", Neither, Count, Exact;
    SLOWDOWN = "slowdown/v1", "slowdown", "", Lower, THREE, Single;
    FAILED_CASES = "failed-cases/v1", "failed", "", Lower, Count, Exact;
    T_ULP_MEDIAN = "t-ulp-median/v1", "median of the error of t", "ulp", Lower, Digits(2), Exact;
    T_ULP_P99 = "t-ulp-p99/v1", "99th percentile of the error of t", "ulp", Lower, Digits(2), Exact;
    T_ULP_MOST = "t-ulp-most/v1", "greatest error of t", "ulp", Lower, Digits(2), Exact;
    T_MEDIAN = "t-median/v1", "median of the relative error of t", "", Lower, Digits(2), Exact;
    T_P99 = "t-p99/v1", "99th percentile of the relative error of t", "", Lower, Digits(2), Exact;
    T_MOST = "t-most/v1", "greatest relative error of t", "", Lower, Digits(2), Exact;
    POINT_ULP_MEDIAN = "point-ulp-median/v1", "median of the error of the point", "ulp", Lower, Digits(2), Exact;
    POINT_ULP_P99 = "point-ulp-p99/v1", "99th percentile of the error of the point", "ulp", Lower, Digits(2), Exact;
    POINT_ULP_MOST = "point-ulp-most/v1", "greatest error of the point", "ulp", Lower, Digits(2), Exact;
    POINT_MEDIAN = "point-median/v1", "median of the relative error of the point", "", Lower, Digits(2), Exact;
    POINT_P99 = "point-p99/v1", "99th percentile of the relative error of the point", "", Lower, Digits(2), Exact;
    POINT_MOST = "point-most/v1", "greatest relative error of the point", "", Lower, Digits(2), Exact;
    TRIANGLES = "triangles/v1", "triangles", "", Neither, Count, Exact;
    MISSES = "misses/v1", "misses", "", Lower, Count, Exact;
    MISS_SHARE = "miss-share/v1", "share of misses", "", Lower, THREE, Exact;
    CONFIRMED_MISSES = "confirmed-misses/v1", "confirmed misses", "", Lower, Count, Exact;
    LOST_HITS = "lost-hits/v1", "lost", "", Lower, Count, Exact;
    PAD_ULPS = "pad-ulps/v1", "pad", "ulp", Neither, Count, Exact;
    SOUND_PAD = "sound-pad/v1", "smallest pad that loses no hit", "ulp", Lower, THREE, Exact;
    SELF_INTERSECTIONS = "self-intersections/v1", "self-intersections", "", Lower, Count, Exact;
    LEAKS = "leaks/v1", "leaks", "", Lower, Count, Exact;
    BAD_BEGINS = "bad-begins/v1", "self-intersections and leaks", "", Lower, Count, Exact;
    FARTHEST_BEGIN = "farthest-begin/v1", "farthest begin", "bounds of the point's error", Lower, THREE, Exact;
    TEST_BYTES = "test-bytes/v1", "bytes", "", Lower, Count, Exact;
    NS_PER_TEST = "ns-per-test/v1", "ns per test", "", Lower, THREE, Single;
    TRAVERSAL_RATIO = "traversal-ratio/v1", "traversal against moeller-trumbore", "", Lower, THREE, Single;
    TESTS_PER_RAY = "tests-per-ray/v1", "tests per ray", "", Lower, THREE, Exact;
    NUMERICS = "numerics/v1", "value", "", Lower, THREE, Single;
    ALARM = "alarm/v1", "alarm", "", Neither, THREE, Exact;
    ALARMS = "alarms/v1", "figures beyond their alarm level", "", Lower, Count, Exact;
}

/// Returns the figure of this program with this id.
pub fn find(id: &str) -> Option<&'static Figure> {
    static BY_ID: LazyLock<HashMap<&str, &Figure>> = LazyLock::new(|| {
        FIGURES
            .iter()
            .map(|figure| (&*figure.id, *figure))
            .collect()
    });
    BY_ID.get(id).copied()
}

/// Returns the figure of this id, which must exist.
///
/// # Panics
/// There is none: the table and the code that measures do not fit.
pub fn figure(id: &str) -> &'static Figure {
    find(id).unwrap_or_else(|| panic!("the table of figures has no row {id}"))
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
