//! Records of the coherence of rays: counts of a model, see [`crate::coherence`].

use crate::figure::{self, Figure};
use crate::{Key, Reading, Samples, axis};
use raystone_config::Coherence;
use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::ops::AddAssign;

/// The organisation in which a lane keeps its pixel, the baseline of the others.
pub const SINGLE_KERNEL: &str = "single kernel";

/// The label of all rays on the axis of rays.
pub const ALL_RAYS: &str = "all";

/// Coherence of a full cell.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CoherenceRecord {
    /// The modelled machine, and the sample of paths.
    pub settings: Coherence,
    /// Samples per pixel of the sampler with which the cell was timed.
    pub timed_spp: u32,
    /// By samples per pixel and organisation.
    pub at: Vec<CoherenceAt>,
}

/// Coherence at a number of samples per pixel.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct CoherenceAt {
    /// Samples per pixel that the sampler was made for.
    pub spp: u32,
    /// Assignment of rays to the lanes of a warp.
    pub organisation: String,
    /// Paths in the sample.
    pub paths: u64,
    /// Counts by class of rays (`primary`, `shadow 0`, `bounce 1`, …), in the order in which they are traced.
    pub classes: Vec<(String, Tally)>,
    /// For each class, rays and predicted cycles of each group of warps. Groups are a sample of the image: their spread
    /// bounds that of others. Older records have none.
    #[serde(default, skip_serializing_if = "Vec::is_empty")]
    pub groups: Vec<Vec<[u64; 2]>>,
}

/// Returns the rays and predicted cycles of a class in each group of warps.
pub fn by_group(groups: &[Tallies], class: u32) -> Vec<[u64; 2]> {
    let of_group = |group: &Tallies| {
        let tally = group.get(&class).copied().unwrap_or_default();
        [tally.rays, tally.cost()]
    };
    groups.iter().map(of_group).collect()
}

impl CoherenceRecord {
    /// Returns its figures by samples per pixel, organisation and class of rays.
    pub fn readings(&self) -> Vec<Reading> {
        let line_bytes = self.settings.line_bytes;
        self.at
            .iter()
            .flat_map(|at| at.readings(line_bytes))
            .collect()
    }

    /// Returns the prediction for the timed number of samples.
    pub fn timed(&self, organisation: &str) -> Option<&CoherenceAt> {
        let is_it = |at: &&CoherenceAt| at.spp == self.timed_spp && at.organisation == organisation;
        self.at.iter().find(is_it)
    }
}

impl CoherenceAt {
    /// Counts of all rays together.
    pub fn all(&self) -> Tally {
        let mut all = Tally::default();
        for (_, tally) in &self.classes {
            all += *tally;
        }
        all
    }

    /// Returns its figures; those of each class and of all rays.
    fn readings(&self, line_bytes: u32) -> Vec<Reading> {
        let key = Key::default().with(axis::SPP, self.spp);
        let key = key.with(axis::SUBJECT, &self.organisation);
        let mut readings = Vec::new();
        for (place, (class, tally)) in self.classes.iter().enumerate() {
            let key = key.clone().with(axis::RAYS, class);
            let groups = self.groups.get(place).map(Vec::as_slice);
            readings.extend(tally.readings(&key, line_bytes, groups));
        }
        let key = key.with(axis::RAYS, ALL_RAYS);
        let groups = self.groups_of_all();
        readings.extend(self.all().readings(&key, line_bytes, groups.as_deref()));
        let per_path = Reading::known([(&figure::CYCLES_PER_PATH, self.cost_of_path())]);
        // Primary rays are traced first: one for each path.
        let paths = self.groups.first().zip(groups);
        let parts = paths.map(|(primary, all)| {
            let of_one = |([paths, _], [_, cycles]): (&[u64; 2], &[u64; 2])| [*paths, *cycles];
            primary.iter().zip(&all).map(of_one).collect::<Vec<_>>()
        });
        readings.extend(per_path.into_iter().map(|reading| {
            reading
                .at(key.clone())
                .with_samples(cycles_over(parts.as_deref()))
        }));
        readings
    }

    /// Returns the rays and predicted cycles of all classes together in each group of warps, where those are known.
    fn groups_of_all(&self) -> Option<Vec<[u64; 2]>> {
        let mut all = vec![[0; 2]; self.groups.first()?.len()];
        for groups in &self.groups {
            for ([rays, cycles], [more, cost]) in all.iter_mut().zip(groups) {
                *rays += more;
                *cycles += cost;
            }
        }
        Some(all)
    }

    /// Returns the predicted cycles of a path: see [`Tally::cost`].
    pub fn cost_of_path(&self) -> Option<f64> {
        ratio(self.all().cost(), self.paths)
    }
}

/// Returns the predicted cycles over rays or paths, from counts of those and of cycles by group.
fn cycles_over(groups: Option<&[[u64; 2]]>) -> Samples {
    let of_one = |[count, cycles]: &[u64; 2]| [*cycles as f64, *count as f64];
    let groups = groups.map(|groups| groups.iter().map(of_one).collect());
    groups.map_or(Samples::Once, Samples::Groups)
}

/// Counts of one class of rays.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, Serialize, Deserialize, schemars::JsonSchema,
)]
pub struct Tally {
    /// Rays.
    pub rays: u64,
    /// Visits of nodes, over all rays.
    pub nodes: u64,
    /// Tests of triangles, over all rays.
    pub triangles: u64,
    /// Issues of all warps.
    pub issues: u64,
    /// Lanes that took part, over all issues.
    pub active: u64,
    /// Lanes of the warps, over all issues.
    pub lanes: u64,
    /// Bytes that lanes requested.
    pub bytes: u64,
    /// Cache lines that were needed, over all issues: accesses to the L1.
    pub lines: u64,
    /// Those that were in the L1.
    pub l1_hits: u64,
    /// Those that were in the L2, of those that were not in the L1.
    pub l2_hits: u64,
}

/// Cycles of an issue, of a line from the L1, of one from the L2 and of one from memory, on a multiprocessor of a
/// GPU like NVIDIA's H100 (132 of them, 1.7 GHz): about a hundred instructions at four a cycle; 128 bytes a cycle; about
/// 5.5 TB/s, and 3.35 TB/s, shared by all.
pub const COST: [u64; 4] = [25, 1, 5, 9];

impl Tally {
    /// Returns the number of lines that were not in the L1.
    pub fn l2_accesses(&self) -> u64 {
        self.lines - self.l1_hits
    }

    /// Returns the number of lines that came from memory.
    pub fn misses(&self) -> u64 {
        self.l2_accesses() - self.l2_hits
    }

    /// Cycles of one multiprocessor if nothing but throughput counted, by [`COST`]: to be compared, not to be
    /// believed.
    pub fn cost(&self) -> u64 {
        let counts = [self.issues, self.lines, self.l2_accesses(), self.misses()];
        counts.iter().zip(COST).map(|(n, cycles)| n * cycles).sum()
    }

    /// Returns the share of the lanes that take part in an issue.
    pub fn efficiency(&self) -> Option<f64> {
        ratio(self.active, self.lanes)
    }

    /// Readings of its figures at `key`, with rays and predicted cycles of each group where those are known.
    pub(crate) fn readings(
        &self,
        key: &Key,
        line_bytes: u32,
        groups: Option<&[[u64; 2]]>,
    ) -> Vec<Reading> {
        let readings = Reading::known(self.figures(line_bytes)).into_iter();
        let with_groups = |reading: Reading| {
            if reading.figure == figure::CYCLES_PER_RAY.id {
                reading.with_samples(cycles_over(groups))
            } else {
                reading
            }
        };
        readings
            .map(|reading| with_groups(reading).at(key.clone()))
            .collect()
    }

    /// Returns the known figures by id.
    pub fn figures(&self, line_bytes: u32) -> [(&'static Figure, Option<f64>); 9] {
        let line = u64::from(line_bytes);
        [
            (&figure::SIMT_EFFICIENCY, self.efficiency()),
            (&figure::LINES_PER_ISSUE, ratio(self.lines, self.issues)),
            (&figure::L1_HITS, ratio(self.l1_hits, self.lines)),
            (&figure::L2_HITS, ratio(self.l2_hits, self.l2_accesses())),
            (&figure::ISSUES_PER_RAY, ratio(self.issues, self.rays)),
            (&figure::ASKED_BYTES_PER_RAY, ratio(self.bytes, self.rays)),
            (
                &figure::L2_BYTES_PER_RAY,
                ratio(self.l2_accesses() * line, self.rays),
            ),
            (
                &figure::MEMORY_BYTES_PER_RAY,
                ratio(self.misses() * line, self.rays),
            ),
            (&figure::CYCLES_PER_RAY, ratio(self.cost(), self.rays)),
        ]
    }
}

/// Returns the quotient of two counts; `None` if there is none.
fn ratio(part: u64, of: u64) -> Option<f64> {
    (of > 0).then(|| part as f64 / of as f64)
}

impl AddAssign for Tally {
    fn add_assign(&mut self, other: Self) {
        let sums = [
            (&mut self.rays, other.rays),
            (&mut self.nodes, other.nodes),
            (&mut self.triangles, other.triangles),
            (&mut self.issues, other.issues),
            (&mut self.active, other.active),
            (&mut self.lanes, other.lanes),
            (&mut self.bytes, other.bytes),
            (&mut self.lines, other.lines),
            (&mut self.l1_hits, other.l1_hits),
            (&mut self.l2_hits, other.l2_hits),
        ];
        for (sum, more) in sums {
            *sum += more;
        }
    }
}

/// Tallies by class.
pub type Tallies = BTreeMap<u32, Tally>;

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_cycles_of_a_path_are_those_of_all_its_rays() {
        let at = CoherenceAt {
            spp: 1,
            organisation: SINGLE_KERNEL.to_owned(),
            paths: 6,
            classes: vec![
                ("primary".to_owned(), Tally::default()),
                ("shadow".to_owned(), Tally::default()),
            ],
            // Rays and cycles of two groups: the first has four paths, the second two.
            groups: vec![vec![[4, 100], [2, 50]], vec![[3, 30], [1, 20]]],
        };
        let readings = at.readings(128);
        let mut of_path = readings
            .iter()
            .filter(|r| r.figure == figure::CYCLES_PER_PATH.id);
        let samples = of_path.next().map(|reading| &reading.samples);
        let expected = Samples::Groups(vec![[130.0, 4.0], [70.0, 2.0]]);
        assert_eq!(samples, Some(&expected));
    }
}
