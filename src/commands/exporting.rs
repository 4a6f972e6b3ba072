//! `raystone export`.

use super::output::{print, tell, warn};
use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use raystone::atomic::write_atomic;
use raystone::export::select::Selection;
use raystone::export::{FORMATS, Format, Source, Writer};
use raystone::measure::record::read_records;
use raystone::run::records_in;
use raystone::text::nearest;
use std::path::PathBuf;
use std::process::ExitCode;

/// Write the figures, times, checks or images of a run in the format of another tool
#[derive(Args)]
pub struct Export {
    /// Folder that a run wrote, with records.jsonl
    dir: PathBuf,
    /// Format, by its name in `raystone list format`
    #[arg(long, value_name = "NAME", value_parser = format_of)]
    format: &'static Format,
    /// File to write, for npy a folder [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    /// Figure, by its id with or without the version, or a pattern of ids; may be given many times
    #[arg(long, value_name = "ID")]
    figure: Vec<String>,
    /// Keep what fits: `--only 'accel=*bvh,uniform-grid(lambda=3),scene=cornell-box'`; patterns of one axis are alternatives
    #[arg(long, value_name = "AXIS=PATTERN,…")]
    only: Vec<String>,
}

fn format_of(name: &str) -> Result<&'static Format, String> {
    let found = FORMATS.iter().find(|format| format.name == name);
    found.ok_or_else(|| {
        let known = || FORMATS.iter().map(|format| format.name);
        let hint = nearest(name, known()).map(|near| format!(", did you mean `{near}`?"));
        let known: Vec<&str> = known().collect();
        let (hint, known) = (hint.unwrap_or_default(), known.join(", "));
        format!("there is no such format{hint} (known: {known})")
    })
}

impl Export {
    pub fn execute(self) -> Result<ExitCode> {
        let name = self.format.name;
        let chooses = !self.figure.is_empty() || !self.only.is_empty();
        if chooses && !self.format.selective {
            bail!("--format {name} holds no figures to choose from: leave out --figure and --only");
        }
        let dir = records_in(&self.dir);
        let records = read_records(&dir)?;
        for warning in &records.warnings {
            warn(warning);
        }
        let choice = Selection::new(&self.figure, &self.only)?;
        let source = Source::new(&dir, &records.lines, &choice)?;
        match &self.format.write {
            Writer::Text(write) => {
                let exported = write(&source);
                for line in &exported.left_out {
                    warn(&format!("left out: {line}"));
                }
                match &self.out {
                    None => print(&exported.text)?,
                    Some(file) => write_atomic(file, exported.text.as_bytes())
                        .with_context(|| format!("cannot write {}", file.display()))?,
                }
            }
            Writer::Folder(write) => {
                let folder = self.out.as_deref();
                let folder = folder.ok_or_else(|| {
                    anyhow!("--format {name} writes files: give their folder with -o")
                })?;
                let files = write(&source, folder)?;
                for line in &files.left_out {
                    warn(line);
                }
                tell(&format!("{} files in {}", files.count, folder.display()));
            }
        }
        Ok(ExitCode::SUCCESS)
    }
}
