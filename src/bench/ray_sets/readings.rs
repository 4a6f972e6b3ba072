//! Figures of sets of rays.

use super::descent::Descent;
use crate::timing::Samples;
use raystone_accel::{Anatomy, Division, LevelAnatomy, StreamCounts};
use raystone_core::geometry::Ray;
use raystone_record::figure::{Better, CYCLES_PER_RAY, Figure, Shown, Spread};
use raystone_record::{Key, Reading, axis};

const fn counted(id: &'static str, title: &'static str, unit: &'static str) -> Figure {
    let shown = Shown::Digits(3);
    Figure::new(id, title, unit, Better::Lower, shown, Spread::Exact)
}

/// What depends on the order in which pairs come, where a stream is too short.
const fn once(id: &'static str, title: &'static str, unit: &'static str) -> Figure {
    let shown = Shown::Digits(3);
    Figure::new(id, title, unit, Better::Lower, shown, Spread::Single)
}

/// What describes a level, and is neither good nor bad.
const fn shape(id: &'static str, title: &'static str, unit: &'static str) -> Figure {
    let shown = Shown::Digits(3);
    Figure::new(id, title, unit, Better::Neither, shown, Spread::Exact)
}

const fn time(id: &'static str, title: &'static str) -> Figure {
    let (shown, spread) = (Shown::Digits(3), Spread::Median);
    Figure::new(id, title, "ns per ray", Better::Lower, shown, spread)
}

const TIME: usize = 0;
const FRAME: usize = 1;
const BUILD: usize = 2;
const BYTES: usize = 3;
const LIVE: usize = 4;
const TESTS: usize = 5;
const CANDIDATES: usize = 6;
const LONGEST: usize = 7;
const WALKED: usize = 8;
/// The first of those of a level.
const LEVEL: usize = 9;
const TRIANGLES: usize = 16;
const ERROR: usize = 17;
const REFIT: usize = 18;
const REFIT_FRAME: usize = 19;
const PASS: usize = 20;
const FIRST: usize = 21;

pub(super) static FIGURES: [Figure; 22] = [
    time("rays-ns/v1", "time"),
    time("rays-frame-ns/v1", "time with building"),
    Figure::new(
        "rays-build-ms/v1",
        "building",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    Figure::new(
        "rays-bytes/v1",
        "structure",
        "",
        Better::Lower,
        Shown::Bytes,
        Spread::Exact,
    ),
    Figure::new(
        "rays-live/v1",
        "rays",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
    counted("descent-tests/v1", "tests of nodes", "per ray"),
    counted("descent-candidates/v1", "candidates", "per ray"),
    once("descent-longest/v1", "longest stream", "pairs per ray"),
    once("descent-walked/v1", "pairs without room", "per ray"),
    counted("level-tests/v1", "tests of a level", "per ray"),
    counted("level-pairs/v1", "pairs of a level", "per ray"),
    shape("level-nodes/v1", "nodes of a level", ""),
    shape("level-angle/v1", "mean half angle", "rad"),
    shape("level-widest/v1", "greatest half angle", "rad"),
    shape("level-radius/v1", "mean radius", "scene units"),
    shape("level-largest/v1", "greatest radius", "scene units"),
    Figure::new(
        "rays-triangles/v1",
        "triangles",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
    once("lobe-error/v1", "RMSE of 16 samples of a lobe", ""),
    Figure::new(
        "rays-refit-ms/v1",
        "refitting",
        "ms",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    time("rays-refit-frame-ns/v1", "time with refitting"),
    Figure::new(
        "pass-ns/v1",
        "time of a pass",
        "ns per ray",
        Better::Lower,
        Shown::Digits(3),
        Spread::Single,
    ),
    Figure::new(
        "descent-first/v1",
        "nodes that a descent begins with",
        "",
        Better::Neither,
        Shown::Count,
        Spread::Exact,
    ),
];

/// Rays that can hit something: the others end at once.
pub(crate) fn live(rays: &[Ray]) -> usize {
    rays.iter().filter(|ray| ray.is_ray()).count()
}

/// Times per ray, without building and with it.
pub(crate) fn times(samples: &Samples, rays: f64, build_ms: f64) -> Result<Vec<Reading>, String> {
    Ok(vec![
        samples.ns_per_item(&FIGURES[TIME], rays)?,
        after(samples, build_ms).ns_per_item(&FIGURES[FRAME], rays)?,
        Reading::exact(&FIGURES[BUILD], build_ms),
    ])
}

/// Times per ray through a refitted structure, with refitting it.
pub(super) fn refitted(samples: &Samples, rays: f64, ms: f64) -> Result<[Reading; 2], String> {
    Ok([
        after(samples, ms).ns_per_item(&FIGURES[REFIT_FRAME], rays)?,
        Reading::exact(&FIGURES[REFIT], ms),
    ])
}

/// Samples of what comes after something that took `ms` milliseconds.
fn after(samples: &Samples, ms: f64) -> Samples {
    let later = |all: &[f64]| all.iter().map(|sample| sample + ms).collect();
    Samples {
        ms: later(&samples.ms),
        wall_ms: later(&samples.wall_ms),
        cpu_ms: Vec::new(),
    }
}

/// The time of each pass by its name, in one trace; none where the adapter has no timestamps.
pub(super) fn passes(ms: &[(String, f64)], rays: f64) -> impl Iterator<Item = Reading> {
    ms.iter().map(move |(name, ms)| {
        let at = Key::default().with(axis::SUBJECT, format!("pass {name}"));
        Reading::exact(&FIGURES[PASS], ms * 1e6 / rays).at(at)
    })
}

pub(super) fn counts(rays: usize, triangles: usize, bytes: u64) -> [Reading; 3] {
    [
        Reading::exact(&FIGURES[TRIANGLES], triangles as f64),
        Reading::exact(&FIGURES[BYTES], bytes as f64),
        Reading::exact(&FIGURES[LIVE], rays as f64),
    ]
}

/// The error of an image of a glossy mirror, and what tracing its rays costs by the model of coherence.
pub(super) fn of_sampler(error: Option<f64>, cycles: Option<f64>) -> Vec<Reading> {
    Reading::known([(&FIGURES[ERROR], error), (&CYCLES_PER_RAY, cycles)])
}

/// What passes did as a whole, and level by level: leaves first in a tree over rays, and in a division the first problem.
pub(super) fn descent(descent: &Descent, rays: f64) -> Vec<Reading> {
    match descent {
        Descent::Tree { anatomy, streams } => tree(anatomy.as_ref(), streams, rays),
        Descent::Division { host, without_room } => division(host, *without_room, rays),
    }
}

fn tree(anatomy: Option<&Anatomy>, streams: &[StreamCounts], rays: f64) -> Vec<Reading> {
    let longest = streams.iter().map(|level| level.longest).max();
    let walked: u64 = streams.iter().map(|level| u64::from(level.walked)).sum();
    let whole = |figure: usize, count: f64| Reading::exact(&FIGURES[figure], count / rays);
    let mut found = vec![
        whole(LONGEST, f64::from(longest.unwrap_or(0))),
        whole(WALKED, walked as f64),
    ];
    let Some(anatomy) = anatomy else {
        return found;
    };
    let candidates = anatomy.levels.first().map_or(0, |level| level.pairs);
    found.push(whole(TESTS, anatomy.tests() as f64));
    found.push(whole(CANDIDATES, candidates as f64));
    let first = anatomy.levels.last().map_or(0, |level| level.nodes);
    found.push(Reading::exact(&FIGURES[FIRST], first as f64));
    let levels = anatomy.levels.iter().enumerate();
    found.extend(levels.flat_map(|(number, level)| of_level(number, level, rays)));
    found
}

fn division(host: &Division, without_room: u64, rays: f64) -> Vec<Reading> {
    let whole = |figure: usize, count: u64| Reading::exact(&FIGURES[figure], count as f64 / rays);
    let longest = host.levels.iter().map(|level| level.pairs).max();
    let mut found = vec![
        whole(LONGEST, longest.unwrap_or(0)),
        whole(WALKED, without_room),
        whole(TESTS, host.box_tests),
        whole(CANDIDATES, host.tests),
    ];
    let levels = host.levels.iter().enumerate();
    for (number, level) in levels.filter(|(_, level)| level.pairs > 0) {
        let at = Key::default().with(axis::SUBJECT, format!("level {number:02}"));
        let [pairs, nodes] = [&FIGURES[LEVEL + 1], &FIGURES[LEVEL + 2]];
        found.push(Reading::exact(pairs, level.pairs as f64 / rays).at(at.clone()));
        found.push(Reading::exact(nodes, level.problems as f64).at(at));
    }
    found
}

fn of_level(number: usize, level: &LevelAnatomy, rays: f64) -> impl Iterator<Item = Reading> {
    let at = Key::default().with(axis::SUBJECT, format!("level {number:02}"));
    let values = [
        level.tests as f64 / rays,
        level.pairs as f64 / rays,
        level.nodes as f64,
        level.angle[0],
        level.angle[1],
        level.radius[0],
        level.radius[1],
    ];
    let figures = FIGURES[LEVEL..].iter();
    let readings = figures.zip(values);
    readings.map(move |(figure, value)| Reading::exact(figure, value).at(at.clone()))
}

/// Reads a known descent: the figures of its whole, and of each level, leaves first.
///
/// # Errors
/// One is not what it should be: the figure, its level, and both values.
pub(crate) fn check_known() -> Result<(), String> {
    let level = |k: u64| LevelAnatomy {
        nodes: 100 + k,
        tests: 200 + 20 * k,
        pairs: 300 + 10 * k,
        longest: 300,
        angle: [0.1, 0.2],
        radius: [0.3, 0.4],
    };
    let stream = |k: u32| StreamCounts {
        pairs: 300 + 10 * k,
        longest: 70 - 10 * k,
        walked: k,
    };
    let known = Descent::Tree {
        anatomy: Some(Anatomy {
            rays: 10,
            levels: (0..3).map(level).collect(),
            pilots: 0,
        }),
        streams: (0..3).map(stream).collect(),
    };
    // Of ten rays: 70 pairs in the longest stream; 1 + 2 without room; 200 + 220 + 240 tests; 300 candidates at the leaves, and
    // 102 nodes at the level that it begins at.
    let whole = [
        (LONGEST, 7.0),
        (WALKED, 0.3),
        (TESTS, 66.0),
        (CANDIDATES, 30.0),
        (FIRST, 102.0),
    ];
    let of_level = |k: usize| {
        let (tests, pairs) = (20.0 + 2.0 * k as f64, 30.0 + k as f64);
        let shape = [100.0 + k as f64, 0.1, 0.2, 0.3, 0.4];
        let values = [tests, pairs].into_iter().chain(shape);
        (LEVEL..)
            .zip(values)
            .map(move |(figure, value)| (figure, value, Some(k)))
    };
    let whole = whole
        .into_iter()
        .map(|(figure, value)| (figure, value, None));
    let expected = whole.chain((0..3).flat_map(of_level));
    let found = descent(&known, 10.0);
    let mut pairs = found.iter().zip(expected);
    let wrong = pairs.find(|(found, (figure, value, level))| {
        let key = level.map_or_else(Key::default, |k| {
            Key::default().with(axis::SUBJECT, format!("level 0{k}"))
        });
        found.figure != FIGURES[*figure].id
            || (found.value.value - value).abs() > 1e-9 * value
            || found.at != key
    });
    wrong.map_or(Ok(()), |(found, (figure, value, level))| {
        Err(format!(
            "of a known descent {found:?} is read, and should be {value} of {} at level {level:?}: this program shows wrong \
             figures; build it anew, and report what stays wrong",
            FIGURES[figure].id
        ))
    })
}
