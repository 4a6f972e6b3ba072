//! Measuring: the gate, the timing protocol, image metrics, statistics, records.

pub mod atomic;
pub mod bias;
pub mod hypothesis;
pub mod image;
pub mod picture;
pub mod record;
pub mod statistics;
