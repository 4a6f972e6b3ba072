//! Figures round by round, where records keep the times: cells that were timed in the same rounds share what the machine
//! did in them, and their ratio is known better than either of them.

use crate::integrator::{RAY_COUNT_CLASSES, TRACED_CLASSES};
use crate::measure::comparison::LogFigure;
use crate::measure::record::{Body, CellRecord, Interval, Key, Line, axis};
use crate::report::data::competitor;
use crate::report::format;
use crate::report::values::Value;
use std::collections::BTreeMap;

/// What cells have in common that were timed in the same rounds: one process timed them, on one scene with one
/// triangle test and box test, all structures in turns or all full cells or all compactions.
#[derive(Debug, Clone, PartialEq)]
struct Sitting {
    kind: &'static str,
    world: [String; 3],
    began_unix_s: u64,
    device: String,
}

/// A figure in each of its rounds.
#[derive(Debug, Clone)]
struct Series {
    sitting: Sitting,
    values: Vec<f64>,
}

/// The figures of a run that are known round by round.
#[derive(Debug, Clone, Default)]
pub struct Rounds {
    of: BTreeMap<(String, String), Series>,
}

impl Rounds {
    /// Those of a run's records; of two lines on one thing the later one holds, as in reports.
    pub fn new(lines: &[Line]) -> Self {
        let mut rounds = Self::default();
        let cells = lines.iter().filter_map(|line| match &line.body {
            Body::Cell(cell) => Some(cell),
            _ => None,
        });
        let by_line = cells.flat_map(|cell| cell.lines.iter().map(move |hash| (&**hash, cell)));
        let by_line: BTreeMap<&str, &CellRecord> = by_line.collect();
        for line in lines {
            // Records of older programs do not say when they were taken: their rounds may be those of several runs.
            let cell = by_line.get(&*line.hash).filter(|c| c.run_began_unix_s > 0);
            if let Some(cell) = cell {
                rounds.add(line, cell);
            }
        }
        rounds
    }

    fn add(&mut self, line: &Line, cell: &CellRecord) {
        let key = competitor(line);
        let world = [axis::SCENE, axis::TRIANGLE, axis::BOX_TEST];
        let sitting = |kind| Sitting {
            kind,
            world: world.map(|axis| key.label(axis).to_owned()),
            began_unix_s: cell.run_began_unix_s,
            device: cell.inputs.device.clone(),
        };
        let mut put = |key: &Key, figure: &str, kind, values: Vec<f64>| {
            let series = Series {
                sitting: sitting(kind),
                values,
            };
            self.of.insert((key.to_string(), figure.to_owned()), series);
        };
        let each = |ms: &[f64], of: &dyn Fn(f64) -> f64| ms.iter().map(|ms| of(*ms)).collect();
        match &line.body {
            Body::Structure(record) => {
                for t in &record.timings {
                    let key = key.clone().with(axis::RAYS, format::ray_class(t.class));
                    let rate = each(&t.ms, &|ms| t.rays as f64 / ms * 1e-3);
                    put(&key, "mrays-per-s/v1", "rays", rate);
                }
            }
            Body::Time(record) => {
                let per_spp = each(&record.ms, &|ms| ms / f64::from(record.spp));
                put(&key, "ms-per-spp/v1", "full cells", per_spp);
                let traced = RAY_COUNT_CLASSES[..TRACED_CLASSES].iter();
                let rays: u64 = traced.filter_map(|class| record.rays.get(*class)).sum();
                let rate = each(&record.ms, &|ms| rays as f64 / ms * 1e-3);
                put(&key, "cell-mrays-per-s/v1", "full cells", rate);
            }
            Body::Compaction(record) => {
                let ns = each(&record.ms, &|ms| 1e6 * ms / f64::from(record.elements));
                put(&key, "compaction-ns/v1", "compactions", ns);
            }
            _ => {}
        }
    }

    /// `a / b` with its interval, by the estimator of comparisons; `None` unless both were timed in the same rounds.
    pub fn ratio(&self, a: &Value, b: &Value) -> Option<Interval> {
        let series = |v: &Value| self.of.get(&(v.key.to_string(), v.figure.id.to_string()));
        let (x, y) = (series(a)?, series(b)?);
        if x.sitting != y.sitting || x.values.len() != y.values.len() {
            return None;
        }
        let ratios: Vec<f64> = x.values.iter().zip(&y.values).map(|(x, y)| x / y).collect();
        Some(LogFigure::of_times(&ratios)?.interval())
    }
}
