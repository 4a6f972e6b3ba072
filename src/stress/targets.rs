//! What the default configuration promises, and whether it holds here.

use super::axes::smallest_sound_pad;
use super::place::Place;
use super::record::{
    CellRecord, Line, OffsetRecord, Record, ShotsRecord, SuiteRecord, TargetRecord,
};
use crate::accel::BoxTest;
use crate::integrator::RayOffset;
use crate::measure::record::{Key, Recorded, Verdict, axis};

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
    targets.extend(figure_target(records));
    targets.extend(cost.map(|cost| cost_target(default, cost.traversal_ratio)));
    targets
}

/// The first record.
pub fn suite(records: &[Line]) -> Option<&SuiteRecord> {
    all!(records, Suite).next().map(|suite| suite.body)
}

/// The cells.
pub fn cells(records: &[Line]) -> impl Iterator<Item = Recorded<'_, CellRecord>> {
    all!(records, Cell)
}

/// The series of shots.
pub fn shots(records: &[Line]) -> impl Iterator<Item = Recorded<'_, ShotsRecord>> {
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

fn shot_targets(shots: &[Recorded<ShotsRecord>], wanted: usize) -> Vec<TargetRecord> {
    let name = |s: &Recorded<ShotsRecord>| {
        let what = [axis::ACCEL, axis::MESH, axis::PLACE, axis::AIM].map(|axis| s.key.label(axis));
        format!("{}: {} of {}", what.join(", "), s.misses, s.rays)
    };
    let at = |place: Place| {
        let place = place.to_string();
        (shots.iter()).filter(move |s| s.key.label(axis::PLACE) == place)
    };
    let ordinary = |random: bool| {
        at(Place::ORDINARY)
            .filter(move |s| (s.key.label(axis::AIM) == "random") == random)
            .map(|s| (s.misses as f64, name(s)))
    };
    let far = at(Place::FAR).map(|s| (s.misses as f64 / s.rays.max(1) as f64, name(s)));
    let misses = format!("watertight misses of {wanted} rays per mesh, ordinary scale");
    let aimed = format!("misses at vertices and edges of {wanted} shots");
    vec![
        target(misses, 0.0, ordinary(true)),
        target(aimed, 0.0, ordinary(false)),
        target("share of misses at the far position", FAR_MISSES, far),
    ]
}

fn cell_targets(cells: &[Recorded<CellRecord>]) -> Vec<TargetRecord> {
    let name = |c: &Recorded<CellRecord>, what: &str| {
        let [accel, family] = [axis::ACCEL, axis::FAMILY].map(|axis| c.key.label(axis));
        format!("{accel}, {family}: {what}")
    };
    let cracks = cells.iter().map(|c| (c.cracks as f64, name(c, "cracks")));
    let differing = cells.iter().map(|c| {
        let any = c.any_differing.unwrap_or(0);
        let replay = c.worst.as_ref().map_or("", |w| w.replay.as_str());
        ((c.differing + any) as f64, name(c, replay))
    });
    let hangs = cells.iter().map(|c| {
        let raised = || c.failures.iter().filter(|f| !f.contains("not built"));
        let first = raised().next().map_or("", |f| f.as_str());
        (raised().count() as f64, name(c, first))
    });
    let strange = cells
        .iter()
        .filter(|c| c.key.label(axis::FAMILY) == NO_RAYS);
    let slowdown = strange.filter_map(|c| Some((c.slowdown?, name(c, "slowdown"))));
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
    let found = smallest_sound_pad(padded.map(|t| t.body)).map_or(f64::MAX, f64::from);
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
    let found = |figure: fn(&OffsetRecord) -> f64| {
        let of_default = all!(records, Offset).filter(|o| o.key.label(axis::OFFSET) == default);
        of_default.map(move |o| {
            let [mesh, place] = [axis::MESH, axis::PLACE].map(|axis| o.key.label(axis));
            (figure(o.body), format!("{mesh}, {place}"))
        })
    };
    let bad = found(|o| (o.self_intersections + o.leaks) as f64);
    let farthest = found(|o| o.farthest);
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
fn figure_target(records: &[Line]) -> Option<TargetRecord> {
    all!(records, Figure).next()?;
    let alarms = all!(records, Figure).filter(|f| !f.passed);
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
    use crate::measure::record::Ran;

    #[test]
    fn one_figure_beyond_its_alarm_fails_their_target_by_name() {
        let figure = |name: &str, passed| {
            Line::about_all(Record::Figure(crate::stress::numerics::Figure {
                name: name.into(),
                value: 2.0,
                alarm: Some(1.0),
                unit: String::new(),
                passed,
                note: String::new(),
            }))
        };
        let verdict = |records: &[Line]| figure_target(records).map(|t| (t.verdict, t.note));
        assert_eq!(verdict(&[]), None);
        let good = verdict(&[figure("sum", true)]);
        assert_eq!(good, Some((Verdict::Pass, String::new())));
        let bad = verdict(&[figure("sum", true), figure("acos", false)]);
        assert_eq!(bad, Some((Verdict::Fail, "acos".into())));
    }

    fn shot(misses: usize, place: Place, aim: &str) -> Line {
        let record = ShotsRecord {
            triangles: 10,
            rays: 1000,
            misses,
            confirmed: misses,
            failure: None,
            worst: None,
        };
        let key = Key::default().with(axis::PLACE, place).with(axis::AIM, aim);
        Line::new(key, Ran::default(), Record::Shots(record))
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
                shot(misses[0], Place::ORDINARY, "random"),
                shot(misses[1], Place::ORDINARY, "edges"),
                shot(misses[2], Place::FAR, "random"),
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
