//! Maps of lost hits, and errors over the rungs.

use super::{cell, structures, triangles};
use crate::families::FAMILIES;
use crate::placement::Placement;
use crate::record::Line;
use crate::suite::BRUTE_FORCE;
use raystone_record::Interval;
use raystone_record::figure;
use raystone_report::document::Illustration;
use raystone_report::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use raystone_report::plot::heat::HeatMap;

/// Families whose errors are drawn over the rungs.
const CURVES: [&str; 4] = ["watertight", "edges", "axis-parallel", "needles"];

/// Lost hits of a cell per million rays, and whether it differs from brute force.
fn lost_hits(records: &[Line], test: &str, accel: &str, family: &str) -> Option<(f64, bool)> {
    let cell = cell(records, test, accel, family)?;
    let lost = cell
        .count(&figure::CRACKS)
        .max(cell.count(&figure::UNEXPLAINED_MISSES));
    let share = lost as f64 / cell.count(&figure::RAYS).max(1) as f64;
    Some((1e6 * share, cell.count(&figure::DIFFERING) > 0))
}

/// The most that any cell loses: where the colours of all maps end.
fn greatest_loss(records: &[Line]) -> f64 {
    let mut greatest = 0.0f64;
    for test in triangles(records) {
        for accel in structures(records) {
            let of = |family: &str| lost_hits(records, &test, &accel, family);
            let lost = FAMILIES.iter().filter_map(|family| of(family.name));
            greatest = lost.map(|(lost, _)| lost).fold(greatest, f64::max);
        }
    }
    greatest
}

pub(super) fn heat_map(records: &[Line], test: &str) -> Option<Illustration> {
    let is_tried = |accel: &str, family: &str| cell(records, test, accel, family).is_some();
    let mut rows = structures(records);
    rows.retain(|accel| FAMILIES.iter().any(|f| is_tried(accel, f.name)));
    let columns = FAMILIES.iter().map(|f| f.name.to_owned());
    let columns = columns.filter(|f| rows.iter().any(|accel| is_tried(accel, f)));
    let columns: Vec<String> = columns.collect();
    let value = |accel: &String, family: &str| lost_hits(records, test, accel, family);
    let row = |accel: &String| columns.iter().map(|f| value(accel, f)).collect();
    let values: Vec<_> = rows.iter().map(row).collect();
    let greatest = greatest_loss(records);
    let what = "lost hits per million rays";
    let drawing = HeatMap::of_counts(what, rows, columns, &values, greatest).draw()?;
    let caption = format!("{test}: lost hits per million rays");
    Some(Illustration::new(
        format!("lost-hits-{test}"),
        caption,
        drawing,
    ))
}

/// A way along the rungs: its name, the title of its axis, where a rung is on it.
type Sweep = (&'static str, &'static str, fn(&Placement) -> Option<f64>);

const SWEEPS: [Sweep; 2] = [
    ("scale", "scale", |at| (at.shift == 0.0).then_some(at.scale)),
    ("shift", "translation, units", |at| {
        (at.shift != 0.0).then_some(at.shift)
    }),
];

/// Error of the distance over the rungs, one plot per family and sweep, one curve per triangle test.
pub(super) fn curves(records: &[Line]) -> Vec<Option<Illustration>> {
    let sweeps = CURVES
        .into_iter()
        .flat_map(|family| SWEEPS.map(|sweep| (family, sweep)));
    let figure = |(family, sweep): (&str, Sweep)| {
        let (name, x_title, _) = sweep;
        let curve = |(look, test): (usize, &String)| curve(records, family, sweep, look, test);
        let plot = CurvePlot {
            x_title: x_title.into(),
            x_ticks: Ticks::PowersOfTen,
            y_title: "error of t (99th percentile), ulp".into(),
            curves: (triangles(records).iter().enumerate())
                .filter_map(curve)
                .collect(),
            guides: Vec::new(),
        };
        let caption = format!("{family}: 99th percentile of the error of the distance over rungs.");
        plot.figure(format!("error-{family}-{name}"), caption)
    };
    sweeps.map(figure).collect()
}

fn curve(
    records: &[Line],
    family: &str,
    (.., on_axis): Sweep,
    look: usize,
    test: &str,
) -> Option<Curve> {
    let cell = cell(records, test, BRUTE_FORCE, family)?;
    let first = cell.rungs.first()?.label.split(", ").next()?;
    let of_first = cell.rungs.iter().filter(|r| r.label.starts_with(first));
    let mut points: Vec<CurvePoint> = Vec::new();
    for rung in of_first {
        let (Some(x), Some(q)) = (on_axis(&rung.place), rung.t_ulp) else {
            continue;
        };
        // Of several cases in one place the worst counts.
        match points.iter_mut().find(|point| point.x == x) {
            Some(known) if known.y >= q.p99 => {}
            Some(known) => *known = CurvePoint::new(x, &Interval::exact(q.p99)),
            None => points.push(CurvePoint::new(x, &Interval::exact(q.p99))),
        }
    }
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    (points.len() > 1).then_some(())?;
    Some(Curve {
        label: format!("{test}, {first}"),
        look,
        exact: false,
        points,
    })
}
