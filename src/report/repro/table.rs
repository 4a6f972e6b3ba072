//! Prepares the experiment of a table, and compares its records with each expectation.

use super::Source;
use super::claim::{Context, Row, judge, unused};
use super::judge::ClaimVerdict;
use super::scenes::{IN_FILES, is_model, name_of, what_to_get};
use crate::data::{RunData, without_repeats};
use crate::values::values;
use raystone_config::expect::{Compare, Substitute, Thesis, same_experiment};
use raystone_config::{Catalogue, ConfigError, Experiment, Pattern};
use raystone_record::figure::{self, Figure};
use raystone_record::{
    Body, Environment, Key, Line, RecordError, RunRecord, read_records, records_file,
};
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Settings of the runs of tables.
#[derive(Debug, Clone, Default)]
pub struct Settings {
    /// Short runs on built-in scenes.
    pub quick: bool,
    /// True if the adapter is a software rasteriser, which runs some tables smaller.
    pub software: bool,
    /// The scene directory.
    pub scenes: PathBuf,
    /// Folder of all tables.
    pub out: PathBuf,
    /// Repeats runs that exist.
    pub force: bool,
}

/// A reason why a table has no verdicts.
#[derive(Debug, Error)]
pub enum TableError {
    /// Its file or an override is wrong.
    #[error(transparent)]
    Config(#[from] ConfigError),
    /// Its records cannot be read.
    #[error(transparent)]
    Records(#[from] RecordError),
}

/// A scene of the run, and its triangles if it was loaded.
pub type Placed = (String, Option<usize>);

/// A table with its results.
#[derive(Debug, Clone)]
pub struct Reproduced {
    /// Its name.
    pub name: &'static str,
    /// Its description of the thesis.
    pub thesis: Thesis,
    /// Machine and program of the run; `None` if there was none.
    pub environment: Option<Environment>,
    /// Start of the run, seconds since 1970-01-01 UTC.
    pub started: u64,
    /// True if it was a short run.
    pub quick: bool,
    /// Changes of the run to the experiment.
    pub changes: Vec<String>,
    /// Original scene → ours with its triangles, or why there is none.
    pub scenes: Vec<(Substitute, Result<Placed, String>)>,
    /// Figures that the run describes itself: those of measurements that add their own.
    pub figures: Vec<Figure>,
    /// Rows of each expectation, in the order of the file.
    pub claims: Vec<Vec<Row>>,
}

impl Reproduced {
    /// Returns the figure with this id, if the program or the run describes it.
    pub(crate) fn figure(&self, id: &str) -> Option<&Figure> {
        figure::find(id).or_else(|| self.figures.iter().find(|figure| figure.id == id))
    }

    /// Returns the verdict on an expectation as a whole.
    pub fn verdict(&self, index: usize) -> ClaimVerdict {
        let found = ClaimVerdict::of_all(self.claims[index].iter().map(|row| row.verdict));
        // A row that is only shown is no claim, whether there is something to show or not.
        let only_shown = self.thesis.expects[index].compare == Compare::Shown;
        if found != ClaimVerdict::Faulty && only_shown {
            ClaimVerdict::Shown
        } else {
            found
        }
    }
}

/// The runnable part of a table: the experiment, and its substitute scenes.
pub struct Prepared {
    /// The experiment.
    pub experiment: Experiment,
    /// Its description of the thesis.
    pub thesis: Thesis,
    /// Scene of each substitute, or why it has none.
    pub scenes: Vec<(Substitute, Result<String, String>)>,
    /// Changes of a short run, or of one on a software adapter.
    pub changes: Vec<String>,
}

/// Reads a table's file, with the scenes that exist and, if asked for, the changes of a short run.
///
/// # Errors
/// A fault of the file.
pub fn prepare(
    source: &Source,
    settings: &Settings,
    catalogue: &Catalogue,
) -> Result<Prepared, ConfigError> {
    let thesis = source.thesis()?;
    let at = format!("{}.toml", source.name);
    if let Some(reason) = thesis.expects.iter().find_map(unused) {
        return Err(ConfigError::Refused { at, reason });
    }
    let stand_in = |s: &Substitute| (s.clone(), scene_of(s, settings));
    let scenes: Vec<_> = thesis.substitutes.iter().map(stand_in).collect();
    let changes = match (settings.quick, settings.software) {
        (true, _) => thesis.quick.clone(),
        (false, true) => thesis.software.clone(),
        (false, false) => Vec::new(),
    };
    let mut overrides = changes.clone();
    let there = scenes.iter().filter_map(|(_, scene)| scene.as_ref().ok());
    let there = without_repeats(there.map(|scene| name_of(scene).to_owned()).collect());
    if !there.is_empty() {
        overrides.insert(0, format!("axes.scene={}", toml::Value::from(there)));
    }
    let folder = settings.scenes.display().to_string();
    let text = source.text.replace(IN_FILES, &folder);
    let file = format!("{}.toml", source.name);
    let experiment = Experiment::parse(&text, &file, &overrides, catalogue)?;
    Ok(Prepared {
        experiment,
        thesis,
        scenes,
        changes,
    })
}

/// Returns the scene in the place of the thesis's.
fn scene_of(substitute: &Substitute, settings: &Settings) -> Result<String, String> {
    let original = &substitute.original;
    if settings.quick {
        let none = || format!("no built-in scene stands for {original}; run it without --quick");
        return substitute.quick.clone().ok_or_else(none);
    }
    let none = || format!("no scene stands for {original}: {}", substitute.why);
    let scene = substitute.scene.clone().ok_or_else(none)?;
    if !is_model(&scene) {
        return Ok(scene);
    }
    let path = settings.scenes.join(&scene);
    if path.is_file() {
        Ok(path.display().to_string())
    } else {
        Err(what_to_get(&scene, &settings.scenes))
    }
}

/// Returns a table's verdicts from its records alone; `None` if it has none that are whole.
///
/// # Errors
/// A fault of its file, or records that cannot be read.
pub fn recorded(
    source: &Source,
    settings: &Settings,
    catalogue: &Catalogue,
) -> Result<Option<Reproduced>, TableError> {
    let out = settings.out.join(source.name);
    // The adapter of the run is not known.
    for software in [settings.software, !settings.software] {
        let settings = Settings {
            software,
            ..settings.clone()
        };
        let prepared = prepare(source, &settings, catalogue)?;
        if is_done(&out, &prepared.experiment.text) {
            return judged(source.name, settings.quick, prepared, &out).map(Some);
        }
    }
    Ok(None)
}

/// Returns `true` if a folder holds records of this experiment, whole or left by a killed run.
pub fn is_of(folder: &Path, text: &str) -> bool {
    let same = |line: &Line| matches!(&line.body, Body::Run(r) if same_experiment(&r.experiment_text, text));
    let records = read_records(folder);
    records.is_ok_and(|records| records.lines.iter().any(same))
}

/// Returns `true` if a folder holds the whole records of this experiment.
pub fn is_done(out: &Path, text: &str) -> bool {
    if !records_file(out).is_file() || !is_of(out, text) {
        return false;
    }
    let finished = |line: &Line| matches!(line.body, Body::Finished(_));
    read_records(out).is_ok_and(|records| records.lines.iter().any(finished))
}

/// Returns the verdicts on a completed table, from the records in `out`.
///
/// # Errors
/// Records that cannot be read.
pub fn judged(
    name: &'static str,
    quick: bool,
    prepared: Prepared,
    out: &Path,
) -> Result<Reproduced, TableError> {
    let lines = read_records(out)?.lines;
    let data = RunData::new(&lines);
    let run = data.run;
    let context = Context {
        quick,
        software: run.is_none_or(|run| run.environment.software),
        scenes: (prepared.scenes.iter())
            .map(|(s, ours)| (s.original.clone(), ours.clone().map(|ours| pattern(&ours))))
            .collect(),
        absent: lines.iter().filter_map(absent).collect(),
    };
    let values = values(&data);
    let claims = prepared.thesis.expects.iter();
    let claims = claims.map(|expect| judge(expect, &values, &context));
    let claims = claims.collect();
    let placed = |ours: String| {
        let wanted = Pattern::new(pattern(&ours));
        let mut scenes = data.scenes.iter();
        let scene = scenes.find(|scene| wanted.fits_text(scene.name));
        let count = scene.and_then(|scene| Some(scene.record?.triangles));
        // A pattern is shown as the scene it matched, a path as the name of its file.
        (scene.map_or(ours, |scene| scene.name.to_owned()), count)
    };
    let scenes = prepared.scenes.into_iter();
    let scenes = scenes.map(|(substitute, ours)| (substitute, ours.map(placed)));
    Ok(Reproduced {
        name,
        scenes: scenes.collect(),
        thesis: prepared.thesis,
        environment: run.map(|run: &RunRecord| run.environment.clone()),
        started: run.map_or(0, |run| run.started_unix_s),
        quick,
        changes: prepared.changes,
        figures: run.map_or_else(Vec::new, |run| run.figures.clone()),
        claims,
    })
}

/// Returns the pattern of a scene's label: a path by its file's name, a built-in scene with any parameters, unless it is a pattern
/// itself.
fn pattern(scene: &str) -> String {
    if name_of(scene) != scene {
        return scene.to_owned();
    }
    let file = Path::new(scene).file_name();
    let file = file.map_or(scene.into(), |file| file.to_string_lossy());
    if is_model(scene) {
        format!("*{file}*")
    } else {
        format!("{file}*")
    }
}

/// Returns the key of a line that was left out or failed, with the reason.
fn absent(line: &Line) -> Option<(Key, String)> {
    let reason = match &line.body {
        Body::Skipped(record) | Body::Failed(record) => record.reason.clone(),
        Body::Structure(record) => record.failure.clone()?,
        Body::Time(record) => record.failure.clone()?,
        _ => return None,
    };
    (!line.key.is_empty()).then(|| (line.key.clone(), reason))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_scene_is_found_by_its_file_by_its_name_or_by_the_pattern_that_it_is() {
        assert_eq!(pattern("../a.b/model.obj"), "*model.obj*");
        assert_eq!(pattern("city"), "city*");
        assert_eq!(
            pattern("instances(*overlap=0.5*"),
            "instances(*overlap=0.5*"
        );
    }

    #[test]
    fn records_of_another_experiment_are_none_of_this_one() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "[run]\nname = \"a\"\n";
        assert!(!is_of(folder.path(), text));
        assert!(!is_done(folder.path(), text));
    }
}
