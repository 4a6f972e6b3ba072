//! Measurements: what is measured of a plan, what that costs, and how.
//!
//! A measurement is one entry of the [`MeasurementRegistry`]. Plans, shards, expected times, resumed runs and records know it by
//! that entry alone. One that is measured cell by cell (see [`Measurement::prepare`]) writes [readings](Reading), which stand in
//! pages, comparisons and exports without another line of code; the others bring a loop of their own.

use super::cost::{Cost, Work};
use super::device::Device;
use super::progress::Progress;
use super::registries::Registries;
use crate::timing::{Measured, Samples};
use raystone_accel::Traced;
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_gpu::Gpu;
use raystone_record::figure::Figure;
use raystone_record::{Note, Reading};
use raystone_render::Stage;

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

    /// Work that several cells share, done once for all that lie on the returned cell.
    fn shared_cost(&self, _cell: &Cell, _cost: &Cost) -> Option<(Cell, Work)> {
        None
    }

    /// The structures that a cell is measured through.
    fn through(&self) -> Through {
        Through::Own
    }

    /// Makes cells ready and checks them, one by one, in their order; the driver times them together and writes their readings.
    fn prepare<'a>(&'a self, _at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let unfit = || Absent::Failed(format!("{} are not measured cell by cell", self.plural()));
        Box::new(cells.iter().map(move |_| Err(unfit())))
    }
}

/// The structures that a cell is measured through.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Through {
    /// That of the cell.
    Own,
    /// Any of its scene with its kernels: what it measures does not depend on the structure.
    Any,
    /// None.
    None,
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
#[derive(Debug)]
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
    /// The structures that passed their gate, by cell.
    pub(super) traced: Vec<(&'a Cell, &'a Traced)>,
    /// Structures that the driver refused, each with the reason.
    pub(super) refused: Vec<(Cell, String)>,
    pub(super) progress: Progress,
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
    /// The driver refused it, or it did not pass its gate.
    pub fn traced(&self, cell: &Cell) -> Result<&Traced, Absent> {
        let mut structures = self.traced.iter();
        let structure = structures.find(|(structure, _)| cell.is_on(structure));
        let absent = || {
            let mut refused = self.refused.iter();
            let refused = refused.find(|(structure, _)| cell.is_on(structure));
            let failed = || Absent::Failed("its structure did not pass the gate".to_owned());
            refused.map_or_else(failed, |(_, reason)| Absent::Refused(reason.clone()))
        };
        structure.map(|(_, traced)| *traced).ok_or_else(absent)
    }
}
