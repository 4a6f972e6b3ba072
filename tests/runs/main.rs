//! The program as a whole: its commands, runs, their output and its readers.

#[path = "../support/mod.rs"]
mod support;

mod ci_kit;
mod command_line;
mod examples;
mod exports;
mod numerics;
mod recovery;
mod report_page;
mod stop_rule;
mod stress;
mod sweeps;
mod tiny_run;
