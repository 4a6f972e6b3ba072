//! Measurements of a plan and their cost.
//!
//! A measurement is one entry of the [`MeasurementRegistry`]; plans, shards, expected times,
//! resumed runs and records use only that entry. Cell-by-cell measurements (see
//! [`Measurement::prepare`]) write [readings](Reading), which appear in pages, comparisons and
//! exports without further code; the others have their own loop.

use super::cost::{Cost, Work};
use super::device::Device;
use super::progress::Progress;
use super::registries::Registries;
use crate::timing::{Measured, Samples};
use raystone_accel::Traced;
use raystone_config::{Axis, Catalogue, Cell, Experiment, Plan};
use raystone_gpu::Gpu;
use raystone_image::Picture;
use raystone_record::figure::Figure;
use raystone_record::{Note, Reading};
use raystone_render::Stage;

/// A kind of measurement.
pub trait Measurement: Send + Sync {
    /// Name in records and lists, for instance `compaction`.
    fn name(&self) -> &'static str;

    /// Plural name of its cells.
    fn plural(&self) -> &'static str;

    /// Its figures, in addition to [`raystone_record::figure::FIGURES`].
    fn figures(&self) -> &'static [Figure] {
        &[]
    }

    /// Adds its entries of axes and sections of settings to the catalogue.
    fn declare(&self, _catalogue: &mut Catalogue) {}

    /// The cells of a plan that it measures, in plan order.
    fn cells(&self, experiment: &Experiment, plan: &Plan) -> Vec<Cell>;

    /// Name of a cell in records, unique among all measurements.
    fn unit_name(&self, cell: &Cell) -> String {
        format!("{} of {cell}", self.name())
    }

    /// Key (measurement and part of the cell) of cells in the same rounds, and so in one shard.
    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        (self.name(), cell.on(&Cell::WORLD))
    }

    /// True if work for one cell serves others: its kernels then count for all of its cells.
    fn is_shared(&self) -> bool {
        false
    }

    /// True if it reads clocks, so figures of different machines must not be mixed.
    fn is_timed(&self) -> bool {
        true
    }

    /// Text of the experiment settings that its figures depend on. `reference_file` is the hash of
    /// the reference image; empty if it is rendered.
    fn settings(&self, experiment: &Experiment, reference_file: &str) -> String;

    /// Work of a cell, without shared work.
    fn cost(&self, cell: &Cell, cost: &Cost) -> Work;

    /// Work shared by several cells, done once for all of them on the returned cell.
    fn shared_cost(&self, _cell: &Cell, _cost: &Cost) -> Option<(Cell, Work)> {
        None
    }

    /// The structures through which a cell is measured.
    fn through(&self) -> Through {
        Through::Own
    }

    /// What the cells that are timed in the same rounds have in common, and follow each other by. Others are prepared
    /// when these are done, so that a device holds at one time what one group needs.
    fn group(&self, _cell: &Cell) -> String {
        String::new()
    }

    /// Prepares and checks cells of one group in order; the driver times them together and writes readings.
    fn prepare<'a>(&'a self, _at: &'a At<'a>, cells: &'a [Cell]) -> Preparation<'a> {
        let unfit = || Absent::Failed(format!("{} are not measured cell by cell", self.plural()));
        Box::new(cells.iter().map(move |_| Err(unfit())))
    }
}

/// The structures through which a cell is measured.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Through {
    /// The cell's own.
    Own,
    /// Any of its scene with its kernels: the result does not depend on the structure.
    Any,
    /// None.
    None,
}

/// Cells being prepared, one item each.
pub type Preparation<'a> = Box<dyn Iterator<Item = Result<Box<dyn Prepared + 'a>, Absent>> + 'a>;

/// A cell that is ready and has passed its checks.
pub trait Prepared {
    /// Items to time in the rounds of all cells; empty if no clock is read.
    fn timed(&self) -> Vec<&dyn Measured> {
        Vec::new()
    }

    /// Its figures, from the samples of each timed item.
    ///
    /// # Errors
    /// The problem with them: the cell fails.
    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String>;

    /// What figures cannot say.
    fn notes(&self) -> Vec<Note> {
        Vec::new()
    }

    /// A picture of what was found, for the page.
    fn picture(&self) -> Option<Picture> {
        None
    }
}

/// Why a cell is not timed.
#[derive(Debug, Clone)]
pub enum Absent {
    /// It cannot be measured here, for this reason: the cell is skipped.
    Refused(String),
    /// Its result is wrong: the cell fails.
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

/// Context of a measurement.
pub struct At<'a> {
    /// The experiment.
    pub experiment: &'a Experiment,
    /// All registries.
    pub registries: &'a Registries,
    /// The scene with its tests; `None` for cells without a scene.
    pub stage: Option<&'a Stage>,
    pub(super) device: &'a Device,
    /// The structures that passed the correctness check, by cell.
    pub(super) traced: Vec<(&'a Cell, &'a Traced)>,
    /// Structures refused by the driver, with the reason.
    pub(super) refused: Vec<(Cell, String)>,
    pub(super) progress: Progress,
}

impl At<'_> {
    /// The device with a cell's kernels.
    ///
    /// # Errors
    /// The kernels are not in the plan.
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

    /// A cell's structure on the device.
    ///
    /// # Errors
    /// The driver refused it, or it failed its correctness check.
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
