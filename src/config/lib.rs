//! Experiment files: parse, validate, expand axes into cells.
//!
//! [`Experiment::load`] reads a file, applies command-line overrides, and checks every key and name
//! against a [`Catalogue`]; settings are fully declared by structs ([`Settings`]). [`Plan::new`]
//! expands the axes into the cells to run, and [`cell_hash`](raystone_core::text::cell_hash) hashes
//! the content of each.
#![warn(missing_docs)]

mod axis;
mod catalogue;
mod cells;
mod check;
mod error;
pub mod expect;
mod experiment;
mod faults;
mod parse;
mod pattern;
mod plan;
pub mod plot;
mod product;
mod sections;
mod settings;
mod tree;
mod units;
mod values;
mod variants;

pub use axis::{Axis, AxisMap};
pub use catalogue::Catalogue;
pub use cells::{COMPACTIONS, CONES, Cell, MEDIA, NO_PEER, RAYS, SPECULAR, STRESS, is_bench};
pub use error::{ConfigError, Place};
pub use experiment::{Axes, CellSet, Condition, Experiment, REFERENCE_PARTS, Seeds};
pub use pattern::{Pattern, Selector, split_outside_brackets};
pub use plan::{Plan, Skipped};
pub use sections::{
    Animation, Coherence, Discrepancy, Follow, Gate, Map, Motion, Pace, Reference, Rule, Run,
    SppCounts, StopRule, Timing, View, Window,
};
pub use settings::{Contradiction, Section, Settings};
pub use units::Shard;
