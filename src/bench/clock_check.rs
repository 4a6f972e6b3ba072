//! The clocks of a run against each other and against the work: twice the rays must take about twice
//! the time, or as much more as passes on the clock around them, and a measurement must account for most
//! of the time that passed around it, and for no more. Where one is too short to say, many in one submission are not.

use std::time::Duration;

use raystone_accel::RayBatch;
use raystone_gpu::{Elapsed, GpuError, Stopwatch, wait_for};

/// Bounds of the time of twice the rays over that of the rays.
const TWICE: [f64; 2] = [1.5, 2.8];
/// Most that a measurement may claim of the time around it: timestamps have another period.
const MOST_CLAIMED: f64 = 1.05;
/// Least of it that it must claim in some round, after [`SPARE_MS`] for wiping answers and waking up.
const LEAST_CLAIMED: f64 = 0.65;
const SPARE_MS: f64 = 2.0;
/// Least of the time around a measurement that the processors of a software adapter must have worked in some round; on an
/// idle machine it is about their number, and a thread that waits works a few hundredths of it.
const LEAST_WORKED: f64 = 0.1;
/// Milliseconds below which a time says nothing about a clock.
const LEAST_MS: f64 = 5.0;
/// Milliseconds of many traces in one submission: so long that half of them with [`SPARE_MS`] is less than [`LEAST_CLAIMED`].
const MANY_MS: f64 = 20.0;
/// Most traces of one submission.
const MOST_TRACES: u32 = 256;
/// Rounds between two verdicts, and how long a wrong verdict asks for more of them: other work on the machine lengthens
/// times, so the shortest of all rounds so far count.
const ROUNDS: usize = 5;
const PATIENCE: Duration = Duration::from_secs(10);

/// The shortest times of a measurement: as told, around it, and of the processors of a software adapter around it.
#[derive(Debug, Clone, Copy)]
struct Shortest {
    ms: f64,
    around_ms: f64,
    cpu_ms: Option<f64>,
    /// Least and most of the time around it that a round claims.
    claimed: [f64; 2],
    /// The most with [`SPARE_MS`].
    spared: f64,
}

/// Compares a batch with one of twice the rays. Returns what is wrong; `None` if nothing is, or if
/// the times are too short to say.
///
/// # Errors
/// The device is lost or hangs, or a clock ran backwards.
pub(crate) fn fault(single: &RayBatch, double: &RayBatch) -> Result<Option<String>, GpuError> {
    if let Some(fault) = single.gpu().period_fault() {
        return Ok(Some(fault));
    }
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
                let around_cpu_ms = around.cpu_ms.filter(|_| batch.gpu().is_software());
                shortest.note(elapsed.ms(), around.wall_ms, around_cpu_ms);
            }
        }
        // What is too short to say anything is not judged alone.
        let found = if shortest[0].around_ms < LEAST_MS {
            None
        } else {
            judge(shortest).or_else(|| idle(shortest[1], worked))
        };
        if found.is_none() {
            return fault_of_many(single);
        }
        if started.elapsed().wall_ms > PATIENCE.as_secs_f64() * 1e3 {
            return Ok(found);
        }
    }
}

/// Compares the time of many traces in one submission with that around it: what one trace waits for beside its work does not
/// count there. Returns what is wrong; `None` also where as many are still too short.
fn fault_of_many(batch: &RayBatch) -> Result<Option<String>, GpuError> {
    let started = Stopwatch::start();
    let (mut times, mut rounds, mut shortest) = (1, 0, Shortest::NONE);
    loop {
        let around = Stopwatch::start();
        let elapsed = wait_for(batch.trace_times_async(times))?.measured()?;
        let around_ms = around.elapsed().wall_ms;
        if around_ms < MANY_MS {
            if times == MOST_TRACES {
                return Ok(None);
            }
            times *= 2;
            continue;
        }
        shortest.note(elapsed.ms(), around_ms, None);
        rounds += 1;
        let found = shortest.fault_of_span();
        let is_certain = shortest.claimed[1] > MOST_CLAIMED;
        let is_sound = found.is_none() && rounds >= ROUNDS;
        if is_certain || is_sound || started.elapsed().wall_ms > PATIENCE.as_secs_f64() * 1e3 {
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
        cpu_ms: None,
        claimed: [f64::INFINITY, 0.0],
        spared: 0.0,
    };

    fn note(&mut self, ms: f64, around_ms: f64, cpu_ms: Option<f64>) {
        self.ms = self.ms.min(ms);
        self.around_ms = self.around_ms.min(around_ms);
        let shorter = |cpu_ms: f64| self.cpu_ms.map_or(cpu_ms, |before| before.min(cpu_ms));
        self.cpu_ms = cpu_ms.map(shorter);
        let ([least, most], claimed) = (self.claimed, ms / around_ms);
        self.claimed = [least.min(claimed), most.max(claimed)];
        self.spared = self.spared.max((ms + SPARE_MS) / around_ms);
    }

    /// What a measurement, whose passes may overlap, claims of the time around it is too much or too little.
    fn fault(&self) -> Option<String> {
        self.fault_if(self.claimed[0] > MOST_CLAIMED)
    }

    /// From the beginning of a first pass to the end of a last one no more time passes than around them, in any round.
    fn fault_of_span(&self) -> Option<String> {
        self.fault_if(self.claimed[1] > MOST_CLAIMED)
    }

    fn fault_if(&self, is_too_much: bool) -> Option<String> {
        let is_wrong = is_too_much || self.spared < LEAST_CLAIMED;
        is_wrong.then(|| {
            format!(
                "{:.3} ms are measured while {:.3} ms pass on the clock around it",
                self.ms, self.around_ms
            )
        })
    }
}

/// Judges the shortest times of the rays, and of twice as many.
fn judge([single, double]: [Shortest; 2]) -> Option<String> {
    let ratio = double.ms / single.ms;
    // NaN is no ratio.
    if !(is_twice(ratio) || is_kept_waiting(ratio, single, double)) {
        return Some(format!(
            "twice the rays take {ratio:.2} times as long, {:.3} ms and {:.3} ms",
            double.ms, single.ms
        ));
    }
    [double, single].iter().find_map(Shortest::fault)
}

fn is_twice(ratio: f64) -> bool {
    let [least, most] = TWICE;
    (least..=most).contains(&ratio)
}

/// Other work can keep one batch or the other from ever having the processors to itself. Then those of a software adapter
/// still work twice as long for twice the rays, of which nothing is spared what it must claim, or more time passes on the
/// clock around it, too.
fn is_kept_waiting(ratio: f64, single: Shortest, double: Shortest) -> bool {
    let around = double.around_ms / single.around_ms;
    let worked = double.cpu_ms.zip(single.cpu_ms);
    let works_twice = worked.is_some_and(|(double, single)| is_twice(double / single))
        && double.claimed[1] >= LEAST_CLAIMED;
    ratio.is_finite() && (works_twice || ratio > TWICE[1] && around > TWICE[1])
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Two rounds with a time, the one around it, and that of the processors.
    fn of(ms: f64, around_ms: f64, cpu_ms: f64) -> Shortest {
        let mut all = Shortest::NONE;
        all.note(1.5 * ms, 1.5 * around_ms, Some(1.1 * cpu_ms));
        all.note(ms, around_ms, Some(cpu_ms));
        all
    }

    #[test]
    fn processors_that_hardly_work_are_told() {
        let double = of(20.0, 21.0, 20.0);
        assert!(idle(double, Some(0.04)).is_some());
        assert_eq!(idle(double, Some(0.4)), None);
        assert_eq!(idle(double, None), None);
        assert_eq!(idle(of(0.5, 1.0, 1.0), Some(0.04)), None);
    }

    #[test]
    fn times_that_do_not_follow_the_work_or_the_clock_are_told() {
        let said = |single, double| judge([single, double]).unwrap_or_default();
        assert_eq!(said(of(10.0, 11.0, 18.0), of(20.0, 21.5, 37.0)), "");
        assert_eq!(said(of(10.0, 14.0, 18.0), of(27.0, 33.0, 37.0)), "");
        // Busy machines.
        assert_eq!(said(of(6.0, 6.5, 11.0), of(21.0, 22.0, 60.0)), "");
        assert_eq!(said(of(15.0, 16.0, 11.0), of(21.0, 22.0, 22.0)), "");
        assert_eq!(said(of(6.0, 6.5, 11.0), of(21.0, 22.0, 22.0)), "");
        for (single, double, part) in [
            (of(10.0, 10.5, 18.0), of(11.0, 20.5, 36.0), "1.10 times"),
            // Short ones, of which the second is given the time of the first.
            (of(5.0, 5.5, 9.0), of(5.0, 10.5, 18.0), "1.00 times"),
            (of(10.0, 10.5, 18.0), of(11.0, 11.5, 20.0), "1.10 times"),
            (of(10.0, 10.5, 18.0), of(40.0, 25.0, 36.0), "40.000 ms are"),
            (of(0.0, 10.5, 18.0), of(0.0, 20.5, 36.0), "twice the rays"),
            (
                of(20.0, 10.5, 18.0),
                of(40.0, 20.5, 36.0),
                "40.000 ms are measured",
            ),
            (
                of(5.0, 10.5, 18.0),
                of(10.0, 20.5, 36.0),
                "10.000 ms are measured",
            ),
        ] {
            assert!(said(single, double).contains(part), "{part}");
        }
    }

    #[test]
    fn many_traces_that_claim_twice_or_half_the_time_are_told() {
        let many = |ms| {
            let mut many = Shortest::NONE;
            many.note(ms, 2.5 * MANY_MS, None);
            many.note(ms, MANY_MS, None);
            many.fault_of_span()
        };
        assert_eq!(many(0.95 * MANY_MS), None);
        assert!(many(2.0 * 0.95 * MANY_MS).is_some() && many(0.5 * MANY_MS).is_some());
    }

    #[test]
    fn one_round_that_waited_says_nothing_of_what_a_measurement_claims() {
        let mut double = of(20.0, 21.0, 37.0);
        double.note(19.0, 60.0, Some(36.0));
        assert_eq!(judge([of(10.0, 11.0, 18.0), double]), None);
    }
}
