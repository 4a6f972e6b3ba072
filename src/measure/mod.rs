//! Measuring: the gate, the timing protocol, image metrics, statistics, records.

pub mod record;
