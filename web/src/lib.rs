//! The web page's program: measures structures on the visitor's GPU, each gated against the reference tracer before it is
//! timed, and writes the records of `raystone run`.
//!
//! Building structures and tracing reference rays takes the host seconds, so all of it runs in a worker: the page stays alive,
//! and stopping is ending the worker.
#![warn(missing_docs)]

mod host;
mod plan;
mod rounds;
mod run;
mod world;

#[cfg(target_family = "wasm")]
mod browser;

pub use host::Host;
pub use plan::{EXPERIMENT, FILE, Registries};
pub use run::run;
