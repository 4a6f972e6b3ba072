//! Experiment files: parse, validate, expand axes into cells.
//!
//! [`Experiment::load`] reads a file, lays the defaults under it and the overrides of the command
//! line over it, and checks every key against [`keys::KEYS`] and every name against a
//! [`Catalogue`]. [`Plan::new`] turns the axes into the cells that have to be run, and
//! [`cell_hash`] gives each its content hash.

mod cells;
mod check;
mod error;
mod experiment;
pub mod keys;
mod parse;
mod pattern;
mod plan;
mod section;
mod tree;
mod variants;

pub use cells::{SamplerCell, StreamCell, StructureCell, TimeCell};
pub use error::{ConfigError, Place};
pub use experiment::{
    Axes, Discrepancy, Exclude, Experiment, Gate, REFERENCE_PARTS, Reference, Seeds, SppRange,
    Tests, Timing,
};
pub use keys::Axis;
pub use pattern::Pattern;
pub use plan::{Plan, Skipped};

use crate::params::Entry;

/// Every name that an experiment may use, by axis. Built from the registries, so that a new entry
/// is known to the parser, `raystone list` and the docs without another edit.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    /// Built-in scenes; any other scene name is a path.
    pub scene: Vec<Entry>,
    /// Acceleration structures.
    pub accel: Vec<Entry>,
    /// Sample sequences.
    pub sequence: Vec<Entry>,
    /// Decorrelations.
    pub decorrelation: Vec<Entry>,
    /// Integrators.
    pub integrator: Vec<Entry>,
}

impl Catalogue {
    /// The known entries of one axis.
    pub fn entries(&self, axis: Axis) -> &[Entry] {
        match axis {
            Axis::Scene => &self.scene,
            Axis::Accel => &self.accel,
            Axis::Sequence => &self.sequence,
            Axis::Decorrelation => &self.decorrelation,
            Axis::Integrator => &self.integrator,
            Axis::Kernels => &[],
        }
    }
}
