//! How alike the rays of neighbouring lanes are, and what a processor makes of it: a model that needs no GPU.
//!
//! The rays that an integrator would trace with a sampler ([`paths`]) are sent through the twin of a structure,
//! which tells every node that it visits and every triangle that it tests with the memory that it reads for
//! them ([`trace`]). The lanes of a warp then take these steps together (`simt`), and the cache lines that a
//! step needs pass through the caches of a machine ([`cache`]). All is counted in integers, in an order that
//! depends on nothing but the input ([`model`]): the same rays give the same figures on every machine, with any
//! number of threads.
//!
//! What it leaves out: latency, the order of warps that a scheduler would choose, the loads of shading and of
//! samplers, words of masks. `docs/coherence.md` has the rules, and what they say.

pub mod cache;
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
pub use model::{Machine, Pass, Warp, run, together};
pub use organisation::Organisation;
pub use paths::{RayClass, Rays, View, groups_of};
pub use sets::of_rays;
pub use trace::{Kind, Step, Trace, trace_of};
