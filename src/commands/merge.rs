//! `raystone merge`.

use super::failure::ended;
use super::output::{OutputArguments, tell, warn};
use anyhow::Result;
use clap::Args;
use raystone::measure::record::{RunRecord, all_of, read_records};
use raystone::report::format::plural;
use raystone::report::{failed_checks, write_report};
use raystone::run::merge;
use serde_json::json;
use std::path::PathBuf;
use std::process::ExitCode;

/// Join the folders of shards to one, with its report
#[derive(Args)]
pub struct Merge {
    /// Folders that `raystone run --shard` wrote
    #[arg(required = true)]
    dirs: Vec<PathBuf>,
    /// Folder for the joined records, pictures and report
    #[arg(long, short, value_name = "DIR")]
    out: PathBuf,
    /// Where shards ran on several devices: take the times of those alone whose description holds this text
    #[arg(long, value_name = "TEXT")]
    device: Option<String>,
    #[command(flatten)]
    output: OutputArguments,
}

impl Merge {
    pub fn execute(self) -> Result<ExitCode> {
        let registries = raystone::registries();
        let merged = merge(&self.dirs, &self.out, self.device.as_deref(), &registries)?;
        for note in &merged.notes {
            warn(note);
        }
        let page = write_report(&self.out)?.html;
        let lines = read_records(&self.out)?.lines;
        let failed = failed_checks(&lines);
        for check in &failed {
            tell(&format!("failed: {check}"));
        }
        let cells = merged.cells;
        let fields = json!({
            "cells": cells,
            "whole": !merged.incomplete,
            "notes": merged.notes,
            "report": page,
        });
        let (folders, page) = (self.dirs.len(), page.display());
        let joined = [plural(cells, "cell"), plural(folders, "folder")].join(" of ");
        let text = format!("{joined}\n\nreport: {page}\n");
        self.output.show("merge", fields, &text)?;
        // As of the run that was divided.
        let is_lenient = all_of::<RunRecord>(&lines)
            .last()
            .is_some_and(|run| run.body.lenient);
        Ok(ended(
            !merged.incomplete && (failed.is_empty() || is_lenient),
        ))
    }
}
