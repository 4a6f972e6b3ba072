//! Records of a structure on a scene.

use super::{Interval, Key, Reading, Samples, Tally, axis};
use crate::figure;
use raystone_config::Coherence;
use raystone_core::structure::{Counters, Phase, Space, StructureStats};
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;

/// Ray classes of the recorded ray sets.
#[derive(
    Debug,
    Clone,
    Copy,
    PartialEq,
    Eq,
    PartialOrd,
    Ord,
    Hash,
    Serialize,
    Deserialize,
    schemars::JsonSchema,
)]
#[serde(rename_all = "kebab-case")]
pub enum RayClass {
    /// Camera rays through pixel centres, 8×8 tiles; closest hit.
    Primary,
    /// Rays from first hits towards emitters (or towards points of the bounding sphere); any hit.
    Shadow,
    /// The same from the other end: from the emitter to the first hit.
    ShadowReversed,
    /// Those of [`RayClass::Shadow`], light by light.
    ShadowClustered,
    /// Those of [`RayClass::ShadowReversed`], light by light.
    ShadowReversedClustered,
    /// Cosine-distributed rays of limited length from first hits; any hit.
    Ao,
    /// Cosine-distributed rays from first hits; closest hit.
    Bounce,
    /// Rays between random points of the bounding box; closest hit.
    Chord,
    /// Rays that are likely to expose faults (see `hard_rays`); both queries, never timed.
    Hard,
}

impl RayClass {
    /// Returns its name in keys, tables and plots.
    pub fn name(self) -> &'static str {
        match self {
            Self::Primary => "primary",
            Self::Shadow => "shadow",
            Self::ShadowReversed => "shadow, reversed",
            Self::ShadowClustered => "shadow, clustered",
            Self::ShadowReversedClustered => "shadow, reversed and clustered",
            Self::Ao => "ambient occlusion",
            Self::Bounce => "bounce",
            Self::Chord => "chord",
            Self::Hard => "hard",
        }
    }

    /// Returns the key of readings of this class.
    pub fn key(self) -> Key {
        Key::default().with(axis::RAYS, self.name())
    }
}

/// Gate result for one ray class.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ClassVerdict {
    /// Class of the rays.
    pub class: RayClass,
    /// Rays compared to the bit (id, t, u, v; hit or miss for any-hit queries).
    pub rays: usize,
    /// Rays whose answer differs and is not a tie.
    pub wrong: usize,
    /// Rays whose id or t differs but both triangles lie within 4 ulp of the same distance; for a triangle test that is not
    /// exact, rays with another triangle that rounding explains.
    pub ties: usize,
    /// The first wrong ray, replayable, with both answers.
    pub first_wrong: Option<String>,
}

/// Comparison of the reference tracer with a slower, simpler one.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ReferenceCheck {
    /// Rays compared.
    pub rays: usize,
    /// Rays that differ.
    pub wrong: usize,
    /// Rays that pass within rounding error of an edge or of another surface (oracle only).
    pub ambiguous: usize,
    /// Number of these that are hard rays, made to pass there.
    #[serde(default)]
    pub hard_ambiguous: usize,
    /// The first ray that differs, with both answers.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub first_wrong: Option<String>,
    /// Time of the check, if it was before this run: the same rays and answers, found in the cache.
    #[serde(default)]
    pub reused_unix_s: Option<u64>,
}

/// The verdict of the gate on one structure and scene.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct GateVerdict {
    /// Nothing wrong, no fuse blown, the reference tracer itself sound.
    pub passed: bool,
    /// Per ray class.
    pub classes: Vec<ClassVerdict>,
    /// The reference tracer (scalar plain BVH) against brute force.
    pub brute_force: ReferenceCheck,
    /// The reference tracer against the f64 oracle.
    pub oracle: ReferenceCheck,
    /// Error words raised by kernels (step fuse, stack overflow), in words.
    pub kernel_errors: Vec<String>,
    /// The first ray whose counted work is not that of the structure's twin on the host.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub work: Option<String>,
    /// Structural faults found by `validate`.
    pub structural: Option<String>,
    /// The fault on one of the gate's further scenes.
    #[serde(default)]
    pub elsewhere: Option<String>,
    /// True if answers were compared up to rounding, for a triangle test that is not exact: the structure is not ranked.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub inexact: bool,
}

/// Work counted per ray, means over a class.
#[derive(Debug, Clone, Copy, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CountersPerRay {
    /// Nodes or cells visited.
    pub nodes: f64,
    /// Ray–box tests.
    pub box_tests: f64,
    /// Ray–triangle tests.
    pub triangle_tests: f64,
    /// Deepest stack seen in the class (entries).
    pub stack_high_water: u32,
}

impl CountersPerRay {
    /// Returns the mean work of these rays.
    pub fn mean_of(work: &[Counters]) -> Self {
        let mean = |get: fn(&Counters) -> u32| {
            work.iter().map(|c| f64::from(get(c))).sum::<f64>() / work.len().max(1) as f64
        };
        Self {
            nodes: mean(|c| c.nodes),
            box_tests: mean(|c| c.box_tests),
            triangle_tests: mean(|c| c.triangle_tests),
            stack_high_water: work.iter().map(|c| c.stack_high_water).max().unwrap_or(0),
        }
    }
}

/// Speed of one ray class through one structure.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ClassTiming {
    /// Class of the rays.
    pub class: RayClass,
    /// Rays per dispatch.
    pub rays: usize,
    /// Fraction of the rays that hit something.
    pub hit_fraction: f64,
    /// Answers that differ from those of the shadow rays between the same ends; absent for classes that are not
    /// shadow rays in another order or direction.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub unlike_shadow: Option<usize>,
    /// Every sample after warm-up, milliseconds, an empty dispatch already subtracted.
    pub ms: Vec<f64>,
    /// The same dispatches by the wall clock, milliseconds.
    pub wall_ms: Vec<f64>,
    /// The same in time of the processors, all threads of the process together; empty on adapters that work elsewhere.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub cpu_ms: Vec<f64>,
    /// Million rays per second, median with interval.
    pub mrays_s: Interval,
    /// Counted work, from a separate run; absent for a structure that counts none.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub counters: Option<CountersPerRay>,
    /// Dispatches that a sample is the mean of, where the clock ticks too coarsely for one.
    #[serde(default = "one", skip_serializing_if = "is_one")]
    pub dispatches: u32,
    /// Samples that were discarded because the clock ran backwards.
    #[serde(default, skip_serializing_if = "is_zero")]
    pub discarded: u32,
}

fn one() -> u32 {
    1
}

// By reference, as serde asks.
fn is_one(n: &u32) -> bool {
    *n == 1
}

fn is_zero(n: &u32) -> bool {
    *n == 0
}

impl ClassTiming {
    /// Returns its figures.
    pub fn readings(&self) -> Vec<Reading> {
        let rate = |ms: &f64| self.rays as f64 / ms * 1e-3;
        let rates = |ms: &[f64]| ms.iter().map(rate).collect();
        let work_done = format!("{} rays", self.rays);
        let speed = Reading::new(&figure::MRAYS_PER_S, self.mrays_s)
            .of_work(&work_done)
            .with_samples(Samples::Rounds {
                adapter: rates(&self.ms),
                wall: rates(&self.wall_ms),
                processors: rates(&self.cpu_ms),
            });
        let work = self.counters;
        let unlike = (self.unlike_shadow).map(|rays| 1e6 * rays as f64 / self.rays.max(1) as f64);
        let counted = Reading::known([
            (&figure::RAYS, Some(self.rays as f64)),
            (&figure::HIT_SHARE, Some(self.hit_fraction)),
            (&figure::UNLIKE_SHADOW, unlike),
            (&figure::NODES_PER_RAY, work.map(|w| w.nodes)),
            (&figure::BOX_TESTS_PER_RAY, work.map(|w| w.box_tests)),
            (
                &figure::TRIANGLE_TESTS_PER_RAY,
                work.map(|w| w.triangle_tests),
            ),
            (
                &figure::DEEPEST_STACK,
                work.map(|w| f64::from(w.stack_high_water)),
            ),
        ]);
        let counted = counted
            .into_iter()
            .map(|reading| reading.of_work(&work_done));
        let all = [speed].into_iter().chain(counted);
        all.map(|reading| reading.at(self.class.key())).collect()
    }
}

/// Coherence of recorded rays, as they follow each other.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct ClassCoherence {
    /// The machine, and how many rays were looked at.
    pub settings: Coherence,
    /// Counts by class.
    pub classes: Vec<(RayClass, Tally)>,
    /// For each class, rays and predicted cycles of each group of warps, as in [`super::CoherenceAt::groups`].
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<Vec<[u64; 2]>>,
}

impl ClassCoherence {
    /// Returns its figures, class by class.
    pub fn readings(&self) -> Vec<Reading> {
        let classes = self.classes.iter().enumerate();
        let of_class = |(place, (class, tally)): (usize, &(RayClass, Tally))| {
            let groups = self.groups.get(place).map(Vec::as_slice);
            let readings = tally.readings(&class.key(), self.settings.line_bytes, groups);
            let rays = format!("{} rays", tally.rays);
            readings
                .into_iter()
                .map(move |reading| reading.of_work(&rays))
        };
        classes.flat_map(of_class).collect()
    }
}

/// A structure on a scene.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct StructureRecord {
    /// True if the driver caused the failure by ending loops too early for this structure: the cell then counts as
    /// skipped.
    #[serde(default, skip_serializing_if = "std::ops::Not::not")]
    pub refused: bool,
    /// The space in which triangles are intersected, by which the reference tracer is chosen: see [`Space`].
    #[serde(default)]
    pub space: Space,
    /// Load path of nodes and triangles, which `auto` leaves to the adapter: `buffer` or `texture`; absent in records
    /// from before there was a choice.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub load: Option<String>,
    /// Timed build phases.
    pub build: Vec<Phase>,
    /// Sum of the phases, milliseconds.
    pub build_ms: f64,
    /// Most host memory that the build needed beyond what was in use before it, the result included,
    /// bytes; absent where allocations are not counted.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub build_peak_bytes: Option<u64>,
    /// Milliseconds to update the transforms of all instances, with the objects unchanged: median of several; absent
    /// where a moved object needs a full build.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub update_ms: Option<f64>,
    /// Static figures.
    pub stats: StructureStats,
    /// Figures from outside the crate, by id.
    #[serde(default, skip_serializing_if = "BTreeMap::is_empty")]
    pub figures: BTreeMap<String, Interval>,
    /// Verdict; `None` only if the build failed.
    pub gate: Option<GateVerdict>,
    /// Speeds; empty unless the gate passed.
    pub timings: Vec<ClassTiming>,
    /// Coherence of the recorded rays; absent where it is not modelled.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub coherence: Option<ClassCoherence>,
    /// Heat map of traversal cost of primary rays, a PNG relative to the run's folder.
    pub heat_map: Option<String>,
    /// Cost (nodes + triangle tests) at the top of the heat map's colour scale.
    pub heat_map_max: Option<f64>,
    /// The reason why there are no figures.
    pub failure: Option<String>,
}

/// Classes of leaf sizes: title, least and greatest number of references.
const LEAF_CLASSES: [(&str, usize, usize); 8] = [
    ("0", 0, 0),
    ("1", 1, 1),
    ("2", 2, 2),
    ("3", 3, 3),
    ("4", 4, 4),
    ("5–8", 5, 8),
    ("9–16", 9, 16),
    ("17 or more", 17, usize::MAX),
];

impl StructureRecord {
    /// Returns `true` if it was built at all.
    pub fn is_built(&self) -> bool {
        !self.build.is_empty() || self.gate.is_some()
    }

    /// Returns its figures: those of the build if it was built, those of rays if it passed the gate.
    pub fn readings(&self) -> Vec<Reading> {
        let mut readings = Vec::new();
        if self.is_built() {
            readings.extend(self.of_build());
        }
        if self.fault().is_none() {
            readings.extend(self.timings.iter().flat_map(ClassTiming::readings));
            readings.extend(self.coherence.iter().flat_map(ClassCoherence::readings));
        }
        readings.extend(self.figures.iter().map(|(id, value)| Reading {
            figure: id.clone(),
            ..Reading::new(&figure::EPO, *value)
        }));
        readings
    }

    fn of_build(&self) -> Vec<Reading> {
        let stats = &self.stats;
        let mut readings = Reading::known([
            (&figure::BUILD_MS, Some(self.build_ms)),
            (
                &figure::BUILD_PEAK_BYTES,
                self.build_peak_bytes.map(|n| n as f64),
            ),
            (&figure::UPDATE_MS, self.update_ms),
            (&figure::BYTES, Some(stats.bytes as f64)),
            (&figure::NODES, Some(stats.nodes as f64)),
            (&figure::LEAVES, Some(stats.leaves as f64)),
            (&figure::REFERENCES, Some(stats.references as f64)),
            (&figure::DEPTH, stats.depth.map(f64::from)),
            (&figure::SAH_COST, stats.sah_cost),
            (&figure::EPO, stats.epo),
        ]);
        let all: u64 = stats.leaf_histogram.iter().sum();
        readings.extend(LEAF_CLASSES.iter().filter_map(|(title, least, greatest)| {
            let sizes = stats.leaf_histogram.iter().enumerate();
            let inside = sizes.filter(|(size, _)| least <= size && size <= greatest);
            let leaves: u64 = inside.map(|(_, leaves)| leaves).sum();
            let share = Reading::exact(&figure::LEAF_SHARE, leaves as f64 / all as f64);
            (leaves > 0).then(|| share.at(Key::default().with(axis::SUBJECT, title)))
        }));
        readings
    }

    /// Returns the reason why the structure gets no figures; `None` when it passed the gate.
    pub fn fault(&self) -> Option<String> {
        match (&self.failure, &self.gate) {
            (Some(failure), _) => Some(failure.clone()),
            (None, None) => Some("not gated".into()),
            (None, Some(gate)) => (!gate.passed).then(|| fault_text(gate)),
        }
    }
}

/// Describes the faults that the gate found.
pub fn fault_text(verdict: &GateVerdict) -> String {
    let mut parts = Vec::new();
    let wrong: usize = verdict.classes.iter().map(|c| c.wrong).sum();
    if wrong > 0 {
        let rays: usize = verdict.classes.iter().map(|c| c.rays).sum();
        let first = verdict
            .classes
            .iter()
            .find_map(|c| c.first_wrong.as_deref())
            .unwrap_or_default();
        parts.push(format!(
            "{wrong} of {rays} rays differ from the reference tracer; first: {first}"
        ));
    }
    parts.extend(verdict.kernel_errors.iter().cloned());
    parts.extend(verdict.work.clone());
    parts.extend(verdict.structural.clone());
    parts.extend(verdict.elsewhere.clone());
    parts.extend(verdict.reference_fault());
    parts.join("; ")
}

impl StructureRecord {
    /// True if its triangle test is not exact, so that it is not ranked.
    pub fn is_inexact(&self) -> bool {
        self.gate.as_ref().is_some_and(|gate| gate.inexact)
    }
}

impl GateVerdict {
    /// Describes the fault of the reference tracer itself; `None` if it is sound.
    pub fn reference_fault(&self) -> Option<String> {
        let [brute_force, oracle] = [&self.brute_force, &self.oracle];
        let first = [brute_force, oracle].map(|check| check.first_wrong.as_deref());
        let first = first.into_iter().flatten().next().unwrap_or_default();
        (brute_force.wrong + oracle.wrong > 0).then(|| {
            format!(
                "the reference tracer itself is wrong on {} of {} rays against brute force and {} \
                 of {} against f64, so that no structure can be compared with it; first: {first}",
                brute_force.wrong, brute_force.rays, oracle.wrong, oracle.rays
            )
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_leaf_is_in_one_class_of_sizes() {
        let mut record = StructureRecord {
            build: vec![Phase {
                name: "whole".to_owned(),
                ms: 1.0,
                cpu_ms: None,
            }],
            ..StructureRecord::default()
        };
        // A leaf of each size from 0 to 20.
        record.stats.leaf_histogram = vec![1; 21];
        let shares = record.readings().into_iter();
        let shares = shares.filter(|r| r.figure == figure::LEAF_SHARE.id);
        let shares: Vec<f64> = shares.map(|r| 21.0 * r.value.value).collect();
        let expected = [1.0, 1.0, 1.0, 1.0, 1.0, 4.0, 8.0, 4.0];
        assert_eq!(shares.len(), expected.len());
        let near = |(a, b): (&f64, &f64)| (a - b).abs() < 1e-9;
        assert!(shares.iter().zip(&expected).all(near), "{shares:?}");
    }
}
