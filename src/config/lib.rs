//! Experiment files: parse, validate, expand axes into cells.
//!
//! [`Experiment::load`] reads a file, lays the defaults under it and the overrides of the command
//! line over it, and checks every key against [`keys::KEYS`] and every name against a
//! [`Catalogue`]. [`Plan::new`] turns the axes into the cells that have to be run, and
//! [`cell_hash`](raystone_core::text::cell_hash) gives each its content hash.
#![warn(missing_docs)]

mod axis_map;
mod cells;
mod check;
mod error;
pub mod expect;
mod experiment;
pub mod keys;
mod parse;
mod pattern;
mod plan;
mod product;
mod section;
mod tree;
mod units;
mod variants;

pub use axis_map::AxisMap;
pub use cells::{COMPACTIONS, Cell, NO_PEER, is_compaction};
pub use error::{ConfigError, Place};
pub use experiment::{
    Animation, Axes, CellSet, Coherence, Condition, Discrepancy, Experiment, Gate, Motion,
    REFERENCE_PARTS, Reference, Rule, Seeds, SppCounts, StopRule, Timing,
};
pub use keys::Axis;
pub use pattern::{Pattern, Selector};
pub use plan::{Plan, Skipped};
pub use units::Shard;

use raystone_core::params::Entry;

/// Every name that an experiment may use, by axis. Built from the registries, so that a new entry
/// is known to the parser, `raystone list` and the docs without another edit. Scenes may be paths besides,
/// kernels are nothing else.
pub type Catalogue = AxisMap<Vec<Entry>>;
