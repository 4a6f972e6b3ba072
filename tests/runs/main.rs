//! The program as a whole: its commands, runs, what they leave behind and what reads it.

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
