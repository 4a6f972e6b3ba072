//! `raystone repro`.

use super::failure::{BAD_INPUT, FAILED};
use super::output::{OutputArguments, tell};
use super::signals;
use anyhow::{Result, anyhow, bail};
use clap::Args;
use raystone::config::Shard;
use raystone::gpu::{AdapterChoice, GpuError, is_software};
use raystone::report::{html, markdown, write_file, write_page};
use raystone::repro::claim::Row;
use raystone::repro::judge::ClaimVerdict;
use raystone::repro::run::{ReproError, Reproduced, Settings, recorded, reproduce};
use raystone::repro::{NotCovered, Source, chosen, latex, not_covered, page, scenes};
use raystone::run::{RunError, RunOptions};
use raystone::store::user_folder;
use serde_json::{Value, json};
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Run tables and figures of four theses, with their numbers beside ours and a verdict on every claim
#[derive(Args)]
pub struct Repro {
    /// Tables, by name; all without any
    name: Vec<String>,
    /// List the tables, with what each claims, and end
    #[arg(long)]
    list: bool,
    /// Short runs on small built-in scenes
    #[arg(long)]
    quick: bool,
    /// Folder of models [default: ../shared/scenes if it is there, else raystone/scenes in the user's data]
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
    /// Folder for everything that is written [default: results/repro, or results/repro-quick]
    #[arg(long, short, value_name = "DIR")]
    out: Option<PathBuf>,
    /// Run again what the folder holds whole; otherwise a run goes on where an earlier one ended
    #[arg(long)]
    force: bool,
    /// Run one of N shares of the tables, as 3/8, and write no page; a run without it then reads them all
    #[arg(long, value_name = "K/N")]
    shard: Option<Shard>,
    /// Run nothing: write the pages from the records that are there
    #[arg(long, conflicts_with = "force")]
    pages: bool,
    /// Adapter, by its number in `raystone list adapter` or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    adapter: Option<AdapterChoice>,
    #[command(flatten)]
    output: OutputArguments,
}

/// Returns the folder of models. One that was named has to be there: without its models hours of runs would say little.
fn folder_of_models(named: Option<&Path>) -> Result<PathBuf> {
    if let Some(folder) = named.filter(|folder| !folder.is_dir()) {
        let folder = folder.display();
        bail!(
            "--scenes {folder}: there is no such folder; `raystone list model` names the models that belong in it"
        );
    }
    Ok(scenes::directory(named))
}

impl Repro {
    pub fn execute(self) -> Result<ExitCode> {
        let sources = chosen(&self.name).map_err(|problem| anyhow!(problem))?;
        let not_covered = not_covered()?;
        if self.list {
            let fields = list_json(&sources, &not_covered)?;
            let text = list(&sources, &not_covered)?;
            self.output.show("repro", fields, &text)?;
            return Ok(ExitCode::SUCCESS);
        }
        let folder = if self.quick { "repro-quick" } else { "repro" };
        let mut settings = Settings {
            quick: self.quick,
            software: false,
            scenes: folder_of_models(self.scenes.as_deref())?,
            out: self
                .out
                .clone()
                .unwrap_or_else(|| PathBuf::from("results").join(folder)),
            force: self.force,
        };
        let registries = raystone::registries();
        let catalogue = registries.catalogue();
        let options = RunOptions {
            program: raystone::PROGRAM,
            adapter: self.adapter.clone().unwrap_or_default(),
            warn: Some(super::output::warn),
            cache: user_folder(),
            ..RunOptions::default()
        };
        // Without an adapter, recorded tables can be checked all the same; a run reports that there is none.
        settings.software = is_software(&options.adapter).unwrap_or(true);
        signals::watch(options.interrupt.clone())?;
        let (mut tables, mut failed) = (Vec::new(), Vec::new());
        for (index, source) in sources.iter().enumerate() {
            let is_its = |shard: Shard| index % shard.of == shard.number - 1;
            let mine = self.shard.is_none_or(is_its);
            let found = if self.pages || !mine {
                recorded(source, &settings, &catalogue).map_err(ReproError::from)
            } else {
                tell(&format!(
                    "{} ({} of {})",
                    source.name,
                    index + 1,
                    sources.len()
                ));
                reproduce(source, &settings, &registries, &options).map(Some)
            };
            match found {
                Ok(None) if mine && self.name.iter().any(|name| name == source.name) => {
                    let why = "the folder holds no whole records of it; those of --quick are read with --quick";
                    failed.push((source.name.to_owned(), why.to_owned()));
                }
                Ok(table) => tables.extend(table),
                Err(error) if ends_all(&error) => return Err(error.into()),
                Err(ReproError::Run(RunError::Interrupted)) => signals::wait_for_end(),
                Err(error) => failed.push((source.name.to_owned(), error.to_string())),
            }
        }
        if tables.is_empty() && failed.is_empty() && self.pages {
            bail!(
                "{}: holds no whole records of a table, so there is no page to write; without --pages they are run",
                settings.out.display()
            );
        }
        if self.shard.is_some() {
            return Ok(end(&tables, &failed));
        }
        let html = write(&settings, &tables, &failed, &not_covered)?;
        let text = format!("{}\nreport: {}\n", in_words(&tables), html.display());
        let fields = as_json(&tables, &failed, &html);
        self.output.show("repro", fields, &text)?;
        Ok(end(&tables, &failed))
    }
}

/// Returns `true` if every other table would fail the same way: there is no adapter.
fn ends_all(error: &ReproError) -> bool {
    matches!(error, ReproError::Run(error @ RunError::Gpu(GpuError::NoAdapter | GpuError::UnknownAdapter { .. })) if error.exit_code() == 3)
}

fn end(tables: &[Reproduced], failed: &[(String, String)]) -> ExitCode {
    for (name, reason) in failed {
        tell(&format!("failed: {name}: {reason}"));
    }
    let mut faults = 0;
    for table in tables {
        for row in table.claims.iter().flatten() {
            if row.verdict == ClaimVerdict::Faulty {
                tell(&format!(
                    "faulty expectation: {}: {}",
                    table.name, row.reason
                ));
                faults += 1;
            }
        }
    }
    match (failed.is_empty(), faults) {
        (false, _) => ExitCode::from(FAILED),
        (true, 0) => ExitCode::SUCCESS,
        _ => ExitCode::from(BAD_INPUT),
    }
}

fn write(
    settings: &Settings,
    tables: &[Reproduced],
    failed: &[(String, String)],
    not_covered: &NotCovered,
) -> Result<PathBuf> {
    let mut document = page::document(tables, failed, not_covered);
    std::fs::create_dir_all(&settings.out)?;
    let (index, _) = write_page(&settings.out, &mut document)?;
    let html = settings.out.join("repro.html");
    write_file(&html, html::page(&document)?.as_bytes())?;
    std::fs::remove_file(index)?;
    let summary = markdown::summary(&document);
    write_file(&settings.out.join("repro.md"), summary.as_bytes())?;
    write_file(
        &settings.out.join("repro.tex"),
        latex::tables(tables).as_bytes(),
    )?;
    Ok(html)
}

fn in_words(tables: &[Reproduced]) -> String {
    let mut text = String::new();
    for table in tables {
        text += &format!("\n{}: {}\n", table.name, table.thesis.title);
        for (index, expect) in table.thesis.expects.iter().enumerate() {
            let verdict = table.verdict(index);
            if verdict != ClaimVerdict::Shown {
                let claim = page::claim_name(expect);
                text += &format!("  {:17}  {claim}: {}\n", verdict.word(), expect.says);
            }
        }
    }
    format!("{text}\n{}", page::tally(tables))
}

fn row_json(row: &Row) -> Value {
    json!({
        "row": row.row,
        "column": row.column,
        "x": row.x,
        "thesis": row.thesis,
        "ours": row.ours,
        "verdict": row.verdict.word(),
        "reason": row.reason,
        "counted": row.counted,
    })
}

fn as_json(tables: &[Reproduced], failed: &[(String, String)], html: &Path) -> Value {
    let claims = |table: &Reproduced| {
        let claims = table.thesis.expects.iter().enumerate();
        let claim = |(index, expect)| {
            json!({
                "claim": page::claim_name(expect),
                "says": expect.says,
                "verdict": table.verdict(index).word(),
                "rows": table.claims[index].iter().map(row_json).collect::<Vec<_>>(),
            })
        };
        claims.map(claim).collect::<Vec<_>>()
    };
    let table = |table: &Reproduced| {
        json!({
            "name": table.name,
            "title": table.thesis.title,
            "started_unix_s": table.started,
            "quick": table.quick,
            "changes": table.changes,
            "device": table.environment.as_ref().map(|e| &e.adapter),
            "claims": claims(table),
        })
    };
    let failure = |(name, reason): &(String, String)| json!({ "name": name, "reason": reason });
    json!({
        "tables": tables.iter().map(table).collect::<Vec<_>>(),
        "failed": failed.iter().map(failure).collect::<Vec<_>>(),
        "report": html,
    })
}

fn list_json(sources: &[Source], not_covered: &NotCovered) -> Result<Value> {
    let table = |source: &Source| -> Result<Value> {
        let thesis = source.thesis()?;
        let claim = |e| json!({ "claim": page::claim_name(e), "says": e.says });
        let claims: Vec<Value> = thesis.expects.iter().map(claim).collect();
        Ok(json!({ "name": source.name, "title": thesis.title, "claims": claims }))
    };
    let tables: Result<Vec<Value>> = sources.iter().map(table).collect();
    let not_yet = not_covered.table.iter();
    let not_yet = not_yet.map(|t| json!({ "name": t.name, "title": t.title, "why": t.why }));
    Ok(json!({ "tables": tables?, "not_yet": not_yet.collect::<Vec<_>>() }))
}

fn list(sources: &[Source], not_covered: &NotCovered) -> Result<String> {
    let mut text = String::new();
    for source in sources {
        let thesis = source.thesis()?;
        text += &format!("{}\n    {}\n", source.name, thesis.title);
        for expect in &thesis.expects {
            text += &format!("      {}: {}\n", page::claim_name(expect), expect.says);
        }
    }
    text += "\nNot yet:\n";
    for table in &not_covered.table {
        text += &format!("{}\n    {}: {}\n", table.name, table.title, table.why);
    }
    Ok(text)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_folder_of_models_that_was_named_has_to_be_there() {
        let there = std::env::temp_dir();
        assert_eq!(folder_of_models(Some(&there)).unwrap(), there);
        let missing = there.join("no such folder of models");
        let said = folder_of_models(Some(&missing)).unwrap_err().to_string();
        assert!(
            said.starts_with("--scenes ") && said.contains("no such folder"),
            "{said}"
        );
        assert!(folder_of_models(None).is_ok());
    }
}
