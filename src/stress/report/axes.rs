//! Shots, box tests, offsets, costs, accumulation and sampling.

use crate::measure::record::{Key, axis};
use crate::report::document::{Cell, Table};
use crate::report::format;
use crate::report::pivot::{Part, Pivot};
use crate::report::values::Value;
use crate::stress::record::{Line, Record};

/// A table whose rows are the lines of one kind, told apart by `row`, with the labels of `heads`.
fn table(
    lines: &[Line],
    values: &[Value],
    is_kind: fn(&Record) -> bool,
    (caption, heads, row): (&str, &[(&str, &str)], Part),
    figures: &[&str],
    across: Option<Part>,
) -> Table {
    let of_kind = || lines.iter().filter(|line| is_kind(&line.body));
    let mut rows: Vec<(String, Vec<Cell>)> = Vec::new();
    for line in of_kind() {
        let name = row(&line.key);
        if rows.iter().all(|(known, _)| *known != name) {
            let labels = heads.iter().map(|(_, axis)| line.key.label(axis).into());
            rows.push((name, labels.collect()));
        }
    }
    let keys: Vec<&Key> = of_kind().map(|line| &line.key).collect();
    let of_kind = values.iter().filter(|value| keys.contains(&&value.key));
    let heads: Vec<&str> = heads.iter().map(|(head, _)| *head).collect();
    Pivot {
        caption: caption.into(),
        heads: &heads,
        rows,
        row,
        figures,
        across,
    }
    .table(&of_kind.cloned().collect::<Vec<_>>())
}

/// Labels on some axes, as one text.
fn labels(key: &Key, axes: &[&str]) -> String {
    let labels: Vec<&str> = axes.iter().map(|axis| key.label(axis)).collect();
    labels.join(" · ")
}

/// Misses by what is aimed at.
pub(super) fn shot_table(lines: &[Line], values: &[Value]) -> Table {
    let misses: Vec<Value> = values
        .iter()
        .filter(|v| v.figure.id == "misses/v1")
        .cloned()
        .collect();
    let mut table = table(
        lines,
        &misses,
        |record| matches!(record, Record::Shots(_)),
        (
            "shots at closed meshes from inside, and at a plane: misses",
            &[
                ("triangle", axis::TRIANGLE),
                (":structure", axis::ACCEL),
                (":mesh", axis::MESH),
                (":place", axis::PLACE),
            ],
            &|key| labels(key, &[axis::TRIANGLE, axis::ACCEL, axis::MESH, axis::PLACE]),
        ),
        &["misses/v1"],
        Some(&|key| key.label(axis::AIM).to_owned()),
    );
    let shots = lines.iter().find_map(|line| match &line.body {
        Record::Shots(shots) => Some(shots.count("rays/v1")),
        _ => None,
    });
    table.caption += &format!(
        " of {} shots each",
        format::count(shots.unwrap_or(0) as u64)
    );
    table
}

/// Box tests, offsets, costs, and the figures of accumulation and sampling.
pub(super) fn extras(lines: &[Line], values: &[Value]) -> Vec<Table> {
    let boxes = table(
        lines,
        values,
        |record| matches!(record, Record::BoxTest(_)),
        (
            "box tests: answers that differ from brute force",
            &[("box test", axis::BOX_TEST), (":structure", axis::ACCEL)],
            &|key| labels(key, &[axis::BOX_TEST, axis::ACCEL]),
        ),
        &["pad-ulps/v1", "rays/v1", "lost-hits/v1"],
        None,
    );
    let offsets = table(
        lines,
        values,
        |record| matches!(record, Record::Offset(_)),
        (
            "ray offsets: rays spawned inside closed meshes by mirrors",
            &[
                ("offset", axis::OFFSET),
                (":triangle", axis::TRIANGLE),
                (":mesh", axis::MESH),
                (":place", axis::PLACE),
            ],
            &|key| {
                labels(
                    key,
                    &[axis::OFFSET, axis::TRIANGLE, axis::MESH, axis::PLACE],
                )
            },
        ),
        &[
            "rays/v1",
            "self-intersections/v1",
            "leaks/v1",
            "farthest-begin/v1",
        ],
        None,
    );
    let costs = table(
        lines,
        values,
        |record| matches!(record, Record::Cost(_)),
        (
            "cost of triangle tests",
            &[("triangle", axis::TRIANGLE)],
            &|key| key.label(axis::TRIANGLE).to_owned(),
        ),
        &[
            "test-bytes/v1",
            "ns-per-test/v1",
            "traversal-ratio/v1",
            "tests-per-ray/v1",
        ],
        None,
    );
    vec![boxes, offsets, costs, numerics(lines)]
}

fn numerics(lines: &[Line]) -> Table {
    let heads = ["figure", "value", "alarm", ":unit", ":verdict", ":note"];
    let mut table = Table::new("accumulation and sampling", &heads);
    for line in lines {
        if let Record::Gauge(f) = &line.body {
            table.rows.push(vec![
                f.name.clone().into(),
                format::number(f.value).into(),
                format::optional(f.alarm).into(),
                f.unit.clone().into(),
                if f.passed { "ok" } else { "ALARM" }.into(),
                f.note.clone().into(),
            ]);
        }
    }
    table
}
