//! The clocks of a run against each other and against the work: twice the rays must take about twice
//! the time, or as much more as passes on the clock around them, and a measurement must account for most
//! of the time that passed around it, and for no more.

use std::time::Duration;

use raystone_accel::RayBatch;
use raystone_gpu::{Elapsed, GpuError, Stopwatch};

/// Bounds of the time of twice the rays over that of the rays.
const TWICE: [f64; 2] = [1.5, 2.8];
/// Most that a measurement may claim of the time around it: timestamps have another period.
const MOST_CLAIMED: f64 = 1.05;
/// Least of it that it must claim, after [`SPARE_MS`] for wiping answers and waking up.
const LEAST_CLAIMED: f64 = 0.65;
const SPARE_MS: f64 = 2.0;
/// Least of the time around a measurement that the processors of a software adapter must have worked in some round; on an
/// idle machine it is about their number, and a thread that waits works a few hundredths of it.
const LEAST_WORKED: f64 = 0.1;
/// Milliseconds below which a time says nothing about a clock.
const LEAST_MS: f64 = 5.0;
/// Rounds between two verdicts, and how long a wrong verdict asks for more of them: other work on the machine lengthens
/// times, so the shortest of all rounds so far count.
const ROUNDS: usize = 5;
const PATIENCE: Duration = Duration::from_secs(10);

/// The shortest times of a measurement: as told, and around it.
#[derive(Debug, Clone, Copy)]
struct Shortest {
    ms: f64,
    around_ms: f64,
}

/// Compares a batch with one of twice the rays. Returns what is wrong; `None` if nothing is, or if
/// the times are too short to say.
///
/// # Errors
/// The device is lost or hangs, or a clock ran backwards.
pub(crate) fn fault(single: &RayBatch, double: &RayBatch) -> Result<Option<String>, GpuError> {
    let started = Stopwatch::start();
    let mut shortest = [Shortest::NONE; 2];
    let mut worked: Option<f64> = None;
    loop {
        for _ in 0..ROUNDS {
            for (shortest, batch) in shortest.iter_mut().zip([single, double]) {
                let around = Stopwatch::start();
                let elapsed = batch.trace()?.measured()?;
                if let Some(fault) = other_clock(&elapsed) {
                    return Ok(Some(fault));
                }
                let around = around.elapsed();
                if let (true, Some(cpu_ms)) = (batch.gpu().is_software(), elapsed.cpu_ms) {
                    worked = Some(worked.unwrap_or(0.0).max(cpu_ms / around.wall_ms));
                }
                shortest.note(elapsed, around);
            }
        }
        let found = judge(shortest).or_else(|| idle(shortest[1], worked));
        if found.is_none() || started.elapsed().wall_ms > PATIENCE.as_secs_f64() * 1e3 {
            return Ok(found);
        }
    }
}

/// What is wrong with the time of processors, whose greatest share of the time around it is given where they do the work.
fn idle(double: Shortest, worked: Option<f64>) -> Option<String> {
    let worked = worked.filter(|share| *share < LEAST_WORKED && double.around_ms >= LEAST_MS)?;
    Some(format!(
        "the processors are said to work for {worked:.3} of the time in which a software adapter traces"
    ))
}

/// That of the device counts where there is one, and else that on the wall; never that of the processors.
fn other_clock(elapsed: &Elapsed) -> Option<String> {
    let counts = elapsed.gpu_ms.unwrap_or(elapsed.wall_ms);
    let is_other = elapsed.ms().to_bits() != counts.to_bits();
    is_other.then(|| {
        format!(
            "{:.3} ms are reported where {counts:.3} ms count",
            elapsed.ms()
        )
    })
}

impl Shortest {
    const NONE: Self = Self {
        ms: f64::INFINITY,
        around_ms: f64::INFINITY,
    };

    fn note(&mut self, elapsed: Elapsed, around: Elapsed) {
        self.ms = self.ms.min(elapsed.ms());
        self.around_ms = self.around_ms.min(around.wall_ms);
    }
}

/// Judges the shortest times of the rays, and of twice as many.
fn judge([single, double]: [Shortest; 2]) -> Option<String> {
    let [least, most] = TWICE;
    if single.around_ms < LEAST_MS {
        return None;
    }
    let ratio = double.ms / single.ms;
    // Other work can keep twice the rays from ever having the processors to itself: then more time passes on every clock.
    let is_kept_waiting = ratio > most && double.around_ms / single.around_ms > most;
    // NaN is no ratio.
    if !((least..=most).contains(&ratio) || is_kept_waiting) {
        return Some(format!(
            "twice the rays take {ratio:.2} times as long, {:.3} ms and {:.3} ms",
            double.ms, single.ms
        ));
    }
    let claimed = double.ms / double.around_ms;
    if claimed > MOST_CLAIMED || double.ms + SPARE_MS < LEAST_CLAIMED * double.around_ms {
        return Some(format!(
            "{:.3} ms are measured while {:.3} ms pass on the clock around it",
            double.ms, double.around_ms
        ));
    }
    None
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn processors_that_hardly_work_are_told() {
        let double = Shortest {
            ms: 20.0,
            around_ms: 21.0,
        };
        assert!(idle(double, Some(0.04)).is_some());
        assert_eq!(idle(double, Some(0.4)), None);
        assert_eq!(idle(double, None), None);
        let short = Shortest {
            around_ms: 1.0,
            ..double
        };
        assert_eq!(idle(short, Some(0.04)), None);
    }

    #[test]
    fn times_that_do_not_follow_the_work_or_the_clock_are_told() {
        let of = |ms: f64, around_ms: f64| Shortest { ms, around_ms };
        let said = |single, double| judge([single, double]).unwrap_or_default();
        assert_eq!(said(of(10.0, 11.0), of(20.0, 21.5)), "");
        assert_eq!(said(of(10.0, 14.0), of(27.0, 33.0)), "");
        // A busy machine.
        assert_eq!(said(of(6.0, 6.5), of(21.0, 22.0)), "");
        // Too short to say.
        assert_eq!(said(of(0.2, 1.0), of(0.2, 1.0)), "");
        for (single, double, part) in [
            (of(10.0, 10.5), of(11.0, 20.5), "1.10 times"),
            (of(10.0, 10.5), of(40.0, 25.0), "4.00 times"),
            (of(0.0, 10.5), of(0.0, 20.5), "twice the rays"),
            (of(20.0, 10.5), of(40.0, 20.5), "40.000 ms are measured"),
            (of(5.0, 10.5), of(10.0, 20.5), "10.000 ms are measured"),
        ] {
            assert!(said(single, double).contains(part), "{part}");
        }
    }
}
