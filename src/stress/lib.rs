//! The numerical stress suite: every triangle test and structure on scenes and rays that rounding makes hard, checked
//! exactly. `docs/stress.md` explains the counts.
//!
//! Families make cases (`families`), which are traced on the adapter (`suite`) beside a million shots at closed meshes
//! ([`shots`]); the exact oracle checks the answers ([`tally`]). Each part of the suite is a measurement ([`register`])
//! of an ordinary experiment, [`EXPERIMENT`], whose targets are its `[[expect]]`.
#![warn(missing_docs)]

mod axes;
pub(crate) mod bench;
pub mod case;
pub mod explain;
pub(crate) mod families;
mod found;
mod measurement;
pub mod numerics;
pub mod placement;
pub(crate) mod shapes;
pub(crate) mod shot_meshes;
pub mod shots;
pub(crate) mod suite;
pub mod tally;

pub use families::family_names;
pub use found::Found;
pub use measurement::{Settings, register};

/// The experiment of the whole suite.
pub const EXPERIMENT: &str = include_str!("../../experiments/stress.toml");
