//! Measuring: the gate, the timing protocol, image metrics, statistics, records.

pub mod bias;
pub mod hypothesis;
pub mod image;
pub mod record;
pub mod statistics;
