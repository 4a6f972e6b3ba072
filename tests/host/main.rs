//! Tests without a device: parsers, plans, records, statistics, comparisons, exact references.

#[path = "../support/mod.rs"]
mod support;

mod advice;
mod compare;
mod declared_parameters;
mod discrepancy;
mod experiments;
mod kernel_errors;
mod linear_images;
mod lock_files;
mod models;
mod oracle;
mod parameters;
mod records;
mod repro;
mod statistics;
mod tiers;
mod triangle;
mod twins;
