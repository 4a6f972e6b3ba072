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

/// Takes a MiB on top of another.
///
/// # Errors
/// Another peak is measured, where one is.
pub(crate) fn check() -> Result<(), String> {
    const TAKEN: usize = 1 << 20;
    let take = || std::hint::black_box(vec![1_u8; TAKEN]);
    let held = take();
    let (_, peak) = peak_bytes(|| take().len());
    drop(held);
    let is_taken = |peak: u64| (TAKEN as u64..2 * TAKEN as u64).contains(&peak);
    peak.is_none_or(is_taken).then_some(()).ok_or_else(|| {
        format!(
            "a MiB has a peak of {peak:?} bytes: this program shows wrong figures; build it anew, and report what stays wrong"
        )
    })
}
