//! Timing by clocks that tick coarsely: batches of at least ten milliseconds, in interleaved rounds.
//!
//! Browsers round timestamps (Chrome: to 65,536 ns or 100 µs), so that a dispatch of a millisecond would be known to a tenth
//! and a short one not at all. A batch of ten milliseconds is known to about one per cent, whatever the step.

use raystone_accel::RayBatch;
use raystone_core::random::Pcg32;
use raystone_gpu::{Elapsed, GpuError};
use raystone_record::{ClassTiming, Interval};
use raystone_stats::rates::{millions_per_second, rate_fault, without_overhead};
use raystone_stats::statistics::median;
use raystone_verify::rays::RaySet;

/// Least milliseconds of a batch.
const BATCH_MS: f64 = 10.0;
/// Most dispatches of a batch.
const MOST_DISPATCHES: u32 = 256;
/// Measurements of a turn, while the clock runs backwards in each.
const TRIES: u32 = 3;
/// Empty measurements, of which the median counts.
const EMPTY: usize = 5;

/// A class of rays through a structure that passed its gate, with its times so far.
pub(crate) struct Timed<'a> {
    /// Place among the structures of the scene.
    pub structure: usize,
    pub set: &'a RaySet,
    pub batch: RayBatch,
    clocked: Clocked,
    answers: Option<[u8; 32]>,
    differed: bool,
}

/// What the clocks told of a batch, round by round.
#[derive(Debug, Default, PartialEq)]
struct Clocked {
    dispatches: u32,
    empty_ms: f64,
    ms: Vec<f64>,
    wall_ms: Vec<f64>,
    discarded: u32,
}

/// Dispatches of a batch, of which one takes `ms`: so many that a whole one lasts long enough.
fn dispatches_for(ms: f64) -> u32 {
    let needed = (BATCH_MS / ms.max(1e-3)).ceil();
    (needed as u32).clamp(1, MOST_DISPATCHES)
}

impl Clocked {
    /// Dispatches of a batch that is long enough, where one of as many as now takes `ms`.
    fn longer(&self, ms: f64) -> u32 {
        let each = without_overhead(&[ms], self.empty_ms)[0] / f64::from(self.dispatches.max(1));
        // At most four times as many: a batch that seems to take nothing says little.
        let most = self.dispatches.saturating_mul(4);
        dispatches_for(each).clamp(self.dispatches, most.min(MOST_DISPATCHES))
    }

    /// Takes the times of a batch; false if the clock ran backwards, or the batch took no longer than an empty one, which is
    /// counted.
    fn take(&mut self, told: Elapsed) -> bool {
        if told.measured().is_err() || told.ms() <= self.empty_ms {
            self.discarded += 1;
            return false;
        }
        let each = |ms: f64| ms / f64::from(self.dispatches.max(1));
        let corrected = without_overhead(&[told.ms()], self.empty_ms);
        self.ms.extend(corrected.into_iter().map(each));
        self.wall_ms.push(each(told.wall_ms));
        true
    }
}

impl<'a> Timed<'a> {
    /// Traces once or twice, to know how many dispatches make a batch.
    pub(crate) async fn new(
        structure: usize,
        set: &'a RaySet,
        batch: RayBatch,
    ) -> Result<Self, GpuError> {
        // The first trace is in slices that grow, the second in those that fit.
        batch.trace_async().await?;
        let ms = batch.trace_async().await?.ms();
        let mut empty = Vec::new();
        for _ in 0..EMPTY {
            empty.extend(
                batch
                    .trace_nothing_async()
                    .await?
                    .measured()
                    .ok()
                    .map(|e| e.ms()),
            );
        }
        let mut clocked = Clocked {
            dispatches: dispatches_for(ms),
            ..Clocked::default()
        };
        clocked.empty_ms = median(&empty).unwrap_or(0.0);
        // What one takes alone holds the way through the browser, which a batch takes once: it may need more.
        for _ in 0..TRIES {
            let whole = batch.trace_times_async(clocked.dispatches).await?;
            let needed = clocked.longer(whole.ms());
            if needed == clocked.dispatches {
                break;
            }
            clocked.dispatches = needed;
        }
        Ok(Self {
            structure,
            set,
            batch,
            clocked,
            answers: None,
            differed: false,
        })
    }

    /// One turn, again where the clock ran backwards.
    pub(crate) async fn turn(&mut self) -> Result<(), GpuError> {
        for _ in 0..TRIES {
            let told = match self.clocked.dispatches {
                1 => self.batch.trace_async().await?,
                times => self.batch.trace_times_async(times).await?,
            };
            if self.clocked.take(told) {
                break;
            }
        }
        let answers = *self.batch.digest_async().await?.as_bytes();
        self.differed |= *self.answers.get_or_insert(answers) != answers;
        Ok(())
    }

    /// What is wrong with the answers of the rounds: they must all be alike.
    pub(crate) fn fault(&self) -> Option<String> {
        self.differed
            .then(|| "dispatches do not repeat: two timed turns answered otherwise".to_owned())
    }

    /// The figures, without counted work; `None` if no time is known.
    pub(crate) fn timing(self) -> Result<Option<ClassTiming>, String> {
        let Clocked {
            dispatches,
            ms,
            wall_ms,
            discarded,
            ..
        } = self.clocked;
        let rays = self.set.rays.len();
        let rate: Option<Interval> = millions_per_second(&ms, rays as f64);
        if let Some(fault) = rate.and_then(|rate| rate_fault(&rate, rays as f64, &ms)) {
            return Err(fault);
        }
        Ok(rate.map(|mrays_s| ClassTiming {
            class: self.set.class,
            rays,
            hit_fraction: self.set.hit_fraction(),
            unlike_shadow: None,
            ms,
            wall_ms,
            cpu_ms: Vec::new(),
            mrays_s,
            counters: None,
            dispatches,
            discarded,
        }))
    }
}

/// A random order of so many, for a round.
pub(crate) fn order(random: &mut Pcg32, count: usize) -> Vec<usize> {
    let mut order: Vec<usize> = (0..count).collect();
    for i in (1..count).rev() {
        order.swap(i, random.below(i + 1));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    /// A clock whose stamps are rounded down to multiples of `step` nanoseconds.
    fn told(begin_ns: u64, ns: u64, step: u64) -> Elapsed {
        let rounded = |at: u64| at / step * step;
        Elapsed {
            gpu_ms: Some((rounded(begin_ns + ns) - rounded(begin_ns)) as f64 * 1e-6),
            wall_ms: ns as f64 * 1e-6 + 1.0,
            ..Elapsed::default()
        }
    }

    #[test]
    fn a_batch_is_known_to_about_a_per_cent_by_rounded_stamps() {
        for step in [1, 65_536, 100_000] {
            for ns in [3_000_u64, 41_234, 777_777, 3_141_592, 25_000_000] {
                let true_ms = ns as f64 * 1e-6;
                let dispatches = dispatches_for(true_ms);
                let mut clocked = Clocked {
                    dispatches,
                    ..Clocked::default()
                };
                for round in 0..9 {
                    let begin = 1_000_000_007 + round * 12_345_678;
                    assert!(clocked.take(told(begin, ns * u64::from(dispatches), step)));
                }
                let batch_ns = (ns * u64::from(dispatches)) as f64;
                let most = step as f64 / batch_ns + 1e-9;
                for ms in &clocked.ms {
                    assert!((ms / true_ms - 1.0).abs() <= most, "{step} {ns}: {ms}");
                }
                if dispatches < MOST_DISPATCHES {
                    assert!(most <= 0.0101, "{step} {ns}");
                }
            }
        }
    }

    #[test]
    fn times_before_zero_are_discarded_and_counted() {
        let mut clocked = Clocked {
            dispatches: 4,
            empty_ms: 2.0,
            ..Clocked::default()
        };
        let backwards = Elapsed {
            backwards: true,
            wall_ms: 12.0,
            ..Elapsed::default()
        };
        assert!(!clocked.take(backwards));
        assert!(clocked.take(told(0, 10_000_000, 1)));
        // No longer than an empty one.
        assert!(!clocked.take(told(0, 1_900_000, 1)));
        assert_eq!(clocked.discarded, 2);
        assert_eq!(clocked.ms, [2.0]);
        assert_eq!(clocked.wall_ms, [2.75]);
        // Without timestamps the wall clock counts.
        assert!(clocked.take(Elapsed {
            wall_ms: 18.0,
            ..Elapsed::default()
        }));
        assert_eq!(clocked.ms, [2.0, 4.0]);
    }

    #[test]
    fn a_batch_lasts_ten_milliseconds_where_it_can() {
        assert_eq!(
            [0.0, 0.01, 0.3, 3.0, 9.9, 10.0, 500.0].map(dispatches_for),
            [256, 256, 34, 4, 2, 1, 1]
        );
    }

    #[test]
    fn a_batch_that_is_too_short_gets_more_dispatches_and_never_fewer() {
        let clocked = |dispatches, empty_ms| Clocked {
            dispatches,
            empty_ms,
            ..Clocked::default()
        };
        assert_eq!(clocked(1, 0.0).longer(5.0), 2);
        assert_eq!(clocked(2, 1.0).longer(5.0), 5);
        assert_eq!(clocked(3, 0.0).longer(30.0), 3);
        // One that takes no longer than an empty one.
        assert_eq!(clocked(2, 5.0).longer(4.0), 8);
        assert_eq!(clocked(200, 5.0).longer(4.0), MOST_DISPATCHES);
    }

    #[test]
    fn a_round_measures_everything_once() {
        let mut random = Pcg32::new(1);
        let mut last = Vec::new();
        for _ in 0..8 {
            let mut now = order(&mut random, 12);
            assert_ne!(now, last);
            last.clone_from(&now);
            now.sort_unstable();
            assert!(now.into_iter().eq(0..12));
        }
    }
}
