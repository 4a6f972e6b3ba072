//! The page of the numerical stress suite, and its tables for the terminal.

mod axes;
mod families;
mod figures;
mod values;

#[cfg(test)]
use crate::measure::record::Verdict;
use crate::measure::record::{Recorded, SkippedRecord, axis};
use crate::report::data::without_repeats;
use crate::report::document::{Banner, Block, Check, Document, Section, Table, Tone};
use crate::report::terminal::aligned;
use crate::report::values::csv;
use crate::report::{ReportError, format, write_file, write_page};
use crate::stress::families::FAMILIES;
use crate::stress::record::{Findings, Line, Record, TargetRecord};
use crate::stress::targets::{cells, shots, suite};
use axes::{extras, shot_table};
use families::{count_table, error_table, matrix_table, worst_table};
use figures::{curves, heat_map};
use std::path::{Path, PathBuf};

/// Writes `index.html`, `figures.csv` and the plots beside the `stress.jsonl` in `dir`.
///
/// # Errors
/// A folder that cannot be written.
pub fn write_stress_page(dir: &Path, records: &[Line]) -> Result<PathBuf, ReportError> {
    let mut document = document(records);
    let (html, _) = write_page(dir, &mut document)?;
    write_file(
        &dir.join("figures.csv"),
        csv(&values::values(records)).as_bytes(),
    )?;
    Ok(html)
}

/// Targets, families and the matrix as aligned plain text.
pub fn stress_tables(records: &[Line]) -> String {
    let mut text = String::new();
    let mut tables: Vec<Table> = triangles(records)
        .iter()
        .flat_map(|test| [count_table(records, test), error_table(records, test)])
        .collect();
    tables.push(matrix_table(records));
    let values = values::values(records);
    tables.push(shot_table(records, &values));
    tables.extend(extras(records, &values));
    for table in tables.iter().filter(|table| !table.rows.is_empty()) {
        text += &aligned(table);
        text.push('\n');
    }
    for skipped in skipped(records).filter(|s| !s.reason.starts_with("every case")) {
        text += &format!("skipped: {}: {}\n", skipped.cell, skipped.reason);
    }
    for check in checks(records) {
        text += &format!(
            "{}  {}: {}\n",
            check.verdict.word(),
            check.title,
            check.detail
        );
    }
    text
}

fn document(records: &[Line]) -> Document {
    let mut verdict = Section::new("targets", "Targets of the default configuration");
    verdict.blocks.push(Block::Checks(checks(records)));
    let mut maps = Section::new("maps", "Where hits are lost");
    maps.blocks.push(Block::Paragraph(
        "Cracks in closed meshes, and misses elsewhere that the rounding of one triangle test cannot \
         explain, per million rays; a cell with a mark also differs from brute force. Rays lost within \
         rounding of a silhouette are in the tables."
            .into(),
    ));
    let map = |test: &String| heat_map(records, test);
    maps.blocks.push(Block::Figures(
        triangles(records).iter().filter_map(map).collect(),
    ));
    let mut tables = Section::new("families", "Families");
    tables.blocks.push(family_legend());
    for test in triangles(records) {
        for table in [count_table(records, &test), error_table(records, &test)] {
            tables.blocks.extend(table.into_block());
        }
    }
    let mut errors = Section::new("errors", "Error against scale and translation");
    errors.blocks.push(Block::Figures(curves(records)));
    let mut rest = Section::new("axes", "Shots, box tests, offsets, cost");
    let values = values::values(records);
    rest.blocks
        .extend(shot_table(records, &values).into_block());
    let extras = extras(records, &values);
    rest.blocks
        .extend(extras.into_iter().filter_map(Table::into_block));
    let mut worst = Section::new("worst", "Worst rays");
    worst.blocks.extend(worst_table(records).into_block());
    let left_out: Vec<String> = skipped(records)
        .map(|s| format!("{}: {}", s.cell, s.reason))
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

fn subtitle(records: &[Line]) -> String {
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

fn banners(records: &[Line]) -> Vec<Banner> {
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
    if !records
        .iter()
        .any(|line| matches!(line.body, Record::Finished { .. }))
    {
        add(Tone::Bad, "The suite did not finish.");
    }
    banners
}

/// Triangle tests in the order in which they were tried, the default first.
fn triangles(records: &[Line]) -> Vec<String> {
    let keys = cells(records)
        .map(|c| c.key)
        .chain(shots(records).map(|s| s.key));
    without_repeats(
        keys.map(|key| key.label(axis::TRIANGLE).to_owned())
            .collect(),
    )
}

fn structures(records: &[Line]) -> Vec<String> {
    let names = cells(records).map(|cell| cell.key.label(axis::ACCEL).to_owned());
    without_repeats(names.collect())
}

fn cell<'a>(
    records: &'a [Line],
    test: &str,
    accel: &str,
    family: &str,
) -> Option<Recorded<'a, Findings>> {
    cells(records).find(|c| {
        let labels = [axis::TRIANGLE, axis::ACCEL, axis::FAMILY].map(|axis| c.key.label(axis));
        labels == [test, accel, family]
    })
}

fn skipped(records: &[Line]) -> impl Iterator<Item = &SkippedRecord> {
    records.iter().filter_map(|line| match &line.body {
        Record::Skipped(skipped) => Some(skipped),
        _ => None,
    })
}

fn checks(records: &[Line]) -> Vec<Check> {
    let targets = records.iter().filter_map(|line| match &line.body {
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
        verdict: target.verdict,
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

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_target_that_was_not_looked_at_is_open_and_a_missed_one_says_by_how_much() {
        let target = |found: Option<f64>| TargetRecord {
            target: "misses".into(),
            limit: 0.0,
            found,
            verdict: Verdict::new(found.is_some(), found.is_some_and(|f| f > 0.0)),
            note: "bvh, sphere".into(),
        };
        assert_eq!(check(&target(None)).verdict.word(), "OPEN");
        assert_eq!(check(&target(Some(0.0))).verdict.word(), "PASS");
        let missed = check(&target(Some(3.0)));
        assert_eq!(missed.verdict.word(), "FAIL");
        assert!(
            missed.detail.contains("3.00, limit 0") && missed.detail.contains("bvh, sphere"),
            "{}",
            missed.detail
        );
    }
}
