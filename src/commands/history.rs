//! `raystone history`.

use super::export::ChoiceArguments;
use super::output::{OutputArguments, screen, warn};
use anyhow::Result;
use clap::Args;
use raystone::history::History;
use raystone::measure::record::read_records;
use raystone::report::write_page;
use raystone::run::records_in;
use serde_json::json;
use std::collections::BTreeSet;
use std::path::PathBuf;
use std::process::ExitCode;

/// Show how figures changed over the runs of several commits: a table, and a page with plots
#[derive(Args)]
pub struct HistoryOf {
    /// Folders that runs wrote; they are taken in the order of their time
    #[arg(required = true)]
    dirs: Vec<PathBuf>,
    #[command(flatten)]
    choice: ChoiceArguments,
    /// Folder for the page and its plots [default: none is written]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

impl HistoryOf {
    pub fn execute(self) -> Result<ExitCode> {
        let mut all = Vec::new();
        let mut seen = BTreeSet::new();
        for dir in self.dirs.iter().map(|dir| records_in(dir)) {
            if !seen.insert(dir.canonicalize().unwrap_or_else(|_| dir.clone())) {
                warn(&format!(
                    "{}: given before, and counted once",
                    dir.display()
                ));
                continue;
            }
            let records = read_records(&dir)?;
            for warning in &records.warnings {
                warn(&format!("{}: {warning}", dir.display()));
            }
            all.push((dir, records.lines));
        }
        let history = History::new(&all, &self.choice.selection()?)?;
        let page = match &self.out {
            Some(folder) => Some(write_page(folder, &mut history.document())?.0),
            None => None,
        };
        let screen = screen();
        let mut text = screen.table(&history.runs_table()) + "\n";
        let changes = history.changes_table();
        if !changes.rows.is_empty() {
            text += &(screen.table(&changes) + "\n");
        }
        text += &screen.lines(&history.summary());
        if let Some(page) = &page {
            text += &format!("page: {}\n", page.display());
        }
        let mut fields = history.json();
        fields["page"] = json!(page);
        self.output.show("history", fields, &text)?;
        Ok(ExitCode::SUCCESS)
    }
}
