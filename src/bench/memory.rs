//! How much host memory a piece of work needs at most.

use peak_alloc::PeakAlloc;

/// Runs `work`; also returns the most bytes that were allocated above what was allocated before, on
/// all threads. Absent if the program was not started with `PeakAlloc` as its global allocator.
pub fn peak_bytes<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    let before = PeakAlloc.current_usage();
    PeakAlloc.reset_peak_usage();
    let result = work();
    let peak = PeakAlloc.peak_usage().saturating_sub(before);
    (result, (before > 0).then_some(peak as u64))
}
