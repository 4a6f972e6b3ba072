//! The figures of pictures by cones.

use crate::sample::POWERS;
use raystone_record::figure::{Better, Figure, Shown, Spread};

const fn figure(id: &'static str, title: &'static str, unit: &'static str, shown: Shown) -> Figure {
    Figure::new(id, title, unit, Better::Lower, shown, Spread::Exact)
}

/// Places of figures after the errors with 1, 2, 4, … samples.
pub(crate) const BIAS: usize = POWERS;
pub(crate) const CROSSING: usize = POWERS + 1;
pub(crate) const ADAPTIVE: usize = POWERS + 2;
pub(crate) const LAYERS: usize = POWERS + 3;
pub(crate) const LAYERS_99: usize = POWERS + 4;
pub(crate) const OPEN: usize = POWERS + 5;
pub(crate) const APART: usize = POWERS + 6;
pub(crate) const AREA: usize = POWERS + 7;
pub(crate) const TIME: usize = POWERS + 8;
pub(crate) const EDGES: usize = POWERS + 9;
pub(crate) const EDGE_BIAS: usize = POWERS + 10;
pub(crate) const EDGE_CROSSING: usize = POWERS + 11;
pub(crate) const SHIMMER: usize = POWERS + 12;

pub(crate) static FIGURES: [Figure; POWERS + 13] = [
    figure("cones-error-1/v1", "RMSE of 1 sample", "", Shown::Digits(3)),
    figure("cones-error-2/v1", "of 2", "", Shown::Digits(3)),
    figure("cones-error-4/v1", "of 4", "", Shown::Digits(3)),
    figure("cones-error-8/v1", "of 8", "", Shown::Digits(3)),
    figure("cones-error-16/v1", "of 16", "", Shown::Digits(3)),
    figure("cones-error-32/v1", "of 32", "", Shown::Digits(3)),
    figure("cones-error-64/v1", "of 64", "", Shown::Digits(3)),
    figure("cones-error-128/v1", "of 128", "", Shown::Digits(3)),
    figure("cones-error-256/v1", "of 256", "", Shown::Digits(3)),
    figure(
        "cones-bias/v1",
        "RMSE of the cone (biased by design)",
        "",
        Shown::Digits(3),
    ),
    figure(
        "cones-crossing/v1",
        "samples with which the sampler is as good",
        "spp",
        Shown::Digits(3),
    ),
    figure(
        "cones-adaptive/v1",
        "RMSE with samples by footprint over that with as many everywhere",
        "",
        Shown::Digits(3),
    ),
    figure(
        "cones-layers/v1",
        "layers of a cone, mean",
        "",
        Shown::Digits(3),
    ),
    figure(
        "cones-layers-99/v1",
        "layers of 99 % of the cones, greatest",
        "",
        Shown::Count,
    ),
    figure(
        "cones-open/v1",
        "part of the cones that no kept layer covers",
        "",
        Shown::Percent,
    ),
    figure(
        "cones-apart/v1",
        "f32 from the oracle, greatest",
        "",
        Shown::Digits(2),
    ),
    figure(
        "cones-area-off/v1",
        "area of an overlap in f32 from quadrature, greatest",
        "",
        Shown::Digits(2),
    ),
    Figure::new(
        "cones-ns/v1",
        "time",
        "ns per cone",
        Better::Lower,
        Shown::Digits(3),
        Spread::Median,
    ),
    Figure::new(
        "cones-edges/v1",
        "pixels at silhouettes",
        "",
        Better::Neither,
        Shown::Percent,
        Spread::Exact,
    ),
    figure(
        "cones-edge-bias/v1",
        "RMSE of the cone there",
        "",
        Shown::Digits(3),
    ),
    figure(
        "cones-edge-crossing/v1",
        "samples with which the sampler is as good there",
        "spp",
        Shown::Digits(3),
    ),
    figure(
        "cones-shimmer/v1",
        "deviation of the error over frames",
        "",
        Shown::Digits(3),
    ),
];
