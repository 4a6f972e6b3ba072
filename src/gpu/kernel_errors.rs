//! Descriptions of the kernels' error word.

use super::{Gpu, GpuError};

/// Bit for loops that the driver ended early: [`super::Gpu::loop_limit`].
pub(crate) const LOOPS_CUT: u32 = 4;

/// Meaning of the bits of the kernels' error word, as in `kernels/common/errors.wesl`.
pub const KERNEL_ERRORS: [(u32, &str); 5] = [
    (
        1,
        "a traversal took more steps than the structure allows (step fuse)",
    ),
    (2, "a traversal stack overflowed"),
    (LOOPS_CUT, "the driver ended loops before their end"),
    (8, "a queue of rays or paths was too short"),
    (16, "a path was in no queue for shading, or in two"),
];

/// The meanings of the set bits; empty for 0.
pub fn kernel_errors(word: u32) -> Vec<String> {
    let known = KERNEL_ERRORS.iter().filter(|(bit, _)| word & bit != 0);
    let mut texts: Vec<String> = known.map(|(_, text)| (*text).to_owned()).collect();
    let unknown = KERNEL_ERRORS
        .iter()
        .fold(word, |left, (bit, _)| left & !bit);
    if unknown != 0 {
        texts.push(format!("unknown bits {unknown:#x} of the error word"));
    }
    texts
}

impl Gpu {
    /// Fails if kernels raised their error word.
    ///
    /// # Errors
    /// [`GpuError::LoopsCut`] if the driver ended loops, regardless of the consequences;
    /// [`GpuError::Kernels`] for any other bit.
    pub fn check_error_word(&self, word: u32) -> Result<(), GpuError> {
        match self.loop_limit {
            _ if word == 0 => Ok(()),
            Some(limit) if word & LOOPS_CUT != 0 => Err(GpuError::LoopsCut { limit }),
            _ => Err(GpuError::Kernels(kernel_errors(word).join("; "))),
        }
    }
}
