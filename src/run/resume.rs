//! What an earlier run left in the folder of a run that is resumed: which cells still hold, and their lines.

use super::inputs::Current;
use crate::config::Unit;
use crate::measure::record::{Body, CellRecord, KernelSetRecord, Kind as _, Line, Outcome};
use std::collections::{BTreeMap, HashMap, HashSet};

/// The lines that an earlier run left.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    lines: Vec<Line>,
}

/// What is taken over of an earlier run.
#[derive(Debug, Default)]
pub(super) struct Kept {
    /// Its lines, to stand before the new ones.
    pub lines: Vec<Line>,
    /// Cells that hold.
    pub cells: Vec<CellRecord>,
    /// Cells of the plan that do not hold any more, with the reason.
    pub stale: Vec<(String, String)>,
}

impl Earlier {
    pub fn new(lines: Vec<Line>) -> Self {
        Self { lines }
    }

    pub fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// The last word on each cell.
    pub fn cells(&self) -> BTreeMap<&str, &CellRecord> {
        let cells = self
            .lines
            .iter()
            .filter_map(|line| CellRecord::of(&line.body));
        cells.map(|cell| (cell.unit.as_str(), cell)).collect()
    }

    /// Hashes of the modules of kernels, by their id.
    pub fn kernel_sets(&self) -> HashMap<&str, &KernelSetRecord> {
        let sets = self
            .lines
            .iter()
            .filter_map(|line| KernelSetRecord::of(&line.body));
        sets.map(|set| (set.id.as_str(), set)).collect()
    }

    /// Every line.
    pub fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// What still holds of these units.
    pub fn kept(&self, units: &[Unit], current: &Current) -> Kept {
        let cells = self.cells();
        let sets = self.kernel_sets();
        let mut kept = Kept::default();
        for unit in units {
            let Some(record) = cells.get(unit.name.as_str()) else {
                continue;
            };
            let failed = || format!("it failed: {}", record.reason);
            let why = (record.outcome == Outcome::Failed).then(failed);
            match why.or_else(|| current.stale(unit, record, &sets)) {
                Some(why) => kept.stale.push((unit.name.clone(), why)),
                None => kept.cells.push((*record).clone()),
            }
        }
        kept.lines = self.lines_of(&kept.cells);
        kept
    }

    /// The lines that these cells consist of, each text once: the last time that it stands there.
    pub fn lines_of(&self, cells: &[CellRecord]) -> Vec<Line> {
        let names: HashSet<&str> = cells.iter().map(|cell| cell.unit.as_str()).collect();
        let of_cells = cells.iter().flat_map(|cell| &cell.lines);
        let hashes: HashSet<&str> = of_cells
            .chain(cells.iter().map(|cell| &cell.inputs.scene))
            .map(String::as_str)
            .collect();
        let sets: HashSet<&str> = cells.iter().map(|c| c.inputs.kernels.as_str()).collect();
        let last = self.cells();
        let belongs = |line: &&Line| match &line.body {
            Body::Kernels(set) => sets.contains(set.id.as_str()),
            Body::Cell(cell) => {
                names.contains(cell.unit.as_str()) && last.get(cell.unit.as_str()) == Some(&cell)
            }
            // The runs that the lines are of: each is followed by its own.
            Body::Run(_) => true,
            _ => !line.hash.is_empty() && hashes.contains(line.hash.as_str()),
        };
        once(self.lines.iter().filter(belongs))
    }
}

/// These lines, of equal ones the last.
fn once<'a>(lines: impl Iterator<Item = &'a Line>) -> Vec<Line> {
    let lines: Vec<&Line> = lines.collect();
    let mut seen = HashSet::new();
    let mut kept: Vec<Line> = Vec::new();
    for line in lines.into_iter().rev() {
        let text = serde_json::to_string(line).unwrap_or_default();
        if seen.insert(blake3::hash(text.as_bytes())) {
            kept.push(line.clone());
        }
    }
    kept.reverse();
    // A run of which nothing is left says nothing.
    let mut whole: Vec<Line> = Vec::new();
    for line in kept {
        let is_run = |line: &Line| matches!(line.body, Body::Run(_));
        if is_run(&line) && whole.last().is_some_and(is_run) {
            whole.pop();
        }
        whole.push(line);
    }
    if whole.len() == 1 && matches!(whole[0].body, Body::Run(_)) {
        whole.clear();
    }
    whole
}
