//! Work by the processor time that it takes: what else runs on the machine hardly adds to it.

use std::hint::black_box;
use std::time::Instant;

/// Clocks of processor time go on by ticks of some milliseconds: less than this is not told from nothing.
const LEAST: f64 = 0.1;

/// Processor time of this thread in seconds, where the system tells it.
fn of_thread() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

/// Seconds that `work` takes on this thread alone, repeated as often as it takes to measure it, at best of three; by the clock on the
/// wall where the system does not tell processor time.
pub fn seconds<T>(work: impl Fn() -> T) -> f64 {
    let several = |times: u32| {
        let (clock, before) = (Instant::now(), of_thread());
        for _ in 0..times {
            black_box(work());
        }
        let booked = before
            .zip(of_thread())
            .map(|(before, after)| after - before);
        booked.unwrap_or_else(|| clock.elapsed().as_secs_f64())
    };
    let powers = (0..).map(|power| 1_u32 << power);
    let enough = powers.take(20).find(|times| several(*times) >= LEAST);
    let times = enough.unwrap_or(1 << 20);
    let each = [(); 3].map(|()| several(times) / f64::from(times));
    each.into_iter().fold(f64::INFINITY, f64::min)
}
