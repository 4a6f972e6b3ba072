//! Tests of the search: its parts against closed forms and differences, its figures against those known.

mod oracle;
mod search;
