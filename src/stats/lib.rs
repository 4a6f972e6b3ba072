//! Estimates with intervals, hypothesis tests, and image metrics.
#![warn(missing_docs)]

pub mod adaptive;
pub mod bias;
pub mod comparison;
pub mod flip;
pub mod growth;
pub mod heavy_tails;
pub mod hypothesis;
pub mod interval;
pub mod known_figures;
mod known_metrics;
mod known_tests;
mod log_figure;
pub mod metrics;
pub mod rates;
mod shown;
pub mod signed_rank;
pub mod statistics;
