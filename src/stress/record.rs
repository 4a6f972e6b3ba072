//! Records of the suite: one JSON line per cell, shot series, target and so on, in `stress.jsonl`.

use super::place::Place;
use crate::gpu::Environment;
use serde::{Deserialize, Serialize};
use std::io::Write as _;
use std::path::{Path, PathBuf};
use thiserror::Error;

/// Version tag of every line.
pub const SCHEMA: &str = "raystone-stress/1";
/// Name of the file in the suite's folder.
pub const FILE: &str = "stress.jsonl";

/// A line of the file.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct Line {
    /// Always [`SCHEMA`].
    pub schema: String,
    /// What was found.
    pub record: Record,
}

/// What a line holds.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(tag = "kind", rename_all = "kebab-case")]
pub enum Record {
    /// First line: where and how.
    Suite(SuiteRecord),
    /// A triangle test, a structure and a family.
    Cell(CellRecord),
    /// Shots at one closed mesh.
    Shots(ShotsRecord),
    /// A box test.
    BoxTest(BoxTestRecord),
    /// A ray offset.
    Offset(OffsetRecord),
    /// Cost of a triangle test.
    Cost(CostRecord),
    /// Accumulation and sampling.
    Figure(super::numerics::Figure),
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

/// Where and how the suite ran.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SuiteRecord {
    /// Start, seconds since 1970.
    pub started_unix_s: u64,
    /// Machine, adapter, driver, program.
    pub environment: Environment,
    /// Whether a few rungs only were climbed.
    pub quick: bool,
    /// Seed.
    pub seed: u64,
    /// Rays a case.
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
    pub place: Place,
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

/// A triangle test, a structure and a family.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CellRecord {
    /// Triangle test.
    pub triangle: String,
    /// Structure.
    pub accel: String,
    /// Family.
    pub family: String,
    /// Rays, over all rungs.
    pub rays: usize,
    /// Misses where something is hit exactly.
    pub false_misses: usize,
    /// Those that the rounding of one test cannot explain.
    pub unexplained_misses: usize,
    /// Those from inside a closed mesh.
    pub cracks: usize,
    /// Hits where nothing is hit exactly.
    pub false_hits: usize,
    /// Those that rounding cannot explain.
    pub unexplained_hits: usize,
    /// Hits of another triangle than any that is hit exactly.
    pub wrong_triangle: usize,
    /// Hits of a triangle behind another by more than rounding: the order of hits is wrong.
    pub not_nearest: usize,
    /// Rays of which only rounding decides whether the interval holds the hit.
    pub borderline: usize,
    /// Answers that differ from brute force with the same test in any bit.
    pub differing: usize,
    /// Any-hit answers that differ from brute force; absent where they were not asked for.
    pub any_differing: Option<usize>,
    /// Differences within 4 ulp on an adapter that does not compute like the host.
    pub ties: usize,
    /// Error of the distance, ulp.
    pub t_ulp: Option<Quantiles>,
    /// Error of the distance, relative.
    pub t_relative: Option<Quantiles>,
    /// Error of the hit point, ulp of its greatest coordinate.
    pub point_ulp: Option<Quantiles>,
    /// Error of the hit point, relative to the way of the ray.
    pub point_relative: Option<Quantiles>,
    /// Time against ordinary rays in the same mesh, the greatest of all cases that were timed.
    pub slowdown: Option<f64>,
    /// Error words of kernels and structures that could not be built, with the case.
    pub failures: Vec<String>,
    /// The ray to look at first.
    pub worst: Option<Worst>,
    /// The cases.
    pub rungs: Vec<Rung>,
}

/// Shots at one closed mesh from inside, or at a plane: every miss is a crack.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct ShotsRecord {
    /// Triangle test.
    pub triangle: String,
    /// Structure.
    pub accel: String,
    /// Mesh.
    pub mesh: String,
    /// Triangles of the mesh.
    pub triangles: usize,
    /// Where it stands.
    pub place: Place,
    /// `random`, `vertices` or `edges`: what is aimed at.
    pub aim: String,
    /// Rays.
    pub rays: usize,
    /// Rays that missed.
    pub misses: usize,
    /// Of the misses that were looked up, those that hit something exactly.
    pub confirmed: usize,
    /// The kernel's errors, in words.
    pub failure: Option<String>,
    /// The first miss.
    pub worst: Option<Worst>,
}

/// How many hits a box test loses.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct BoxTestRecord {
    /// Name of the box test.
    pub box_test: String,
    /// Pad, ulp.
    pub pad_ulps: u32,
    /// Structure.
    pub accel: String,
    /// Rays.
    pub rays: usize,
    /// Answers that differ from brute force.
    pub lost: usize,
    /// The first of them.
    pub worst: Option<Worst>,
}

/// What a ray offset does.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct OffsetRecord {
    /// Name of the offset.
    pub offset: String,
    /// Triangle test.
    pub triangle: String,
    /// Mesh.
    pub mesh: String,
    /// Where it stands.
    pub place: Place,
    /// Rays that were spawned.
    pub rays: usize,
    /// Rays that hit the triangle they start from.
    pub self_intersections: usize,
    /// Rays that left the closed mesh.
    pub leaks: usize,
    /// Greatest distance between a ray's origin and the point it leaves, in bounds of the point's error
    /// (its box along the normal, and a unit of each coordinate).
    #[serde(default)]
    pub farthest: f64,
}

/// What a triangle test costs.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct CostRecord {
    /// Triangle test.
    pub triangle: String,
    /// Bytes it reads of a triangle.
    pub bytes: u32,
    /// Nanoseconds a test in the brute-force kernel, on the whole adapter.
    pub ns_per_test: f64,
    /// Time through the default structure against Möller–Trumbore.
    pub traversal_ratio: f64,
    /// Triangle tests a ray in that traversal.
    pub tests_per_ray: f64,
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
    /// Whether it holds; `None` if it was not looked at.
    pub passed: Option<bool>,
    /// Where it is worst.
    pub note: String,
}

/// What was not done.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SkippedRecord {
    /// What.
    pub what: String,
    /// Why.
    pub reason: String,
}

/// Why records cannot be written or read.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The file or folder.
    #[error("cannot write {}: {source}; choose another folder with --out", path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The file cannot be read.
    #[error("cannot read {}: {source}; give the folder that `raystone stress` wrote", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// A line is no record.
    #[error("{}:{line}: not a record of the suite: {reason}", path.display())]
    Parse {
        /// The file.
        path: PathBuf,
        /// Line, from 1.
        line: usize,
        /// Why.
        reason: String,
    },
}

/// Writes all records at once: the file is whole or absent.
///
/// # Errors
/// The folder cannot be made or written.
pub fn write(dir: &Path, records: &[Record]) -> Result<PathBuf, RecordError> {
    let path = dir.join(FILE);
    let failed = |source: std::io::Error| RecordError::Write {
        path: path.clone(),
        source,
    };
    std::fs::create_dir_all(dir).map_err(failed)?;
    let mut text = Vec::new();
    for record in records {
        let line = Line {
            schema: SCHEMA.to_owned(),
            record: record.clone(),
        };
        serde_json::to_writer(&mut text, &line).map_err(|e| failed(e.into()))?;
        writeln!(text).map_err(failed)?;
    }
    crate::atomic::write_atomic(&path, &text).map_err(failed)?;
    Ok(path)
}

/// Reads the records of a folder.
///
/// # Errors
/// A missing file, another schema, or a line that is no record.
pub fn read(dir: &Path) -> Result<Vec<Record>, RecordError> {
    let path = dir.join(FILE);
    let text = std::fs::read_to_string(&path).map_err(|source| RecordError::Read {
        path: path.clone(),
        source,
    })?;
    let parse = |(index, row): (usize, &str)| {
        let failed = |reason: String| RecordError::Parse {
            path: path.clone(),
            line: index + 1,
            reason,
        };
        let line: Line = serde_json::from_str(row).map_err(|e| failed(e.to_string()))?;
        match line.schema == SCHEMA {
            true => Ok(line.record),
            false => Err(failed(format!("schema {:?}, not {SCHEMA:?}", line.schema))),
        }
    };
    text.lines().enumerate().map(parse).collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn records_read_back_and_another_schema_is_refused_with_its_line() {
        let dir = tempfile::tempdir().unwrap();
        let records = vec![
            Record::Target(TargetRecord {
                target: "cracks".into(),
                limit: 0.0,
                found: Some(0.0),
                passed: Some(true),
                note: String::new(),
            }),
            Record::Finished { wall_s: 1.5 },
        ];
        let path = write(dir.path(), &records).unwrap();
        assert_eq!(read(dir.path()).unwrap(), records);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen(SCHEMA, "raystone-stress/9", 1)).unwrap();
        let error = read(dir.path()).unwrap_err().to_string();
        assert!(
            error.contains(":1:") && error.contains("raystone-stress/9"),
            "{error}"
        );
    }
}
