//! The timing protocol: warm-up until the rate is stable, then interleaved rounds in random order,
//! so that machine drift affects all measurements alike.

use raystone_config::Timing;
use raystone_core::random::Pcg32;
use raystone_gpu::{Elapsed, Gpu, GpuError, Stopwatch};
use raystone_record::figure::Figure;
use raystone_record::{Reading, Samples as Rounds};
use raystone_stats::statistics::median_interval;
use std::cell::{Cell, OnceCell};
use std::time::Instant;

/// Two warm-up runs within this relative difference are stable.
const STABLE: f64 = 0.05;

/// A repeatable measurement.
pub trait Measured {
    /// Measures once.
    ///
    /// # Errors
    /// It failed; it is not measured again.
    fn measure(&self) -> Result<Elapsed, GpuError>;

    /// The device whose kernel compilations alternate by round: see [`Gpu::compiled_apart`].
    fn device(&self) -> Option<&Gpu> {
        None
    }
}

impl<M: Measured + ?Sized> Measured for &M {
    fn measure(&self) -> Result<Elapsed, GpuError> {
        (**self).measure()
    }

    fn device(&self) -> Option<&Gpu> {
        (**self).device()
    }
}

/// Answers of a measurement in every turn, which must agree for its time to be valid.
#[derive(Debug, Default)]
pub(crate) struct Watch {
    first: OnceCell<blake3::Hash>,
    turns: Cell<u32>,
    differed: OnceCell<u32>,
}

impl Watch {
    /// Records the hash of one turn's answers.
    pub(crate) fn note(&self, answers: blake3::Hash) {
        self.turns.set(self.turns.get() + 1);
        if *self.first.get_or_init(|| answers) != answers {
            self.differed.get_or_init(|| self.turns.get());
        }
    }

    /// Describes the first turn that differed from the very first.
    pub(crate) fn fault(&self) -> Option<String> {
        let turn = self.differed.get()?;
        Some(format!(
            "dispatches do not repeat: timed turn {turn} of {} answered otherwise than the first",
            self.turns.get()
        ))
    }

    /// True if two turns with other answers than the first pass unseen.
    pub(crate) fn is_blind() -> bool {
        let watch = Self::default();
        for answers in [b"a", b"b", b"a"] {
            watch.note(blake3::hash(answers));
        }
        watch.fault().is_none()
    }
}

/// Samples of one measurement.
#[derive(Debug, Clone, Default)]
pub struct Samples {
    /// Milliseconds on the GPU clock (wall clock if there is none).
    pub ms: Vec<f64>,
    /// Milliseconds on the wall clock.
    pub wall_ms: Vec<f64>,
    /// Milliseconds of all processors, if counted.
    pub cpu_ms: Vec<f64>,
}

impl Samples {
    /// Nanoseconds per item: the median of the rounds with its interval, and the rounds.
    ///
    /// # Errors
    /// Nothing was timed.
    pub fn ns_per_item(&self, figure: &'static Figure, items: f64) -> Result<Reading, String> {
        let each = |ms: &[f64]| ms.iter().map(|ms| ms * 1e6 / items).collect();
        let rounds: Vec<f64> = each(&self.ms);
        let median = median_interval(&rounds).ok_or("nothing was timed")?;
        Ok(Reading::new(figure, median).with_samples(Rounds::Rounds {
            adapter: rounds,
            wall: each(&self.wall_ms),
            processors: Vec::new(),
        }))
    }
}

/// Measures everything `rounds` times in rounds of random order; failures keep their error.
///
/// # Errors
/// The device is lost: the index of the measurement, and the error; others are unmeasured.
pub(crate) fn interleave<M: Measured>(
    measured: &[M],
    timing: &Timing,
    seed: u64,
    mut tick: impl FnMut(),
) -> Result<Vec<Result<Samples, GpuError>>, (usize, GpuError)> {
    let mut results: Vec<Result<Samples, GpuError>> = Vec::with_capacity(measured.len());
    for (index, item) in measured.iter().enumerate() {
        tick();
        match warm_up(item, timing) {
            Err(error @ GpuError::Lost(_)) => return Err((index, error)),
            outcome => results.push(outcome.map(|()| Samples::default())),
        }
    }
    let mut random = Pcg32::new(seed);
    let mut order: Vec<usize> = (0..measured.len()).collect();
    for round in 0..timing.rounds as usize {
        for i in (1..order.len()).rev() {
            order.swap(i, random.below(i + 1));
        }
        for &index in &order {
            let Ok(samples) = &mut results[index] else {
                continue;
            };
            take_turn(&measured[index], round);
            match turn(&measured[index]) {
                Ok(elapsed) => {
                    samples.ms.push(elapsed.ms());
                    samples.wall_ms.push(elapsed.wall_ms);
                    samples.cpu_ms.extend(elapsed.cpu_ms);
                }
                Err(error @ GpuError::Lost(_)) => return Err((index, error)),
                Err(error) => results[index] = Err(error),
            }
            tick();
        }
    }
    measured.iter().for_each(|item| take_turn(item, 0));
    Ok(results)
}

fn take_turn(measured: &impl Measured, round: usize) {
    if let Some(gpu) = measured.device() {
        gpu.take_turn(round);
    }
}

/// Attempts at a turn in which a clock runs backwards.
const TRIES: usize = 3;

/// One turn, repeated if a clock ran backwards or claims more time than passed, as a round must not
/// mix clocks.
fn turn(measured: &impl Measured) -> Result<Elapsed, GpuError> {
    let mut last = Err(GpuError::Clock);
    for _ in 0..TRIES {
        let around = Stopwatch::start();
        let told = measured.measure();
        let around = around.elapsed();
        last = told.and_then(|told| told.measured()?.within(&around));
        if !matches!(last, Err(GpuError::Clock)) {
            break;
        }
    }
    last
}

/// Runs until two consecutive runs agree, for at least `min_warmup_ms` and at most `max_warmup_ms`.
/// The first run does not count: it includes the driver's compiler.
fn warm_up(measured: &impl Measured, timing: &Timing) -> Result<(), GpuError> {
    // Make each compilation before it is timed.
    for compilation in (0..measured.device().map_or(1, Gpu::compilations)).rev() {
        take_turn(measured, compilation);
        measured.measure()?;
    }
    let start = Instant::now();
    let mut last = turn(measured)?.ms();
    loop {
        let spent_ms = start.elapsed().as_secs_f64() * 1e3;
        let now = turn(measured)?.ms();
        let stable = (now - last).abs() <= STABLE * now.max(last);
        if (stable && spent_ms >= f64::from(timing.min_warmup_ms))
            || spent_ms >= f64::from(timing.max_warmup_ms)
        {
            return Ok(());
        }
        last = now;
    }
}

/// Times of nine dispatches of nothing, ms: what a measurement costs by itself is their median.
///
/// # Errors
/// The device is lost or hangs, or a clock ran backwards.
pub(crate) fn empty_rounds(
    mut measure: impl FnMut() -> Result<Elapsed, GpuError>,
) -> Result<Vec<f64>, GpuError> {
    let rounds = (0..9).map(|_| measure().and_then(Elapsed::measured).map(|e| e.ms()));
    rounds.collect()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn turns_that_answer_otherwise_are_told_with_their_number() {
        assert!(!Watch::is_blind());
        let watch = Watch::default();
        [b"a", b"a", b"b"]
            .iter()
            .for_each(|answers| watch.note(blake3::hash(*answers)));
        assert!(watch.fault().is_some_and(|fault| fault.contains("turn 3")));
    }
}
