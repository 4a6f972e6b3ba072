//! What a cell says of its stages, orders of passes and rasterised rays, what is said of modelled accesses, and what replicates say of
//! the parts of a reference: of known numbers, beside [`super::known_readings`].

use crate::coherence::Tally;
use crate::figure::UNLIKE_SHADOW;
use crate::replicates::{Replicates, Without};
use crate::{
    ClassTiming, ErrorAtSpp, ErrorRecord, Interval, OrderTime, PrimaryRecord, RayClass, Reading,
    Tail, TimeRecord,
};

/// A figure's name, what was found, and what it should be.
type Known = (String, f64, f64);

/// Relative error of a quotient.
const ROUNDING: f64 = 1e-12;

/// Of 10 issues, 30 of 40 lanes, 800 bytes and 20 lines, of which 12 are in the L1 and 6 in the L2, for 4 rays; a line has 128 bytes. Cycles
/// are 10 · 25 + 20 · 1 + 8 · 5 + 2 · 9.
const TALLY: [(&str, f64); 9] = [
    ("simt-efficiency/v1", 0.75),
    ("lines-per-issue/v1", 2.0),
    ("l1-hits/v1", 0.6),
    ("l2-hits/v1", 0.75),
    ("issues-per-ray/v1", 2.5),
    ("asked-bytes-per-ray/v1", 200.0),
    ("l2-bytes-per-ray/v1", 256.0),
    ("memory-bytes-per-ray/v1", 64.0),
    ("cycles-per-ray/v1", 82.0),
];
/// Of stages of 3, 1 and 4 ms the first two are queries; sixteen passes take twice the time of one; of 400 pixels 4 see another triangle
/// and 6 have another value.
const CELL: [(&str, f64); 17] = [
    ("ms-per-spp/v1", 2.5),
    ("cell-mrays-per-s/v1", 0.07),
    ("ray-query-share/v1", 0.5),
    ("order-passes/v1", 1.0),
    ("order-ms/v1", 2.0),
    ("order-ratio/v1", 1.0),
    ("first-picture-ms/v1", 2.0),
    ("order-passes/v1", 16.0),
    ("order-ms/v1", 4.0),
    ("order-ratio/v1", 2.0),
    ("first-picture-ms/v1", 0.25),
    ("primary-other-triangle/v1", 0.01),
    ("primary-other-value/v1", 0.015),
    ("primary-mean-difference/v1", 0.125),
    ("primary-rms-difference/v1", 0.375),
    ("raster-ms/v1", 0.5),
    ("traced-primary-ms/v1", 0.75),
];

/// Reads them anew.
///
/// # Errors
/// A figure is not what it should be: which, and both values.
pub(crate) fn check(cell: TimeRecord) -> Result<(), String> {
    let mut tally = tally();
    tally += tally;
    let figures = tally.figures(128).into_iter();
    let figures = figures.map(|(figure, value)| (figure.id.to_string(), value.unwrap_or(f64::NAN)));
    let readings = with_orders(cell).readings();
    if readings.len() != CELL.len() {
        return Err(format!("a known cell has {} readings", readings.len()));
    }
    let readings = readings
        .iter()
        .map(|Reading { figure, value, .. }| (figure.to_string(), value.value));
    let pairs = figures.zip(TALLY).chain(readings.zip(CELL));
    let of_figures = pairs.map(|((id, found), (known, value))| {
        let found = if id == known { found } else { f64::NAN };
        (known.to_owned(), found, value)
    });
    let mut all = of_figures.chain(sources()).chain([unlike()]);
    let wrong = all.find(|(_, found, expected)| {
        let agrees = (found - expected).abs() <= ROUNDING * expected.abs();
        !agrees
    });
    wrong.map_or(Ok(()), |(name, found, expected)| {
        Err(format!(
            "the figure {name} of known records is {found}, and should be {expected}: this program shows wrong figures; build it \
             anew, and report what stays wrong"
        ))
    })
}

fn tally() -> Tally {
    Tally {
        rays: 4,
        nodes: 9,
        triangles: 3,
        issues: 10,
        active: 30,
        lanes: 40,
        bytes: 800,
        lines: 20,
        l1_hits: 12,
        l2_hits: 6,
    }
}

fn with_orders(cell: TimeRecord) -> TimeRecord {
    let exact = |x| Some(Interval::exact(x));
    let order = |order: &str, passes, ms, first| OrderTime {
        order: order.to_owned(),
        passes,
        ms_per_spp: exact(ms),
        first_picture_ms: exact(first),
    };
    let stages = [("closest hits", 3.0), ("any hits", 1.0), ("shading", 4.0)];
    TimeRecord {
        stages: stages.map(|(name, ms)| (name.to_owned(), ms)).into(),
        orders: vec![
            order("one-pass", 1, 2.0, 2.0),
            order("blocks", 16, 4.0, 0.25),
        ],
        primary: Some(PrimaryRecord {
            pixels: 400,
            other_triangle: 4,
            other_value: 6,
            unexplained: 2,
            mean_difference: 0.125,
            rms_difference: 0.375,
            raster_ms: exact(0.5),
            traced_ms: exact(0.75),
        }),
        ..cell
    }
}

/// Three of 6,000 rays, by the million.
fn unlike() -> Known {
    let timing = ClassTiming {
        class: RayClass::ShadowReversed,
        rays: 6000,
        hit_fraction: 0.5,
        unlike_shadow: Some(3),
        ms: vec![1.0],
        wall_ms: vec![1.0],
        cpu_ms: Vec::new(),
        mrays_s: Interval::exact(6.0),
        counters: None,
        dispatches: 1,
        discarded: 0,
    };
    let readings = timing.readings();
    let found = readings.iter().find(|r| r.figure == UNLIKE_SHADOW.id);
    let found = found.map_or(f64::NAN, |reading| reading.value.value);
    (UNLIKE_SHADOW.id.to_string(), found, 500.0)
}

/// Two replicates, not in their order, of values 4 and 8, against a reference without each of its four parts: means without a part of either
/// half, without a replicate, and what the last replicate says of the tail.
fn sources() -> Vec<Known> {
    const ID: &str = "metric";
    let record = |replicate: u32, value: f64, share: f64| ErrorRecord {
        randomised: true,
        replicate,
        seed: replicate,
        resolution: [2, 2],
        errors: vec![ErrorAtSpp {
            spp: 4,
            metrics: [(ID.to_owned(), value)].into(),
            without_part: [(
                ID.to_owned(),
                [1.0, 2.0, 3.0, 5.0].map(|part| part * value).to_vec(),
            )]
            .into(),
            tail: Some(Tail {
                greatest_share: share,
                missed: 0.0,
            }),
            partial_net: false,
        }],
        stop: None,
        non_finite_pixels: 0,
        image_hash: String::new(),
        image: None,
        error_map: None,
    };
    let (second, first) = (record(1, 8.0, 0.5), record(0, 4.0, 0.25));
    let all = [&second, &first];
    let all = Replicates(&all);
    let mean = |without| all.mean(ID, 4, without);
    let found = all.sources(ID, mean).unwrap_or_default();
    let at = |source: usize, place: usize| {
        let estimates = found.get(source).and_then(|of| of.get(place));
        estimates.copied().unwrap_or(f64::NAN)
    };
    let share = all.tail(4).map_or(f64::NAN, |tail| tail.greatest_share);
    vec![
        (
            "mean of replicates".to_owned(),
            mean(Without::Nothing).unwrap_or(f64::NAN),
            6.0,
        ),
        ("mean without the first part".to_owned(), at(0, 0), 6.0),
        ("mean without the second part".to_owned(), at(0, 1), 12.0),
        ("mean without the third part".to_owned(), at(1, 0), 18.0),
        ("mean without the last part".to_owned(), at(1, 1), 30.0),
        ("mean without a replicate".to_owned(), at(2, 0), 4.0),
        ("mean without another replicate".to_owned(), at(2, 1), 8.0),
        ("greatest share of a pixel".to_owned(), share, 0.5),
    ]
}
