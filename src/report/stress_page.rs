//! The page of the numerical stress suite, and its tables for the terminal.

use super::document::{Banner, Block, Cell, Check, Document, Figure, Section, Table, Tone};
use super::format;
use super::plot::curves::{Curve, CurvePlot, CurvePoint, Ticks};
use super::plot::heat::HeatMap;
use super::terminal::aligned;
use super::{ReportError, write_page};
use crate::stress::families::FAMILIES;
use crate::stress::record::{
    BoxTestRecord, CellRecord, CostRecord, OffsetRecord, Quantiles, Record, SkippedRecord,
    TargetRecord,
};
use crate::stress::suite::BRUTE_FORCE;
use crate::stress::targets::{cells, shots, suite};
use std::path::{Path, PathBuf};

/// Families whose errors are drawn over the rungs.
const CURVES: [&str; 4] = ["watertight", "edges", "axis-parallel", "needles"];

/// Writes `index.html` and the plots beside the `stress.jsonl` in `dir`.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_stress_page(dir: &Path, records: &[Record]) -> Result<PathBuf, ReportError> {
    let mut document = document(records);
    let (html, _) = write_page(dir, &mut document)?;
    Ok(html)
}

/// Targets, families and the matrix as aligned plain text.
pub fn stress_tables(records: &[Record]) -> String {
    let mut text = String::new();
    let mut tables: Vec<Table> = triangles(records)
        .iter()
        .map(|test| family_table(records, test))
        .collect();
    tables.push(matrix_table(records));
    tables.extend(shot_table(records));
    tables.extend(extras(records));
    for table in tables.iter().filter(|table| !table.rows.is_empty()) {
        text += &aligned(table);
        text.push('\n');
    }
    for skipped in skipped(records).filter(|s| !s.reason.starts_with("every case")) {
        text += &format!("skipped: {}: {}\n", skipped.what, skipped.reason);
    }
    for check in checks(records) {
        text += &format!("{}  {}: {}\n", check.word(), check.title, check.detail);
    }
    text
}

fn document(records: &[Record]) -> Document {
    let mut verdict = Section::new("targets", "Targets of the default configuration");
    verdict.blocks.push(Block::Checks(checks(records)));
    let mut maps = Section::new("maps", "Where hits are lost");
    maps.blocks.push(Block::Paragraph(
        "Misses where the exact oracle sees a hit, per million rays; a cell with a mark also differs from \
         brute force. Rounding of vertices at the edge of a mesh counts here as well as cracks do: which \
         is which, the tables tell."
            .into(),
    ));
    let map = |test: &String| heat_map(records, test);
    maps.blocks.push(Block::Figures(
        triangles(records).iter().filter_map(map).collect(),
    ));
    let mut tables = Section::new("families", "Families");
    tables.blocks.push(family_legend());
    for test in triangles(records) {
        tables
            .blocks
            .extend(family_table(records, &test).into_block());
    }
    let mut errors = Section::new("errors", "Error against scale and translation");
    errors.blocks.push(Block::Figures(curves(records)));
    let mut rest = Section::new("axes", "Shots, box tests, offsets, cost");
    rest.blocks.extend(
        shot_table(records)
            .into_iter()
            .filter_map(Table::into_block),
    );
    rest.blocks
        .extend(extras(records).into_iter().filter_map(Table::into_block));
    let mut worst = Section::new("worst", "Worst rays");
    worst.blocks.extend(worst_table(records).into_block());
    let left_out: Vec<String> = skipped(records)
        .map(|s| format!("{}: {}", s.what, s.reason))
        .collect();
    if !left_out.is_empty() {
        worst.blocks.push(Block::Heading("Left out".into()));
        worst.blocks.push(Block::Verbatim(left_out.join("\n")));
    }
    Document {
        title: "Raystone: numerical stress suite".into(),
        subtitle: subtitle(records),
        banners: banners(records),
        sections: vec![verdict, maps, tables, errors, rest, worst],
    }
}

fn subtitle(records: &[Record]) -> String {
    let Some(suite) = suite(records) else {
        return "The first record is missing.".into();
    };
    let e = &suite.environment;
    format!(
        "{} on {} ({}, {} {}), {}, seed {}{}",
        format::utc(suite.started_unix_s),
        e.adapter,
        e.backend,
        e.driver,
        e.driver_info,
        e.cpu,
        suite.seed,
        if suite.quick { ", quick" } else { "" }
    )
}

fn banners(records: &[Record]) -> Vec<Banner> {
    let mut banners = Vec::new();
    let mut add = |tone, text: &str| {
        banners.push(Banner {
            tone,
            text: text.into(),
        })
    };
    if suite(records).is_some_and(|s| !s.exact_adapter) {
        add(
            Tone::Note,
            "This adapter does not compute like the host: differences within 4 ulp are ties.",
        );
    }
    if !records.iter().any(|r| matches!(r, Record::Finished { .. })) {
        add(Tone::Bad, "The suite did not finish.");
    }
    banners
}

/// Triangle tests in the order in which they were tried, the default first.
fn triangles(records: &[Record]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    let of_cells = cells(records).map(|c| &c.triangle);
    for name in of_cells.chain(shots(records).map(|s| &s.triangle)) {
        if !names.contains(name) {
            names.push(name.clone());
        }
    }
    names
}

fn skipped(records: &[Record]) -> impl Iterator<Item = &SkippedRecord> {
    records.iter().filter_map(|r| match r {
        Record::Skipped(skipped) => Some(skipped),
        _ => None,
    })
}

fn checks(records: &[Record]) -> Vec<Check> {
    let targets = records.iter().filter_map(|r| match r {
        Record::Target(target) => Some(target),
        _ => None,
    });
    targets.map(check).collect()
}

fn check(target: &TargetRecord) -> Check {
    let detail = match target.found {
        None => "not looked at.".to_owned(),
        Some(found) => {
            let note = match target.note.is_empty() {
                true => String::new(),
                false => format!(" ({})", target.note),
            };
            format!(
                "{}, limit {}{note}",
                format::number(found),
                format::number(target.limit)
            )
        }
    };
    Check {
        tone: match target.passed {
            Some(true) => Tone::Good,
            Some(false) => Tone::Bad,
            None => Tone::Note,
        },
        title: target.target.clone(),
        detail,
    }
}

fn family_legend() -> Block {
    let lines = FAMILIES
        .iter()
        .map(|f| format!("{:15} {}", f.name, f.description));
    Block::Verbatim(lines.collect::<Vec<_>>().join("\n"))
}

fn three(quantiles: Option<Quantiles>) -> String {
    quantiles.map_or_else(
        || format::ABSENT.into(),
        |q| {
            let of = [q.median, q.p99, q.max].map(|x| format::significant(x, 2));
            of.join(" / ")
        },
    )
}

/// Brute force with one triangle test, family by family; and what other structures do otherwise.
fn family_table(records: &[Record], test: &str) -> Table {
    let mut table = Table::new(
        format!(
            "{test}: brute force against the exact oracle; (…) is not explained by rounding; errors are \
             median / p99 / max"
        ),
        &[
            "family",
            "rays",
            "false misses",
            "cracks",
            "false hits",
            "wrong triangle",
            "not nearest",
            "error of t, ulp",
            "relative",
            "error of point, ulp",
            "relative",
            "slowdown",
            ":structures that differ",
        ],
    );
    let of_test: Vec<&CellRecord> = cells(records).filter(|c| c.triangle == test).collect();
    for family in FAMILIES.iter().map(|f| f.name) {
        let of_family: Vec<_> = of_test.iter().filter(|c| c.family == family).collect();
        let Some(cell) = of_family.iter().find(|c| c.accel == BRUTE_FORCE) else {
            continue;
        };
        let differing = of_family.iter().filter_map(|c| {
            let any = c.any_differing.unwrap_or(0);
            let failures = c.failures.len();
            match (c.differing + any, failures) {
                (0, 0) => None,
                (n, 0) => Some(format!("{} {n}", c.accel)),
                (n, f) => Some(format!("{} {n} ({f} failed)", c.accel)),
            }
        });
        let slowest = of_family.iter().filter_map(|c| c.slowdown).reduce(f64::max);
        let both = |all: usize, unexplained: usize| match all {
            0 => "0".to_owned(),
            _ => format!(
                "{} ({})",
                format::count(all as u64),
                format::count(unexplained as u64)
            ),
        };
        table.rows.push(vec![
            family.into(),
            format::count(cell.rays as u64).into(),
            both(cell.false_misses, cell.unexplained_misses).into(),
            Cell::from(format::count(cell.cracks as u64)).toned(if cell.cracks > 0 {
                Tone::Bad
            } else {
                Tone::Plain
            }),
            both(cell.false_hits, cell.unexplained_hits).into(),
            format::count(cell.wrong_triangle as u64).into(),
            format::count(cell.not_nearest as u64).into(),
            three(cell.t_ulp).into(),
            three(cell.t_relative).into(),
            three(cell.point_ulp).into(),
            three(cell.point_relative).into(),
            format::optional(slowest).into(),
            differing.collect::<Vec<_>>().join(", ").into(),
        ]);
    }
    table
}

/// A mark per triangle test, structure and family.
fn matrix_table(records: &[Record]) -> Table {
    let mut table = Table::new(
        "false misses per triangle test, structure and family; · none, ! differs from brute force, x failed",
        &["triangle", ":structure"],
    );
    let families: Vec<&str> = FAMILIES
        .iter()
        .map(|f| f.name)
        .filter(|name| cells(records).any(|c| c.family == *name))
        .collect();
    families.iter().for_each(|name| table.add_column(*name));
    for test in triangles(records) {
        for accel in structures(records) {
            let row: Vec<Option<&CellRecord>> = families
                .iter()
                .map(|f| cell(records, &test, &accel, f))
                .collect();
            if row.iter().all(Option::is_none) {
                continue;
            }
            let mut cells: Vec<Cell> = vec![test.clone().into(), accel.clone().into()];
            cells.extend(
                row.iter()
                    .map(|cell| cell.map_or_else(|| "".into(), |c| mark(c).into())),
            );
            table.rows.push(cells);
        }
    }
    table
}

fn mark(cell: &CellRecord) -> String {
    let mut text = match cell.false_misses {
        0 => "·".to_owned(),
        n => n.to_string(),
    };
    if cell.differing + cell.any_differing.unwrap_or(0) > 0 {
        text.push('!');
    }
    if !cell.failures.is_empty() {
        text.push('x');
    }
    text
}

fn structures(records: &[Record]) -> Vec<String> {
    let mut names: Vec<String> = Vec::new();
    for cell in cells(records) {
        if !names.contains(&cell.accel) {
            names.push(cell.accel.clone());
        }
    }
    names
}

fn cell<'a>(
    records: &'a [Record],
    test: &str,
    accel: &str,
    family: &str,
) -> Option<&'a CellRecord> {
    cells(records).find(|c| c.triangle == test && c.accel == accel && c.family == family)
}

fn heat_map(records: &[Record], test: &str) -> Option<Figure> {
    let rows = structures(records);
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
        let share = cell.false_misses as f64 / cell.rays.max(1) as f64;
        Some((1e6 * share, cell.differing > 0))
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
    let caption = format!("{test}: false misses per million rays");
    let name = format!("false-misses-{test}");
    Some(Figure::new(name, caption, map.draw()?))
}

/// Error of the distance over the rungs, one plot per family and sweep, one curve per triangle test.
fn curves(records: &[Record]) -> Vec<Figure> {
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

fn shot_table(records: &[Record]) -> Option<Table> {
    let mut table = Table::new(
        "shots at closed meshes from inside, and at a plane: misses",
        &[
            "triangle",
            ":structure",
            ":mesh",
            ":place",
            "random",
            "vertices",
            "edges",
            "shots each",
        ],
    );
    let mut seen: Vec<(&str, &str, &str, String)> = Vec::new();
    for shot in shots(records) {
        let key = (
            shot.triangle.as_str(),
            shot.accel.as_str(),
            shot.mesh.as_str(),
            shot.place.to_string(),
        );
        if seen.contains(&key) {
            continue;
        }
        let of = |aim: &str| {
            let same = shots(records).find(|s| {
                s.aim == aim
                    && s.triangle == shot.triangle
                    && s.accel == shot.accel
                    && s.mesh == shot.mesh
                    && s.place == shot.place
            });
            same.map_or_else(
                || format::ABSENT.to_owned(),
                |s| match &s.failure {
                    None => format::count(s.misses as u64),
                    Some(failure) => failure.clone(),
                },
            )
        };
        table.rows.push(vec![
            key.0.into(),
            key.1.into(),
            key.2.into(),
            key.3.clone().into(),
            of("random").into(),
            of("vertices").into(),
            of("edges").into(),
            format::count(shot.rays as u64).into(),
        ]);
        seen.push(key);
    }
    (!table.rows.is_empty()).then_some(table)
}

/// Box tests, offsets and costs.
fn extras(records: &[Record]) -> Vec<Table> {
    let mut boxes = Table::new(
        "box tests: answers that differ from brute force",
        &["box test", ":structure", "pad, ulp", "rays", "lost"],
    );
    let mut offsets = Table::new(
        "ray offsets: rays spawned inside closed meshes by mirrors",
        &[
            "offset",
            ":triangle",
            ":mesh",
            ":place",
            "rays",
            "self-intersections",
            "leaks",
        ],
    );
    let mut costs = Table::new(
        "cost of triangle tests",
        &[
            "triangle",
            "bytes",
            "ns a test",
            "traversal against moeller-trumbore",
            "tests a ray",
        ],
    );
    let mut figures = Table::new(
        "accumulation and sampling",
        &["figure", "value", "alarm", ":unit", ":verdict", ":note"],
    );
    for record in records {
        match record {
            Record::Figure(f) => figures.rows.push(vec![
                f.name.clone().into(),
                format::number(f.value).into(),
                format::optional(f.alarm).into(),
                f.unit.clone().into(),
                if f.passed { "ok" } else { "ALARM" }.into(),
                f.note.clone().into(),
            ]),
            Record::BoxTest(r) => boxes.rows.push(box_row(r)),
            Record::Offset(r) => offsets.rows.push(offset_row(r)),
            Record::Cost(r) => costs.rows.push(cost_row(r)),
            _ => {}
        }
    }
    vec![boxes, offsets, costs, figures]
}

fn box_row(r: &BoxTestRecord) -> Vec<Cell> {
    vec![
        r.box_test.clone().into(),
        r.accel.clone().into(),
        r.pad_ulps.to_string().into(),
        format::count(r.rays as u64).into(),
        format::count(r.lost as u64).into(),
    ]
}

fn offset_row(r: &OffsetRecord) -> Vec<Cell> {
    vec![
        r.offset.clone().into(),
        r.triangle.clone().into(),
        r.mesh.clone().into(),
        r.place.to_string().into(),
        format::count(r.rays as u64).into(),
        format::count(r.self_intersections as u64).into(),
        format::count(r.leaks as u64).into(),
    ]
}

fn cost_row(r: &CostRecord) -> Vec<Cell> {
    vec![
        r.triangle.clone().into(),
        r.bytes.to_string().into(),
        format::number(r.ns_per_test).into(),
        format::number(r.traversal_ratio).into(),
        format::number(r.tests_per_ray).into(),
    ]
}

fn worst_table(records: &[Record]) -> Table {
    let mut table = Table::new(
        "The ray to look at first in each cell of brute force and of structures that differ from it",
        &["family", ":triangle", ":structure", ":what", ":replay"],
    );
    for cell in cells(records) {
        let Some(worst) = &cell.worst else { continue };
        if cell.accel == BRUTE_FORCE || cell.differing > 0 {
            table.rows.push(vec![
                cell.family.clone().into(),
                cell.triangle.clone().into(),
                cell.accel.clone().into(),
                worst.what.clone().into(),
                worst.replay.clone().into(),
            ]);
        }
    }
    table
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_was_not_looked_at_is_open_and_a_missed_one_says_by_how_much() {
        let target = |found: Option<f64>| TargetRecord {
            target: "misses".into(),
            limit: 0.0,
            found,
            passed: found.map(|f| f <= 0.0),
            note: "bvh, sphere".into(),
        };
        assert_eq!(check(&target(None)).word(), "OPEN");
        assert_eq!(check(&target(Some(0.0))).word(), "PASS");
        let missed = check(&target(Some(3.0)));
        assert_eq!(missed.word(), "FAIL");
        assert!(
            missed.detail.contains("3.00, limit 0") && missed.detail.contains("bvh, sphere"),
            "{}",
            missed.detail
        );
    }
}
