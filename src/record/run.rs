//! Records of a run as a whole, and of its scenes.

use super::{Environment, MachineLoad};
use crate::figure::Figure;
use raystone_advice::SceneFeatures;
use raystone_core::geometry::Camera;
use raystone_core::load::LoadReport;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// A folder of kernels that a run put in the place of embedded ones.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct KernelFolder {
    /// Its label, as in the axis of kernels in [`Key`](super::Key).
    pub label: String,
    /// The folder as given.
    pub folder: String,
    /// BLAKE3 of the names and texts of all its kernels.
    pub hash: String,
    /// Its kernels.
    pub files: Vec<KernelFile>,
}

/// A kernel of a folder.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct KernelFile {
    /// Path below the folder.
    pub file: String,
    /// BLAKE3 of its text.
    pub hash: String,
    /// True if it replaces an embedded kernel; if not, another kernel imports it.
    pub replaces: bool,
}

/// First line of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct RunRecord {
    /// `run.name` of the experiment.
    pub name: String,
    /// The experiment file as given.
    pub experiment: String,
    /// The whole experiment text with overrides appended as comments, so that it can be repeated.
    pub experiment_text: String,
    /// Seconds since 1970-01-01 UTC.
    pub started_unix_s: u64,
    /// The machine and the program.
    pub environment: Environment,
    /// Renders (image × replicate) that the full product of all axes would need.
    pub renders_full_product: usize,
    /// Renders that this plan needs, since images are equal across structures.
    pub renders_planned: usize,
    /// Folders of kernels that replaced embedded ones.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub kernels: Vec<KernelFolder>,
    /// Values that were laid over the experiment, `section.key=value`.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub overrides: Vec<String>,
    /// Filters of its cells.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub only: Vec<String>,
    /// The part of the plan that was run, as `3/8`; absent for all of it.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub shard: Option<String>,
    /// Figures from outside the crate that its records hold.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub figures: Vec<Figure>,
    /// True if the run was to end with exit code 0 whatever fails.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub lenient: bool,
    /// Number of compilations of every timed kernel: the rounds used them in turns.
    #[serde(default = "once", skip_serializing_if = "is_once")]
    pub compilations: usize,
}

fn once() -> usize {
    1
}

fn is_once(compilations: &usize) -> bool {
    *compilations == 1
}

impl RunRecord {
    /// Returns `run.seed` of the experiment, with overrides; `None` where its text has no readable one.
    pub fn seed(&self) -> Option<i64> {
        const DEFAULT: i64 = 1;
        let of_file: toml::Table = self.experiment_text.parse().ok()?;
        let set = self.experiment_text.lines().rev();
        let set = set.map_while(|line| line.strip_prefix("# --set "));
        let laid_over = set.filter_map(|set| {
            let (key, value) = set.split_once('=')?;
            (key.trim() == "run.seed").then(|| value.trim().parse().ok())
        });
        // The last one counts.
        if let Some(value) = laid_over.into_iter().next() {
            return value;
        }
        match of_file.get("run").and_then(|run| run.get("seed")) {
            Some(seed) => seed.as_integer(),
            None => Some(DEFAULT),
        }
    }
}

/// A loaded scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SceneRecord {
    /// Number of triangles.
    pub triangles: usize,
    /// Minimum corner of the bounding box.
    pub bounds_min: [f32; 3],
    /// Maximum corner of the bounding box.
    pub bounds_max: [f32; 3],
    /// Parse and prepare, milliseconds (structures not included).
    pub load_ms: f64,
    /// Bytes of the scene's arrays on the host.
    pub bytes: u64,
    /// Number of materials.
    pub materials: usize,
    /// Number of textures.
    pub textures: usize,
    /// Number of emissive triangles.
    pub emitters: usize,
    /// The camera in use.
    pub camera: Camera,
    /// What structures are advised by; absent in records of before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub features: Option<SceneFeatures>,
    /// Dropped and approximated things.
    pub report: LoadReport,
    /// BLAKE3 of the content.
    pub scene_hash: String,
}

/// A cell left out, or failed, or with a warning.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct SkippedRecord {
    /// The cell, in words.
    pub cell: String,
    /// The reason.
    pub reason: String,
}

/// CPU time of the process, of all its threads.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CpuTime {
    /// Of the whole run, seconds.
    pub whole_s: f64,
    /// Outside GPU work, builds, checks and loading, seconds.
    pub overhead_s: f64,
}

/// Last line of a run.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct FinishedRecord {
    /// Whole wall time, seconds.
    pub wall_s: f64,
    /// Named parts of it, seconds: `load`, `build`, `gate`, `gpu`, `judge`, `report`, …
    pub parts_s: BTreeMap<String, f64>,
    /// Wall time outside GPU work, builds, checks and loading.
    pub overhead_s: f64,
    /// The same as CPU time; absent where the system has no such clock, and in records of before.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub cpu: Option<CpuTime>,
    /// Cells that failed.
    pub failed: usize,
    /// Cells that were skipped.
    pub skipped: usize,
    /// The state of the machine when the run ended.
    #[serde(default)]
    pub load: MachineLoad,
}

/// Last line of a run that was ended early: all not measured by then is missing.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct InterruptedRecord {
    /// The cause of the end, for instance `SIGINT`.
    pub reason: String,
    /// Wall time until then, seconds.
    pub wall_s: f64,
}
