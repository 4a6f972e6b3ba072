//! The page of the numerical stress suite, and its tables for the terminal.

mod axes;
mod families;
mod figures;
mod values;

use crate::families::FAMILIES;
use crate::record::{Findings, Line, Record, TargetRecord};
use crate::targets::{cells, shots, suite};
use families::{count_table, error_table, matrix_table, worst_table};
use figures::{curves, heat_map};
use raystone_record::{Recorded, SkippedRecord, Verdict, axis};
use raystone_report::data::without_repeats;
use raystone_report::document::{Banner, Block, Check, Document, Section, Table, Tone};
use raystone_report::terminal::Screen;
use raystone_report::values::csv;
use raystone_report::{ReportError, format, terms, write_file, write_page};
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
pub fn stress_tables(records: &[Line], screen: Screen) -> String {
    let mut tables = by_test(records);
    tables.push(matrix_table(records));
    tables.extend(axes::tables(records));
    let mut text = String::new();
    for table in tables.iter().filter(|table| !table.rows.is_empty()) {
        text += &(screen.table(table) + "\n");
    }
    for skipped in skipped(records).filter(|s| !s.reason.starts_with("every case")) {
        text += &screen.lines(&format!("skipped: {}: {}", skipped.cell, skipped.reason));
    }
    checks(records)
        .iter()
        .for_each(|check| text += &screen.check(check));
    text
}

/// The tables of families, test by test.
fn by_test(records: &[Line]) -> Vec<Table> {
    let tests = triangles(records);
    let tables = tests
        .iter()
        .flat_map(|test| [count_table(records, test), error_table(records, test)]);
    tables.collect()
}

fn document(records: &[Line]) -> Document {
    let section = |id: &str, title: &str, blocks: Vec<Block>| Section {
        id: id.into(),
        title: title.into(),
        blocks,
    };
    let shown = |tables: Vec<Table>| tables.into_iter().filter_map(Table::into_block);
    let lost = "Cracks in closed meshes, and misses elsewhere that the rounding of one triangle test cannot \
                explain, per million rays; a cell with a mark also differs from brute force. Rays lost within \
                rounding of a silhouette are in the tables.";
    let tests = triangles(records);
    let maps = tests.iter().map(|test| heat_map(records, test));
    let left_out = skipped(records).map(|s| format!("{}: {}", s.cell, s.reason));
    let left_out: Vec<String> = left_out.collect();
    let fold = |title: &str, tables: Vec<Table>| Block::fold(title, shown(tables).collect());
    let by_test = tests.iter().flat_map(|test| {
        let tables = vec![count_table(records, test), error_table(records, test)];
        fold(&format!("Families with {test}, as numbers"), tables)
    });
    let verbatim = |texts: &[String]| match texts.is_empty() {
        true => Vec::new(),
        false => vec![Block::Verbatim(texts.join("\n"))],
    };
    let mut sections = vec![
        section("verdict", "Verdict", verdict(records)),
        section(
            "maps",
            "Where hits are lost",
            [Block::Paragraph(lost.into())]
                .into_iter()
                .chain(Block::figures(maps))
                .collect(),
        ),
        section(
            "families",
            "Families of hard scenes and rays",
            (Block::fold("What each family is", vec![family_legend()]).into_iter())
                .chain(fold("Every cell at a glance", vec![matrix_table(records)]))
                .chain(by_test)
                .collect(),
        ),
        section(
            "errors",
            "Error against scale and translation",
            Block::fold(
                "Error of the distance along the rungs, family by family",
                Block::figures(curves(records)).into_iter().collect(),
            )
            .into_iter()
            .collect(),
        ),
        section(
            "axes",
            "Shots, box tests, offsets, cost",
            axes::tables(records)
                .into_iter()
                .flat_map(|table| fold(&table.caption.clone(), vec![table]))
                .collect(),
        ),
        section(
            "worst",
            "Worst rays",
            (fold(
                "The ray to look at first in each cell",
                vec![worst_table(records)],
            ))
            .into_iter()
            .collect(),
        ),
        section(
            "left-out",
            "Left out",
            Block::fold("Cases that were not tried, and why", verbatim(&left_out))
                .into_iter()
                .collect(),
        ),
    ];
    sections.retain(|section| !section.blocks.is_empty());
    let mut document = Document {
        title: "Raystone: numerical stress suite".into(),
        subtitle: subtitle(records),
        banners: banners(records),
        sections,
    };
    terms::explain(&mut document);
    document
}

/// Whether the default configuration holds, and what misses its target; what holds is folded.
fn verdict(records: &[Line]) -> Vec<Block> {
    let checks = checks(records);
    let count = |verdict: Verdict| checks.iter().filter(|c| c.verdict == verdict).count();
    let [passed, failed, open] = [Verdict::Pass, Verdict::Fail, Verdict::Open].map(count);
    let title = match (failed, open) {
        _ if checks.is_empty() => "The suite holds no target",
        (0, 0) => "The default configuration meets every target",
        (0, _) => "No target is missed, but not all were looked at",
        _ => "The default configuration misses a target",
    };
    let rest = format!("{failed} missed, {open} not looked at");
    let summary = Check {
        verdict: Verdict::new(passed + failed > 0 && open == 0, failed > 0),
        title: title.into(),
        detail: format!(
            "Targets of the default configuration: {passed} of {} met; {rest}.",
            checks.len()
        ),
    };
    let (met, others): (Vec<Check>, Vec<Check>) = checks
        .into_iter()
        .partition(|check| check.verdict == Verdict::Pass);
    let mut blocks = vec![Block::Checks([vec![summary], others].concat())];
    let met = match met.is_empty() {
        true => Vec::new(),
        false => vec![Block::Checks(met)],
    };
    blocks.extend(Block::fold("Targets that are met", met));
    blocks
}

fn subtitle(records: &[Line]) -> String {
    let Some(suite) = suite(records) else {
        return "The first record is missing.".into();
    };
    format!(
        "{}, seed {}{}",
        format::where_and_when(&suite.environment, suite.started_unix_s),
        suite.seed,
        if suite.quick { ", quick" } else { "" }
    )
}

fn banners(records: &[Line]) -> Vec<Banner> {
    let finished = |line: &Line| matches!(line.body, Record::Finished { .. });
    let said = [
        (
            suite(records).is_some_and(|s| !s.exact_adapter),
            Tone::Note,
            "This adapter does not compute like the host: differences within 4 ulp are ties.",
        ),
        (
            !records.iter().any(finished),
            Tone::Bad,
            "The suite did not finish.",
        ),
    ];
    let said = said.into_iter().filter(|(holds, ..)| *holds);
    said.map(|(_, tone, text)| Banner::new(tone, text))
        .collect()
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
    let note = match target.note.is_empty() {
        true => String::new(),
        false => format!(" ({})", target.note),
    };
    let [found, limit] = [target.found.unwrap_or(0.0), target.limit].map(format::number);
    Check {
        verdict: target.verdict,
        title: target.target.clone(),
        detail: match target.found {
            None => "not looked at.".to_owned(),
            Some(_) => format!("{found}, limit {limit}{note}"),
        },
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
