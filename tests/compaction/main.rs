//! Stream compaction, and the scans that it is made of.

mod scan;
#[path = "../support/mod.rs"]
mod support;
