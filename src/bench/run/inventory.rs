//! What the records of a folder hold of the plan that they were made by: which cells are done, which are missing, and whether they still hold.

use super::cost::Cost;
use super::error::RunError;
use super::inputs::{Current, MadeOf, differing};
use super::kernels::Kernels;
use super::options::RunOptions;
use super::reference_file::ReferenceFile;
use super::registries::Registries;
use super::resume::{Earlier, made_of};
use super::scene_hashes;
use super::shard::shards;
use super::units::Unit;
use raystone_config::{Axis, Experiment, Plan, Shard};
use raystone_record::{CellRecord, Inputs, InterruptedRecord, KernelSetRecord, Outcome, RunRecord};
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// The state of a cell of a plan.
#[derive(Debug, Clone, PartialEq)]
pub struct State {
    /// The cell.
    pub unit: Unit,
    /// The last word on it; `None`: nothing was recorded.
    pub record: Option<CellRecord>,
}

impl State {
    /// Whether nothing has to be done about it.
    pub fn is_settled(&self) -> bool {
        let outcome = self.record.as_ref().map(|record| record.outcome);
        matches!(outcome, Some(Outcome::Done | Outcome::LeftOut))
    }
}

/// The records of a folder beside their plan.
pub struct Inventory {
    /// The folder of the records.
    pub dir: PathBuf,
    /// The experiment that the records name.
    pub experiment: Experiment,
    /// Its plan.
    pub plan: Plan,
    /// The first line of the last run.
    pub run: RunRecord,
    /// Every cell of the plan, in its order.
    pub states: Vec<State>,
    /// Cells that are recorded and not of the plan.
    pub foreign: Vec<String>,
    /// Cells that are recorded more than once with different figures to depend on.
    pub contradicted: Vec<String>,
    /// Why the run ended early, if it did.
    pub interrupted: Option<String>,
    /// What was left out while reading.
    pub warnings: Vec<String>,
    earlier: Earlier,
}

impl Inventory {
    /// Reads the records of a folder, those of a run that goes on or was killed included.
    ///
    /// # Errors
    /// Records that cannot be read, without a first line, or of an experiment that this program does not know.
    pub fn read(dir: &Path, registries: &Registries) -> Result<Self, RunError> {
        let earlier = Earlier::read(dir)?;
        let (experiment, plan) = earlier.planned(registries)?;
        let mut of_unit: BTreeMap<&str, Vec<&CellRecord>> = BTreeMap::new();
        for cell in earlier.all::<CellRecord>() {
            of_unit.entry(&cell.unit).or_default().push(cell);
        }
        let units = registries.measurements.units(&experiment, &plan);
        let known: HashSet<&str> = units.iter().map(|unit| unit.name.as_str()).collect();
        let names = of_unit.keys().copied();
        let foreign = names.filter(|name| !known.contains(name));
        let sets = earlier.kernel_sets();
        let contradicted = of_unit
            .iter()
            .filter(|(_, records)| is_contradicted(records, &sets));
        let cost = Cost::new(&experiment, &plan, &registries.integrators);
        let wanted = wanted(&earlier, &units, &cost);
        let ended = earlier.all::<InterruptedRecord>().next_back();
        Ok(Self {
            foreign: foreign.map(str::to_owned).collect(),
            contradicted: contradicted.map(|(name, _)| (*name).to_owned()).collect(),
            interrupted: ended.map(|record| record.reason.clone()),
            states: (units.iter().zip(wanted))
                .filter(|(_, wanted)| *wanted)
                .map(|(unit, _)| State {
                    record: of_unit
                        .get(&*unit.name)
                        .and_then(|r| r.last().copied().cloned()),
                    unit: unit.clone(),
                })
                .collect(),
            run: earlier.run()?.clone(),
            dir: earlier.dir.clone(),
            warnings: earlier.warnings.clone(),
            earlier,
            experiment,
            plan,
        })
    }

    /// The cells of the plan that nothing was recorded of.
    pub fn missing(&self) -> impl Iterator<Item = &State> {
        self.states.iter().filter(|state| state.record.is_none())
    }

    /// The cells that failed.
    pub fn failed(&self) -> impl Iterator<Item = (&State, &CellRecord)> {
        let states = self.states.iter();
        states.filter_map(|state| {
            let record = state.record.as_ref()?;
            (record.outcome == Outcome::Failed).then_some((state, record))
        })
    }

    /// Why what was recorded of a cell does not hold any more; `None` if it does. The scene is loaded; the adapter is not looked at.
    ///
    /// # Errors
    /// Folders of kernels that cannot be read.
    pub fn stale(
        &self,
        state: &State,
        registries: &Registries,
        options: &RunOptions,
    ) -> Result<Option<String>, RunError> {
        let Some(record) = &state.record else {
            return Ok(Some("it was not measured".to_owned()));
        };
        if record.outcome == Outcome::Failed {
            return Ok(Some(format!("it failed: {}", record.reason)));
        }
        let kernels = Kernels::load(&self.plan.kernels, registries)?;
        let file = ReferenceFile::load(&self.experiment)?;
        let mut current = Current::new(&self.experiment, file.as_ref(), registries, &kernels);
        let scene = state.unit.cell.get(Axis::Scene);
        current.scenes = scene_hashes(scene, options, self.earlier.table_bytes());
        let sets = current.changed(&self.earlier.kernel_sets());
        Ok(current.stale(&state.unit, record, &sets))
    }

    /// Names of the modules that the kernels of a cell were made of.
    pub fn modules(&self, inputs: &Inputs) -> Vec<&str> {
        let sets = self.earlier.kernel_sets();
        let set = sets.get(inputs.kernels.as_str());
        let names = set.into_iter().flat_map(|set| set.modules.keys());
        names.map(String::as_str).collect()
    }
}

/// Which units are of the shards that the records are of; all of them where one run had no shard.
fn wanted(earlier: &Earlier, units: &[Unit], cost: &Cost) -> Vec<bool> {
    let parts = earlier.all::<RunRecord>();
    let parts: Option<Vec<Shard>> = parts.map(|run| run.shard.as_ref()?.parse().ok()).collect();
    let mut wanted = vec![parts.is_none(); units.len()];
    for part in parts.into_iter().flatten() {
        let numbers = shards(units, part.of, |unit| cost.seconds_of(unit));
        for (wanted, number) in wanted.iter_mut().zip(numbers) {
            *wanted |= number == part.number;
        }
    }
    wanted
}

/// Whether records of one cell, all of them done, depend on different things.
fn is_contradicted(records: &[&CellRecord], sets: &HashMap<&str, &KernelSetRecord>) -> bool {
    let done = records
        .iter()
        .filter(|record| record.outcome == Outcome::Done);
    let made_of: Vec<MadeOf> = done.map(|record| made_of(record, sets)).collect();
    let Some((last, before)) = made_of.split_last() else {
        return false;
    };
    before
        .iter()
        .any(|one| one.0.device != last.0.device || differing(*one, *last).is_some())
}
