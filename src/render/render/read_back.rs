//! What a renderer has so far, read back and checked.

use super::Renderer;
use raystone_core::structure::RAY_COUNT_CLASSES;
use raystone_gpu::{GpuError, Recording, wait_for};
use raystone_image::Image;

impl Renderer<'_> {
    /// The mean so far.
    ///
    /// # Errors
    /// A kernel raised its error word, a pixel lacks samples, or the device is lost or hangs.
    pub fn image(&self) -> Result<Image, GpuError> {
        wait_for(self.image_async())
    }

    /// See [`Renderer::image`].
    ///
    /// # Errors
    /// As [`Renderer::image`].
    pub async fn image_async(&self) -> Result<Image, GpuError> {
        let earlier = self.blocks.borrow().clone();
        let totals = self.with_pending(earlier).await?;
        let count = f64::from(self.done.get());
        let mean = |total: &[f64; 3]| total.map(|sum| (sum / count) as f32);
        Ok(Image {
            width: self.size[0],
            height: self.size[1],
            pixels: totals.iter().map(mean).collect(),
        })
    }

    /// Checks everything since the last reset.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn check(&self) -> Result<(), GpuError> {
        wait_for(self.with_pending(Vec::new())).map(|_| ())
    }

    /// The sums of earlier blocks with those on the device, if these are valid.
    pub(super) async fn with_pending(
        &self,
        mut totals: Vec<[f64; 3]>,
    ) -> Result<Vec<[f64; 3]>, GpuError> {
        let mut recording = Recording::new();
        recording.download("status", &self.status);
        for (index, band) in self.bands.iter().enumerate() {
            recording.download(&index.to_string(), &band.sums);
        }
        let played = self.player.play_async(&recording).await?;
        let status: Vec<u32> = played.download("status")?;
        self.gpu.check_error_word(status[0])?;
        let [width, height] = self.size.map(|edge| edge as usize);
        totals.resize(width * height, [0.0; 3]);
        let wanted = self.pending.get();
        let (mut wrong, mut first) = (0, None);
        for (index, band) in self.bands.iter().enumerate() {
            let sums: Vec<[f32; 4]> = played.download(&index.to_string())?;
            let [start, end] = [band.rows.start, band.rows.end].map(|row| row as usize * width);
            let pixels = totals[start..end].iter_mut().zip(&sums);
            for (pixel, (total, [r, g, b, taken])) in (start..).zip(pixels) {
                let blocks = self.chosen.as_ref();
                let is_off = blocks.is_some_and(|blocks| !blocks.has(pixel, width));
                let wanted = if is_off { 0 } else { wanted };
                // Exact: a block has far fewer samples than 2²⁴.
                if *taken != wanted as f32 {
                    wrong += 1;
                    first.get_or_insert((pixel, *taken));
                }
                for (total, sum) in total.iter_mut().zip([r, g, b]) {
                    *total += f64::from(*sum);
                }
            }
        }
        match first {
            None => Ok(totals),
            Some((pixel, taken)) => Err(GpuError::Samples {
                wrong,
                wanted,
                x: (pixel % width) as u32,
                y: (pixel / width) as u32,
                taken,
            }),
        }
    }

    /// The error word of the kernels since the last reset.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn error_word(&self) -> Result<u32, GpuError> {
        Ok(self.gpu.read::<u32>(&self.status)?[0])
    }

    /// Rays per class since the last reset, in the order of [`CountedRays`](crate::CountedRays);
    /// zeros unless the kernel was compiled to count.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn ray_counts(&self) -> Result<[u64; RAY_COUNT_CLASSES.len()], GpuError> {
        wait_for(self.ray_counts_async())
    }

    /// See [`Renderer::ray_counts`].
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub async fn ray_counts_async(&self) -> Result<[u64; RAY_COUNT_CLASSES.len()], GpuError> {
        let totals = self.totals().await?;
        Ok(std::array::from_fn(|class| totals[class]))
    }

    /// Paths alive at the camera, after one bounce, after two, …, since the last reset; empty
    /// unless the kernel was compiled to count.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn live_paths(&self) -> Result<Vec<u64>, GpuError> {
        let mut live = wait_for(self.totals())?.split_off(RAY_COUNT_CLASSES.len());
        let last = live.iter().rposition(|paths| *paths > 0);
        live.truncate(last.map_or(0, |last| last + 1));
        Ok(live)
    }

    /// The kernels' counters after the error word.
    async fn totals(&self) -> Result<Vec<u64>, GpuError> {
        self.with_pending(Vec::new()).await?;
        let words: Vec<u32> = self.gpu.read_async(&self.status).await?;
        let pairs = words[1..].as_chunks::<2>().0.iter();
        let total = |[low, high]: &[u32; 2]| u64::from(*low) | u64::from(*high) << 32;
        Ok(pairs.map(total).collect())
    }
}
