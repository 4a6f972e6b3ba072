//! The two sides of a comparison: their records and the notes on them.

use crate::data::without_repeats;
use raystone_record::Environment;
use raystone_record::*;
use std::path::{Path, PathBuf};

/// Input that cannot be compared.
#[derive(Debug, thiserror::Error)]
pub enum SideError {
    /// The records cannot be read.
    #[error(transparent)]
    Records(#[from] RecordError),
    /// There is no such file or folder.
    #[error(
        "{} is neither a file of records nor a folder with {RECORDS_FILE}{}",
        path.display(), if *unfinished { "; its run did not end: name its folder `partial` to compare what it had measured" } else { "" }
    )]
    NoRecords {
        /// The path given.
        path: PathBuf,
        /// `true` if a run was killed there.
        unfinished: bool,
    },
    /// A single run was given that lacks two sets of kernels to compare.
    #[error("{name} holds the kernels {}: {wanted}", listed(found))]
    Kernels {
        /// The run.
        name: String,
        /// Labels of its kernels.
        found: Vec<String>,
        /// The missing part.
        wanted: String,
    },
}

fn listed(labels: &[String]) -> String {
    if labels.is_empty() {
        "of no cell".into()
    } else {
        labels.join(", ")
    }
}

/// The name of the program's own kernels, as opposed to folders.
pub const EMBEDDED: &str = "embedded";

/// One side: the records of a run, or of one set of kernels in it.
#[derive(Debug, Clone)]
pub struct Side {
    /// Its name.
    pub name: String,
    /// Its records.
    pub lines: Vec<Line>,
    /// Notes on the records: lines cut off, other versions.
    pub notes: Vec<String>,
    /// `true` if the other side was measured in the same rounds, so that times of one round belong together.
    pub in_rounds: bool,
}

impl Side {
    /// Reads a file of records, or the one in a folder.
    ///
    /// # Errors
    /// If there is none, or it is not a file of records.
    pub fn read(path: &Path) -> Result<Self, SideError> {
        let file = if path.is_dir() {
            records_file(path)
        } else {
            path.to_owned()
        };
        if !file.is_file() {
            return Err(SideError::NoRecords {
                path: path.into(),
                unfinished: path.join(PARTIAL).join(RECORDS_FILE).is_file(),
            });
        }
        let records = read_lines(&file, SCHEMA)?;
        let mut notes = records.warnings;
        if records.old > 0 {
            let (old, all) = (records.old, records.lines.len());
            notes.push(format!(
                "{old} of {all} lines are of an older schema and were read as {SCHEMA}"
            ));
        }
        Ok(Self::new(path.display(), records.lines, notes))
    }

    /// Returns a side of the given records.
    pub fn new(name: impl ToString, lines: Vec<Line>, mut notes: Vec<String>) -> Self {
        let ended = |line: &Line| matches!(line.body, Body::Finished(_));
        if !lines.iter().any(ended) {
            notes.push("the run did not reach its end: what it had not measured is missing".into());
        }
        Self {
            name: name.to_string(),
            lines,
            notes,
            in_rounds: false,
        }
    }

    /// Returns the number of compilations of every timed kernel.
    pub fn compilations(&self) -> usize {
        let runs = all_of::<RunRecord>(&self.lines).map(|run| run.body.compilations);
        runs.min().unwrap_or(1)
    }

    /// Returns the environments of the measurements; several if runs were merged.
    pub(crate) fn environments(&self) -> impl Iterator<Item = &Environment> {
        all_of::<RunRecord>(&self.lines).map(|run| &run.body.environment)
    }

    /// Returns the labels of the kernels of its cells, in order of first appearance.
    pub fn kernels(&self) -> Vec<String> {
        let of_cells = self.lines.iter().filter(|line| is_of_kernels(&line.body));
        without_repeats(of_cells.map(|line| label(&line.key).to_owned()).collect())
    }

    /// Returns the two sides of one run: by these labels of kernels, or by the only two present.
    ///
    /// # Errors
    /// If it does not hold these labels, or not exactly two.
    pub fn of_kernels(&self, labels: Option<[&str; 2]>) -> Result<[Self; 2], SideError> {
        let found = self.kernels();
        let error = |wanted: String| SideError::Kernels {
            name: self.name.clone(),
            found: found.clone(),
            wanted,
        };
        let labels = match (labels, &found[..]) {
            (Some(labels), _) => labels.map(str::to_owned),
            // The program's own are what others are held against, whichever was recorded first.
            (None, [a, b]) if b == EMBEDDED => [b.clone(), a.clone()],
            (None, [a, b]) => [a.clone(), b.clone()],
            (None, []) => {
                return Err(error(
                    "give a run with two sets of kernels, or two runs".into(),
                ));
            }
            (None, [_]) => {
                return Err(error(
                    "give a second run, or measure with --kernels A B".into(),
                ));
            }
            (None, _) => return Err(error("say which two: --kernels A B".into())),
        };
        for label in &labels {
            if !found.contains(label) {
                return Err(error(format!("{label} is none of them")));
            }
        }
        Ok(labels.map(|label| self.part(&label)))
    }

    /// Returns the side without the axis of kernels if all its cells have the same kernels, so that two runs with different
    /// kernels can be compared cell by cell.
    #[must_use]
    pub fn alone(self) -> Self {
        match &self.kernels()[..] {
            [one] if one != EMBEDDED => Self {
                name: self.name.clone(),
                in_rounds: false,
                ..self.part(one)
            },
            _ => self,
        }
    }

    /// Returns the records of these kernels and those that all kernels share, without the axis of kernels.
    fn part(&self, wanted: &str) -> Self {
        let kept = self.lines.iter().filter_map(|line| {
            let mut line = line.clone();
            let is_kept = match &mut line.body {
                Body::Failed(cell) | Body::Skipped(cell) | Body::Warning(cell) => {
                    let text = without_kernels(&cell.cell, wanted);
                    text.map(|text| cell.cell = text).is_some()
                }
                body => !is_of_kernels(body) || label(&line.key) == wanted,
            };
            line.key = line.key.with(axis::KERNELS, "");
            is_kept.then_some(line)
        });
        Self {
            name: wanted.to_owned(),
            lines: kept.collect(),
            notes: self.notes.clone(),
            in_rounds: true,
        }
    }
}

/// Returns a cell in words (`box, bvh, @idea`) without these kernels; `None` if it belongs to others.
fn without_kernels(cell: &str, kernels: &str) -> Option<String> {
    let mark = format!("@{kernels}");
    let mut parts: Vec<&str> = cell.split(", ").collect();
    let marked = parts.iter().any(|part| part.starts_with('@'));
    parts.retain(|part| *part != mark);
    let own = parts.len() < cell.split(", ").count();
    (own || (kernels == EMBEDDED && !marked)).then(|| parts.join(", "))
}

fn label(key: &Key) -> &str {
    match key.label(axis::KERNELS) {
        "" => EMBEDDED,
        label => label,
    }
}

/// Returns `true` if a record belongs to a set of kernels, and not to the run, a scene or a cell in words.
fn is_of_kernels(body: &Body) -> bool {
    !matches!(
        body,
        Body::Run(_)
            | Body::Scene(_)
            | Body::Reference(_)
            | Body::Peer(_)
            | Body::Skipped(_)
            | Body::Failed(_)
            | Body::Warning(_)
            | Body::Finished(_)
            | Body::Interrupted(_)
            | Body::Kernels(_)
            | Body::Cell(_)
    )
}

/// Returns the name of the clock of a run's times.
fn clock(environment: &Environment) -> &'static str {
    if environment.timestamps {
        "timestamps of the device"
    } else {
        "the wall"
    }
}

/// Returns the differences of two environments that make their times incomparable: name, and both values.
pub fn differences(a: &Environment, b: &Environment) -> Vec<(&'static str, String, String)> {
    let texts = |e: &Environment| {
        [
            ("adapter", e.adapter.clone()),
            ("backend", e.backend.clone()),
            ("driver", e.driver.clone()),
            ("driver version", e.driver_info.clone()),
            ("type of device", e.device_type.clone()),
            ("limit of loops", format!("{:?}", e.loop_limit)),
            ("system", e.os.clone()),
            ("processor", e.cpu.clone()),
            ("processor threads", e.cpu_threads.to_string()),
            ("clock", clock(e).to_owned()),
        ]
    };
    let pairs = texts(a).into_iter().zip(texts(b));
    let differing = pairs.filter(|(a, b)| a.1 != b.1);
    differing.map(|((name, a), (_, b))| (name, a, b)).collect()
}
