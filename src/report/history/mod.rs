//! Figures over runs of several commits: one series for each figure, key and device, with the runs at which its level
//! changes. Exact figures such as counts change where they differ; `e_divisive` separates the levels of the others.

pub mod change;
pub mod page;

use crate::compare::taken::Works;
use crate::data::RunData;
use crate::export::ExportError;
use crate::export::select::Selection;
use crate::values::{Estimate, Value, values};
use change::e_divisive;
use raystone_record::figure::{Better, Figure, Spread};
use raystone_record::{Interval, Key, Line};
use raystone_stats::statistics::median;
use serde::Serialize;
use std::borrow::Cow;
use std::path::{Path, PathBuf};

/// Chance of reporting a change in a series without one.
pub(crate) const LEVEL: f64 = 0.05;

/// A run of the history.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Run {
    /// Folder of the run.
    pub folder: PathBuf,
    /// The commit of the program, with `+` if the sources had changes; `unknown` where it was not recorded.
    pub commit: String,
    /// Seconds since 1970-01-01 UTC.
    pub started_unix_s: u64,
    /// Adapter, driver and processor; a series never mixes figures of different ones.
    pub device: String,
}

/// A level that differs from the one before.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Change {
    /// The first run of the new level.
    pub run: usize,
    /// Median of the level before.
    pub before: f64,
    /// Median of the new level.
    pub after: f64,
    /// p-value of the permutation test; `None` for exact figures, which need no test.
    pub p: Option<f64>,
}

/// A figure of one key on one device.
#[derive(Debug, Clone, PartialEq)]
pub struct Series<'a> {
    /// The key that the figure belongs to.
    pub key: Key,
    /// Row of the table of figures.
    pub figure: Cow<'a, Figure>,
    /// The device.
    pub device: String,
    /// The scene and the work that was measured: a series never mixes different ones.
    pub work: String,
    /// Run and value, in order of time.
    pub points: Vec<(usize, Interval)>,
    /// Changes of the level.
    pub changes: Vec<Change>,
    /// `true` if there are enough values to find a change; exact figures need two.
    pub tested: bool,
}

/// All series of a set of runs.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct History<'a> {
    /// The runs in order of time.
    pub runs: Vec<Run>,
    /// The series, in the order of the records.
    pub series: Vec<Series<'a>>,
    /// Number of values that are no finite numbers, or have no interval to be trusted.
    pub left_out: usize,
}

impl<'a> History<'a> {
    /// Builds the history of the chosen figures; without a choice, of all figures that rank.
    ///
    /// # Errors
    /// If a run lacks its first line, or nothing matches the choice.
    pub fn new(all: &'a [(PathBuf, Vec<Line>)], choice: &Selection) -> Result<Self, ExportError> {
        let mut data: Vec<(Run, RunData<'a>)> = Vec::new();
        for (folder, lines) in all {
            let of_run = RunData::new(lines);
            data.push((run(folder, &of_run)?, of_run));
        }
        data.sort_by_key(|(run, _)| run.started_unix_s);
        let found = data.iter().map(|(_, data)| values(data));
        let found: Vec<Vec<Value>> = found.collect();
        // A single run may lack a figure: the choice is checked against all runs together.
        choice.of(found.concat())?;
        let mut history = Self::default();
        for (number, ((run, data), values)) in data.iter().zip(found).enumerate() {
            history.runs.push(run.clone());
            let works = Works::new(data);
            let ranks =
                |figure: &Figure| !choice.is_of_all_figures() || figure.better != Better::Neither;
            for value in values {
                if choice.keeps(&value.key, &value.figure.id) && ranks(&value.figure) {
                    let work = works.words(&value);
                    history.add(number, &run.device, work, value);
                }
            }
        }
        for series in &mut history.series {
            series.find_changes();
        }
        Ok(history)
    }

    fn add(&mut self, run: usize, device: &str, work: String, value: Value<'a>) {
        let point = match value.estimate {
            Estimate::Known(interval) if interval.value.is_finite() => (run, interval),
            _ => {
                self.left_out += 1;
                return;
            }
        };
        let is_it = |series: &&mut Series| {
            series.device == device
                && series.work == work
                && series.figure.id == value.figure.id
                && series.key == value.key
        };
        match self.series.iter_mut().find(is_it) {
            Some(series) => series.points.push(point),
            None => self.series.push(Series {
                key: value.key,
                figure: value.figure,
                device: device.to_owned(),
                work,
                points: vec![point],
                changes: Vec::new(),
                tested: false,
            }),
        }
    }

    /// Returns the expected number of false alarms: series reported as changed by chance.
    pub(crate) fn false_alarms(&self) -> f64 {
        let tested = |s: &&Series| s.tested && s.figure.spread != Spread::Exact;
        LEVEL * self.series.iter().filter(tested).count() as f64
    }
}

impl Series<'_> {
    fn find_changes(&mut self) {
        let values: Vec<f64> = self.points.iter().map(|(_, value)| value.value).collect();
        let splits: Vec<(usize, Option<f64>)> = match self.figure.spread {
            Spread::Exact => {
                let places = (1..values.len()).filter(|at| values[*at] != values[at - 1]);
                places.map(|at| (at, None)).collect()
            }
            _ => {
                let found = e_divisive(&values, LEVEL);
                found.into_iter().map(|(at, p)| (at, Some(p))).collect()
            }
        };
        self.tested = match self.figure.spread {
            Spread::Exact => values.len() > 1,
            _ => values.len() >= change::LEAST_RUNS,
        };
        let mut bounds: Vec<usize> = vec![0];
        bounds.extend(splits.iter().map(|(at, _)| *at));
        bounds.push(values.len());
        let level =
            |part: usize| median(&values[bounds[part]..bounds[part + 1]]).unwrap_or(f64::NAN);
        let change = |(part, (at, p)): (usize, &(usize, Option<f64>))| Change {
            run: self.points[*at].0,
            before: level(part),
            after: level(part + 1),
            p: *p,
        };
        self.changes = splits.iter().enumerate().map(change).collect();
    }
}

fn run(folder: &Path, data: &RunData) -> Result<Run, ExportError> {
    let no_run = || {
        ExportError::Choice(format!(
            "{}: the records lack the first line, which says when and where they were made",
            folder.display()
        ))
    };
    let run = data.run.ok_or_else(no_run)?;
    let machine = &run.environment;
    let commit = machine.commit.as_deref().unwrap_or("unknown");
    let dirty = if machine.dirty == Some(true) { "+" } else { "" };
    Ok(Run {
        folder: folder.to_owned(),
        commit: format!("{commit}{dirty}"),
        started_unix_s: run.started_unix_s,
        device: format!(
            "{} ({}, {} {}), {}",
            machine.adapter, machine.backend, machine.driver, machine.driver_info, machine.cpu
        ),
    })
}
