//! Plots of a table: curves of the thesis beside ours, and bars of Mrays/s.

use super::claim::Row;
use super::run::Reproduced;
use crate::config::expect::Expect;
use crate::measure::figure::FIGURES;
use crate::measure::record::Interval;
use crate::report::document::{Block, Illustration};
use crate::report::plot::curves::{Curve, CurvePlot, CurvePoint, Guide, Ticks};
use crate::report::plot::rates::{Bar, RatePlot};

/// Exponents of the thesis's fits `factor / √N`, by table.
const FITS: [(&str, &str, f64); 2] = [
    ("dufay-fig-5-14", "Dufay: 2.5/√N", 2.5),
    ("dufay-fig-5-15", "Dufay: 1.5/√N", 1.5),
];

/// All plots of a table.
pub fn of(table: &Reproduced) -> Option<Block> {
    let pairs = || table.thesis.expects.iter().zip(&table.claims);
    let mut figures: Vec<&str> = Vec::new();
    for (expect, rows) in pairs() {
        let drawn = rows.iter().any(|row| row.x.is_some() && row.ours.is_some());
        if drawn && !is_ratio(expect) && !figures.contains(&expect.figure.as_str()) {
            figures.push(&expect.figure);
        }
    }
    let curves = figures.into_iter().map(|figure| curves(table, figure));
    let bars = pairs().filter(|(expect, _)| expect.figure.contains("mrays") && !is_ratio(expect));
    let bars = bars.map(|(expect, rows)| bars_of(table, expect, rows));
    Block::figures(curves.chain(bars))
}

fn is_ratio(expect: &Expect) -> bool {
    use crate::config::expect::Compare::{Bound, Shown};
    !matches!(expect.compare, Bound | Shown)
}

/// Every series of a figure over samples or points; those of the thesis are dashed.
fn curves(table: &Reproduced, figure: &str) -> Option<Illustration> {
    let mut plot = CurvePlot {
        x_title: "N".to_owned(),
        x_ticks: Ticks::PowersOfTwo,
        y_title: FIGURES
            .iter()
            .find(|f| f.id == figure)
            .map_or(figure.to_owned(), |f| f.heading()),
        curves: Vec::new(),
        guides: Vec::new(),
    };
    let pairs = table.thesis.expects.iter().zip(&table.claims);
    for (expect, rows) in pairs.filter(|(e, _)| e.figure == figure && !is_ratio(e)) {
        for (column, rows) in by_column(rows) {
            let name = if column.is_empty() {
                &expect.id
            } else {
                column
            };
            let look = plot.curves.len() / 2;
            let ours = points(&rows, |row| row.ours);
            let thesis = points(&rows, |row| row.thesis.map(Interval::exact));
            for (label, exact, points) in [("ours", false, ours), ("thesis", true, thesis)] {
                plot.curves.push(Curve {
                    label: format!("{name}, {label}"),
                    look,
                    exact,
                    points,
                });
            }
        }
    }
    plot.curves.retain(|curve| !curve.points.is_empty());
    let fits = FITS.iter().filter(|(name, _, _)| *name == table.name);
    plot.guides = fits
        .map(|(_, label, k)| Guide::new(*label, *k, -0.5))
        .collect();
    let stem = figure.split('/').next().unwrap_or(figure);
    plot.figure(
        format!("{}-{stem}", table.name),
        "Ours with 95 % intervals; dashed: the thesis's numbers, or exact values.",
    )
}

fn by_column(rows: &[Row]) -> Vec<(&str, Vec<&Row>)> {
    let mut columns: Vec<(&str, Vec<&Row>)> = Vec::new();
    for row in rows {
        match columns.iter_mut().find(|(column, _)| *column == row.column) {
            Some((_, rows)) => rows.push(row),
            None => columns.push((&row.column, vec![row])),
        }
    }
    columns
}

fn points(rows: &[&Row], of: impl Fn(&Row) -> Option<Interval>) -> Vec<CurvePoint> {
    let point = |row: &&Row| Some(CurvePoint::new(row.x?, &of(row)?));
    let mut points: Vec<CurvePoint> = rows.iter().filter_map(point).collect();
    points.sort_by(|a, b| a.x.total_cmp(&b.x));
    points
}

fn bars_of(table: &Reproduced, expect: &Expect, rows: &[Row]) -> Option<Illustration> {
    let mut groups: Vec<(String, Vec<Bar>)> = Vec::new();
    for row in rows.iter().filter(|row| row.ours.is_some()) {
        let (group, label) = row.row.split_once(" · ").unwrap_or(("", &row.row));
        let bars = match groups.iter().position(|(name, _)| name == group) {
            Some(at) => &mut groups[at].1,
            None => {
                groups.push((group.to_owned(), Vec::new()));
                let last = groups.len() - 1;
                &mut groups[last].1
            }
        };
        bars.push(Bar {
            label: label.to_owned(),
            look: bars.len(),
            rate: row.ours,
            instead: String::new(),
        });
    }
    let software = table.environment.as_ref().is_none_or(|e| e.software);
    let clock = if software {
        "software adapter"
    } else {
        "device"
    };
    let drawing = RatePlot { clock, groups }.draw()?;
    let name = format!("{}-{}", table.name, expect.id);
    Some(Illustration::new(
        name,
        format!("{}: ours.", expect.says),
        drawing,
    ))
}
