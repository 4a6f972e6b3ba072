//! Stream compaction, and the scans that it is made of.

mod faults;
mod methods;
mod runs;
mod scan;
