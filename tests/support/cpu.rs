//! Measures work by its processor time: other processes hardly affect it.

use std::hint::black_box;
use std::time::Instant;

/// Clocks of processor time advance by ticks of some milliseconds: less than this cannot be resolved.
const LEAST: f64 = 0.1;

/// Processor time of this thread in seconds, where the system reports it.
fn of_thread() -> Option<f64> {
    let text = std::fs::read_to_string("/proc/thread-self/schedstat").ok()?;
    let nanoseconds: f64 = text.split_whitespace().next()?.parse().ok()?;
    Some(nanoseconds * 1e-9)
}

/// Seconds of `work` on this thread alone, repeated until measurable, the best of three; by the wall clock where the system does not
/// report processor time.
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
