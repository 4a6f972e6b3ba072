//! Maps of lost hits, and errors over the rungs.

use super::{cell, structures, triangles};
use crate::report::document::Figure;
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use crate::report::plot::heat::HeatMap;
use crate::stress::families::FAMILIES;
use crate::stress::record::Line;
use crate::stress::suite::BRUTE_FORCE;

/// Families whose errors are drawn over the rungs.
const CURVES: [&str; 4] = ["watertight", "edges", "axis-parallel", "needles"];

pub(super) fn heat_map(records: &[Line], test: &str) -> Option<Figure> {
    let tried = |accel: &String| {
        FAMILIES
            .iter()
            .any(|f| cell(records, test, accel, f.name).is_some())
    };
    let rows: Vec<String> = structures(records).into_iter().filter(tried).collect();
    let columns: Vec<String> = FAMILIES
        .iter()
        .map(|f| f.name.to_owned())
        .filter(|f| {
            rows.iter()
                .any(|accel| cell(records, test, accel, f).is_some())
        })
        .collect();
    let value = |accel: &String, family: &String| {
        let cell = cell(records, test, accel, family)?;
        let lost = cell
            .count("cracks/v1")
            .max(cell.count("unexplained-misses/v1"));
        let share = lost as f64 / cell.count("rays/v1").max(1) as f64;
        Some((1e6 * share, cell.count("differing/v1") > 0))
    };
    let values = rows
        .iter()
        .map(|accel| columns.iter().map(|family| value(accel, family)).collect())
        .collect();
    let map = HeatMap {
        rows,
        columns,
        values,
    };
    let caption = format!("{test}: lost hits per million rays");
    let name = format!("lost-hits-{test}");
    Some(Figure::new(name, caption, map.draw()?))
}

/// Error of the distance over the rungs, one plot per family and sweep, one curve per triangle test.
pub(super) fn curves(records: &[Line]) -> Vec<Figure> {
    let mut figures = Vec::new();
    for family in CURVES {
        for (sweep, title) in [("scale", "scale"), ("shift", "translation, units")] {
            let curve = |(look, test): (usize, &String)| {
                let cell = cell(records, test, BRUTE_FORCE, family)?;
                let first = cell.rungs.first()?.label.split(", ").next()?.to_owned();
                let mut points: Vec<CurvePoint> = (cell.rungs.iter())
                    .filter(|r| r.label.starts_with(&first))
                    .filter(|r| (sweep == "scale") == (r.place.shift == 0.0))
                    .filter_map(|r| {
                        let q = r.t_ulp?;
                        let x = if sweep == "scale" {
                            r.place.scale
                        } else {
                            r.place.shift
                        };
                        Some(CurvePoint {
                            x,
                            y: q.p99,
                            low: q.median.max(1e-3).min(q.p99),
                            high: q.p99,
                        })
                    })
                    .collect();
                points.sort_by(|a, b| a.x.total_cmp(&b.x));
                let label = format!("{test}, {first}");
                Some(Curve {
                    label,
                    look,
                    exact: false,
                    points,
                })
            };
            let plot = CurvePlot {
                x_title: title.into(),
                x_ticks: Ticks::PowersOfTen,
                y_title: "error of t, ulp".into(),
                curves: triangles(records)
                    .iter()
                    .enumerate()
                    .filter_map(curve)
                    .collect(),
                guides: Vec::new(),
            };
            let caption = format!(
                "{family}: error of the distance, median (end of the band) to 99th percentile (line)."
            );
            let drawn = plot.draw();
            figures
                .extend(drawn.map(|d| Figure::new(format!("error-{family}-{sweep}"), caption, d)));
        }
    }
    figures
}
