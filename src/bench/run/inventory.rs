//! What the records of a folder hold of the plan that they were made by: which cells are done, which are missing, and whether they still hold.

use super::cost::Cost;
use super::error::RunError;
use super::folder::records_in;
use super::inputs::{Current, MadeOf, differing};
use super::kernels::Kernels;
use super::options::RunOptions;
use super::registries::Registries;
use super::resume::Earlier;
use super::shard::shards;
use super::units::Unit;
use super::world::load_options;
use raystone_config::{ConfigError, Experiment, Plan, Shard};
use raystone_record::{
    CellRecord, Inputs, InterruptedRecord, KernelSetRecord, Kind as _, Line, Outcome, RecordError,
    RunRecord, read_records, records_file,
};
use raystone_scene as scene;
use std::collections::{BTreeMap, BTreeSet, HashMap};
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

/// The plan that a run was made by.
///
/// # Errors
/// The experiment in the records is none to this program.
pub(super) fn planned(
    run: &RunRecord,
    registries: &Registries,
) -> Result<(Experiment, Plan), ConfigError> {
    // Overrides stand behind the text as comments, too.
    let text = &run.experiment_text;
    let experiment = Experiment::parse(
        text,
        &run.experiment,
        &run.overrides,
        &registries.catalogue(),
    )?;
    let plan = Plan::new(&experiment, &run.only, |s, d| {
        registries.is_randomised(s, d)
    })?;
    Ok((experiment, plan))
}

impl Inventory {
    /// Reads the records of a folder, those of a run that goes on or was killed included.
    ///
    /// # Errors
    /// Records that cannot be read, without a first line, or of an experiment that this program does not know.
    pub fn read(dir: &Path, registries: &Registries) -> Result<Self, RunError> {
        let dir = &records_in(dir);
        let fault = |error: RecordError| RunError::Input(error.to_string());
        let records = read_records(dir).map_err(fault)?;
        let mut runs = records
            .lines
            .iter()
            .filter_map(|line| RunRecord::of(&line.body));
        let run = runs.next_back().cloned().ok_or_else(|| {
            RunError::Input(format!(
                "{} does not say of what experiment it is: its first line is missing",
                records_file(dir).display()
            ))
        })?;
        let (experiment, plan) = planned(&run, registries)
            .map_err(|e| RunError::Input(format!("{}: {e}", dir.display())))?;
        let mut ended = records
            .lines
            .iter()
            .filter_map(|l| InterruptedRecord::of(&l.body));
        let interrupted = ended.next_back().map(|record| record.reason.clone());
        let mut of_unit: BTreeMap<String, Vec<CellRecord>> = BTreeMap::new();
        for cell in records.lines.iter().filter_map(|l| CellRecord::of(&l.body)) {
            of_unit
                .entry(cell.unit.clone())
                .or_default()
                .push(cell.clone());
        }
        let units = wanted_units(&records.lines, &experiment, &plan, registries);
        let all = registries.measurements.units(&experiment, &plan);
        let known: BTreeSet<&str> = all.iter().map(|unit| unit.name.as_str()).collect();
        let foreign = of_unit.keys().filter(|name| !known.contains(name.as_str()));
        let foreign = foreign.cloned().collect();
        let states = units.into_iter().map(|unit| State {
            record: of_unit
                .get(&unit.name)
                .and_then(|records| records.last().cloned()),
            unit,
        });
        let states = states.collect();
        let earlier = Earlier::new(records.lines);
        let sets = earlier.kernel_sets();
        let contradicted = of_unit
            .iter()
            .filter(|(_, records)| is_contradicted(records, &sets));
        let contradicted = contradicted.map(|(name, _)| name.clone()).collect();
        Ok(Self {
            states,
            dir: dir.to_owned(),
            foreign,
            contradicted,
            interrupted,
            warnings: records.warnings,
            earlier,
            experiment,
            plan,
            run,
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
        let file = super::reference_file::ReferenceFile::load(&self.experiment)?;
        let file = file.as_ref().map_or("", |file| &*file.hash);
        let mut current = Current::new(&self.experiment, file, registries, &kernels);
        current.scenes = HashMap::new();
        if let Some(scene) = state.unit.cell.get(raystone_config::Axis::Scene) {
            let load = load_options(options, self.earlier.table_bytes());
            let loaded = scene::load(scene, &load);
            let hash = loaded.map(|s| s.hash).map_err(|e| e.to_string());
            current.scenes.insert(scene.label.clone(), hash);
        }
        let sets = current.changed(&self.earlier.kernel_sets());
        Ok(current.stale(&state.unit, record, &sets))
    }

    /// Names of the modules that the kernels of a cell were made of.
    pub fn modules(&self, inputs: &Inputs) -> Vec<&str> {
        let set = self
            .earlier
            .kernel_sets()
            .get(inputs.kernels.as_str())
            .copied();
        let names = set.into_iter().flat_map(|set| set.modules.keys());
        names.map(String::as_str).collect()
    }
}

/// The units of the shards that the records are of; all of them where one run had no shard.
fn wanted_units(
    lines: &[Line],
    experiment: &Experiment,
    plan: &Plan,
    registries: &Registries,
) -> Vec<Unit> {
    let mut units = registries.measurements.units(experiment, plan);
    let runs = lines.iter().filter_map(|line| RunRecord::of(&line.body));
    let parts: Option<Vec<Shard>> = runs.map(|run| run.shard.as_ref()?.parse().ok()).collect();
    let Some(parts) = parts.filter(|parts| !parts.is_empty()) else {
        return units;
    };
    let cost = Cost::new(experiment, plan, &registries.integrators);
    let seconds = |unit: &Unit| cost.seconds_of(unit);
    let mut wanted = vec![false; units.len()];
    for part in parts {
        let numbers = shards(&units, part.of, seconds);
        for (wanted, number) in wanted.iter_mut().zip(numbers) {
            *wanted |= number == part.number;
        }
    }
    let mut wanted = wanted.into_iter();
    units.retain(|_| wanted.next() == Some(true));
    units
}

/// Whether records of one cell, all of them done, depend on different things.
fn is_contradicted(records: &[CellRecord], sets: &HashMap<&str, &KernelSetRecord>) -> bool {
    let done = records
        .iter()
        .filter(|record| record.outcome == Outcome::Done)
        .map(|record| &record.inputs);
    let made_of: Vec<MadeOf> = done
        .map(|inputs| (inputs, sets.get(&*inputs.kernels).copied()))
        .collect();
    let Some((last, before)) = made_of.split_last() else {
        return false;
    };
    before
        .iter()
        .any(|one| one.0.device != last.0.device || differing(*one, *last).is_some())
}
