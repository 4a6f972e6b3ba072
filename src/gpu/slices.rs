//! Work in slices: short dispatches, so that no watchdog triggers and progress is shown.

use super::{Elapsed, Gpu};
use std::cell::Cell;
use std::thread::available_parallelism;

/// Target milliseconds of a slice.
const SLICE_MS: f64 = 250.0;
/// Maximum milliseconds of a slice: some drivers reset the device after two seconds.
pub const MOST_SLICE_MS: f64 = 1000.0;
/// Maximum growth factor from one slice to the next.
const GROWTH: u64 = 8;

/// The number of items (rays, samples of pixels) per slice, learnt from earlier slices.
#[derive(Debug)]
pub struct Slices {
    fitting: Cell<u64>,
    least: u64,
    /// Threads that share the work of a software adapter; `None` on others.
    threads: Option<f64>,
    longest_ms: Cell<f64>,
}

impl Slices {
    /// Begins with `first` items, which should be few: the time of a slice is not yet known.
    pub fn starting_with(first: u64) -> Self {
        Self {
            fitting: Cell::new(first.max(1)),
            least: 1,
            threads: None,
            longest_ms: Cell::new(0.0),
        }
    }

    /// Never hands out fewer than `least` items.
    #[must_use]
    pub fn at_least(mut self, least: u64) -> Self {
        self.least = least.max(1);
        self
    }

    /// Bounds slices by the work of this adapter: on a software adapter the CPU time of the process,
    /// so that a busy machine does not cut them finer.
    #[must_use]
    pub fn on(mut self, gpu: &Gpu) -> Self {
        let threads = available_parallelism().map_or(1, usize::from);
        self.threads = gpu.is_software().then_some(threads as f64);
        self
    }

    /// Milliseconds that a slice would take on an adapter of its own.
    fn work_ms(&self, elapsed: Elapsed) -> f64 {
        let shared = elapsed
            .cpu_ms
            .zip(self.threads)
            .map(|(ms, threads)| ms / threads);
        shared.map_or(elapsed.ms(), |ms| ms.min(elapsed.ms()))
    }

    /// Items per slice.
    pub fn fitting(&self) -> u64 {
        self.fitting.get().max(self.least)
    }

    /// The size of the slice that begins at `first`, up to `end`.
    pub fn next(&self, first: u32, end: u32) -> u32 {
        self.fitting().min(u64::from(end.saturating_sub(first))) as u32
    }

    /// Milliseconds of the longest slice so far.
    pub fn longest_ms(&self) -> f64 {
        self.longest_ms.get()
    }

    /// Learns from a slice of `items`. A short remainder never reduces the size.
    pub fn learn(&self, items: u64, elapsed: Elapsed) {
        let was = self.fitting();
        let ms = self.work_ms(elapsed).max(0.1);
        self.longest_ms.set(self.longest_ms.get().max(ms));
        if 2 * items >= was || ms > SLICE_MS {
            let now = (items as f64 * SLICE_MS / ms) as u64;
            self.fitting.set(now.min(was.saturating_mul(GROWTH)).max(1));
        }
    }
}

/// A warning about a slice of this many milliseconds, if it was too long.
pub fn slow_slice(longest_ms: f64) -> Option<String> {
    (longest_ms > MOST_SLICE_MS).then(|| {
        format!(
            "a dispatch took {longest_ms:.0} ms, which should stay below {MOST_SLICE_MS:.0} ms: its rays cost far more than those before it"
        )
    })
}

#[cfg(test)]
mod tests {
    use super::*;

    fn slices(slices: &Slices, total: u32, ms_per_item: f64) -> Vec<u32> {
        let (mut first, mut out) = (0, Vec::new());
        while first < total {
            let count = slices.next(first, total);
            slices.learn(
                u64::from(count),
                Elapsed {
                    wall_ms: f64::from(count) * ms_per_item,
                    ..Elapsed::default()
                },
            );
            out.push(count);
            first += count;
        }
        out
    }

    #[test]
    fn slices_cover_everything_grow_by_steps_and_end_at_a_quarter_of_a_second() {
        let known = Slices::starting_with(64);
        let first = slices(&known, 100_000, 0.1);
        assert_eq!(first[..4], [64, 512, 2500, 2500]);
        assert_eq!(first.iter().sum::<u32>(), 100_000);
        assert!(first.iter().all(|n| f64::from(*n) * 0.1 <= SLICE_MS));
        // The last remainder did not reduce the size.
        assert_eq!(slices(&known, 2_600, 0.1), [2500, 100]);
        assert_eq!(known.fitting(), 2500);
    }

    #[test]
    fn a_busy_machine_does_not_cut_a_software_adapter_s_slices_finer() {
        let busy = Elapsed {
            wall_ms: 2000.0,
            cpu_ms: Some(400.0),
            ..Elapsed::default()
        };
        let of_hardware = Slices::starting_with(64);
        let of_software = Slices {
            threads: Some(2.0),
            ..Slices::starting_with(64)
        };
        of_hardware.learn(64, busy);
        of_software.learn(64, busy);
        assert_eq!((of_hardware.fitting(), of_software.fitting()), (8, 80));
        assert_eq!(of_software.longest_ms(), 200.0);
    }

    #[test]
    fn a_slice_that_took_too_long_is_followed_by_a_small_one() {
        let slow = Slices::starting_with(64).at_least(8);
        assert_eq!(slices(&slow, 80, 1000.0), [64, 8, 8]);
        assert_eq!(slow.longest_ms(), 64_000.0);
        assert!(slow.longest_ms() > MOST_SLICE_MS);
        let text = slow_slice(slow.longest_ms()).unwrap();
        assert!(text.contains("64000 ms") && text.contains("1000 ms"));
        assert_eq!(slow_slice(MOST_SLICE_MS), None);
    }
}
