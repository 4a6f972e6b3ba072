//! Peak host memory of a piece of work.

use peak_alloc::PeakAlloc;

/// Runs `work`; also returns the peak of additionally allocated bytes, over all threads. Absent if
/// `PeakAlloc` is not the global allocator.
pub fn peak_bytes<T>(work: impl FnOnce() -> T) -> (T, Option<u64>) {
    let before = PeakAlloc.current_usage();
    PeakAlloc.reset_peak_usage();
    let result = work();
    let peak = PeakAlloc.peak_usage().saturating_sub(before);
    (result, (before > 0).then_some(peak as u64))
}
