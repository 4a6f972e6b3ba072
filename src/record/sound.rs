//! Values that no run writes: negative times and counts, shares above one, rounds that lack one of their clocks. A record that
//! holds one was damaged, and none of its figures counts.

use super::*;

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
                    rounds(&timing.wall_ms, [&[], &timing.cpu_ms], &mut faults);
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
