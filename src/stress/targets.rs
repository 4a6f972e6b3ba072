//! What the default configuration promises, and whether it holds here.

use super::axes::smallest_sound_pad;
use super::placement::Placement;
use super::record::{Findings, Line, Record, SuiteRecord, TargetRecord};
use raystone_accel::BoxTest;
use raystone_record::figure::{self, Figure};
use raystone_record::{Key, Recorded, Verdict, axis};
use raystone_render::RayOffset;

/// Misses that Embree's own test allows at the far position, as a share of the rays.
const FAR_MISSES: f64 = 2e-5;
/// How much longer rays that are no numbers may take.
const STRANGE_SLOWDOWN: f64 = 2.5;
/// What the default triangle test may cost against Möller–Trumbore.
const COST: f64 = 1.15;
/// How many bounds of a point's error a ray may begin from it: one, and the rounding of that.
const FARTHEST: f64 = 2.0;
/// The family of rays that are none.
const NO_RAYS: &str = "non-finite";

/// The records of one kind.
macro_rules! all {
    ($records:expr, $kind:ident) => {
        ($records.iter()).filter_map(|line| match &line.body {
            Record::$kind(found) => Some(line.of(found)),
            _ => None,
        })
    };
}

/// Every target, with what the records say of it.
pub fn targets(records: &[Line]) -> Vec<TargetRecord> {
    let Some(suite) = suite(records) else {
        return Vec::new();
    };
    let default = &suite.default_triangle;
    let is_default = |key: &Key| key.label(axis::TRIANGLE) == default;
    let cells: Vec<_> = cells(records).filter(|c| is_default(c.key)).collect();
    let shots: Vec<_> = shots(records).filter(|s| is_default(s.key)).collect();
    let cost = all!(records, Cost).find(|cost| is_default(cost.key));
    let mut targets = shot_targets(&shots, suite.shots);
    targets.extend(cell_targets(&cells));
    targets.extend(pad_target(records));
    targets.extend(offset_targets(records));
    targets.extend(gauge_target(records));
    let ratio = cost.and_then(|cost| cost.get(&figure::TRAVERSAL_RATIO));
    targets.extend(ratio.map(|ratio| cost_target(default, ratio)));
    targets
}

/// The first record.
pub(crate) fn suite(records: &[Line]) -> Option<&SuiteRecord> {
    all!(records, Suite).next().map(|suite| suite.body)
}

/// The cells.
pub fn cells(records: &[Line]) -> impl Iterator<Item = Recorded<'_, Findings>> {
    all!(records, Cell)
}

/// The series of shots.
pub fn shots(records: &[Line]) -> impl Iterator<Item = Recorded<'_, Findings>> {
    all!(records, Shots)
}

/// The greatest of some figures against a limit that it must not exceed.
fn target(
    name: impl Into<String>,
    limit: f64,
    found: impl IntoIterator<Item = (f64, String)>,
) -> TargetRecord {
    let worst = found.into_iter().max_by(|a, b| a.0.total_cmp(&b.0));
    let value = worst.as_ref().map(|w| w.0);
    TargetRecord {
        target: name.into(),
        limit,
        found: value,
        verdict: Verdict::new(
            value.is_some(),
            value.is_some_and(|value| value.is_nan() || value > limit),
        ),
        note: match worst {
            Some((value, place)) if value > 0.0 => place,
            _ => String::new(),
        },
    }
}

fn shot_targets(shots: &[Recorded<Findings>], wanted: usize) -> Vec<TargetRecord> {
    let counts = |s: &Findings| [&figure::MISSES, &figure::RAYS].map(|id| s.count(id));
    let name = |s: &Recorded<Findings>| {
        let what = [axis::ACCEL, axis::MESH, axis::PLACE, axis::AIM].map(|axis| s.key.label(axis));
        let [misses, rays] = counts(s);
        format!("{}: {misses} of {rays}", what.join(", "))
    };
    let at = |place: Placement| {
        let place = place.to_string();
        (shots.iter()).filter(move |s| s.key.label(axis::PLACE) == place)
    };
    let ordinary = |random: bool| {
        at(Placement::ORDINARY)
            .filter(move |s| (s.key.label(axis::AIM) == "random") == random)
            .map(|s| (counts(s)[0] as f64, name(s)))
    };
    let share = |[misses, rays]: [usize; 2]| misses as f64 / rays.max(1) as f64;
    let far = at(Placement::FAR).map(|s| (share(counts(s)), name(s)));
    let misses = format!("watertight misses of {wanted} rays per mesh, ordinary scale");
    let aimed = format!("misses at vertices and edges of {wanted} shots");
    vec![
        target(misses, 0.0, ordinary(true)),
        target(aimed, 0.0, ordinary(false)),
        target("share of misses at the far position", FAR_MISSES, far),
    ]
}

fn cell_targets(cells: &[Recorded<Findings>]) -> Vec<TargetRecord> {
    let name = |c: &Recorded<Findings>, what: &str| {
        let [accel, family] = [axis::ACCEL, axis::FAMILY].map(|axis| c.key.label(axis));
        format!("{accel}, {family}: {what}")
    };
    let cracks = cells
        .iter()
        .map(|c| (c.count(&figure::CRACKS) as f64, name(c, "cracks")));
    let differing = cells.iter().map(|c| {
        let replay = c.worst.as_ref().map_or("", |w| w.replay.as_str());
        (c.differing() as f64, name(c, replay))
    });
    let hangs = cells.iter().map(|c| {
        let raised = || c.failures.iter().filter(|f| !f.contains("not built"));
        let first = raised().next().map_or("", |f| f.as_str());
        (raised().count() as f64, name(c, first))
    });
    let strange = cells
        .iter()
        .filter(|c| c.key.label(axis::FAMILY) == NO_RAYS);
    let slowdown = strange.filter_map(|c| Some((c.get(&figure::SLOWDOWN)?, name(c, "slowdown"))));
    vec![
        target(
            "cracks from inside closed meshes, all families and rungs",
            0.0,
            cracks,
        ),
        target(
            "answers that differ from brute force in a bit",
            0.0,
            differing,
        ),
        target(
            "cases with an error word, a lost invariant or a hang",
            0.0,
            hangs,
        ),
        target(
            "time of NaN and infinite rays against ordinary ones",
            STRANGE_SLOWDOWN,
            slowdown,
        ),
    ]
}

fn pad_target(records: &[Line]) -> Option<TargetRecord> {
    all!(records, BoxTest).next()?;
    // Without a pad and a finite reciprocal, what WGSL leaves open decides.
    let padded = all!(records, BoxTest).filter(|t| t.key.label(axis::BOX_TEST) != "plain");
    let found = smallest_sound_pad(padded.map(|t| t.body)).map_or(f64::MAX, |pad| pad as f64);
    Some(target(
        "smallest pad of boxes that loses no hit here, ulp",
        f64::from(BoxTest::default().pad_ulps),
        [(found, String::new())],
    ))
}

/// Rays begun with the default offset: those that meet the triangle they leave, or escape; and how far they
/// begin from the points they leave, since contact shadows and thin gaps end there.
fn offset_targets(records: &[Line]) -> Vec<TargetRecord> {
    let default = RayOffset::default().name;
    let found = |figures: &'static [&'static Figure]| {
        let of_default = all!(records, Offset).filter(|o| o.key.label(axis::OFFSET) == default);
        of_default.map(move |o| {
            let [mesh, place] = [axis::MESH, axis::PLACE].map(|axis| o.key.label(axis));
            let value = figures.iter().filter_map(|figure| o.get(figure)).sum();
            (value, format!("{mesh}, {place}"))
        })
    };
    const SELF_HITS: &[&Figure] = &[&figure::SELF_INTERSECTIONS, &figure::LEAKS];
    let bad = found(SELF_HITS);
    const FARTHEST_BEGIN: &[&Figure] = &[&figure::FARTHEST_BEGIN];
    let farthest = found(FARTHEST_BEGIN);
    let name = |what: &str, of: &str| format!("{what} with {default}{of}");
    let targets = [
        target(
            name("rays begun", " that meet their own triangle or leak"),
            0.0,
            bad,
        ),
        target(
            name(
                "farthest begin of a ray",
                ", in bounds of the point's error",
            ),
            FARTHEST,
            farthest,
        ),
    ];
    targets.into_iter().filter(|t| t.found.is_some()).collect()
}

/// Accumulation and sampling: how many figures are beyond their alarm level.
fn gauge_target(records: &[Line]) -> Option<TargetRecord> {
    all!(records, Gauge).next()?;
    let alarms = all!(records, Gauge).filter(|f| !f.passed);
    let alarms: Vec<&str> = alarms.map(|f| f.body.name.as_str()).collect();
    Some(target(
        "figures of accumulation and sampling beyond their alarm level",
        0.0,
        [(alarms.len() as f64, alarms.join(", "))],
    ))
}

fn cost_target(triangle: &str, ratio: f64) -> TargetRecord {
    let name = format!("time of {triangle} against moeller-trumbore in a traversal");
    target(name, COST, [(ratio, String::new())])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::record::{about_all, line};

    #[test]
    fn one_figure_beyond_its_alarm_fails_their_target_by_name() {
        let gauge = |name: &str, passed| {
            about_all(Record::Gauge(crate::numerics::Gauge {
                name: name.into(),
                value: 2.0,
                alarm: Some(1.0),
                unit: String::new(),
                passed,
                note: String::new(),
            }))
        };
        let verdict = |records: &[Line]| gauge_target(records).map(|t| (t.verdict, t.note));
        assert_eq!(verdict(&[]), None);
        let good = verdict(&[gauge("sum", true)]);
        assert_eq!(good, Some((Verdict::Pass, String::new())));
        let bad = verdict(&[gauge("sum", true), gauge("acos", false)]);
        assert_eq!(bad, Some((Verdict::Fail, "acos".into())));
    }

    fn shot(misses: usize, place: Placement, aim: &str) -> Line {
        let found = Findings::of([(&figure::RAYS, 1000.0), (&figure::MISSES, misses as f64)]);
        let key = Key::default().with(axis::PLACE, place).with(axis::AIM, aim);
        line(key, Record::Shots(found))
    }

    #[test]
    fn one_miss_fails_its_target_and_no_other() {
        let verdicts = |lines: &[Line]| -> Vec<Verdict> {
            let shots: Vec<_> = shots(lines).collect();
            let targets = shot_targets(&shots, 1000);
            targets.iter().map(|t| t.verdict).collect()
        };
        let shots = |misses: [usize; 3]| {
            [
                shot(misses[0], Placement::ORDINARY, "random"),
                shot(misses[1], Placement::ORDINARY, "edges"),
                shot(misses[2], Placement::FAR, "random"),
            ]
        };
        assert_eq!(verdicts(&shots([0; 3])), [Verdict::Pass; 3]);
        for bad in 0..3 {
            let (mut misses, mut expected) = ([0; 3], [Verdict::Pass; 3]);
            misses[bad] = 1;
            expected[bad] = Verdict::Fail;
            assert_eq!(verdicts(&shots(misses)), expected);
        }
        assert_eq!(verdicts(&[]), [Verdict::Open; 3]);
    }
}
