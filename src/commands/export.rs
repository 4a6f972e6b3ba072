//! `raystone export`.

use super::arguments::unknown;
use super::mitsuba::{MITSUBA, SceneArguments};
use super::output::{print, tell, warn};
use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use raystone::atomic::write_atomic;
use raystone::export::select::Selection;
use raystone::export::{FORMATS, Format, Source, Writer};
use raystone::measure::record::read_records;
use raystone::report::format::plural;
use raystone::run::records_in;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// Write the figures, times, checks or images of a run, or a scene, in the format of another tool
///
/// `raystone export SCENE --to mitsuba -o FOLDER` writes meshes as PLY and textures as PNG or EXR; `mitsuba FOLDER/scene.xml -D
/// spp=256` renders them.
#[derive(Args)]
pub struct Export {
    /// Folder that a run wrote, with records.jsonl; for mitsuba a built-in scene or the path of a model
    #[arg(value_name = "DIR|SCENE")]
    what: PathBuf,
    /// Format, by its name in `raystone list format`
    #[arg(long, visible_alias = "to", value_name = "NAME", value_parser = target)]
    format: Target,
    /// File to write, for npy and mitsuba a folder [default: standard output]
    #[arg(long, short, value_name = "FILE")]
    out: Option<PathBuf>,
    #[command(flatten)]
    choice: ChoiceArguments,
    #[command(flatten)]
    scene: SceneArguments,
}

/// Which figures of runs.
#[derive(Args)]
pub struct ChoiceArguments {
    /// Figure, by its id with or without the version, or a pattern of ids; may be given many times [default: all that
    /// rank, or that the format holds]
    #[arg(long, value_name = "ID")]
    figure: Vec<String>,
    /// Keep what fits: `--only 'accel=*bvh,uniform-grid(lambda=3),scene=cornell-box'`; patterns of one axis are alternatives
    #[arg(long, value_name = "AXIS=PATTERN,…")]
    only: Vec<String>,
}

impl ChoiceArguments {
    pub fn selection(&self) -> Result<Selection> {
        Ok(Selection::new(&self.figure, &self.only)?)
    }

    /// Fails if figures are selected for a format without figures.
    fn refuse(&self, format: &str) -> Result<()> {
        if !self.figure.is_empty() || !self.only.is_empty() {
            bail!(
                "--format {format} holds no figures to choose from: leave out --figure and --only"
            );
        }
        Ok(())
    }
}

/// The kind of export.
#[derive(Clone, Copy)]
enum Target {
    Run(&'static Format),
    Scene,
}

fn target(name: &str) -> Result<Target, String> {
    if name == MITSUBA.0 {
        return Ok(Target::Scene);
    }
    let found = FORMATS.iter().find(|format| format.name == name);
    let known = FORMATS.iter().map(|format| format.name).chain([MITSUBA.0]);
    found.map(Target::Run).ok_or_else(|| unknown(name, known))
}

impl Export {
    pub fn execute(self) -> Result<ExitCode> {
        match self.format {
            Target::Run(format) => self.figures(format)?,
            Target::Scene => {
                self.choice.refuse(MITSUBA.0)?;
                self.scene.export(&self.what, self.folder(MITSUBA.0)?)?;
            }
        }
        Ok(ExitCode::SUCCESS)
    }

    fn folder(&self, name: &str) -> Result<&Path> {
        let folder = self.out.as_deref();
        folder.ok_or_else(|| anyhow!("--format {name} writes files: give their folder with -o"))
    }

    fn figures(&self, format: &Format) -> Result<()> {
        if let Some(flag) = self.scene.first_given() {
            bail!("{flag} is of scenes, for --to {}", MITSUBA.0);
        }
        if !format.selective {
            self.choice.refuse(format.name)?;
        }
        let dir = records_in(&self.what);
        let records = read_records(&dir)?;
        for warning in &records.warnings {
            warn(warning);
        }
        let choice = self.choice.selection()?;
        let source = Source::new(&dir, &records.lines, &choice)?;
        match &format.write {
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
                let folder = self.folder(format.name)?;
                let files = write(&source, folder)?;
                for line in &files.left_out {
                    warn(line);
                }
                tell(&format!(
                    "{} in {}",
                    plural(files.count, "file"),
                    folder.display()
                ));
            }
        }
        Ok(())
    }
}
