//! Shots, box tests, offsets, costs, accumulation and sampling.

use super::values::of_line;
use crate::record::{Line, Record};
use raystone_record::axis;
use raystone_record::figure::{self, Figure};
use raystone_report::document::Table;
use raystone_report::format;
use raystone_report::pivot::{FIGURES_ALONE, Part, Rows};
use raystone_report::values::Value;

/// A table of the records of one kind.
struct Kind {
    is_it: fn(&Record) -> bool,
    caption: &'static str,
    /// What tells its rows apart, and how the columns of these labels are called.
    by: &'static [&'static str],
    heads: &'static [&'static str],
    figures: &'static [&'static Figure],
    across: Part<'static>,
}

const BOX_TESTS: Kind = Kind {
    is_it: |record| matches!(record, Record::BoxTest(_)),
    caption: "Box tests: answers that differ from brute force",
    by: &[axis::BOX_TEST, axis::ACCEL],
    heads: &["box test", ":structure"],
    figures: &[&figure::PAD_ULPS, &figure::RAYS, &figure::LOST_HITS],
    across: FIGURES_ALONE,
};

const OFFSETS: Kind = Kind {
    is_it: |record| matches!(record, Record::Offset(_)),
    caption: "Ray offsets: rays spawned inside closed meshes by mirrors",
    by: &[axis::OFFSET, axis::TRIANGLE, axis::MESH, axis::PLACE],
    heads: &["offset", ":triangle", ":mesh", ":place"],
    figures: &[
        &figure::RAYS,
        &figure::SELF_INTERSECTIONS,
        &figure::LEAKS,
        &figure::FARTHEST_BEGIN,
    ],
    across: FIGURES_ALONE,
};

const COSTS: Kind = Kind {
    is_it: |record| matches!(record, Record::Cost(_)),
    caption: "Cost of triangle tests",
    by: &[axis::TRIANGLE],
    heads: &["triangle"],
    figures: &[
        &figure::TEST_BYTES,
        &figure::NS_PER_TEST,
        &figure::TRAVERSAL_RATIO,
        &figure::TESTS_PER_RAY,
    ],
    across: FIGURES_ALONE,
};

const SHOTS: Kind = Kind {
    is_it: |record| matches!(record, Record::Shots(_)),
    caption: "Shots at closed meshes from inside, and at a plane: misses",
    by: &[axis::TRIANGLE, axis::ACCEL, axis::MESH, axis::PLACE],
    heads: &["triangle", ":structure", ":mesh", ":place"],
    figures: &[&figure::MISSES],
    across: &|key| key.label(axis::AIM).to_owned(),
};

impl Kind {
    fn table(&self, lines: &[Line]) -> Table {
        let of_kind = lines.iter().filter(|line| (self.is_it)(&line.body));
        let values: Vec<Value> = of_kind.flat_map(of_line).collect();
        let rows = Rows::of_labels(self.by, self.heads, &values);
        rows.table(&values, self.caption, self.figures, self.across)
    }
}

/// Shots, box tests, offsets, costs, and the figures of accumulation and sampling.
pub(super) fn tables(lines: &[Line]) -> Vec<Table> {
    let mut shots = SHOTS.table(lines);
    let rays = lines.iter().find_map(|line| match &line.body {
        Record::Shots(shots) => Some(shots.count(&figure::RAYS)),
        _ => None,
    });
    shots.caption += &format!(" of {} shots each", format::count(rays.unwrap_or(0) as u64));
    let further = [BOX_TESTS, OFFSETS, COSTS].map(|kind| kind.table(lines));
    let mut tables = vec![shots];
    tables.extend(further);
    tables.push(numerics(lines));
    tables
}

fn numerics(lines: &[Line]) -> Table {
    let heads = ["figure", "value", "alarm", ":unit", ":verdict", ":note"];
    let mut table = Table::new("Accumulation and sampling", &heads);
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
