//! Figures part by part, where records keep the parts. Cells that were timed in the same rounds share what the machine did
//! in them, and samplers whose rays were followed from the same pixels share these: a ratio is known better than its sides.

use crate::data::competitor;
use crate::export::samples::traced_rays;
use crate::format;
use crate::values::{ALL_RAYS, Value};
use raystone_record::{
    Body, CellRecord, ClassCoherence, CoherenceRecord, Interval, Key, Line, axis,
};
use raystone_stats::comparison::LogFigure;
use std::collections::BTreeMap;

/// What figures have in common whose parts belong together. Times: one process took them, on one scene with one triangle
/// test and box test, all structures in turns or all full cells or all compactions.
#[derive(Debug, Clone, PartialEq)]
struct Sitting {
    kind: String,
    world: [String; 3],
    began_unix_s: u64,
    device: String,
}

/// What a figure is made of.
#[derive(Debug, Clone, PartialEq)]
enum Parts {
    /// The figure in each round.
    Rounds(Vec<f64>),
    /// Numerator and denominator in each group of pixels: the figure is the quotient of their sums.
    Groups(Vec<[f64; 2]>),
}

#[derive(Debug, Clone)]
struct Series {
    sitting: Sitting,
    parts: Parts,
}

/// The figures of a run that are known part by part.
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
            match &line.body {
                Body::Coherence(record) => rounds.add_paths(line, record),
                Body::Structure(record) => {
                    let coherence = record.coherence.iter();
                    coherence.for_each(|c| rounds.add_recorded(line, c));
                }
                _ => {}
            }
            // Records of older programs do not say when they were taken: their rounds may be those of several runs.
            let cell = by_line.get(&*line.hash).filter(|c| c.run_began_unix_s > 0);
            if let Some(cell) = cell {
                rounds.add_times(line, cell);
            }
        }
        rounds
    }

    fn put(&mut self, key: &Key, figure: &str, sitting: Sitting, parts: Parts) {
        let series = Series { sitting, parts };
        self.of.insert((key.to_string(), figure.to_owned()), series);
    }

    fn add_times(&mut self, line: &Line, cell: &CellRecord) {
        let key = competitor(line);
        let mut put = |key: &Key, figure: &str, kind: &str, values: Vec<f64>| {
            let sitting = Sitting {
                kind: kind.to_owned(),
                world: world(key),
                began_unix_s: cell.run_began_unix_s,
                device: cell.inputs.device.clone(),
            };
            self.put(key, figure, sitting, Parts::Rounds(values));
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
                let rays = traced_rays(record);
                let rate = each(&record.ms, &|ms| rays as f64 / ms * 1e-3);
                put(&key, "cell-mrays-per-s/v1", "full cells", rate);
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
    fn put_groups(&mut self, key: &Key, figure: &str, parts: Vec<[f64; 2]>) {
        let sitting = Sitting {
            kind: "groups of warps".to_owned(),
            world: world(key),
            began_unix_s: 0,
            device: String::new(),
        };
        self.put(key, figure, sitting, Parts::Groups(parts));
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
                self.put_groups(&key.clone().with(axis::RAYS, class), PER_RAY, parts);
            }
            let key = key.with(axis::RAYS, ALL_RAYS);
            let of_paths = all.iter().zip(primary);
            let of_paths = of_paths.map(|([cycles, _], [paths, _])| [*cycles, *paths as f64]);
            self.put_groups(&key, PER_PATH, of_paths.collect());
            self.put_groups(&key, PER_RAY, all);
        }
    }

    /// Of recorded rays, class by class.
    fn add_recorded(&mut self, line: &Line, coherence: &ClassCoherence) {
        for ((class, _), groups) in coherence.classes.iter().zip(&coherence.groups) {
            let key = competitor(line).with(axis::RAYS, format::ray_class(*class));
            self.put_groups(&key, PER_RAY, parts(groups));
        }
    }

    /// `Π vᵉ` of values with their exponents, with its interval; `None` unless all are known by parts that belong together.
    pub fn product(&self, terms: &[(&Value, f64)]) -> Option<Interval> {
        let series = |(v, exponent): &(&Value, f64)| {
            let known = self.of.get(&(v.key.to_string(), v.figure.id.to_string()));
            known.map(|series| (series, *exponent))
        };
        let terms: Vec<(&Series, f64)> = terms.iter().map(series).collect::<Option<_>>()?;
        let sitting = &terms.first()?.0.sitting;
        if terms.iter().any(|(series, _)| series.sitting != *sitting) {
            return None;
        }
        let (mut rounds, mut groups) = (Vec::new(), Vec::new());
        for (series, exponent) in &terms {
            match &series.parts {
                Parts::Rounds(values) => rounds.push((&**values, *exponent)),
                Parts::Groups(sums) => groups.push((&**sums, *exponent)),
            }
        }
        match groups.is_empty() {
            true => of_rounds(&rounds),
            false => Some(of_groups(&groups)),
        }
    }
}

/// Figures of the coherence model.
const PER_RAY: &str = "cycles-per-ray/v1";
const PER_PATH: &str = "cycles-per-path/v1";

/// Cycles over rays of each group.
fn parts(groups: &[[u64; 2]]) -> Vec<[f64; 2]> {
    let of_one = |[rays, cycles]: &[u64; 2]| [*cycles as f64, *rays as f64];
    groups.iter().map(of_one).collect()
}

fn world(key: &Key) -> [String; 3] {
    [axis::SCENE, axis::TRIANGLE, axis::BOX_TEST].map(|axis| key.label(axis).to_owned())
}

/// As many of each, which there are.
fn length<T>(terms: &[(&[T], f64)]) -> Option<usize> {
    let count = terms.first()?.0.len();
    terms
        .iter()
        .all(|(parts, _)| parts.len() == count)
        .then_some(count)
}

/// By the estimator of comparisons, on what each round says.
fn of_rounds(terms: &[(&[f64], f64)]) -> Option<Interval> {
    let at = |round: usize| {
        terms
            .iter()
            .map(|(x, e)| e * x[round].ln())
            .sum::<f64>()
            .exp()
    };
    let products: Vec<f64> = (0..length(terms)?).map(at).collect();
    Some(LogFigure::of_times(&products)?.interval())
}

/// By the jackknife over groups. Where one group alone has such rays, or there is one, or the sides were followed in
/// different numbers of groups, nothing is known of others.
fn of_groups(terms: &[(&[[f64; 2]], f64)]) -> Interval {
    let without = |left_out: usize| {
        let log = |(groups, exponent): &(&[[f64; 2]], f64)| {
            let kept = groups.iter().enumerate().filter(|(i, _)| *i != left_out);
            let [sum, of] = kept.fold([0.0; 2], |sum, (_, g)| [sum[0] + g[0], sum[1] + g[1]]);
            exponent * (sum / of).ln()
        };
        terms.iter().map(log).sum::<f64>()
    };
    let log = without(usize::MAX);
    let count = length(terms).filter(|count| *count > 1);
    let parts = count.map(|count| (0..count).map(without).collect::<Vec<f64>>());
    let known = parts.and_then(|parts| LogFigure::new(log, &[parts], Vec::new()));
    let unknown = Interval {
        value: log.exp(),
        low: 0.0,
        high: f64::INFINITY,
    };
    known.map_or(unknown, |figure| figure.interval())
}
