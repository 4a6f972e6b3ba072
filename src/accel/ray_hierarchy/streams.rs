//! What the device counts of the streams of a descent.

use super::RayHierarchy;
use super::layout::LEVELS;
use crate::Ray;
use crate::tracer::{RayBuffers, Tracer};
use raystone_gpu::{Gpu, GpuError, Recording, Storage};

/// The streams of a level, counted by the device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StreamCounts {
    /// Pairs of a node and a primitive that met, of all batches of primitives.
    pub pairs: u32,
    /// Pairs of the longest stream.
    pub longest: u32,
    /// Pairs whose children had no room, which were answered at once.
    pub walked: u32,
}

impl RayHierarchy {
    /// Traces `rays` once, through one tree, and returns what the device counted of each level,
    /// leaves first; levels above the tree have zeros. `tracer` is that of a structure of this kind.
    ///
    /// # Errors
    /// The device is lost, hangs or has no room, or the structure is of another kind.
    pub fn streams(
        gpu: &Gpu,
        tracer: &Tracer,
        rays: &[Ray],
    ) -> Result<Vec<StreamCounts>, GpuError> {
        let words = trace_state(gpu, tracer, rays, LEVELS)?;
        let levels = words.as_chunks::<4>().0.iter().take(LEVELS as usize);
        let counts = levels.map(|[_, pairs, longest, walked]| StreamCounts {
            pairs: *pairs,
            longest: *longest,
            walked: *walked,
        });
        Ok(counts.collect())
    }
}

/// Traces `rays` once and returns the four words that the passes of a structure leave for each level: see `kernels/accel/found.wesl`.
pub(crate) fn trace_state(
    gpu: &Gpu,
    tracer: &Tracer,
    rays: &[Ray],
    levels: u32,
) -> Result<Vec<u32>, GpuError> {
    let buffers = RayBuffers {
        rays: Storage::Own(gpu.storage("rays", rays)?),
        answers: Storage::Own(gpu.zeroed("answers", 16 * rays.len() as u64)?),
        status: Storage::Own(gpu.zeroed("status", 64)?),
    };
    let mut recording = Recording::new();
    tracer.record(&mut recording, &buffers, 0..rays.len() as u32)?;
    let state = Storage::scratch("trace state", 16 * u64::from(levels));
    recording.download("state", state);
    gpu.play(&recording)?.download("state")
}
