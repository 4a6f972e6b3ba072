//! Shots, box tests, offsets, costs, accumulation and sampling.

use crate::report::document::{Cell, Table};
use crate::report::format;
use crate::stress::record::{BoxTestRecord, CostRecord, OffsetRecord, Record};
use crate::stress::targets::shots;

pub(super) fn shot_table(records: &[Record]) -> Option<Table> {
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
pub(super) fn extras(records: &[Record]) -> Vec<Table> {
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
