//! Records of the suite: one JSON line per cell, shot series, target and so on, in `stress.jsonl`.

use super::place::Place;
use crate::gpu::Environment;
#[cfg(test)]
use crate::measure::record::SCHEMA;
use crate::measure::record::{RecordError, STRESS_FILE, Verdict, read_lines, text_of};
use crate::report::{ReportError, write_file};
use serde::{Deserialize, Serialize};
use std::path::{Path, PathBuf};

/// A line of the file.
pub type Line = crate::measure::record::Line<Record>;

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
    /// Triangles of the mesh.
    pub triangles: usize,
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
    /// Pad, ulp.
    pub pad_ulps: u32,
    /// Rays.
    pub rays: usize,
    /// Answers that differ from brute force.
    pub lost: usize,
    /// The first of them.
    pub worst: Option<Worst>,
}

/// What a ray offset does.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct OffsetRecord {
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
    /// Bytes it reads of a triangle.
    pub bytes: u32,
    /// Nanoseconds per test in the brute-force kernel, on the whole adapter.
    pub ns_per_test: f64,
    /// Time through the default structure against Möller–Trumbore.
    pub traversal_ratio: f64,
    /// Triangle tests per ray in that traversal.
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
    /// Whether it holds.
    pub verdict: Verdict,
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
    Ok(read_lines(&dir.join(STRESS_FILE))?.lines)
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
        let lines = [target, Record::Finished { wall_s: 1.5 }].map(Line::about_all);
        let path = write(dir.path(), &lines).unwrap();
        assert_eq!(read(dir.path()).unwrap(), lines);
        let text = std::fs::read_to_string(&path).unwrap();
        std::fs::write(&path, text.replacen(SCHEMA, "raystone-stress/1", 1)).unwrap();
        let error = read(dir.path()).unwrap_err().to_string();
        assert!(
            error.contains(":1:") && error.contains("raystone-stress/1") && error.contains(SCHEMA),
            "{error}"
        );
    }
}
