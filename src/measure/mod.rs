//! Measuring: the gate, the timing protocol, image metrics, statistics, records.

pub mod adaptive;
pub mod bias;
pub mod compaction;
pub mod comparison;
pub mod figure;
pub mod flip;
pub mod gate;
pub mod growth;
pub mod hard_rays;
mod holes;
pub mod hypothesis;
pub mod image_gate;
mod instance_judge;
mod kept_checks;
pub mod known_images;
pub mod memory;
mod mesh;
pub mod metrics;
pub mod path_oracle;
pub mod peer_judge;
pub mod rays;
pub mod record;
pub mod replicates;
pub mod sampler_cost;
pub mod shadow_rays;
mod shown;
pub mod spectrum;
pub mod statistics;
pub mod stopping;
pub mod stream;
pub mod timing;
mod trial_lights;
pub mod trial_scenes;
mod trial_surfaces;
pub mod words;

pub use kept_checks::CACHE_VARIABLE;
