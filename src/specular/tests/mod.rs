//! Tests of the search: its parts against closed forms and differences, its figures against those known.

mod device;
mod measure;
mod oracle;
mod pseudo_code;
mod reflectors;
mod search;
mod table;
