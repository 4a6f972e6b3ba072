//! What earlier runs left in a folder, which is read here alone: a run that goes on with it keeps the cells that still hold, `merge` takes
//! those of several folders, and `inspect` says what there is.

use super::error::RunError;
use super::folder::records_in;
use super::inputs::{Current, MadeOf};
use super::registries::Registries;
use super::units::Unit;
use raystone_config::{Experiment, Plan};
use raystone_record::{
    Body, CellRecord, KernelSetRecord, Kind, Line, Outcome, RunRecord, read_records,
};
use raystone_scene::LEAST_BINDING;
use std::collections::{BTreeMap, HashMap, HashSet};
use std::path::{Path, PathBuf};

/// The lines that earlier runs left.
#[derive(Debug, Default)]
pub(super) struct Earlier {
    /// The folder of the records.
    pub dir: PathBuf,
    /// What was left out while reading.
    pub warnings: Vec<String>,
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
    /// These lines of the run that goes on.
    pub(super) fn new(lines: Vec<Line>) -> Self {
        Self {
            lines,
            ..Self::default()
        }
    }

    /// Reads the records of a folder, those of a run that goes on or was killed included.
    ///
    /// # Errors
    /// Records that cannot be read.
    pub(super) fn read(dir: &Path) -> Result<Self, RunError> {
        let dir = records_in(dir);
        let records = read_records(&dir).map_err(|e| RunError::Input(e.to_string()))?;
        Ok(Self {
            dir,
            warnings: records.warnings,
            lines: records.lines,
        })
    }

    pub(super) fn is_empty(&self) -> bool {
        self.lines.is_empty()
    }

    /// Every record of a kind.
    pub(super) fn all<'a, K: Kind + 'a>(&'a self) -> impl DoubleEndedIterator<Item = &'a K> {
        self.lines.iter().filter_map(|line| K::of(&line.body))
    }

    /// The first line of the last run: a folder that goes on with other settings holds what of its earlier runs still holds.
    ///
    /// # Errors
    /// There is none.
    pub(super) fn run(&self) -> Result<&RunRecord, RunError> {
        self.all().next_back().ok_or_else(|| {
            RunError::Input(format!(
                "{} does not say of what experiment it is: its first line is missing",
                self.dir.display()
            ))
        })
    }

    /// The experiment and the plan of the last run.
    ///
    /// # Errors
    /// The experiment in the records is none to this program.
    pub(super) fn planned(&self, registries: &Registries) -> Result<(Experiment, Plan), RunError> {
        let run = self.run()?;
        // Overrides stand behind the text as comments, too.
        let (text, catalogue) = (&run.experiment_text, registries.catalogue());
        let experiment = Experiment::parse(text, &run.experiment, &run.overrides, &catalogue);
        let planned = experiment.and_then(|experiment| {
            let is_randomised = |s: &_, d: &_| registries.is_randomised(s, d);
            let plan = Plan::new(&experiment, &run.only, is_randomised)?;
            Ok((experiment, plan))
        });
        planned.map_err(|e| RunError::Input(format!("{}: {e}", self.dir.display())))
    }

    /// The last word on each cell.
    pub(super) fn cells(&self) -> BTreeMap<&str, &CellRecord> {
        let cells = self.all::<CellRecord>();
        cells.map(|cell| (cell.unit.as_str(), cell)).collect()
    }

    /// Hashes of the modules of kernels, by their id.
    pub(super) fn kernel_sets(&self) -> HashMap<&str, &KernelSetRecord> {
        let sets = self.all::<KernelSetRecord>();
        sets.map(|set| (set.id.as_str(), set)).collect()
    }

    /// Bytes that the adapter of the last run binds, which decide how much of textures and maps is left.
    pub(super) fn table_bytes(&self) -> u64 {
        let limits = self.run().ok().map(|run| &run.environment.limits);
        let limit = |name| limits.and_then(|limits| limits.get(name)).copied();
        let binding = limit("max_storage_buffer_binding_size").unwrap_or(LEAST_BINDING);
        limit("max_buffer_size").map_or(binding, |buffer| buffer.min(binding))
    }

    /// Every line.
    pub(super) fn lines(&self) -> &[Line] {
        &self.lines
    }

    /// Refuses units that leave out cells which were measured: a run that goes on keeps those of its own plan alone.
    ///
    /// # Errors
    /// How many they are, the first of them, and what keeps them.
    pub(super) fn check_whole(&self, units: &[Unit], out: &Path) -> Result<(), RunError> {
        let planned: HashSet<&str> = units.iter().map(|unit| unit.name.as_str()).collect();
        let lost = self
            .cells()
            .into_iter()
            .filter(|(name, cell)| cell.outcome == Outcome::Done && !planned.contains(name));
        let lost: Vec<&str> = lost.map(|(name, _)| name).collect();
        let Some(first) = lost.first() else {
            return Ok(());
        };
        Err(RunError::Input(format!(
            "{} holds cells that this plan leaves out: {first}{}. Going on would drop what was measured there: plan them, too, or write \
             to another folder (--out)",
            out.display(),
            match lost.len() - 1 {
                0 => String::new(),
                others => format!(", and {others} more"),
            },
        )))
    }

    /// What still holds of these units.
    pub(super) fn kept(&self, units: &[Unit], current: &Current) -> Kept {
        let cells = self.cells();
        let sets = current.changed(&self.kernel_sets());
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
    pub(super) fn lines_of(&self, cells: &[CellRecord]) -> Vec<Line> {
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

/// What a cell was made of, by the sets of its folder.
pub(super) fn made_of<'a>(
    cell: &'a CellRecord,
    sets: &HashMap<&str, &'a KernelSetRecord>,
) -> MadeOf<'a> {
    (&cell.inputs, sets.get(&*cell.inputs.kernels).copied())
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

#[cfg(test)]
mod tests {
    use super::super::inputs::kernel_set;
    use super::super::kernels::Kernels;
    use super::super::{Cost, Registries, shards};
    use super::*;
    use raystone_config::{Experiment, Plan};
    use raystone_record::{RECORDS_FILE, SkippedRecord, read_records, text_of};
    use std::time::Instant;

    /// An experiment with about `count` cells: parameters of one sequence and one structure.
    fn large(count: usize) -> (Experiment, Plan) {
        let edge = (count as f64).sqrt().ceil() as usize;
        let list = |from: usize| {
            let values: Vec<String> = (from..from + edge).map(|i| i.to_string()).collect();
            values.join(", ")
        };
        let text = format!(
            "[run]\nreplicates = 2\nspp = {{ pow2 = [0, 1] }}\n[axes]\nscene = [\"cornell-box\"]\n\
             accel = [\"uniform-grid\"]\nsequence = [\"halton\"]\ndecorrelation = [\"micro-jitter\"]\n\
             integrator = [\"path\"]\n[accel.uniform-grid]\nlambda = [{}]\n\
             [decorrelation.micro-jitter]\nk = [{}]\n",
            list(1),
            (1..=edge)
                .map(|i| format!("{:.5}", i as f64 / (2 * edge) as f64))
                .collect::<Vec<_>>()
                .join(", "),
        );
        let registries = Registries::default();
        let experiment =
            Experiment::parse(&text, "large", &[], &registries.catalogue()).expect("an experiment");
        let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d));
        (experiment, plan.expect("a plan"))
    }

    #[test]
    fn a_plan_of_many_cells_is_made_and_divided_quickly() {
        let start = Instant::now();
        let (experiment, plan) = large(100_000);
        let registries = Registries::default();
        let units = registries.measurements.units(&experiment, &plan);
        let cost = Cost::new(&experiment, &plan, &registries.integrators);
        let numbers = shards(&units, 64, |unit| cost.seconds_of(unit));
        let seconds = start.elapsed().as_secs_f64();
        assert!(units.len() >= 100_000 && numbers.len() == units.len());
        // Two seconds are the bound for a program as released on a machine of its own.
        assert!(seconds < 20.0, "{seconds}");
        println!(
            "{} cells planned and divided in {seconds:.2} s",
            units.len()
        );
    }

    #[test]
    fn a_finished_run_of_many_cells_is_looked_through_quickly() {
        let (experiment, plan) = large(10_000);
        let registries = Registries::default();
        let units = registries.measurements.units(&experiment, &plan);
        let kernels = Kernels::load(&plan.kernels, &registries).expect("kernels");
        let mut current = Current::new(&experiment, None, &registries, &kernels);
        let scene = ("cornell-box".to_owned(), Ok("0123".to_owned()));
        current.scenes.insert(scene.0, scene.1);
        let library = raystone_gpu::KernelLibrary::default();
        let modules = library.names().take(40).map(str::to_owned);
        let modules = modules.map(|name| {
            let hash = library.text_hash(&name);
            (name, hash)
        });
        let set = kernel_set("", modules.collect());
        let mut lines = vec![Line::about_all(Body::Kernels(set.clone()))];
        for unit in &units {
            // As many bytes as the record of a structure has.
            let record = SkippedRecord {
                cell: unit.name.clone(),
                reason: "x".repeat(4000),
            };
            let hash = blake3::hash(unit.name.as_bytes()).to_hex().to_string();
            lines.push(Line::about_all(Body::Skipped(record)).hashed(&hash));
            let mut inputs = current.inputs(unit);
            inputs.kernels.clone_from(&set.id);
            lines.push(Line::about_all(Body::Cell(CellRecord {
                unit: unit.name.clone(),
                outcome: Outcome::Done,
                reason: String::new(),
                run_began_unix_s: 0,
                inputs,
                lines: vec![hash],
            })));
        }
        let folder = tempfile::tempdir().expect("a folder");
        let text = text_of(&lines).expect("lines");
        std::fs::write(folder.path().join(RECORDS_FILE), text).expect("a file");
        let start = Instant::now();
        let records = read_records(folder.path()).expect("records");
        let earlier = Earlier::new(records.lines);
        let kept = earlier.kept(&units, &current);
        let seconds = start.elapsed().as_secs_f64();
        assert_eq!((kept.cells.len(), kept.stale.len()), (units.len(), 0));
        assert_eq!(kept.lines.len(), lines.len());
        assert!(seconds < 20.0, "{seconds}");
        println!("{} cells looked through in {seconds:.2} s", units.len());
        // One that failed, one of another program and one that is gone.
        let mut other = earlier.lines.clone();
        for (place, line) in other.iter_mut().rev().step_by(2).take(2).enumerate() {
            if let Body::Cell(cell) = &mut line.body {
                match place {
                    0 => cell.outcome = Outcome::Failed,
                    _ => cell.inputs.program = "another".to_owned(),
                }
            }
        }
        other.remove(2);
        let kept = Earlier::new(other).kept(&units, &current);
        assert_eq!((kept.cells.len(), kept.stale.len()), (units.len() - 3, 2));
    }
}
