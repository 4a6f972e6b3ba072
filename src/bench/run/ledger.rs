//! The units of a run: which are done, which are left, and how they ended.

use super::measurement::Measurement;
use super::units::Unit;
use raystone_config::{Cell, Plan};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::sync::Arc;

/// What is left to be measured, and what became of the rest.
pub(super) struct Ledger {
    /// The units of the plan, in its order.
    pub units: Arc<Vec<Unit>>,
    /// Place of each unit by its name.
    places: HashMap<String, usize>,
    /// What is not measured: it has its record (and is not run again after a lost device), or another shard has it.
    done: HashSet<String>,
    /// Units that failed in this run: nothing else is measured through them.
    unusable: HashSet<String>,
    /// Cells that need longer loops than the driver runs, with the reason.
    pub refused: BTreeMap<String, String>,
    /// Cells that failed.
    pub failed: usize,
    /// Cells that were left out.
    pub skipped: usize,
    /// Whether a scene could not be loaded.
    pub bad_input: bool,
}

impl Ledger {
    pub(super) fn new(units: Vec<Unit>) -> Self {
        let places = units.iter().enumerate();
        let places = places.map(|(place, unit)| (unit.name.clone(), place));
        Self {
            places: places.collect(),
            units: Arc::new(units),
            done: HashSet::new(),
            unusable: HashSet::new(),
            refused: BTreeMap::new(),
            failed: 0,
            skipped: 0,
            bad_input: false,
        }
    }

    /// A unit of the plan.
    pub(super) fn unit(&self, name: &str) -> Option<&Unit> {
        self.places
            .get(name)
            .and_then(|place| self.units.get(*place))
    }

    /// Structures that the driver refused, each with the reason.
    pub(super) fn refused_structures(&self, plan: &Plan) -> Vec<(Cell, String)> {
        let reason =
            |cell: &Cell| Some((cell.clone(), self.refused.get(&cell.to_string())?.clone()));
        plan.structures.iter().filter_map(reason).collect()
    }

    /// The units that are not measured yet.
    pub(super) fn open_units(&self) -> impl Iterator<Item = &Unit> {
        self.units.iter().filter(|unit| !self.is_done(&unit.name))
    }

    /// Names of the units that are not measured yet and that `is_one`.
    pub(super) fn open_names(&self, is_one: impl Fn(&Unit) -> bool) -> Vec<String> {
        let open = self.open_units().filter(|unit| is_one(unit));
        open.map(|unit| unit.name.clone()).collect()
    }

    /// Whether a unit of the plan is not measured yet.
    pub(super) fn is_open(&self, measurement: &dyn Measurement, cell: &Cell) -> bool {
        !self.is_done(&measurement.unit_name(cell))
    }

    /// Whether a cell has its record.
    pub(super) fn is_done(&self, cell: &str) -> bool {
        self.done.contains(cell)
    }

    /// Notes that a cell has its record.
    pub(super) fn finish(&mut self, cell: String) {
        self.done.insert(cell);
    }

    /// Whether a unit failed, or cannot be measured here.
    pub(super) fn is_unusable(&self, name: &str) -> bool {
        self.unusable.contains(name)
    }

    /// Notes that a unit failed, or cannot be measured here.
    pub(super) fn set_unusable(&mut self, name: &str) {
        self.unusable.insert(name.to_owned());
    }
}
