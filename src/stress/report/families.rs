//! Tables of families, structures and their worst rays.

use super::{cell, structures, triangles};
use crate::measure::record::{Recorded, axis};
use crate::report::document::{Cell, Table, Tone};
use crate::report::format;
use crate::stress::families::FAMILIES;
use crate::stress::record::{CellRecord, Line, Quantiles};
use crate::stress::suite::BRUTE_FORCE;
use crate::stress::targets::cells;

fn three(quantiles: Option<Quantiles>) -> String {
    quantiles.map_or_else(
        || format::ABSENT.into(),
        |q| {
            // What is relative to nothing is held as the greatest number.
            let text = |x: f64| match x {
                f64::MAX => "∞".to_owned(),
                x => format::significant(x, 2),
            };
            let of = [q.median, q.p99, q.max].map(text);
            of.join(" / ")
        },
    )
}

/// The families that were tried with a triangle test, each with its cells, brute force's first.
fn rows<'a>(records: &'a [Line], test: &str) -> Vec<(&'static str, Vec<Recorded<'a, CellRecord>>)> {
    let of = |family: &'static str| {
        let is_of = |c: &Recorded<CellRecord>| {
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
        let slowest = of_family.iter().filter_map(|c| c.slowdown).reduce(f64::max);
        let both = |all: usize, unexplained: usize| match all {
            0 => "0".to_owned(),
            _ => format!("{} ({})", count(all), count(unexplained)),
        };
        let tone = match cell.cracks {
            0 => Tone::Plain,
            _ => Tone::Bad,
        };
        table.rows.push(vec![
            family.into(),
            count(cell.rays).into(),
            both(cell.false_misses, cell.unexplained_misses).into(),
            Cell::from(count(cell.cracks)).toned(tone),
            both(cell.false_hits, cell.unexplained_hits).into(),
            count(cell.wrong_triangle).into(),
            count(cell.not_nearest).into(),
            count(cell.borderline).into(),
            format::optional(slowest).into(),
            differing(&of_family).into(),
        ]);
    }
    table
}

fn count(n: usize) -> String {
    format::count(n as u64)
}

/// The structures whose answers are not brute force's, or that failed; how many if they are more than a
/// line takes.
fn differing(of_family: &[Recorded<CellRecord>]) -> String {
    const MOST: usize = 3;
    let wrong = |c: &CellRecord| c.differing + c.any_differing.unwrap_or(0);
    let differ: Vec<&Recorded<CellRecord>> = (of_family.iter())
        .filter(|c| wrong(c) > 0 || !c.failures.is_empty())
        .collect();
    if differ.len() > MOST {
        let most = differ.iter().map(|c| wrong(c)).max().unwrap_or(0);
        let failed = differ.iter().filter(|c| !c.failures.is_empty()).count();
        return format!(
            "{} of {}, up to {most}; {failed} failed",
            differ.len(),
            of_family.len()
        );
    }
    let name = |c: &&Recorded<CellRecord>| {
        let accel = c.key.label(axis::ACCEL);
        match c.failures.len() {
            0 => format!("{accel} {}", wrong(c)),
            failed => format!("{accel} {} ({failed} failed)", wrong(c)),
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
        let cell = of_family[0];
        if cell.t_ulp.is_some() {
            table.rows.push(vec![
                family.into(),
                three(cell.t_ulp).into(),
                three(cell.t_relative).into(),
                three(cell.point_ulp).into(),
                three(cell.point_relative).into(),
            ]);
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
            let row: Vec<Option<Recorded<CellRecord>>> = families
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

pub(super) fn worst_table(records: &[Line]) -> Table {
    let mut table = Table::new(
        "The ray to look at first in each cell of brute force and of structures that differ from it",
        &["family", ":triangle", ":structure", ":what", ":replay"],
    );
    for cell in cells(records) {
        let Some(worst) = &cell.worst else { continue };
        let [family, triangle, accel] =
            [axis::FAMILY, axis::TRIANGLE, axis::ACCEL].map(|axis| cell.key.label(axis));
        if accel == BRUTE_FORCE || cell.differing > 0 {
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
