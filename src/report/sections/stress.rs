//! The numerical stress suite: where hits are lost, how errors grow with scale and translation, and the rays to look at.

use crate::data::{RunData, without_repeats};
use crate::document::*;
use crate::pivot::{FIGURES_ALONE, Part, Rows};
use crate::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::plot::heat::HeatMap;
use crate::values::{Estimate, Value, of_readings};
use raystone_config::STRESS;
use raystone_record::figure::{self, FIGURES, Figure, Shown};
use raystone_record::{Interval, Key, axis};

/// The measurement of the families.
const FAMILIES: &str = "stress:families";
const SHOTS: &str = "stress:shots";
const BRUTE_FORCE: &str = "brute-force";
/// Families whose errors are drawn over the rungs.
const CURVES: [&str; 4] = ["watertight", "edges", "axis-parallel", "needles"];

/// Returns the name of a family, or of another part of the suite.
fn part(key: &Key) -> &str {
    key.label(axis::INTEGRATOR).trim_start_matches(STRESS)
}

/// Returns the values of a measurement.
fn values_of<'a>(data: &RunData<'a>, measurement: &str) -> Vec<Value<'a>> {
    let cells = data.measured_by(measurement);
    cells
        .iter()
        .flat_map(|cell| of_readings(data, *cell))
        .collect()
}

/// Returns the values of whole families, not of their cases.
fn of_families<'a>(data: &RunData<'a>) -> Vec<Value<'a>> {
    let mut values = values_of(data, FAMILIES);
    values.retain(|value| value.key.label(axis::PLACE).is_empty());
    values
}

/// Families against the oracle and brute force, and shots; the other parts are tables of all their figures.
pub(crate) fn tables(data: &RunData) -> Vec<Table> {
    let families = of_families(data);
    let is_brute_force = |value: &&Value| value.key.label(axis::ACCEL) == BRUTE_FORCE;
    let judged: Vec<Value> = families.iter().filter(is_brute_force).cloned().collect();
    let rows = |by: &'static [&'static str], values: &[Value]| Rows::of_labels(by, by, values);
    let by_family: Part = &|key| part(key).to_owned();
    let by_aim: Part = &|key| key.label(axis::AIM).to_owned();
    const FAMILY: &[&str] = &[axis::TRIANGLE, axis::INTEGRATOR];
    const CELL: &[&str] = &[axis::TRIANGLE, axis::ACCEL];
    const MESH: &[&str] = &[axis::TRIANGLE, axis::ACCEL, axis::MESH, axis::PLACE];
    let others = [&figure::UNEQUAL, &figure::FAILED_CASES, &figure::SLOWDOWN];
    let of_all = |is_count: bool| -> Vec<&Figure> {
        let is_own = |figure: &&Figure| others.iter().all(|other| other.id != figure.id);
        let of_kind = move |figure: &&Figure| (figure.shown == Shown::Count) == is_count;
        FIGURES
            .iter()
            .copied()
            .filter(is_own)
            .filter(of_kind)
            .collect()
    };
    let mut tables: Vec<Table> = [
        (
            "Brute force against the exact oracle; unexplained: not by rounding",
            true,
        ),
        ("Errors of right hits of brute force", false),
    ]
    .into_iter()
    .map(|(caption, is_count)| {
        rows(FAMILY, &judged).table(&judged, caption, &of_all(is_count), FIGURES_ALONE)
    })
    .collect();
    for figure in [&figure::FALSE_MISSES].into_iter().chain(others) {
        let of_figure = families.iter().filter(|value| value.figure.id == figure.id);
        // Only where anything is lost or differs.
        let mut seen: Vec<Value> = of_figure.cloned().collect();
        let nothing =
            |value: &Value| matches!(value.estimate, Estimate::Known(i) if i.value == 0.0);
        if seen.iter().all(nothing) {
            continue;
        }
        seen.retain(|value| figure.id == figure::FALSE_MISSES.id || !nothing(value));
        let caption = format!("Families: {}", figure.title);
        tables.push(rows(CELL, &seen).table(&seen, caption, &[figure], by_family));
    }
    let shots = values_of(data, SHOTS);
    let caption = "Shots at closed meshes from inside, and at a plane: misses";
    tables.push(rows(MESH, &shots).table(&shots, caption, &[&figure::MISSES], by_aim));
    tables
}

/// Returns `true` if a measurement has tables here.
pub(crate) fn is_shown(measurement: &str) -> bool {
    [FAMILIES, SHOTS].contains(&measurement)
}

/// Returns the section; `None` where the suite was not run.
pub(crate) fn section(data: &RunData) -> Option<Section> {
    let families = of_families(data);
    let mut section = Section::new("stress", "Hard scenes and rays");
    let labels = |axis: &str| {
        let labels = families
            .iter()
            .map(|value| value.key.label(axis).to_owned());
        without_repeats(labels.collect())
    };
    let tests = labels(axis::TRIANGLE);
    let lost: Vec<(&Key, f64, bool)> = lost_hits(&families);
    let greatest = lost.iter().map(|(_, lost, _)| *lost).fold(0.0, f64::max);
    let map = |test: &String| {
        let of_test: Vec<_> = (lost.iter())
            .filter(|(key, ..)| key.label(axis::TRIANGLE) == test)
            .collect();
        let names = |of: fn(&Key) -> &str| {
            without_repeats(of_test.iter().map(|(key, ..)| of(key).to_owned()).collect())
        };
        let [rows, columns] = [names(|key| key.label(axis::ACCEL)), names(part)];
        let tile = |accel: &String, family: &String| {
            let is_it = |key: &Key| key.label(axis::ACCEL) == accel && part(key) == family;
            let found = of_test.iter().find(|(key, ..)| is_it(key));
            found.map(|(_, lost, differs)| (*lost, *differs))
        };
        let row = |accel| columns.iter().map(|family| tile(accel, family)).collect();
        let tiles: Vec<Vec<_>> = rows.iter().map(row).collect();
        let what = "lost hits per million rays";
        let drawing = HeatMap::of_counts(what, rows, columns, &tiles, greatest).draw()?;
        Some(Illustration::new(
            format!("lost-hits-{test}"),
            format!("{test}: {what}"),
            drawing,
        ))
    };
    let blocks = &mut section.blocks;
    if let Some(maps) = Block::figures(tests.iter().map(map)) {
        let text = "Where hits are lost: misses that the rounding of one triangle test cannot explain, or cracks of closed \
                    meshes if those are more. A mark: other hits than brute force's.";
        blocks.extend([Block::Paragraph(text.into()), maps]);
    }
    for table in tables(data) {
        let title = table.caption.clone();
        blocks.extend(Block::fold(title, table.into_block().into_iter().collect()));
    }
    let curves = Block::figures(curves(data, &tests)).into_iter().collect();
    blocks.extend(Block::fold(
        "Error of the distance along the rungs, family by family",
        curves,
    ));
    let notes = notes(data).into_block().into_iter().collect();
    blocks.extend(Block::fold("Rays to look at first, and other notes", notes));
    (!section.blocks.is_empty()).then_some(section)
}

/// Returns the lost hits of each cell per million rays, and `true` if it differs from brute force.
fn lost_hits<'v>(families: &'v [Value]) -> Vec<(&'v Key, f64, bool)> {
    let cells = families.chunk_by(|a, b| a.key == b.key);
    let lost = |cell: &'v [Value]| {
        let count = |figure: &Figure| {
            let found = cell.iter().find(|value| value.figure.id == figure.id);
            found.map_or(0.0, number)
        };
        let lost = count(&figure::CRACKS).max(count(&figure::UNEXPLAINED_MISSES));
        let share = lost / count(&figure::RAYS).max(1.0);
        (&cell[0].key, 1e6 * share, count(&figure::DIFFERING) > 0.0)
    };
    cells.map(lost).collect()
}

fn number(value: &Value) -> f64 {
    match value.estimate {
        Estimate::Known(interval) => interval.value,
        _ => f64::NAN,
    }
}

/// A way along the rungs: its name, the title of its axis, and how the names of its places begin.
const SWEEPS: [[&str; 3]; 2] = [
    ["scale", "scale", "scale "],
    ["shift", "translation, units", "shift "],
];

/// Returns the position of a place on the axis: `scale 1e-8`, `shift 1e2`, `far (223423)`.
fn on_axis([name, _, begin]: [&str; 3], place: &str) -> Option<f64> {
    let far = place.strip_prefix("far (").filter(|_| name == "shift");
    let far = far.and_then(|far| far.strip_suffix(')'));
    match place {
        "ordinary" => (name == "scale").then_some(1.0),
        place => place.strip_prefix(begin).or(far)?.parse().ok(),
    }
}

/// Plots the error of the distance over the rungs, one plot per family and sweep, one curve per triangle test.
fn curves(data: &RunData, tests: &[String]) -> Vec<Option<Illustration>> {
    let mut values = values_of(data, FAMILIES);
    values.retain(|value| value.figure.id == figure::T_ULP_P99.id);
    let sweeps = CURVES
        .into_iter()
        .flat_map(|family| SWEEPS.map(|sweep| (family, sweep)));
    let plot = |(family, sweep): (&str, [&str; 3])| {
        let of_test = |(look, test): (usize, &String)| {
            let is_its = |value: &&Value| {
                part(&value.key) == family && value.key.label(axis::TRIANGLE) == test
            };
            let own: Vec<&Value> = values.iter().filter(is_its).collect();
            curve(&own, sweep, (look, test))
        };
        let plot = CurvePlot {
            x_title: sweep[1].into(),
            x_ticks: Ticks::PowersOfTen,
            y_title: "error of t (99th percentile), ulp".into(),
            curves: tests.iter().enumerate().filter_map(of_test).collect(),
            guides: Vec::new(),
        };
        let caption = format!("{family}: 99th percentile of the error of the distance over rungs.");
        plot.figure(format!("error-{family}-{}", sweep[0]), caption)
    };
    sweeps.map(plot).collect()
}

/// Returns the curve of a family's cases on the mesh of the first.
fn curve(values: &[&Value], sweep: [&str; 3], (look, test): (usize, &String)) -> Option<Curve> {
    let mut cases = values.iter().map(|value| value.key.label(axis::SUBJECT));
    let first = cases.find(|case| !case.is_empty())?.split(", ").next()?;
    let mut points: Vec<CurvePoint> = Vec::new();
    for value in values {
        let [case, place] = [axis::SUBJECT, axis::PLACE].map(|axis| value.key.label(axis));
        let Some(x) = on_axis(sweep, place).filter(|_| case.starts_with(first)) else {
            continue;
        };
        let point = CurvePoint::new(x, &Interval::exact(number(value)));
        // Of several cases in one place the worst counts.
        match points.iter_mut().find(|point| point.x == x) {
            Some(known) if known.y >= point.y => {}
            Some(known) => *known = point,
            None => points.push(point),
        }
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    (points.len() > 1).then(|| Curve {
        label: format!("{test}, {first}"),
        look,
        exact: false,
        points,
    })
}

/// Returns the notes of measurements: commands that show a ray, failures, cells left out.
fn notes(data: &RunData) -> Table {
    let mut table = Table::new("Notes", &["of", ":what", ":text"]);
    for cell in &data.measured {
        table.rows.extend(cell.notes.iter().map(|note| {
            let of = cell.key.clone().beside(&note.at).to_string();
            vec![of.into(), (&*note.what).into(), (&*note.text).into()]
        }));
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn places_stand_on_the_axis_of_their_sweep_alone() {
        let at = |place: &str| SWEEPS.map(|sweep| on_axis(sweep, place));
        assert_eq!(at("ordinary"), [Some(1.0), None]);
        assert_eq!(at("scale 1e-8"), [Some(1e-8), None]);
        assert_eq!(at("shift 1e2"), [None, Some(100.0)]);
        assert_eq!(at("far (223423)"), [None, Some(223_423.0)]);
        assert_eq!(at("elsewhere"), [None, None]);
    }

    #[test]
    fn of_several_cases_in_one_place_the_worst_is_drawn() {
        let value = |case: &str, place: &str, ulp: f64| {
            let key = Key::default().with(axis::SUBJECT, case);
            let key = key.with(axis::PLACE, place);
            Value::known(&key, [(&figure::T_ULP_P99, Some(Interval::exact(ulp)))])
        };
        let values = [
            value("sphere, a", "ordinary", 1.0),
            value("sphere, a", "scale 1e2", 2.0),
            value("sphere, b", "scale 1e2", 7.0),
            value("sphere, c", "scale 1e2", 3.0),
            value("box, a", "scale 1e2", 9.0),
        ]
        .concat();
        let values: Vec<&Value> = values.iter().collect();
        let drawn = curve(&values, SWEEPS[0], (0, &"watertight".to_owned())).unwrap();
        let points: Vec<[f64; 2]> = drawn.points.iter().map(|p| [p.x, p.y]).collect();
        assert_eq!(points, [[1.0, 1.0], [100.0, 7.0]]);
        assert_eq!(drawn.label, "watertight, sphere");
    }
}
