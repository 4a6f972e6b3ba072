//! Measurements: what is measured of a plan, what that costs, and how.
//!
//! A measurement is one entry of the [`MeasurementRegistry`]. Plans, shards, expected times, resumed runs and records know it by
//! that entry alone. One that is measured cell by cell (see [`Measurement::prepare`]) writes [readings](Reading), which stand in
//! pages, comparisons and exports without another line of code; the others bring a loop of their own.

use super::kernels::Device;
use super::progress::Progress;
use super::registries::Registries;
use super::session::Session;
use super::structures::Gated;
use super::world::World;
use super::{Cost, RunError, Work};
use crate::timing::{Measured, Samples};
use raystone_accel::Traced;
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_gpu::Gpu;
use raystone_record::figure::Figure;
use raystone_record::{Note, Reading};
use raystone_render::Stage;
use std::fmt;

/// One kind of measurement.
pub trait Measurement: Send + Sync {
    /// Its name in records and lists, for instance `compaction`.
    fn name(&self) -> &'static str;

    /// What several of its cells are called.
    fn plural(&self) -> &'static str;

    /// Its figures, beside those of [`raystone_record::figure::FIGURES`].
    fn figures(&self) -> &'static [Figure] {
        &[]
    }

    /// Adds what experiments may say of it: entries of axes, sections of settings.
    fn declare(&self, _catalogue: &mut Catalogue) {}

    /// The cells of a plan that it measures, in the order of the plan.
    fn cells(&self, experiment: &Experiment, plan: &Plan) -> Vec<Cell>;

    /// The name of a cell in records: unique among those of all measurements.
    fn unit_name(&self, cell: &Cell) -> String {
        format!("{} of {cell}", self.name())
    }

    /// What cells have in common that are measured in the same rounds, and so stay in one shard: a measurement, and the part of
    /// the cell.
    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        (self.name(), cell.on(&Cell::WORLD))
    }

    /// Whether what is done for one cell serves others as well: what kernels that took counts for all of its cells.
    fn is_shared(&self) -> bool {
        false
    }

    /// Whether clocks speak, so that figures of different machines must not meet.
    fn is_timed(&self) -> bool {
        true
    }

    /// The settings of the experiment that its figures depend on, as a text that differs where they do. `reference_file` is the
    /// hash of the image that errors are measured against; empty if that is rendered.
    fn settings(&self, experiment: &Experiment, reference_file: &str) -> String;

    /// The work of a cell, without what several share.
    fn cost(&self, cell: &Cell, cost: &Cost) -> Work;

    /// Makes cells ready and checks them, one by one, in their order; the driver times them together and writes their readings.
    fn prepare<'a>(&'a self, _at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let unfit = || Absent::Failed(format!("{} are not measured cell by cell", self.plural()));
        Box::new(cells.iter().map(move |_| Err(unfit())))
    }
}

/// Cells on their way to be timed: one item for each.
pub type Preparation<'a> = Box<dyn Iterator<Item = Result<Box<dyn Prepared + 'a>, Absent>> + 'a>;

/// A cell that is ready, and passed its checks.
pub trait Prepared {
    /// What is timed of it, in the rounds of all cells; nothing where no clock is read.
    fn timed(&self) -> Vec<&dyn Measured> {
        Vec::new()
    }

    /// Its figures, from the samples of each thing that was timed.
    ///
    /// # Errors
    /// What is wrong with them, in words: the cell fails.
    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String>;

    /// What figures cannot say.
    fn notes(&self) -> Vec<Note> {
        Vec::new()
    }
}

/// Why a cell is not timed.
#[derive(Debug, Clone)]
pub enum Absent {
    /// It cannot be measured here, for this reason: the cell is left out.
    Refused(String),
    /// It is wrong: the cell fails.
    Failed(String),
}

impl From<raystone_gpu::GpuError> for Absent {
    fn from(error: raystone_gpu::GpuError) -> Self {
        if error.is_refusal() || matches!(error, raystone_gpu::GpuError::TooLarge { .. }) {
            Self::Refused(error.to_string())
        } else {
            Self::Failed(error.to_string())
        }
    }
}

/// Where a measurement is carried out.
pub struct At<'a> {
    /// The experiment.
    pub experiment: &'a Experiment,
    /// Everything that can be named.
    pub registries: &'a Registries,
    /// The scene with its tests; `None` for cells without a scene.
    pub stage: Option<&'a Stage>,
    pub(super) device: &'a Device,
    pub(super) progress: Progress,
    pub(super) gated: &'a [Gated],
}

impl At<'_> {
    /// The device with the kernels of a cell.
    ///
    /// # Errors
    /// The plan was made for other kernels.
    pub fn gpu(&self, cell: &Cell) -> Result<&Gpu, Absent> {
        let gpu = self.device.of(&cell[Axis::Kernels]);
        gpu.map_err(|error| Absent::Failed(error.to_string()))
    }

    /// Devices with the kernels of a cell that may work at once, where nothing is timed: one, or two of a software adapter.
    ///
    /// # Errors
    /// The plan was made for other kernels.
    pub fn gpus(&self, cell: &Cell) -> Result<Vec<Gpu>, Absent> {
        let gpus = self.device.hands(&cell[Axis::Kernels]);
        gpus.map_err(|error| Absent::Failed(error.to_string()))
    }

    /// Says what is being done.
    pub fn say(&self, what: String) {
        self.progress.say(what);
    }

    /// The structure of a cell on the device.
    ///
    /// # Errors
    /// It did not pass its gate.
    pub fn traced(&self, cell: &Cell) -> Result<&Traced, Absent> {
        let structure = self.gated.iter().find(|gated| cell.is_on(&gated.cell));
        let failed = || Absent::Failed("its structure did not pass the gate".to_owned());
        structure.map(|gated| &gated.traced).ok_or_else(failed)
    }
}

/// How the cells of a measurement are run.
#[derive(Clone, Copy)]
pub(super) enum Run {
    /// One by one, by the driver.
    CellByCell,
    /// Before all others of a world, which they serve.
    First,
    /// All of a world, after its structures.
    OfWorld(fn(&mut Session, &World, &[Gated]) -> Result<(), RunError>),
    /// All of the plan, behind the scenes.
    Alone(fn(&mut Session, &Device) -> Result<(), RunError>),
}

/// A measurement with how it is run.
#[derive(Clone, Copy)]
pub(super) struct Entry {
    pub measurement: &'static dyn Measurement,
    pub run: Run,
}

/// All measurements, in the order in which a run takes them.
#[derive(Clone)]
pub struct MeasurementRegistry(Vec<Entry>);

impl Default for MeasurementRegistry {
    fn default() -> Self {
        use super::{animation, coherence, compactions, errors, peers, streams, structures, times};
        let entry = |measurement, run| Entry { measurement, run };
        Self(vec![
            entry(&structures::Structures, Run::First),
            entry(&peers::Peers, Run::First),
            entry(&errors::Errors, Run::OfWorld(errors::run)),
            entry(&times::Times, Run::OfWorld(times::run)),
            entry(&coherence::Models, Run::OfWorld(coherence::run)),
            entry(&animation::Animations, Run::OfWorld(animation::run)),
            entry(&streams::Streams, Run::Alone(streams::run)),
            entry(&compactions::Compactions, Run::CellByCell),
        ])
    }
}

impl MeasurementRegistry {
    /// Adds a measurement that is carried out cell by cell.
    ///
    /// # Errors
    /// Another one has its name, or one of its figures has an id that is taken.
    pub fn add(&mut self, measurement: &'static dyn Measurement) -> Result<(), String> {
        let name = measurement.name();
        if self.iter().any(|known| known.name() == name) {
            return Err(format!(
                "there is a measurement {name:?} already: choose another name"
            ));
        }
        let mut known: Vec<&str> = raystone_record::figure::FIGURES
            .iter()
            .copied()
            .chain(self.figures())
            .map(|figure| &*figure.id)
            .collect();
        for figure in measurement.figures() {
            if known.contains(&&*figure.id) || !figure.id.contains("/v") {
                return Err(format!(
                    "the figure {:?} of {name:?} needs an id of its own with a version, as in \"my-figure/v1\"",
                    figure.id
                ));
            }
            known.push(&figure.id);
        }
        let run = Run::CellByCell;
        self.0.push(Entry { measurement, run });
        Ok(())
    }

    /// All of them.
    pub fn iter(&self) -> impl Iterator<Item = &'static dyn Measurement> {
        self.0.iter().map(|entry| entry.measurement)
    }

    /// Figures of those that were added.
    pub fn figures(&self) -> impl Iterator<Item = &'static Figure> {
        self.iter().flat_map(Measurement::figures)
    }

    pub(super) fn entries(&self) -> &[Entry] {
        &self.0
    }

    /// Everything that is measured of a plan, in the order in which a run of one shard takes it: scene by scene, then what has
    /// none.
    pub fn units(&self, experiment: &Experiment, plan: &Plan) -> Vec<Unit> {
        let cells: Vec<_> = (self.iter().map(|m| (m, m.cells(experiment, plan)))).collect();
        let scenes = plan.scenes.iter().map(Some).chain([None]);
        let mut units = Vec::new();
        for scene in scenes {
            for (measurement, cells) in &cells {
                let own = cells.iter().filter(|cell| cell.get(Axis::Scene) == scene);
                units.extend(own.map(|cell| Unit::new(*measurement, cell)));
            }
        }
        units
    }
}

/// What is measured as one, kept as one when a run is resumed, and given to one shard.
#[derive(Clone)]
pub struct Unit {
    /// Its name, unique in the plan.
    pub name: String,
    /// How it is measured.
    pub measurement: &'static dyn Measurement,
    /// What is measured.
    pub cell: Cell,
}

impl Unit {
    fn new(measurement: &'static dyn Measurement, cell: &Cell) -> Self {
        Self {
            name: measurement.unit_name(cell),
            measurement,
            cell: cell.clone(),
        }
    }

    /// Name of its [measurement](Measurement::name).
    pub fn kind(&self) -> &'static str {
        self.measurement.name()
    }
}

impl PartialEq for Unit {
    fn eq(&self, other: &Self) -> bool {
        (self.kind(), &self.name, &self.cell) == (other.kind(), &other.name, &other.cell)
    }
}

impl fmt::Debug for Unit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}: {}", self.kind(), self.name)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_measurement_from_outside_needs_a_name_and_figures_of_its_own() {
        use raystone_record::figure::{Better::Lower, Shown::Count, Spread::Exact};
        struct Mine(&'static str, &'static [Figure]);
        impl Measurement for Mine {
            fn name(&self) -> &'static str {
                self.0
            }
            fn plural(&self) -> &'static str {
                "mine"
            }
            fn figures(&self) -> &'static [Figure] {
                self.1
            }
            fn cells(&self, _: &Experiment, _: &Plan) -> Vec<Cell> {
                Vec::new()
            }
            fn settings(&self, _: &Experiment, _: &str) -> String {
                String::new()
            }
            fn cost(&self, _: &Cell, _: &Cost) -> Work {
                Work::default()
            }
        }
        static FIGURES: [Figure; 3] = [
            Figure::new("mine/v1", "mine", "", Lower, Count, Exact),
            Figure::new("sah-cost/v1", "cost", "", Lower, Count, Exact),
            Figure::new("mine", "mine", "", Lower, Count, Exact),
        ];
        let add = |registry: &mut MeasurementRegistry, name, figures| {
            registry.add(Box::leak(Box::new(Mine(name, figures))))
        };
        let mut registry = MeasurementRegistry::default();
        let count = registry.iter().count();
        assert!(add(&mut registry, "compaction", &[]).is_err());
        assert!(add(&mut registry, "mine", &FIGURES[1..2]).is_err());
        assert!(add(&mut registry, "mine", &FIGURES[2..]).is_err());
        assert_eq!(add(&mut registry, "mine", &FIGURES[..1]), Ok(()));
        assert!(add(&mut registry, "other", &FIGURES[..1]).is_err());
        assert_eq!(registry.iter().count(), count + 1);
    }
}
