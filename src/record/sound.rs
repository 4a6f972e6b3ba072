//! Values that no run writes: negative times and counts, shares above one, rounds that lack one of their clocks. A record that
//! holds one was damaged, and none of its figures counts. And figures that contradict each other, as a rate that is not rays over
//! time: a run ends before it writes them.

use super::*;
use between::{of_animation, of_hits, of_paths, of_processors};
use raystone_core::structure::StructureStats;
use raystone_stats::hypothesis::student_t_two_sided;
use raystone_stats::rates::rate_fault;
use raystone_stats::statistics::median;
use std::collections::BTreeSet;

mod between;

/// Relative difference of two figures that is rounding.
const ROUNDING: f64 = 1e-9;
/// Most that the stages of an image may take of its longest round: each is a median of its own.
const OF_STAGES: f64 = 1.5;

/// A body of a record that can detect its own damage.
pub trait Sound {
    /// Describes an impossible value in it.
    fn fault(&self) -> Option<String> {
        None
    }
}

impl Sound for Body {
    fn fault(&self) -> Option<String> {
        let mut faults = Vec::new();
        match self {
            Self::Structure(record) => of_structure(record, &mut faults),
            Self::Time(record) => of_cell(record, &mut faults),
            Self::Peer(record) => {
                not_negative("build_ms", [&record.build_ms], &mut faults);
                for timing in &record.timings {
                    rounds(&timing.wall_ms, [&timing.ms, &timing.cpu_ms], &mut faults);
                }
            }
            Self::Error(record) => record
                .errors
                .iter()
                .for_each(|at| of_error(at, &mut faults)),
            Self::Stream(record) => {
                for at in &record.star {
                    share("star", at.value.value, &mut faults);
                }
            }
            _ => {}
        }
        faults.into_iter().next()
    }
}

/// Describes an impossible value in readings: no number, a time or rate below zero, rounds that lack one of their clocks.
pub fn fault_of(readings: &[Reading]) -> Option<String> {
    let mut faults = Vec::new();
    for reading in readings {
        let Interval { value, low, high } = reading.value;
        if ![value, low, high].iter().all(|x| x.is_finite()) || low > value || value > high {
            faults.push(format!("{} is {value} in [{low}, {high}]", reading.figure));
        }
        if let Samples::Rounds {
            adapter,
            wall,
            processors,
        } = &reading.samples
        {
            rounds(adapter, [wall, processors], &mut faults);
        }
    }
    faults.into_iter().next()
}

/// Describes two figures of a record that contradict each other.
pub fn contradiction(body: &Body) -> Option<String> {
    let mut faults = Vec::new();
    match body {
        Body::Structure(record) => of_rays(record, &mut faults),
        Body::Time(record) => of_image(record, &mut faults),
        Body::Error(record) => of_errors(&record.errors, &mut faults),
        Body::Bias(record) => of_bias(record, &mut faults),
        Body::Spectrum(record) => of_spectrum(record, &mut faults),
        Body::Stream(record) => of_stream(record, &mut faults),
        Body::Animation(record) => of_animation(record, &mut faults),
        _ => {}
    }
    faults.into_iter().next()
}

/// Metrics that are sums of squares or of magnitudes.
const NOT_NEGATIVE: [&str; 5] = ["mae", "relmse-trimmed", "mse-luminance", "smape", "flip"];

fn of_error(at: &ErrorAtSpp, faults: &mut Vec<String>) {
    for (id, value) in &at.metrics {
        let name = id.split('/').next().unwrap_or_default();
        if NOT_NEGATIVE.contains(&name) {
            not_negative(id, [value], faults);
        }
    }
}

fn of_errors(errors: &[ErrorAtSpp], faults: &mut Vec<String>) {
    if !errors.is_sorted_by(|a, b| a.spp < b.spp) {
        faults.push("numbers of samples do not ascend".to_owned());
    }
    for at in errors {
        let metric = |id: &str| at.metrics.get(id).copied();
        let (mse, root) = (metric("mse/v1"), metric("rmse/v1"));
        equal(
            "the square of rmse",
            root.map(|root| root * root),
            mse,
            faults,
        );
        let channels = ["mse-red/v1", "mse-green/v1", "mse-blue/v1"].map(metric);
        let sum = channels.into_iter().sum::<Option<f64>>();
        let mean = sum.map(|sum| sum / 3.0);
        equal("the mean over channels of mse", mean, mse, faults);
    }
}

fn of_bias(record: &BiasRecord, faults: &mut Vec<String>) {
    let counted: usize = record.p_histogram.iter().sum();
    if record.rejected > record.tiles || counted > record.tiles {
        faults.push(format!(
            "{} tiles are rejected and {counted} are in a histogram of {}",
            record.rejected, record.tiles
        ));
    }
    for (what, p) in [("p", record.p), ("p_of_all", record.p_of_all)] {
        share(what, p.unwrap_or_default(), faults);
    }
    let test = record.z.zip(record.degrees_of_freedom);
    let p = test.map(|(z, freedom)| student_t_two_sided(z, freedom));
    equal("p of the image", record.p, p, faults);
    // Of three tests, each at a third of the level, the least decides.
    let least = [record.p, record.weighted_p].into_iter().flatten();
    let least = least.fold(f64::INFINITY, f64::min);
    if let Some(all) = record.p_of_all.filter(|all| *all < 1.0)
        && all > 3.0 * least * (1.0 + ROUNDING)
    {
        faults.push(format!("p of all tests is {all}, and that of one {least}"));
    }
}

/// The loudest wave is none below the mean of some.
fn of_spectrum(record: &SpectrumRecord, faults: &mut Vec<String>) {
    if let Some((loudest, low)) = record.loudest.zip(record.low_frequency)
        && loudest.value < low.value * (1.0 - ROUNDING)
    {
        faults.push(format!(
            "the loudest wave has a power of {}, and low frequencies {}",
            loudest.value, low.value
        ));
    }
}

fn of_stream(record: &StreamRecord, faults: &mut Vec<String>) {
    if !record.star.is_sorted_by(|a, b| a.n < b.n) {
        faults.push("numbers of points do not ascend".to_owned());
    }
    for star in &record.star {
        // A mean square over all boxes is at most the square of the greatest.
        let same = record.figures.l2_star.iter().find(|at| at.n == star.n);
        if let Some(l2) = same.filter(|l2| l2.value.value > star.value.value * (1.0 + ROUNDING)) {
            faults.push(format!(
                "the L2-star discrepancy {} of {} points is above D* = {}",
                l2.value.value, star.n, star.value.value
            ));
        }
    }
}

fn of_structure(record: &StructureRecord, faults: &mut Vec<String>) {
    let phases = record.build.iter().map(|phase| &phase.ms);
    not_negative("build", phases.chain([&record.build_ms]), faults);
    not_negative("update_ms", &record.update_ms, faults);
    not_negative("sah_cost", &record.stats.sah_cost, faults);
    for timing in &record.timings {
        rounds(&timing.ms, [&timing.wall_ms, &timing.cpu_ms], faults);
        not_negative("mrays_s", [&timing.mrays_s.value], faults);
        share("hit_fraction", timing.hit_fraction, faults);
        if let Some(work) = &timing.counters {
            let counted = [&work.nodes, &work.box_tests, &work.triangle_tests];
            not_negative("counters", counted, faults);
        }
    }
}

/// Times, rates, rays and leaves of a structure.
fn of_rays(record: &StructureRecord, faults: &mut Vec<String>) {
    let phases = record.build.iter().map(|phase| phase.ms).sum();
    equal(
        "the sum of build",
        Some(phases),
        Some(record.build_ms),
        faults,
    );
    of_leaves(&record.stats, faults);
    let gated = record.gate.iter().flat_map(|gate| &gate.classes);
    let gated: Vec<(RayClass, usize)> = gated.map(|class| (class.class, class.rays)).collect();
    let mut known = BTreeSet::new();
    for timing in &record.timings {
        let class = (timing.class, timing.rays);
        let is_judged = gated.is_empty() || gated.contains(&class);
        if !known.insert(timing.class) || !is_judged {
            faults.push(format!(
                "{} {} rays are timed twice, or others than were checked",
                timing.rays,
                timing.class.name()
            ));
        }
        faults.extend(rate_fault(&timing.mrays_s, timing.rays as f64, &timing.ms));
        counted_twice(&timing.ms, [&timing.wall_ms, &timing.cpu_ms], faults);
        of_processors(&timing.cpu_ms, [&timing.ms, &timing.wall_ms], faults);
    }
    of_hits(&record.timings, faults);
}

/// Two rounds that are equal to the bit by each of three clocks are one. By two clocks, rounds of a quarter of a millisecond are
/// equal by chance once in a few thousand runs. Where the adapter has no clock, the host's may be coarse, and nothing is said.
fn counted_twice(ms: &[f64], [wall_ms, cpu_ms]: [&[f64]; 2], faults: &mut Vec<String>) {
    let mut known = BTreeSet::new();
    let rounds = ms.iter().zip(wall_ms).zip(cpu_ms);
    let mut rounds = rounds.filter(|((ms, wall), _)| ms != wall);
    let twice =
        rounds.find(|((ms, wall), cpu)| !known.insert([ms, wall, cpu].map(|t| t.to_bits())));
    if let Some(((ms, _), _)) = twice {
        faults.push(format!("a round of {ms} ms is counted twice"));
    }
}

/// Leaves and references against the histogram, whose last class holds longer leaves as well. Some structures count
/// empty leaves, too.
fn of_leaves(stats: &StructureStats, faults: &mut Vec<String>) {
    let histogram = &stats.leaf_histogram;
    if histogram.is_empty() {
        return;
    }
    // A record may hold any numbers.
    let all = histogram.iter().copied().fold(0, u64::saturating_add);
    let known = [all, all - histogram[0]].contains(&stats.leaves);
    let references = (histogram.iter().zip(0..))
        .map(|(leaves, size)| leaves.saturating_mul(size))
        .fold(0, u64::saturating_add);
    if !known || references > stats.references {
        faults.push(format!(
            "{} leaves with {} references have a histogram of {all} leaves",
            stats.leaves, stats.references
        ));
    }
}

/// Times and rates of a whole cell against its rays, and those against its pixels.
fn of_image(record: &TimeRecord, faults: &mut Vec<String>) {
    let spp = f64::from(record.spp);
    let per_spp = record.ms_per_spp.map(|ms| ms.value);
    let ms = median(&record.ms).filter(|_| per_spp.is_some());
    equal("ms_per_spp", per_spp, ms.map(|ms| ms / spp), faults);
    if let Some(rate) = record.mrays_s {
        faults.extend(rate_fault(&rate, record.traced_rays() as f64, &record.ms));
    }
    counted_twice(&record.ms, [&record.wall_ms, &record.cpu_ms], faults);
    of_processors(&record.cpu_ms, [&record.ms, &record.wall_ms], faults);
    of_paths(record, faults);
    let stages: f64 = record.stages.values().sum();
    let longest = record.ms.iter().copied().fold(0.0, f64::max);
    if !record.ms.is_empty() && stages > OF_STAGES * longest {
        faults.push(format!(
            "the stages of an image take {stages} ms, and the image at most {longest}"
        ));
    }
    let rays = |class: &str| record.rays.get(class).copied();
    let Some(primary) = rays("primary") else {
        return;
    };
    let [width, height] = record.resolution.map(u64::from);
    let bounced = rays("bounce").unwrap_or_default();
    let (samples, live) = (width * height * u64::from(record.spp), &record.live_paths);
    let is_followed = live.is_empty() || live.iter().sum::<u64>() == primary + bounced;
    if primary != samples || !is_followed {
        faults.push(format!(
            "{primary} primary and {bounced} bounce rays, paths by bounce {live:?}, are not those of {samples} samples"
        ));
    }
}

fn of_cell(record: &TimeRecord, faults: &mut Vec<String>) {
    rounds(&record.ms, [&record.wall_ms, &record.cpu_ms], faults);
    let figures = [&record.ms_per_spp, &record.mrays_s];
    let figures = figures.into_iter().flatten();
    not_negative("ms_per_spp and mrays_s", figures.map(|i| &i.value), faults);
    not_negative("stages", record.stages.values(), faults);
}

/// Checks times by one clock, round by round, and the same by others, which have as many rounds or none.
fn rounds(ms: &[f64], others: [&[f64]; 2], faults: &mut Vec<String>) {
    for times in others.into_iter().chain([ms]) {
        not_negative("a time", times, faults);
    }
    for other in others {
        if !other.is_empty() && other.len() != ms.len() {
            faults.push(format!(
                "{} rounds by one clock and {} by another",
                ms.len(),
                other.len()
            ));
        }
    }
}

/// Two ways to one figure, where both are there.
fn equal(what: &str, found: Option<f64>, expected: Option<f64>, faults: &mut Vec<String>) {
    if let (Some(found), Some(expected)) = (found, expected)
        && (found - expected).abs() > ROUNDING * expected.abs()
    {
        faults.push(format!("{what} is {found} where {expected} was to be"));
    }
}

fn not_negative<'a>(
    what: &str,
    values: impl IntoIterator<Item = &'a f64>,
    faults: &mut Vec<String>,
) {
    let mut values = values.into_iter();
    // Not a number is none of these either.
    let bad = values.find(|x| !(**x >= 0.0 && x.is_finite()));
    faults.extend(bad.map(|x| format!("{what} is {x}")));
}

fn share(what: &str, value: f64, faults: &mut Vec<String>) {
    if !(0.0..=1.0).contains(&value) {
        faults.push(format!("{what} is {value}, and no share"));
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::figure::{BUILD_MS, COMPACTION_NS};
    use std::collections::BTreeMap;

    #[test]
    fn rounds_are_one_where_every_clock_says_so() {
        let said = |wall: [f64; 2], cpu: &[f64]| {
            let mut faults = Vec::new();
            counted_twice(&[3.0, 3.0], [&wall, cpu], &mut faults);
            !faults.is_empty()
        };
        assert!(said([3.5, 3.5], &[3.6, 3.6]));
        // Chance, one clock for two, and a system without a clock of the process.
        assert!(!said([3.5, 3.5], &[3.6, 3.7]) && !said([3.5, 3.6], &[3.6, 3.6]));
        assert!(!said([3.0, 3.0], &[3.6, 3.6]) && !said([3.5, 3.5], &[]));
    }

    #[test]
    fn figures_that_contradict_each_other_are_faults() {
        let (structure, cell) = crate::known_readings::known();
        let said = |body: Body| contradiction(&body).unwrap_or_default();
        assert_eq!(said(Body::Structure(structure.clone())), "");
        assert_eq!(said(Body::Time(cell.clone())), "");
        type Of<T> = (&'static str, fn(&mut T));
        let structures: [Of<StructureRecord>; 6] = [
            ("counted twice", |r| {
                let of = &mut r.timings[0];
                (of.ms, of.wall_ms) = (vec![2.0, 3.0, 3.0, 4.0], vec![2.5, 3.5, 3.5, 4.5]);
                of.cpu_ms = vec![2.6, 3.6, 3.6, 4.6];
            }),
            ("sum of build", |r| r.build_ms = 0.005),
            ("rate", |r| r.timings[0].mrays_s = Interval::exact(4.0)),
            ("timed twice", |r| r.timings.push(r.timings[0].clone())),
            ("histogram", |r| r.stats.leaves = 7),
            ("histogram", |r| r.stats.references = 8),
        ];
        for (part, change) in structures {
            let mut record = structure.clone();
            change(&mut record);
            assert!(said(Body::Structure(record)).contains(part), "{part}");
        }
        let cells: [Of<TimeRecord>; 6] = [
            ("stages", |r| {
                r.stages = [("a".to_owned(), 11.0), ("b".to_owned(), 8.0)].into();
            }),
            ("ms_per_spp", |r| r.ms_per_spp = Some(Interval::exact(10.0))),
            ("rate", |r| r.mrays_s = Some(Interval::exact(0.17))),
            ("samples", |r| r.resolution = [20, 10]),
            ("samples", |r| r.live_paths = vec![400, 99]),
            ("rate", |r| {
                r.rays.insert("shadow".to_owned(), 400);
            }),
        ];
        for (part, change) in cells {
            let mut record = cell.clone();
            change(&mut record);
            let fault = said(Body::Time(record));
            assert!(fault.contains(part), "{part}: {fault}");
        }
        let (bias, spectrum, ..) = crate::known_readings::further();
        assert_eq!(said(Body::Bias(bias.clone())), "");
        assert_eq!(said(Body::Spectrum(spectrum.clone())), "");
        let biases: [Of<BiasRecord>; 3] = [
            ("p of the image", |r| r.p = r.weighted_p),
            ("p of the image", |r| {
                r.degrees_of_freedom = r.weighted_degrees_of_freedom;
            }),
            ("p of all", |r| r.p_of_all = Some(0.9)),
        ];
        for (part, change) in biases {
            let mut record = bias.clone();
            change(&mut record);
            assert!(said(Body::Bias(record)).contains(part), "{part}");
        }
        let mut turned = spectrum;
        (turned.loudest, turned.low_frequency) = (turned.low_frequency, turned.loudest);
        assert!(said(Body::Spectrum(turned)).contains("loudest"));
        let errors = |metrics: &[(&str, f64)], spp: [u32; 2]| {
            let at = |spp| ErrorAtSpp {
                partial_net: false,
                spp,
                metrics: metrics
                    .iter()
                    .map(|(id, x)| ((*id).to_owned(), *x))
                    .collect(),
                without_part: BTreeMap::new(),
                tail: None,
            };
            let mut faults = Vec::new();
            of_errors(&spp.map(at), &mut faults);
            faults.into_iter().next().unwrap_or_default()
        };
        let right = [
            ("mse/v1", 4.0),
            ("rmse/v1", 2.0),
            ("mse-red/v1", 3.0),
            ("mse-green/v1", 4.0),
            ("mse-blue/v1", 5.0),
        ];
        assert_eq!(errors(&right, [1, 2]), "");
        assert!(errors(&right, [2, 2]).contains("ascend"));
        for place in 1..right.len() {
            let mut wrong = right;
            wrong[place].1 *= 1.01;
            assert!(errors(&wrong, [1, 2]).contains("mse"), "{place}");
        }
    }

    #[test]
    fn readings_that_are_no_numbers_or_lack_a_clock_are_faults() {
        let exact = |value| Reading::exact(&BUILD_MS, value);
        assert_eq!(fault_of(&[exact(1.0), exact(-0.5)]), None);
        for value in [f64::NAN, f64::INFINITY] {
            let fault = fault_of(&[exact(1.0), exact(value)]).expect("a fault");
            assert!(fault.contains("build-ms/v1"), "{fault}");
        }
        let turned = Interval {
            value: 1.0,
            low: 2.0,
            high: 3.0,
        };
        assert!(fault_of(&[Reading::new(&BUILD_MS, turned)]).is_some());
        let rounds = |adapter: &[f64], wall: &[f64]| {
            let samples = Samples::Rounds {
                adapter: adapter.to_vec(),
                wall: wall.to_vec(),
                processors: Vec::new(),
            };
            fault_of(&[Reading::exact(&COMPACTION_NS, 1.0).with_samples(samples)])
        };
        assert_eq!(rounds(&[1.0, 2.0], &[1.0, 2.0]), None);
        assert_eq!(rounds(&[1.0, 2.0], &[]), None);
        assert!(rounds(&[1.0, 2.0], &[1.0]).is_some());
        assert!(rounds(&[1.0, -2.0], &[]).is_some());
    }
}
