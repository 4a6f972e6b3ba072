//! Tables of families, structures and their worst rays.

use super::values::of_line;
use super::{cell, structures, triangles};
use crate::families::FAMILIES;
use crate::record::{Findings, Line, Quantiles};
use crate::suite::BRUTE_FORCE;
use crate::targets::cells;
use raystone_record::figure;
use raystone_record::{Recorded, axis};
use raystone_report::document::{Table, TableCell, Tone};
use raystone_report::format;
use raystone_report::pivot::{FIGURES_ALONE, Rows};
use raystone_report::values::Value;

/// The families that were tried with a triangle test, each with its cells, brute force's first.
fn rows<'a>(records: &'a [Line], test: &str) -> Vec<(&'static str, Vec<Recorded<'a, Findings>>)> {
    let of = |family: &'static str| {
        let is_of = |c: &Recorded<Findings>| {
            c.key.label(axis::TRIANGLE) == test && c.key.label(axis::FAMILY) == family
        };
        let mut found: Vec<_> = cells(records).filter(is_of).collect();
        found.sort_by_key(|c| c.key.label(axis::ACCEL) != BRUTE_FORCE);
        let judged = (found.first()).is_some_and(|c| c.key.label(axis::ACCEL) == BRUTE_FORCE);
        judged.then_some((family, found))
    };
    FAMILIES.iter().filter_map(|f| of(f.name)).collect()
}

/// What brute force with one triangle test gets wrong, and what other structures do otherwise.
pub(super) fn count_table(records: &[Line], test: &str) -> Table {
    let families = rows(records, test);
    let row = |(family, cells): &(&str, Vec<Recorded<Findings>>)| {
        let differ = differing(cells).into();
        (cells[0].key.clone(), vec![(*family).into(), differ])
    };
    let judged = |line: &&Line| families.iter().any(|(_, cells)| *cells[0].key == line.key);
    let mut values: Vec<Value> = records.iter().filter(judged).flat_map(of_line).collect();
    // Not brute force's own, which visits all in any case.
    values.retain(|value| value.figure.id != figure::SLOWDOWN.id);
    for (_, cells) in &families {
        let slowest = cells
            .iter()
            .filter_map(|c| c.get(&figure::SLOWDOWN))
            .reduce(f64::max);
        values.extend(Value::known(cells[0].key, [(&figure::SLOWDOWN, slowest)]));
    }
    let heads = ["family", ":structures that differ"];
    let mut table = Rows::new(&[axis::FAMILY], &heads, families.iter().map(row)).table(
        &values,
        format!("{test}: brute force against the exact oracle; unexplained: not by rounding"),
        &[
            &figure::RAYS,
            &figure::FALSE_MISSES,
            &figure::UNEXPLAINED_MISSES,
            &figure::CRACKS,
            &figure::FALSE_HITS,
            &figure::UNEXPLAINED_HITS,
            &figure::WRONG_TRIANGLE,
            &figure::NOT_NEAREST,
            &figure::BORDERLINE,
            &figure::SLOWDOWN,
        ],
        FIGURES_ALONE,
    );
    let cracks = table.columns.iter().position(|c| c.title == "cracks");
    for row in &mut table.rows {
        let cell = cracks.and_then(|column| row.get_mut(column));
        if let Some(cell) = cell.filter(|cell| cell.text != "0") {
            cell.tone = Tone::Bad;
        }
    }
    table
}

/// The structures whose answers are not brute force's, or that failed; how many if they are more than a
/// line takes.
fn differing(of_family: &[Recorded<Findings>]) -> String {
    const MOST: usize = 3;
    let differ: Vec<&Recorded<Findings>> = (of_family.iter())
        .filter(|c| c.differing() > 0 || !c.failures.is_empty())
        .collect();
    if differ.is_empty() {
        return "none".into();
    }
    if differ.len() > MOST {
        let most = differ.iter().map(|c| c.differing()).max().unwrap_or(0);
        let failed = differ.iter().filter(|c| !c.failures.is_empty()).count();
        return format!(
            "{} of {}, up to {most}; {failed} failed",
            differ.len(),
            of_family.len()
        );
    }
    let name = |c: &&Recorded<Findings>| {
        let text = format!("{} {}", c.key.label(axis::ACCEL), c.differing());
        match c.failures.len() {
            0 => text,
            failed => format!("{text} ({failed} failed)"),
        }
    };
    differ.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// How exact the right hits of brute force are.
pub(super) fn error_table(records: &[Line], test: &str) -> Table {
    let caption = format!("{test}: errors of right hits, median / p99 / max");
    let heads = [
        "family",
        "error of t, ulp",
        "of t, relative",
        "of the point, ulp",
        "of the point, relative",
    ];
    let mut table = Table::new(caption, &heads);
    for (family, of_family) in rows(records, test) {
        if let Some(errors) = of_family[0].errors {
            let mut row = vec![family.into()];
            row.extend(errors.map(three));
            table.rows.push(row);
        }
    }
    table
}

fn three(of: Quantiles) -> TableCell {
    // What is relative to nothing is held as the greatest number.
    let text = |x: f64| match x {
        f64::MAX => "∞".to_owned(),
        x => format::significant(x, 2),
    };
    [of.median, of.p99, of.max].map(text).join(" / ").into()
}

/// A mark per triangle test, structure and family.
pub(super) fn matrix_table(records: &[Line]) -> Table {
    let caption = "False misses per triangle test, structure and family; · none, ! differs from brute force, x failed";
    let mut table = Table::new(caption, &["triangle", ":structure"]);
    let tried = |name: &&str| cells(records).any(|c| c.key.label(axis::FAMILY) == *name);
    let families: Vec<&str> = FAMILIES.iter().map(|f| f.name).filter(tried).collect();
    families.iter().for_each(|name| table.add_column(*name));
    for test in triangles(records) {
        for accel in structures(records) {
            let marks = families.iter().map(|f| cell(records, &test, &accel, f));
            let marks: Vec<_> = marks.map(|cell| cell.map(|c| mark(&c))).collect();
            if marks.iter().any(Option::is_some) {
                let mut row: Vec<TableCell> = vec![test.clone().into(), accel.into()];
                row.extend(
                    marks
                        .into_iter()
                        .map(|mark| mark.unwrap_or_default().into()),
                );
                table.rows.push(row);
            }
        }
    }
    table
}

fn mark(cell: &Findings) -> String {
    let count = match cell.count(&figure::FALSE_MISSES) {
        0 => "·".to_owned(),
        n => n.to_string(),
    };
    let differs = if cell.differing() > 0 { "!" } else { "" };
    let failed = if cell.failures.is_empty() { "" } else { "x" };
    count + differs + failed
}

pub(super) fn worst_table(records: &[Line]) -> Table {
    let caption = "The ray to look at first in each cell of brute force and of structures that differ from it";
    let heads = ["family", ":triangle", ":structure", ":what", ":replay"];
    let mut table = Table::new(caption, &heads);
    for cell in cells(records) {
        let Some(worst) = &cell.worst else { continue };
        if cell.key.label(axis::ACCEL) == BRUTE_FORCE || cell.count(&figure::DIFFERING) > 0 {
            let labels =
                [axis::FAMILY, axis::TRIANGLE, axis::ACCEL].map(|axis| cell.key.label(axis));
            let row = labels.into_iter().chain([&*worst.what, &worst.replay]);
            table.rows.push(row.map(TableCell::from).collect());
        }
    }
    table
}
