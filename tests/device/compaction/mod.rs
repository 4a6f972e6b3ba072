//! Stream compaction, and its scans.

mod faults;
mod methods;
mod runs;
mod scan;
mod votes;
