//! The figures of a side with their evidence: raw samples where the records have them.

use super::Identity;
use super::facts::{BIAS, IMAGE, fact, facts, pixels};
use super::side::Side;
use crate::data::{RunData, View};
use crate::failed_checks;
use crate::samplers::{FURTHER_METRICS, MeasuredSampler, Metric};
use crate::values::{Estimate, Value, values};
use raystone_record::figure::{self, Better, Figure, Spread};
use raystone_record::*;
use raystone_stats::statistics::{log_log_fit, mean};
use std::collections::{BTreeMap, BTreeSet};

/// The evidence of a figure.
#[derive(Debug, Clone, PartialEq)]
pub enum Evidence {
    /// It is counted or computed: any difference is one.
    Exact(f64),
    /// Milliseconds of the same work in the order measured, round by round.
    Times {
        /// By the adapter's clock, or the wall clock where it has none.
        adapter: Vec<f64>,
        /// CPU time of all threads of the process together, independent of other processes; empty where the adapter
        /// does not compute on the processor.
        processors: Vec<f64>,
    },
    /// A value for each seed, whose mean is the figure.
    Seeds {
        /// Seed and value; of a figure that is no mean, the jackknife's pseudo-values (Tukey 1958).
        values: Vec<(u32, f64)>,
        /// The reference of the values.
        reference: String,
    },
    /// No more than an interval that is about Student's with so many degrees of freedom.
    Summary(Interval, f64),
    /// An interval that is not to be trusted: seeds that all missed the decisive pixel agree with each other for that reason.
    Untrusted(Interval),
    /// A number that was measured once.
    Once(f64),
    /// A verdict or a hash.
    Fact {
        /// Its text.
        text: String,
        /// True if it is a failure.
        fails: bool,
    },
}

/// A figure of a cell with its evidence.
#[derive(Debug, Clone, PartialEq)]
pub struct Taken {
    /// Its subject.
    pub key: Key,
    /// Its row in the table of figures.
    pub figure: Figure,
    /// The value as it is shown.
    pub shown: String,
    /// Its evidence.
    pub evidence: Evidence,
    /// Description of the work, equal for two values of the same work.
    pub work: String,
    /// `run.seed`, if the figure is of rays, pictures or tests of that seed alone: another seed gives another sample of the
    /// same.
    pub seed: Option<i64>,
    /// Hash of the kernels; empty if none is recorded.
    pub kernel: String,
}

impl Taken {
    /// Returns its unique name: labels, since programs of different versions may know different parameters.
    pub fn identity(&self) -> Identity {
        identity(&self.key, &self.figure)
    }
}

fn identity(key: &Key, figure: &Figure) -> Identity {
    let labels: Vec<String> = key.labels().map(|(a, l)| format!("{a}={l}")).collect();
    (labels.join("\u{1}"), figure.id.to_string())
}

/// Figures that follow from others, or other times of the same subject: reports show them, verdicts ignore them.
const DERIVED: [&Figure; 25] = [
    &figure::BUILD_RATE,
    &figure::BYTES_PER_TRIANGLE,
    &figure::REFERENCES_PER_TRIANGLE,
    &figure::CELL_MRAYS_PER_S,
    &figure::AGAINST_SINGLE_KERNEL,
    &figure::ORDER_RATIO,
    &figure::TIME_TO_IMAGE,
    &figure::ERROR_SECONDS,
    &figure::ERROR_AT_TIME,
    &figure::SPP_TO_ERROR,
    &figure::SECONDS_TO_ERROR,
    &figure::BREAK_EVEN,
    &figure::SPECIALISATION,
    &figure::RAY_QUERY_SHARE,
    &figure::COMPACTION_MELEMENTS_PER_S,
    &figure::COMPACTION_GB_PER_S,
    &figure::COMPACTION_RATIO,
    &figure::CPU_NS_PER_RAY,
    &figure::CPU_OVER_PEER,
    &figure::PRICE_OF_EXACTNESS,
    &figure::PEER_MRAYS_PER_S,
    &figure::FRAME_TIME_RATIO,
    &figure::FRAME_BREAK_EVEN,
    &figure::LOOP_NS,
    &figure::RAYS,
];

/// Figures of cells that the seed of the run changes, beside those of its rays: counts in one picture of that seed, or times of
/// it.
const OF_ONE_SEED: [&Figure; 11] = [
    &figure::MS_PER_SPP,
    &figure::RAY_QUERY_SHARE,
    &figure::PRIMARY_OTHER_TRIANGLE,
    &figure::PRIMARY_OTHER_VALUE,
    &figure::PRIMARY_MEAN_DIFFERENCE,
    &figure::PRIMARY_RMS_DIFFERENCE,
    &figure::COMPACTION_NS,
    &figure::FRAME_JUDGED,
    &figure::FRAME_NODES_RATIO,
    &figure::NEIGHBOUR_ANGLE,
    &figure::COVERAGE,
];

/// With fewer degrees of freedom, the spread of means over seeds is too uncertain to compare those of other seeds.
const FEWEST_FREE: f64 = 7.0;

fn is_among(figures: &[&Figure], id: &str) -> bool {
    figures.iter().any(|figure| figure.id == id)
}

/// Returns `true` if a figure is of rays or pictures of the seed of the run alone, or of few seeds. Errors are known seed by
/// seed, and structures depend on none.
fn is_of_one_seed(taken: &Taken) -> bool {
    match taken.evidence {
        Evidence::Summary(_, freedom) if freedom < FEWEST_FREE => return true,
        Evidence::Untrusted(_) => return true,
        _ => {}
    }
    let of_seeds = matches!(
        taken.evidence,
        Evidence::Seeds { .. } | Evidence::Summary(..)
    );
    let of_rays = !taken.key.label(axis::RAYS).is_empty();
    !of_seeds && (of_rays || is_among(&OF_ONE_SEED, &taken.figure.id) || taken.figure.id == IMAGE)
}

/// A check of the run that failed.
const CHECK: &str = "check/v1";

/// Returns `true` if a figure follows from others; those of the check for bias do, which has a verdict.
fn is_derived(id: &str) -> bool {
    is_among(&DERIVED, id) || id.starts_with("bias-") || id.starts_with("growth-")
}

/// Returns all figures of a side.
pub fn taken(side: &Side) -> Vec<Taken> {
    of_lines(&side.lines)
}

/// Returns the names of figures with two contradictory values on one side: of two lines on one subject a report uses
/// the later one, a comparison neither.
pub(crate) fn contradictions(side: &Side) -> Vec<Identity> {
    if !repeats(&side.lines) {
        return Vec::new();
    }
    let turned: Vec<Line> = side.lines.iter().rev().cloned().collect();
    let by_identity = |all: Vec<Taken>| -> BTreeMap<Identity, Evidence> {
        let pairs = all.into_iter().map(|t| (t.identity(), t.evidence));
        pairs.collect()
    };
    let earlier = by_identity(of_lines(&turned));
    let of_record = |e: &Evidence| !matches!(e, Evidence::Times { .. } | Evidence::Once(_));
    let later = by_identity(of_lines(&side.lines)).into_iter();
    // A check repeats other figures, in their order.
    let differing = later.filter(|((_, figure), _)| figure != CHECK);
    let differing = differing.filter(|(id, evidence)| {
        let other = earlier.get(id);
        of_record(evidence) && other.is_some_and(|other| !is_like(other, evidence))
    });
    differing.map(|(id, _)| id).collect()
}

/// Returns `true` if two lines are on the same subject, as far as keys show.
fn repeats(lines: &[Line]) -> bool {
    let mut seen = BTreeSet::new();
    // Lines without a key are of the run, and of cells and modules, of which there are many.
    let is_new = |line: &Line| {
        if line.key.is_empty() {
            return true;
        }
        let number = match &line.body {
            Body::Error(record) => record.replicate,
            Body::Stream(record) => record.dimensions[0] << 16 | record.dimensions[1],
            Body::Measured(record) => {
                return seen.insert((line.key.to_string(), record.measurement.clone(), 0));
            }
            Body::Skipped(_) | Body::Failed(_) | Body::Warning(_) => return true,
            _ => 0,
        };
        let kind = std::mem::discriminant(&line.body);
        seen.insert((line.key.to_string(), format!("{kind:?}"), number))
    };
    !lines.iter().all(is_new)
}

/// Returns `true` if two pieces of evidence are equal but for the order of seeds and the rounding of their sums.
fn is_like(a: &Evidence, b: &Evidence) -> bool {
    let near = |x: f64, y: f64| x == y || (x - y).abs() <= 1e-9 * x.abs().max(y.abs());
    match (a, b) {
        (Evidence::Seeds { values: a, .. }, Evidence::Seeds { values: b, .. }) => {
            let of = |seed: u32| a.iter().find(|(s, _)| *s == seed).map(|(_, x)| *x);
            a.len() == b.len() && b.iter().all(|(s, y)| of(*s).is_some_and(|x| near(x, *y)))
        }
        (Evidence::Summary(a, _), Evidence::Summary(b, _))
        | (Evidence::Untrusted(a), Evidence::Untrusted(b)) => near(a.value, b.value),
        (Evidence::Exact(a), Evidence::Exact(b)) => near(*a, *b),
        (Evidence::Fact { text: a, .. }, Evidence::Fact { text: b, .. }) => a == b,
        _ => true,
    }
}

/// Returns `true` for a test's verdict, which other seeds may turn.
fn is_a_chance(taken: &Taken) -> bool {
    [CHECK, BIAS].contains(&&*taken.figure.id)
}

fn of_lines(lines: &[Line]) -> Vec<Taken> {
    let data = RunData::new(lines);
    let works = Works::new(&data);
    let mut all: Vec<Taken> = values(&data)
        .into_iter()
        .filter(|value| !is_derived(&value.figure.id))
        .filter_map(|value| of_value(&works, &value))
        .collect();
    all.extend(facts(&data));
    let failed = failed_checks(lines).into_iter();
    all.extend(failed.map(|text| {
        let (title, detail) = text.split_once(": ").unwrap_or((&text, ""));
        let key = Key::default().with(axis::SUBJECT, title);
        fact(&key, CHECK, "check of the run", detail, true)
    }));
    let seed = data.run.and_then(RunRecord::seed);
    for taken in all
        .iter_mut()
        .filter(|t| is_of_one_seed(t) || is_a_chance(t))
    {
        taken.seed = seed;
    }
    all
}

/// Values seed by seed, and their work.
type Seeds = BTreeMap<Identity, (Evidence, String)>;

/// What the values of a run were measured on.
pub(crate) struct Works<'a> {
    data: &'a RunData<'a>,
    of_seeds: Seeds,
}

impl<'a> Works<'a> {
    pub(crate) fn new(data: &'a RunData<'a>) -> Self {
        Self {
            data,
            of_seeds: of_samplers(data),
        }
    }

    /// Describes the scene and the work of a value; values with unlike words are not comparable.
    pub(crate) fn words(&self, value: &Value) -> String {
        let of_seeds = self.of_seeds.get(&identity(&value.key, &value.figure));
        let of_seeds = of_seeds.map_or("", |(_, work)| work);
        scene_hash(self.data, &value.key) + &value.source.work + of_seeds
    }
}

fn of_value(works: &Works, value: &Value) -> Option<Taken> {
    let number = match value.estimate {
        Estimate::Known(interval) | Estimate::HeavyTailed(interval) => interval,
        Estimate::Below(bound) => Interval {
            value: bound,
            low: 0.0,
            high: bound,
        },
        Estimate::Word(_) => return None,
    };
    let mut own = Taken {
        key: value.key.clone(),
        figure: value.figure.clone().into_owned(),
        shown: value.cell().text,
        evidence: evidence(works.data, value, number),
        work: works.words(value),
        seed: None,
        kernel: value.source.kernel.to_owned(),
    };
    if value.is_heavy_tailed() {
        own.evidence = Evidence::Untrusted(number);
    }
    if let Some((evidence, _)) = works.of_seeds.get(&own.identity())
        && !value.is_heavy_tailed()
    {
        own.evidence = evidence.clone();
    }
    Some(own)
}

/// Returns the evidence of a value by itself.
fn evidence(data: &RunData, value: &Value, number: Interval) -> Evidence {
    if let Samples::Rounds {
        adapter,
        processors,
        ..
    } = &value.source.samples
    {
        // A rate is compared by the time that each round took.
        let times = |values: &[f64]| match value.figure.better {
            Better::Higher => values.iter().map(|rate| rate.recip()).collect(),
            _ => values.to_vec(),
        };
        return Evidence::Times {
            adapter: times(adapter),
            processors: times(processors),
        };
    }
    match value.figure.spread {
        Spread::Exact => Evidence::Exact(number.value),
        // The rounds of a median are not recorded.
        Spread::Single | Spread::Median => Evidence::Once(number.value),
        Spread::Mean | Spread::Jackknife => of_means(data, value, number),
    }
}

/// Returns the evidence of means over seeds whose values are not recorded. A value that no seed changes is exact.
fn of_means(data: &RunData, value: &Value, number: Interval) -> Evidence {
    let key = &value.key;
    let is_it = |stream: &&Recorded<StreamRecord>| {
        let own = [axis::SEQUENCE, axis::DECORRELATION];
        stream.key.agrees(key, &own) && !key.label(axis::DIMENSIONS).is_empty()
    };
    match data.streams.iter().find(is_it) {
        Some(stream) if !stream.randomised => Evidence::Exact(number.value),
        Some(stream) => Evidence::Summary(number, stream.seeds.saturating_sub(1).max(1) as f64),
        // A spectrum: the replicates of its sampler.
        None => {
            let replicates = data.views().flat_map(|(_, view)| &view.samplers);
            let fewest = replicates
                .map(|s| s.replicates.len())
                .filter(|n| *n > 1)
                .min();
            Evidence::Summary(number, fewest.unwrap_or(2) as f64 - 1.0)
        }
    }
}

fn scene_hash(data: &RunData, key: &Key) -> String {
    let scene = data
        .scenes
        .iter()
        .find(|s| s.name == key.label(axis::SCENE));
    let record = scene.and_then(|scene| scene.record);
    record.map_or(String::new(), |r| format!("scene {}; ", r.scene_hash))
}

/// Returns the errors of all samplers, seed by seed.
fn of_samplers(data: &RunData) -> Seeds {
    let views = data.views();
    views
        .flat_map(|(_, view)| view.samplers.iter().flat_map(move |s| of_sampler(view, s)))
        .collect()
}

fn of_sampler(view: &View, sampler: &MeasuredSampler) -> Seeds {
    let reference = match view.reference {
        None => "none".into(),
        Some(r) => format!(
            "{} spp, mean {:e}, MSE {:?}, {:?}",
            r.spp, r.mean, r.mse, r.file
        ),
    };
    let work = sampler
        .replicates
        .first()
        .map_or(String::new(), |r| pixels(r.resolution));
    let seeds = |values: Vec<f64>| -> Option<Evidence> {
        let whole =
            values.len() == sampler.replicates.len() && values.iter().all(|x| x.is_finite());
        // Where no seed changes the image, it is the same image with another.
        let seed = |r: &&ErrorRecord| if r.randomised { r.seed } else { 0 };
        let seeds = sampler.replicates.iter().map(seed);
        let mut values: Vec<(u32, f64)> = seeds.zip(values).collect();
        values.sort_by_key(|(seed, _)| *seed);
        whole.then(|| Evidence::Seeds {
            values,
            reference: reference.clone(),
        })
    };
    let mut all = Seeds::new();
    let mut put = |key: &Key, figure: &Figure, values: Vec<f64>| {
        let evidence = seeds(values).map(|evidence| (evidence, work.clone()));
        all.extend(evidence.map(|known| (identity(key, figure), known)));
    };
    let at = |spp: u32, id: &str| -> Vec<f64> {
        let errors = sampler.replicates.iter();
        let errors = errors.filter_map(|r| r.errors.iter().find(|e| e.spp == spp));
        errors.filter_map(|e| e.metrics.get(id).copied()).collect()
    };
    for metric in [Metric::RelMse, Metric::Rmse] {
        let Some(id) = sampler.metric_id(metric) else {
            continue;
        };
        let errors = sampler.mean_errors(metric);
        for error in &errors {
            let key = sampler.key.clone().with(axis::SPP, error.spp);
            let values = at(error.spp, id);
            let root = |values: &[f64]| mean(values).map_or(f64::NAN, f64::sqrt);
            put(
                &key,
                sampler.figure(metric),
                match metric {
                    Metric::RelMse => values,
                    Metric::Rmse => pseudo_values(&values, root),
                },
            );
        }
        let fitted: Vec<u32> = errors
            .iter()
            .filter(|e| e.resolved)
            .map(|e| e.spp)
            .collect();
        let curves: Vec<Vec<f64>> = fitted.iter().map(|spp| at(*spp, id)).collect();
        put(
            &sampler.key,
            metric.slope_figure(),
            slopes(metric, &fitted, &curves),
        );
    }
    if let Some(spp) = sampler.highest_spp() {
        let key = sampler.key.clone().with(axis::SPP, spp);
        FURTHER_METRICS
            .iter()
            .for_each(|(figure, id)| put(&key, figure, at(spp, id)));
    }
    all
}

/// Returns the contribution of each value to an estimate: n times it less n − 1 times that without the value.
fn pseudo_values(values: &[f64], estimate: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    let n = values.len() as f64;
    let all = estimate(values);
    let without = raystone_stats::statistics::leave_one_out(values);
    match values.len() {
        0 | 1 => vec![all; values.len()],
        _ => without
            .map(|rest| n * all - (n - 1.0) * estimate(&rest))
            .collect(),
    }
}

/// Returns the pseudo-values of the slope of the mean error over samples per pixel; empty where some replicates lack
/// some.
fn slopes(metric: Metric, spps: &[u32], curves: &[Vec<f64>]) -> Vec<f64> {
    let n = curves.first().map_or(0, Vec::len);
    if curves.iter().any(|values| values.len() != n) {
        return Vec::new();
    }
    let power = if metric == Metric::Rmse { 0.5 } else { 1.0 };
    let replicates: Vec<f64> = (0..n).map(|i| i as f64).collect();
    pseudo_values(&replicates, |kept| {
        let at = |(spp, values): (&u32, &Vec<f64>)| {
            let kept: Vec<f64> = kept.iter().map(|i| values[*i as usize]).collect();
            (f64::from(*spp), mean(&kept).unwrap_or(f64::NAN))
        };
        let points: Vec<(f64, f64)> = spps.iter().zip(curves).map(at).collect();
        log_log_fit(&points).map_or(f64::NAN, |slope| power * slope)
    })
}
