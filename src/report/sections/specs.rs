//! The tables and plots of the report that choose figures, rows, columns and a caption; terminals show the same ones.

use crate::plot::curves::Ticks;
use crate::spec::Head::{self, Axis, Sampler, Structure, Varied};
use crate::spec::{BY_FIGURE, BY_RAYS, BY_SUBJECT, PlotSpec, TableSpec};
use raystone_record::figure::*;
use raystone_record::{Key, axis};

/// A structure of full cells; the sampler's column has the other axes that vary.
const CELL: Head = Axis("structure", axis::ACCEL);
const WORKGROUP: Head = Varied(":work group", axis::WORKGROUP);

/// A column for each number of points.
const BY_COUNT: fn(&Key) -> String = |key| format!("N = {}", key.label(axis::POINTS));

#[rustfmt::skip]
mod tables {
use super::*;
pub(crate) const SPEED: TableSpec = TableSpec {
    caption: "Speed on {}, Mrays/s: median [{}]", rows: &[Structure], figures: &[&MRAYS_PER_S], across: BY_RAYS,
};
pub(crate) const EXACTNESS: TableSpec = TableSpec {
    caption: "What exactness costs: time over that with the triangle test that is not exact, whose hits differ by rounding and \
              which is not ranked (of the processors where they trace, else by the clock; not in the same rounds)",
    rows: &[Structure], figures: &[&PRICE_OF_EXACTNESS], across: BY_RAYS,
};
pub(crate) const BUILD: TableSpec = TableSpec {
    caption: "Build (one each){}", rows: &[Structure], across: BY_FIGURE,
    figures: &[&BUILD_MS, &BUILD_RATE, &BUILD_PEAK_BYTES, &UPDATE_MS],
};
pub(crate) const BREAK_EVENS: TableSpec = TableSpec {
    caption: "Break-even: thousand rays after which a structure, its build included, overtakes {}, which is built fastest ({} ms)",
    rows: &[Structure], figures: &[&BUILD_MS, &BREAK_EVEN], across: BY_RAYS,
};
pub(crate) const TIMES_TO_IMAGE: TableSpec = TableSpec {
    caption: "Time to image: build + rendering by {} with {}, ms", rows: &[Structure], figures: &[&BUILD_MS, &TIME_TO_IMAGE],
    across: |key| match key.label(axis::SPP) {
        "" => "build".to_owned(),
        spp => format!("build + {spp} spp"),
    },
};
pub(crate) const SHAPE: TableSpec = TableSpec {
    caption: "Size and shape (nodes, leaves: cells where there are cells; SAH and end-point overlap with both constants 1)",
    rows: &[Structure], across: BY_FIGURE,
    figures: &[
        &BYTES, &BYTES_PER_TRIANGLE, &NODES, &LEAVES, &REFERENCES, &REFERENCES_PER_TRIANGLE, &DEPTH, &SAH_COST, &EPO,
    ],
};
pub(crate) const LEAF_SIZES: TableSpec = TableSpec {
    caption: "Leaves (or cells) by the number of references they hold, share",
    rows: &[Structure], figures: &[&LEAF_SHARE], across: BY_SUBJECT,
};
/// Figures that this program does not measure itself.
pub(crate) const OUTSIDE: TableSpec = TableSpec {
    caption: "Further figures on {}", rows: &[Structure], figures: &[], across: BY_FIGURE,
};
pub(crate) const WORK: TableSpec = TableSpec {
    caption: "Counted work per ray (means over a class, from a separate run)",
    rows: &[Axis("class", axis::RAYS), Structure], across: BY_FIGURE,
    figures: &[
        &RAYS, &HIT_SHARE, &UNLIKE_SHADOW, &NODES_PER_RAY, &BOX_TESTS_PER_RAY, &TRIANGLE_TESTS_PER_RAY, &DEEPEST_STACK,
    ],
};
pub(crate) const RECORDED_RAYS: TableSpec = TableSpec {
    caption: "Coherence of the recorded rays, by a model on the host: warps of {} rays that follow each other, {} in each of \
              {}",
    rows: &[Axis("class", axis::RAYS), Structure], across: BY_FIGURE,
    figures: &[&SIMT_EFFICIENCY, &LINES_PER_ISSUE, &L1_HITS, &ISSUES_PER_RAY, &L2_BYTES_PER_RAY, &CYCLES_PER_RAY],
};
pub(crate) const TREES: TableSpec = TableSpec {
    caption: "Trees frame by frame: SAH cost, and what refitting and building anew cost (median [{}]); rays of each gate",
    rows: &[Structure, Axis(":at", axis::SUBJECT)], across: BY_FIGURE,
    figures: &[
        &FRAME_SAH_REFITTED, &FRAME_SAH_REBUILT, &FRAME_SAH_RATIO, &FRAME_REFIT_MS, &FRAME_REFIT_HOST_MS, &FRAME_REBUILD_MS,
        &FRAME_JUDGED,
    ],
};
pub(crate) const FRAME_RAYS: TableSpec = TableSpec {
    caption: "Rays frame by frame: nodes visited and time in the refitted tree over those in the tree built anew, and from how \
              many million rays of a class on building anew pays in that frame (none: its rays are slower; unresolved: the \
              interval of the difference holds 0; any: it costs no more; few: \
              it costs no more, but its rays are slower)",
    rows: &[Structure, Axis(":at", axis::SUBJECT)], across: BY_RAYS,
    figures: &[&FRAME_NODES_RATIO, &FRAME_TIME_RATIO, &FRAME_BREAK_EVEN],
};
const PEER: Head = Axis("peer", axis::PEER);
pub(crate) const PEERS: [TableSpec; 5] = [
    TableSpec {
        caption: "Time of all processors, ns per ray: median [{}]", figures: &[&CPU_NS_PER_RAY], across: BY_RAYS,
        rows: &[PEER, Axis(":structure", axis::ACCEL), Axis(":kernels", axis::KERNELS)],
    },
    TableSpec {
        caption: "Time of the processors over that of a peer: above 1 the peer needs less", figures: &[&CPU_OVER_PEER], across: BY_RAYS,
        rows: &[
            CELL, Axis(":kernels", axis::KERNELS), Axis(":triangle", axis::TRIANGLE), Axis(":box test", axis::BOX_TEST),
            Axis(":over", axis::PEER),
        ],
    },
    TableSpec {
        caption: "Speed by the wall clock, Mrays/s: median [{}]", figures: &[&PEER_MRAYS_PER_S], across: BY_RAYS, rows: &[PEER],
    },
    TableSpec {
        caption: "Rays with another triangle than the reference tracer's, or another answer, per million", figures: &[&UNLIKE_JUDGE],
        across: BY_RAYS, rows: &[PEER],
    },
    TableSpec {
        caption: "Greatest relative difference of a distance at the same triangle", figures: &[&FARTHEST_DISTANCE], across: BY_RAYS,
        rows: &[PEER],
    },
];
pub(crate) const ORGANISATIONS: TableSpec = TableSpec {
    caption: "Organisations of the path tracer: the same image to the bit, in other passes",
    rows: &[
        Varied(":integrator", axis::INTEGRATOR), Axis(":structure", axis::ACCEL), Sampler, Axis(":organisation", axis::ORGANISATION),
        WORKGROUP,
    ],
    figures: &[&MS_PER_SPP, &AGAINST_SINGLE_KERNEL, &RAY_QUERY_SHARE], across: BY_FIGURE,
};
pub(crate) const GAINS: TableSpec = TableSpec {
    caption: "What compiling out gains on {}: time of the kernel that carries a group of features all the same, over that of the \
              specialised one [95 % interval]",
    rows: &[Axis("integrator", axis::INTEGRATOR)], figures: &[&SPECIALISATION],
    across: |key| {
        let [structure, sequence, decorrelation] =
            [axis::ACCEL, axis::SEQUENCE, axis::DECORRELATION].map(|axis| key.label(axis));
        format!("{structure} with {sequence} × {decorrelation}")
    },
};
/// Of one metric and its slope.
pub(crate) const ERRORS: TableSpec = TableSpec {
    caption: "{} with {}: mean [95 % interval] at each spp; metric {}{}", rows: &[Sampler], figures: &[],
    across: |key| match key.label(axis::SPP) {
        "" => "slope".into(),
        spp => format!("{spp} spp"),
    },
};
pub(crate) const FURTHER_ERRORS: TableSpec = TableSpec {
    caption: "Other metrics with {} at {}: mean [95 % interval] over replicates, the noise of the reference included; PSNR, \
              SSIM and FLIP of tone-mapped pictures; `raystone list metrics` has the formulas",
    rows: &[Sampler], figures: &[&MAE, &RELMSE_TRIMMED, &MSE_LUMINANCE, &SMAPE, &PSNR, &SSIM, &FLIP], across: BY_FIGURE,
};
pub(crate) const BIAS: TableSpec = TableSpec {
    caption: "Bias check with {}: biased if the p of the image or of the weighted mean is at most a third of {}, or tiles are \
              rejected at another third (of more, once other samplers were found biased); of a bias of all pixels below the last \
              column it says nothing",
    rows: &[Sampler], across: BY_FIGURE,
    figures: &[
        &BIAS_TILES, &BIAS_REJECTED, &BIAS_LEAST_P, &BIAS_Z, &BIAS_P, &BIAS_FREEDOM, &BIAS_WEIGHTED_P, &BIAS_WEIGHTED_FREEDOM,
        &BIAS_DETECTABLE,
    ],
};
pub(crate) const EFFICIENCY: TableSpec = TableSpec {
    caption: "Error per second with {}, {}", rows: &[Sampler], across: BY_SUBJECT,
    figures: &[&MS_PER_SPP, &ERROR_SECONDS, &ERROR_AT_TIME, &SPP_TO_ERROR, &SECONDS_TO_ERROR],
};
pub(crate) const SPECTRA: TableSpec = TableSpec {
    caption: "Error in space with {} at {}, luminance: power up to 1/8 cycle per pixel (white noise 1), power of the loudest \
              wave (n pixels of white noise: about ln n), correlation of neighbours (white noise 0), RMSE, and share of it after \
              Gaussian filters of standard deviation σ",
    rows: &[Sampler], across: BY_SUBJECT,
    figures: &[&LOW_FREQUENCY_POWER, &LOUDEST_WAVE, &NEIGHBOUR_CORRELATION, &LUMINANCE_RMSE, &FILTERED_SHARE],
};
pub(crate) const ORDERS: TableSpec = TableSpec {
    caption: "Orders of pixels with {}, by the wall clock, a submission for each pass: median [{}]. A picture is there once every \
              pixel has a colour of its own or of the coarser pixel that it lies in",
    rows: &[CELL, Sampler, WORKGROUP, Axis(":order", axis::SUBJECT)], across: BY_FIGURE,
    figures: &[&ORDER_PASSES, &ORDER_MS, &ORDER_RATIO, &FIRST_PICTURE_MS],
};
pub(crate) const PRIMARY: TableSpec = TableSpec {
    caption: "Primary visibility with {}: rasterised against rays through the same points, centres of pixels, with the same \
              samples behind them; wall times of one picture of all first hits, median [{}]. A pixel that sees the same triangle \
              has the same value",
    rows: &[CELL, Sampler, WORKGROUP], across: BY_FIGURE,
    figures: &[
        &PRIMARY_OTHER_TRIANGLE, &PRIMARY_OTHER_VALUE, &PRIMARY_MEAN_DIFFERENCE, &PRIMARY_RMS_DIFFERENCE, &RASTER_MS,
        &TRACED_PRIMARY_MS,
    ],
};
pub(crate) const COHERENCE: TableSpec = TableSpec {
    caption: "Coherence with {}, all rays together",
    rows: &[CELL, Sampler, WORKGROUP, Axis("spp", axis::SPP), Axis(":lanes", axis::SUBJECT)], across: BY_FIGURE,
    figures: &[
        &SIMT_EFFICIENCY, &LINES_PER_ISSUE, &L1_HITS, &L2_HITS, &ISSUES_PER_RAY, &L2_BYTES_PER_RAY, &MEMORY_BYTES_PER_RAY,
        &CYCLES_PER_RAY, &CYCLES_PER_PATH,
    ],
};
pub(crate) const COHERENCE_OF_CLASSES: TableSpec = TableSpec {
    caption: "SIMT efficiency with {} by class of rays, single kernel: of the lanes of warps with any such ray, those that take \
              part in an issue",
    rows: &[CELL, Sampler, WORKGROUP, Axis("spp", axis::SPP)], figures: &[&SIMT_EFFICIENCY], across: BY_RAYS,
};
pub(crate) const POINT_SETS: TableSpec = TableSpec {
    caption: "{}: D* at N = {}, and exponents of N fitted over all N [95 % interval over seeds]: of D*, and of the RMSE of each \
              integrand. Plain Monte Carlo has −0.5 everywhere. A small D* is no promise of a small error: D* ranks a digital \
              shift before Owen scrambling, errors of smooth functions rank them the other way round",
    rows: &[Sampler], figures: &[&STAR_DISCREPANCY, &STAR_EXPONENT, &INTEGRAL_EXPONENT], across: BY_SUBJECT,
};
/// Of one figure.
pub(crate) const POINTS: TableSpec = TableSpec {
    caption: "{} of {}: mean over seeds [95 % interval]", rows: &[Sampler], figures: &[], across: BY_COUNT,
};
pub(crate) const SEVERAL_PIXELS: TableSpec = TableSpec {
    caption: "{}: mean angle between the directions of neighbouring pixels at the same sample, degrees (0: fully coherent), and \
              share of a grid of 4√N × 4√N cells that the points of 150 pixels fall into",
    rows: &[Sampler], figures: &[&NEIGHBOUR_ANGLE, &COVERAGE], across: BY_COUNT,
};
pub(crate) const WORST_PAIRS: TableSpec = TableSpec {
    caption: "The worst pair of dimensions of each sampler, by D* in one pixel among all pairs that the integrators draw: mean D* \
              over seeds [95 % interval]",
    rows: &[Sampler, Axis(":dimensions", axis::DIMENSIONS)], figures: &[&STAR_DISCREPANCY], across: BY_FIGURE,
};
pub(crate) const DRAWING: TableSpec = TableSpec {
    caption: "Cost of drawing on this adapter, nanoseconds per two-dimensional sample: median [{}], empty loop taken off, all \
              units of the adapter together",
    rows: &[Sampler], figures: &[&NS_PER_SAMPLE, &LOOP_NS], across: BY_FIGURE,
};
pub(crate) const GROWTH: TableSpec = TableSpec {
    caption: "Growth with the number of elements n: relative residuals of both models, of two constants each, and the difference \
              of Akaike's criteria, each fitted round by round: median [{}]. A model is named where the whole interval is beyond ±2",
    rows: &[Axis("method", axis::INTEGRATOR), Axis(":kernels", axis::KERNELS)], across: BY_FIGURE,
    figures: &[&GROWTH_LINEAR, &GROWTH_LINEARITHMIC, &GROWTH_DIFFERENCE],
};
}
pub(crate) use tables::*;

#[rustfmt::skip]
mod plots {
use super::*;
const FRAME: fn(&Key) -> Option<f64> = |key| key.label(axis::SUBJECT).strip_prefix("frame ")?.parse().ok();
const BOUNCES: fn(&Key) -> Option<f64> = |key| match key.label(axis::RAYS) {
    "primary" => Some(0.0),
    rays => rays.strip_prefix("bounce ")?.parse().ok(),
};
const SPP: fn(&Key) -> Option<f64> = |key| key.label(axis::SPP).parse().ok();
const COUNT: fn(&Key) -> Option<f64> = |key| key.label(axis::POINTS).parse().ok();

/// Of one metric.
pub(crate) const ERROR_CURVES: PlotSpec = PlotSpec {
    name: "", x_title: "samples per pixel", x_ticks: Ticks::PowersOfTwo, x: SPP, curves: Sampler, y_title: "", figures: &[],
    caption: "{} against samples. Bands: 95 % interval, of replicates and reference; dashed: deterministic.{}",
};
pub(crate) const FRAME_PLOTS: [PlotSpec; 3] = [
    PlotSpec {
        name: "-animation-sah", x_title: "frame", x_ticks: Ticks::Whole, x: FRAME, curves: Structure,
        y_title: "SAH, refitted over rebuilt", figures: &[(&FRAME_SAH_RATIO, "")],
        caption: "SAH cost of the refitted tree over that of the tree built anew, frame by frame.",
    },
    PlotSpec {
        name: "-animation-cost", x_title: "frame", x_ticks: Ticks::Whole, x: FRAME, curves: Structure,
        y_title: "cost of a frame, ms", figures: &[(&FRAME_REFIT_MS, ", refitted"), (&FRAME_REBUILD_MS, ", rebuilt")],
        caption: "What refitting (full lines) and building anew (dashed) cost in each frame: median [{}].",
    },
    PlotSpec {
        name: "-animation-nodes", x_title: "frame", x_ticks: Ticks::Whole, x: FRAME, curves: Structure,
        y_title: "nodes per ray, refitted over rebuilt", figures: &[(&FRAME_NODES_RATIO, "")],
        caption: "Nodes that a bounce ray (where there are none: the first class) visits in the refitted tree, over those in the \
                  tree built anew.",
    },
];
pub(crate) const EFFICIENCY_BY_BOUNCE: PlotSpec = PlotSpec {
    name: "-efficiency-bounces", x_title: "bounces before the ray", x_ticks: Ticks::Whole, x: BOUNCES, curves: Sampler,
    y_title: "SIMT efficiency", figures: &[(&SIMT_EFFICIENCY, "")],
    caption: "SIMT efficiency by bounce at the highest spp, with {}, single kernel: lanes that take part in an issue over lanes of \
              warps with any ray of that bounce.",
};
pub(crate) const CYCLES_BY_SPP: PlotSpec = PlotSpec {
    name: "-cycles-spp", x_title: "samples per pixel", x_ticks: Ticks::PowersOfTwo, x: SPP, curves: Sampler,
    y_title: "predicted cycles per path", figures: &[(&CYCLES_PER_PATH, "")],
    caption: "Predicted cycles of a path by samples per pixel, with {}, single kernel.",
};
pub(crate) const DISCREPANCY: PlotSpec = PlotSpec {
    name: "", x_title: "number of points N", x_ticks: Ticks::PowersOfTwo, x: COUNT, curves: Sampler,
    y_title: "star discrepancy D*", figures: &[(&STAR_DISCREPANCY, "")],
    caption: "{}: exact star discrepancy of the first N points. Bands: 95 % interval over seeds; dashed curves: deterministic.",
};
/// Of one function.
pub(crate) const INTEGRAL: PlotSpec = PlotSpec {
    name: "", x_title: "number of points N", x_ticks: Ticks::PowersOfTwo, x: COUNT, curves: Sampler,
    y_title: "", figures: &[(&INTEGRAL_RMSE, "")],
    caption: "{}: RMSE of the integral of integrand:{} over the first N points. Bands: 95 % interval over seeds; dashed curves: \
              deterministic.",
};
}
pub(crate) use plots::*;
