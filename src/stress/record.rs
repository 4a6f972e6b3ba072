//! Records of the suite: one JSON line per cell, shot series, target and so on, in `stress.jsonl`.

use super::numerics::Gauge;
use super::placement::Placement;
use super::tally::Errors;
use raystone_record::Environment;
use raystone_record::figure::{self, Figure};
use raystone_record::{
    Key, Ran, RecordError, STRESS_FILE, SkippedRecord, Sound, Verdict, read_lines, text_of,
};
use raystone_report::{ReportError, write_file};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Version tag of every line; bumped together with any change of a field's meaning.
pub const SCHEMA: &str = "raystone-stress/2";

/// A line of the file.
pub type Line = raystone_record::Line<Record>;

/// What a line holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Record {
    /// First line: where and how.
    Suite(SuiteRecord),
    /// A triangle test, a structure and a family.
    Cell(Findings),
    /// Shots at one closed mesh from inside, or at a plane: every miss is a crack.
    Shots(Findings),
    /// How many hits a box test loses.
    BoxTest(Findings),
    /// What a ray offset does.
    Offset(Findings),
    /// What a triangle test costs.
    Cost(Findings),
    /// Accumulation and sampling.
    Gauge(Gauge),
    /// A target of the default configuration.
    Target(TargetRecord),
    /// What was not done, and why.
    Skipped(SkippedRecord),
    /// Last line.
    Finished {
        /// Wall time, seconds.
        wall_s: f64,
    },
}

impl Sound for Record {}

impl Record {
    /// What was found, in a line of which figures are told.
    pub fn findings(&self) -> Option<&Findings> {
        match self {
            Self::Cell(found)
            | Self::Shots(found)
            | Self::BoxTest(found)
            | Self::Offset(found)
            | Self::Cost(found) => Some(found),
            _ => None,
        }
    }
}

/// Where and how the suite ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuiteRecord {
    /// Start, seconds since 1970.
    pub started_unix_s: u64,
    /// Machine, adapter, driver, program.
    pub environment: Box<Environment>,
    /// Whether a few rungs only were climbed.
    pub quick: bool,
    /// Seed.
    pub seed: u64,
    /// Rays per case.
    pub rays: usize,
    /// Shots at each closed mesh.
    pub shots: usize,
    /// Whether the adapter computes like the host, so that hits must be equal to the bit.
    pub exact_adapter: bool,
    /// The triangle test that everything uses by default.
    pub default_triangle: String,
}

/// Median, 99th percentile and maximum.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize)]
pub struct Quantiles {
    /// Median.
    pub median: f64,
    /// 99th percentile.
    pub p99: f64,
    /// Maximum.
    pub max: f64,
}

/// The ray to look at first.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Worst {
    /// What is bad about it.
    pub what: String,
    /// The command that shows it.
    pub replay: String,
}

/// One case of a cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Rung {
    /// Label of the case.
    pub label: String,
    /// Where the mesh stands.
    pub place: Placement,
    /// Rays.
    pub rays: usize,
    /// Misses where something is hit exactly.
    pub false_misses: usize,
    /// Answers that differ from brute force.
    pub differing: usize,
    /// Error of the distance, ulp.
    pub t_ulp: Option<Quantiles>,
    /// Error of the hit point, ulp of its greatest coordinate.
    pub point_ulp: Option<Quantiles>,
}

/// What was found of one thing.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
#[serde(default)]
pub struct Findings {
    /// Figures by their ids in the table of figures; absent where they were not asked for.
    pub figures: BTreeMap<String, f64>,
    /// Errors of right hits.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub errors: Option<Errors<Quantiles>>,
    /// Error words of kernels, and structures that could not be built, with the case.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub failures: Vec<String>,
    /// The ray to look at first.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub worst: Option<Worst>,
    /// The cases of a cell.
    #[serde(skip_serializing_if = "Vec::is_empty")]
    pub rungs: Vec<Rung>,
}

impl Findings {
    /// These figures.
    pub fn of<'a>(figures: impl IntoIterator<Item = (&'a Figure, f64)>) -> Self {
        let mut found = Self::default();
        for (figure, value) in figures {
            found.add(figure, value);
        }
        found
    }

    /// Adds to a figure, which begins at 0.
    pub fn add(&mut self, figure: &Figure, value: f64) {
        *self.figures.entry(figure.id.to_string()).or_default() += value;
    }

    /// A figure, if it was asked for.
    pub fn get(&self, figure: &Figure) -> Option<f64> {
        self.figures.get(&*figure.id).copied()
    }

    /// A figure that is a count; 0 where it was not asked for.
    pub fn count(&self, figure: &Figure) -> usize {
        self.get(figure).map_or(0, |count| count as usize)
    }

    /// Answers that differ from brute force, of closest and of any hits.
    pub fn differing(&self) -> usize {
        self.count(&figure::DIFFERING) + self.count(&figure::ANY_DIFFERING)
    }
}

/// A target of the default configuration.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct TargetRecord {
    /// What is promised.
    pub target: String,
    /// The limit.
    pub limit: f64,
    /// What was found; absent if it was not looked at.
    pub found: Option<f64>,
    /// Whether it holds.
    pub verdict: Verdict,
    /// Where it is worst.
    pub note: String,
}

/// A line of a key.
pub(crate) fn line(key: Key, record: Record) -> Line {
    Line {
        schema: SCHEMA.to_owned(),
        ..Line::new(key, Ran::default(), record)
    }
}

/// A line about the whole suite.
pub fn about_all(record: Record) -> Line {
    line(Key::default(), record)
}

/// A line about what was not done, and why.
pub(crate) fn skipped(key: Key, cell: String, reason: impl Into<String>) -> Line {
    let reason = reason.into();
    line(key, Record::Skipped(SkippedRecord { cell, reason }))
}

/// Writes all lines at once: the file is whole or absent.
///
/// # Errors
/// The folder cannot be made or written.
pub fn write(dir: &Path, lines: &[Line]) -> Result<PathBuf, ReportError> {
    let path = dir.join(STRESS_FILE);
    let failed = |source| ReportError::Write {
        path: path.clone(),
        source,
    };
    std::fs::create_dir_all(dir).map_err(failed)?;
    let text = text_of(lines).map_err(|error| failed(error.into()))?;
    write_file(&path, text.as_bytes())?;
    Ok(path)
}

/// Reads the lines of a folder.
///
/// # Errors
/// A missing file, another schema, or a line that is no record.
pub fn read(dir: &Path) -> Result<Vec<Line>, RecordError> {
    Ok(read_lines(&dir.join(STRESS_FILE), SCHEMA)?.lines)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_read_back_and_another_schema_is_refused_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let target = Record::Target(TargetRecord {
            target: "cracks".into(),
            limit: 0.0,
            found: Some(0.0),
            verdict: Verdict::Pass,
            note: String::new(),
        });
        let lines = [target, Record::Finished { wall_s: 1.5 }].map(about_all);
        let path = write(dir.path(), &lines).unwrap();
        assert_eq!(read(dir.path()).unwrap(), lines);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen(SCHEMA, "raystone/2", 1)).unwrap();
        let error = read(dir.path()).unwrap_err().to_string();
        assert!(
            error.contains(":1:") && error.contains("raystone/2") && error.contains(SCHEMA),
            "{error}"
        );
    }
}
