//! Tables of families, structures and their worst rays.

use super::{cell, structures, triangles};
use crate::measure::record::{Recorded, axis};
use crate::report::document::{Cell, Table, Tone};
use crate::report::format;
use crate::stress::families::FAMILIES;
use crate::stress::record::{Findings, Line, Quantiles};
use crate::stress::suite::BRUTE_FORCE;
use crate::stress::targets::cells;

fn three(of: Quantiles) -> Cell {
    // What is relative to nothing is held as the greatest number.
    let text = |x: f64| match x {
        f64::MAX => "∞".to_owned(),
        x => format::significant(x, 2),
    };
    [of.median, of.p99, of.max].map(text).join(" / ").into()
}

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
    let mut table = Table::new(
        format!("{test}: brute force against the exact oracle; (…) is not explained by rounding"),
        &[
            "family",
            "rays",
            "false misses",
            "cracks",
            "false hits",
            "wrong triangle",
            "not nearest",
            "borderline",
            "slowdown",
            ":structures that differ",
        ],
    );
    for (family, of_family) in rows(records, test) {
        let cell = of_family[0];
        let slowdowns = of_family.iter().filter_map(|c| c.get("slowdown/v1"));
        let count = |id: &str| format::count(cell.count(id) as u64);
        let both = |all: &str, unexplained: &str| match cell.count(all) {
            0 => "0".to_owned(),
            _ => format!("{} ({})", count(all), count(unexplained)),
        };
        let tone = match cell.count("cracks/v1") {
            0 => Tone::Plain,
            _ => Tone::Bad,
        };
        table.rows.push(vec![
            family.into(),
            count("rays/v1").into(),
            both("false-misses/v1", "unexplained-misses/v1").into(),
            Cell::from(count("cracks/v1")).toned(tone),
            both("false-hits/v1", "unexplained-hits/v1").into(),
            count("wrong-triangle/v1").into(),
            count("not-nearest/v1").into(),
            count("borderline/v1").into(),
            format::optional(slowdowns.reduce(f64::max)).into(),
            differing(&of_family).into(),
        ]);
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
        let accel = c.key.label(axis::ACCEL);
        match c.failures.len() {
            0 => format!("{accel} {}", c.differing()),
            failed => format!("{accel} {} ({failed} failed)", c.differing()),
        }
    };
    differ.iter().map(name).collect::<Vec<_>>().join(", ")
}

/// How exact the right hits of brute force are.
pub(super) fn error_table(records: &[Line], test: &str) -> Table {
    let mut table = Table::new(
        format!("{test}: errors of right hits, median / p99 / max"),
        &[
            "family",
            "error of t, ulp",
            "of t, relative",
            "of the point, ulp",
            "of the point, relative",
        ],
    );
    for (family, of_family) in rows(records, test) {
        if let Some(errors) = of_family[0].errors {
            let mut row = vec![family.into()];
            row.extend(errors.map(three));
            table.rows.push(row);
        }
    }
    table
}

/// A mark per triangle test, structure and family.
pub(super) fn matrix_table(records: &[Line]) -> Table {
    let mut table = Table::new(
        "false misses per triangle test, structure and family; · none, ! differs from brute force, x failed",
        &["triangle", ":structure"],
    );
    let families: Vec<&str> = FAMILIES
        .iter()
        .map(|f| f.name)
        .filter(|name| cells(records).any(|c| c.key.label(axis::FAMILY) == *name))
        .collect();
    families.iter().for_each(|name| table.add_column(*name));
    for test in triangles(records) {
        for accel in structures(records) {
            let row: Vec<Option<Recorded<Findings>>> = families
                .iter()
                .map(|f| cell(records, &test, &accel, f))
                .collect();
            if row.iter().all(Option::is_none) {
                continue;
            }
            let mut cells: Vec<Cell> = vec![test.clone().into(), accel.clone().into()];
            cells.extend(
                row.iter()
                    .map(|cell| cell.map_or_else(|| "".into(), |c| mark(&c).into())),
            );
            table.rows.push(cells);
        }
    }
    table
}

fn mark(cell: &Findings) -> String {
    let mut text = match cell.count("false-misses/v1") {
        0 => "·".to_owned(),
        n => n.to_string(),
    };
    if cell.differing() > 0 {
        text.push('!');
    }
    if !cell.failures.is_empty() {
        text.push('x');
    }
    text
}

pub(super) fn worst_table(records: &[Line]) -> Table {
    let mut table = Table::new(
        "The ray to look at first in each cell of brute force and of structures that differ from it",
        &["family", ":triangle", ":structure", ":what", ":replay"],
    );
    for cell in cells(records) {
        let Some(worst) = &cell.worst else { continue };
        let [family, triangle, accel] =
            [axis::FAMILY, axis::TRIANGLE, axis::ACCEL].map(|axis| cell.key.label(axis));
        if accel == BRUTE_FORCE || cell.count("differing/v1") > 0 {
            table.rows.push(vec![
                family.into(),
                triangle.into(),
                accel.into(),
                worst.what.clone().into(),
                worst.replay.clone().into(),
            ]);
        }
    }
    table
}
