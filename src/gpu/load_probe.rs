//! The faster load path of arrays on an adapter: storage buffers, or texels of textures.
//!
//! On Mesa's software driver a `vec4` of a storage buffer costs two to five times as much as a
//! texel (docs/performance.md); hardware with caches for buffers may well lose by textures.

use super::compose::Composition;
use super::{Bindings, Gpu, GpuError, Recording, Storage, groups_for, wait_for};

/// Elements of the probed array: 4 MiB, beyond the first caches and a whole number of rows.
const ELEMENTS: u32 = 1 << 18;
/// Invocations.
const COUNT: u32 = 1 << 14;
/// Alternating rounds, of which the fastest counts.
const ROUNDS: usize = 3;
/// Minimum speed-up of textures to be chosen: less may be chance, and they cost memory.
const MARGIN: f64 = 1.1;

impl Gpu {
    /// True if kernels read nodes and triangles faster as texels than from storage buffers: on software adapters, and
    /// on others by a short measurement, once per device.
    ///
    /// # Errors
    /// The kernels do not run.
    pub fn reads_texels_faster(&self) -> Result<bool, GpuError> {
        if self.is_software() {
            return Ok(true);
        }
        if let Some(known) = self.texels_faster.get() {
            return Ok(*known);
        }
        let measured = wait_for(measure(self))?;
        Ok(*self.texels_faster.get_or_init(|| measured))
    }
}

pub(super) async fn measure(gpu: &Gpu) -> Result<bool, GpuError> {
    let mut state = 1_u32;
    let mut next = || {
        state = state.wrapping_mul(747_796_405).wrapping_add(2_891_336_453);
        (state >> 7) % ELEMENTS
    };
    let words: Vec<[u32; 4]> = (0..ELEMENTS).map(|_| [next(), next(), 0, next()]).collect();
    let mut bindings = Bindings::new();
    bindings
        .buffer("words", &gpu.storage("words", &words)?)
        .buffer("sums", Storage::scratch("sums", u64::from(COUNT) * 4));
    let recorded = |texels| {
        let kernel = Composition::new("common/load_probe").feature("texels", texels);
        let mut recording = Recording::new();
        let groups = groups_for(COUNT);
        recording.run("loads", &gpu.pipeline(&kernel, false)?, &bindings, groups);
        Ok::<_, GpuError>(recording)
    };
    let recordings = [recorded(false)?, recorded(true)?];
    let mut fastest = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        for (recording, fastest) in recordings.iter().zip(&mut fastest) {
            *fastest = fastest.min(gpu.play_async(recording).await?.elapsed().ms());
        }
    }
    let [buffer, texture] = fastest;
    Ok(buffer > MARGIN * texture)
}
