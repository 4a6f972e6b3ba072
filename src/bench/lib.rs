//! Runs: executes the measurements of experiments and records them.
#![warn(missing_docs)]

pub mod animation;
mod clock_check;
pub mod coherence;
pub mod compaction;
pub mod environment;
pub mod figure_registry;
mod heat_map;
pub mod known_pictures;
pub mod known_words;
pub mod memory;
pub mod peers;
pub mod ray_sets;
pub mod run;
pub mod sampler_cost;
pub mod spectrum;
pub mod stopping;
pub mod stream;
mod timed_rays;
pub mod timing;
pub mod words;
