//! Figures part by part, where records keep the parts. Cells that were timed in the same rounds share what the machine did
//! in them, and samplers whose rays were followed from the same pixels share these: a ratio is known better than its sides.

use crate::data::{FULL_CELLS, RAYS, cells_of, competitor, sitting};
use crate::export::samples::traced_rays;
use crate::format;
use crate::values::{ALL_RAYS, Value};
use raystone_record::figure::{self, Figure};
use raystone_record::{Body, CellRecord, ClassCoherence, CoherenceRecord, Key, Line, axis};
use raystone_stats::comparison::LogFigure;
use std::collections::BTreeMap;

/// The figures of a run that are known part by part.
#[derive(Debug, Clone, Default)]
pub struct Rounds {
    of: BTreeMap<(String, String), LogFigure>,
}

impl Rounds {
    /// Those of a run's records; of two lines on one thing the later one holds, as in reports.
    pub fn new(lines: &[Line]) -> Self {
        let mut rounds = Self::default();
        let cells = cells_of(lines);
        for line in lines {
            match &line.body {
                Body::Coherence(record) => rounds.add_paths(line, record),
                Body::Structure(record) => {
                    let coherence = record.coherence.iter();
                    coherence.for_each(|c| rounds.add_recorded(line, c));
                }
                _ => {}
            }
            rounds.add_times(line, cells.get(&*line.hash).copied());
        }
        rounds
    }

    /// What is known of a value part by part.
    pub fn of(&self, value: &Value) -> Option<&LogFigure> {
        let (key, figure) = (value.key.to_string(), value.figure.id.to_string());
        self.of.get(&(key, figure))
    }

    fn put(&mut self, key: &Key, figure: &str, known: LogFigure) {
        self.of.insert((key.to_string(), figure.to_owned()), known);
    }

    fn add_times(&mut self, line: &Line, cell: Option<&CellRecord>) {
        let key = competitor(line);
        let mut put = |key: &Key, figure: &str, kind: &str, values: Vec<f64>| {
            let known = LogFigure::of_rounds(&sitting(kind, key, cell), &values);
            known
                .into_iter()
                .for_each(|known| self.put(key, figure, known));
        };
        let each = |ms: &[f64], of: &dyn Fn(f64) -> f64| ms.iter().map(|ms| of(*ms)).collect();
        match &line.body {
            Body::Structure(record) => {
                for t in &record.timings {
                    let key = key.clone().with(axis::RAYS, format::ray_class(t.class));
                    let rate = each(&t.ms, &|ms| t.rays as f64 / ms * 1e-3);
                    put(&key, &figure::MRAYS_PER_S.id, RAYS, rate);
                }
            }
            Body::Time(record) => {
                let per_spp = each(&record.ms, &|ms| ms / f64::from(record.spp));
                put(&key, &figure::MS_PER_SPP.id, FULL_CELLS, per_spp);
                let rays = traced_rays(record);
                let rate = each(&record.ms, &|ms| rays as f64 / ms * 1e-3);
                put(&key, &figure::CELL_MRAYS_PER_S.id, FULL_CELLS, rate);
            }
            Body::Measured(record) => {
                let timed = line.readings.iter().filter(|r| !r.rounds().is_empty());
                for reading in timed {
                    let key = key.clone().beside(&reading.at);
                    put(
                        &key,
                        &reading.figure,
                        &record.measurement,
                        reading.rounds().to_vec(),
                    );
                }
            }
            _ => {}
        }
    }

    /// Predicted cycles. They are counted, and so the same in every run.
    fn put_groups(&mut self, key: &Key, figure: &Figure, parts: &[[f64; 2]]) {
        let world = [axis::SCENE, axis::TRIANGLE, axis::BOX_TEST].map(|axis| key.label(axis));
        // Where sides were followed in different numbers of groups, no group belongs to another.
        let of = format!("{} groups of warps\n{}", parts.len(), world.join("\n"));
        self.put(key, &figure.id, LogFigure::of_groups(&of, parts));
    }

    /// Of the paths of a full cell, by class of rays and together.
    fn add_paths(&mut self, line: &Line, record: &CoherenceRecord) {
        for at in &record.at {
            // What is traced first are the primary rays: one for each path.
            let Some(primary) = at.groups.first() else {
                continue;
            };
            let key = competitor(line).with(axis::SPP, at.spp);
            let key = key.with(axis::SUBJECT, &at.organisation);
            let mut all = vec![[0.0; 2]; primary.len()];
            for ((class, _), groups) in at.classes.iter().zip(&at.groups) {
                let parts = parts(groups);
                for (sum, [cycles, rays]) in all.iter_mut().zip(&parts) {
                    *sum = [sum[0] + cycles, sum[1] + rays];
                }
                self.put_groups(&key.clone().with(axis::RAYS, class), PER_RAY, &parts);
            }
            let key = key.with(axis::RAYS, ALL_RAYS);
            let of_paths = all.iter().zip(primary);
            let of_paths = of_paths.map(|([cycles, _], [paths, _])| [*cycles, *paths as f64]);
            let of_paths: Vec<[f64; 2]> = of_paths.collect();
            self.put_groups(&key, PER_PATH, &of_paths);
            self.put_groups(&key, PER_RAY, &all);
        }
    }

    /// Of recorded rays, class by class.
    fn add_recorded(&mut self, line: &Line, coherence: &ClassCoherence) {
        for ((class, _), groups) in coherence.classes.iter().zip(&coherence.groups) {
            let key = competitor(line).with(axis::RAYS, format::ray_class(*class));
            self.put_groups(&key, PER_RAY, &parts(groups));
        }
    }
}

/// Figures of the coherence model.
const PER_RAY: &Figure = &figure::CYCLES_PER_RAY;
const PER_PATH: &Figure = &figure::CYCLES_PER_PATH;

/// Cycles over rays of each group.
fn parts(groups: &[[u64; 2]]) -> Vec<[f64; 2]> {
    let of_one = |[rays, cycles]: &[u64; 2]| [*cycles as f64, *rays as f64];
    groups.iter().map(of_one).collect()
}
