//! Failures of a run, from the last word on each cell.

use crate::data::{RunData, grouped};
use crate::format;
use raystone_record::Outcome;
use std::collections::BTreeMap;

impl<'a> RunData<'a> {
    /// Returns all failures, each with the reason: those recorded once for many cells, and cells by their last
    /// outcome.
    pub fn failures(&self) -> BTreeMap<&'a str, &'a str> {
        let cells = self
            .cells
            .values()
            .filter(|cell| cell.outcome == Outcome::Failed);
        let cells = cells.map(|cell| (cell.unit.as_str(), cell.reason.as_str()));
        let told = self.failed.iter();
        let told = told.map(|failed| (failed.cell.as_str(), failed.reason.as_str()));
        cells.chain(told).collect()
    }

    /// Returns [`RunData::failures`], one for each reason: the first that was recorded for many cells or else the first cell,
    /// with the number of others.
    pub fn failures_by_reason(&self) -> Vec<(String, &'a str)> {
        let all = self.failures();
        let shared = |name: &str| self.failed.iter().any(|failed| failed.cell == name);
        let mut order: Vec<(&str, &str)> = all.into_iter().collect();
        order.sort_by_key(|(name, _)| !shared(name));
        let described = |group: (&'a str, Vec<&(&'a str, &'a str)>)| {
            let (reason, cells) = group;
            let first = cells[0].0.trim_end_matches(": failed");
            let others = match cells.len() - 1 {
                0 => String::new(),
                others => format!(", and {}", format::plural(others, "cell")),
            };
            (format!("{first}{others}"), reason)
        };
        let groups = grouped(order.iter(), |(_, reason)| *reason);
        groups.into_iter().map(described).collect()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_record::{CellRecord, Inputs, SkippedRecord};

    #[test]
    fn a_reason_of_many_cells_is_given_once_by_the_name_that_stands_for_them() {
        let scene = SkippedRecord {
            cell: "scene z.obj: failed".to_owned(),
            reason: "no triangles".to_owned(),
        };
        let failed = |unit: &str, reason: &str| CellRecord {
            unit: unit.to_owned(),
            outcome: Outcome::Failed,
            reason: reason.to_owned(),
            run_began_unix_s: 0,
            inputs: Inputs::default(),
            lines: Vec::new(),
        };
        let cells = [
            failed("a, bvh", "no triangles"),
            failed("b, bvh", "no triangles"),
            failed("c, bvh", "a ray differs"),
        ];
        let mut data = RunData::default();
        data.failed.push(&scene);
        data.cells = cells
            .iter()
            .map(|cell| (cell.unit.as_str(), cell))
            .collect();
        let said = data.failures_by_reason();
        let expected = [
            ("scene z.obj, and 2 cells", "no triangles"),
            ("c, bvh", "a ray differs"),
        ];
        let said: Vec<_> = said
            .iter()
            .map(|(name, why)| (name.as_str(), *why))
            .collect();
        assert_eq!(said, expected);
    }
}
