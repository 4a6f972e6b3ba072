//! Tests of the search: its parts against closed forms and differences, its figures against those known.

mod device;
mod measure;
mod oracle;
mod pseudo_code;
mod reflectors;
mod search;
mod table;
#[allow(dead_code, unreachable_pub, reason = "other tests use the rest")]
#[path = "../../../tests/support/tier.rs"]
mod tier;
