//! The web page's program. It shows scenes on the visitor's GPU while structures and samplers work on them, and measures
//! structures, each gated against the reference tracer before it is timed, into the records of `raystone run`.
//!
//! Building structures and tracing reference rays takes the host seconds, so all of it runs in workers: the page stays alive,
//! and stopping is ending the worker.
#![warn(missing_docs)]

mod host;
mod memory;
mod opened;
mod plan;
mod rounds;
mod run;
mod told;
mod view;
mod world;

#[cfg(target_family = "wasm")]
mod browser;

use raystone_core::program::Program;

pub use host::Host;
pub use plan::{EXPERIMENT, FILE, plan};
pub use run::run;
pub use view::{Shell, view};

const PROGRAM: Program = Program {
    version: env!("CARGO_PKG_VERSION"),
    commit: option_env!("RAYSTONE_COMMIT"),
    dirty: None,
};
