//! Coherence of rays in neighbouring lanes, and its effect on a processor: a model without a GPU.
//!
//! The rays of an integrator and sampler ([`paths`]) traverse a structure's host twin, which
//! reports every node visit and triangle test with its memory reads ([`trace`]). The lanes of a
//! warp execute these steps in lock step (`simt`), and the cache lines of each step pass through
//! the caches of a machine ([`cache`]). Everything is counted in integers, in an order that depends
//! only on the input ([`model`]): equal rays give equal figures on any machine.
//!
//! Not modelled: latency, the order of warps chosen by a scheduler, loads of shading and samplers,
//! mask words. `docs/coherence.md` states the rules and their meaning.

pub mod cache;
pub(crate) mod known;
pub mod memory;
pub mod model;
pub mod organisation;
pub mod paths;
pub mod sets;
pub(crate) mod simt;
pub mod trace;

pub use cache::CacheShape;
pub use memory::{Fetch, Memory};
pub(crate) use model::run_groups;
pub use model::{Machine, Pass, Running, Warp, run, together};
pub use organisation::Organisation;
pub(crate) use paths::check_origins;
pub use paths::{RayClass, Rays, View, groups_of};
pub use sets::of_rays;
pub use trace::{Kind, Step, Trace, trace_of};
