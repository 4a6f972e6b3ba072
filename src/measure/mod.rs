//! Measuring: the gate, the timing protocol, image metrics, statistics, records.

pub mod bias;
pub mod comparison;
pub mod figure;
pub mod flip;
pub mod gate;
pub mod hard_rays;
pub mod hypothesis;
pub mod image_gate;
mod instance_judge;
mod kept_checks;
pub mod memory;
pub mod metrics;
pub mod path_oracle;
pub mod rays;
pub mod record;
pub mod replicates;
pub mod sampler_cost;
mod shown;
pub mod spectrum;
pub mod statistics;
pub mod stopping;
pub mod stream;
pub mod timing;
pub mod trial_scenes;
pub mod words;

pub use kept_checks::CACHE_VARIABLE;
