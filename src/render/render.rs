//! The renderer: plays the passes of an integrator in slices of about a quarter of a second and
//! stores the sum at every power of two of samples, so that one run gives the error at spp = 1, 2,
//! 4, ….
//!
//! Every returned image was checked: no kernel raised its error word, and every pixel took exactly
//! the requested samples.

mod read_back;

use super::blocks::Blocks;
use super::kind::ConfiguredIntegrator;
use super::offset::RayOffset;
use super::passes::{ImageSteps, Passes};
use super::slice::{Slice, job_uniform, lens};
use super::tables::SceneBuffers;
use super::visibility::Visibility;
use raystone_accel::Traced;
use raystone_core::geometry::Camera;
use raystone_core::text::cell_hash;
use raystone_gpu::{
    Composition, Elapsed, Gpu, GpuError, Player, Recording, Slices, UniformValues, wait_for,
};
use raystone_image::Image;
use raystone_sampling::Sampler;
use std::cell::{Cell, RefCell};
use std::collections::BTreeMap;
use std::ops::Range;

/// Samples of the first slice: few, as each may be a path through brute force.
const FIRST_SLICE: u64 = 512;
/// Bytes of the error word and the counters after it, see `kernels/common/ray_counts.wesl`.
const STATUS_BYTES: u64 = 256;
/// Maximum bytes of a buffer between passes, below the adapter's limit.
const SCRATCH_BYTES: u64 = 1 << 28;

/// Samples of a pixel that are summed in f32 on the device before the host adds the sum in f64.
/// Blocks begin at multiples of it, so that an image does not depend on slices.
pub const BLOCK_SAMPLES: u32 = 256;

/// Bound on the effect of rounding alone on a pixel of an image of `spp` samples, relative to the
/// mean of the samples' magnitudes: one rounding per addition within a block, and one of the mean
/// to f32 (N. Higham, "Accuracy and Stability of Numerical Algorithms", 2nd ed., 2002, section
/// 4.2). The f64 part is below a millionth of it.
pub fn rounding_bound(spp: u32) -> f64 {
    let roundings = f64::from(spp.min(BLOCK_SAMPLES));
    roundings * 0.5 * f64::from(f32::EPSILON) * (1.0 + 1e-6)
}

/// One image to render.
#[derive(Clone, Copy)]
pub struct RenderJob<'a> {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// The camera.
    pub camera: Camera,
    /// The source of random numbers.
    pub sampler: &'a Sampler,
    /// The integrator.
    pub integrator: &'a ConfiguredIntegrator,
    /// Origins of rays that leave a surface.
    pub offset: RayOffset,
    /// Enables the driver's runtime checks.
    pub runtime_checks: bool,
}

/// The image after some number of samples.
#[derive(Debug, Clone)]
pub struct Snapshot {
    /// Samples per pixel.
    pub spp: u32,
    /// Mean radiance.
    pub image: Image,
}

/// Rows whose sums fit into one buffer.
struct Band {
    rows: Range<u32>,
    /// Sum of radiance and number of samples, per pixel.
    sums: wgpu::Buffer,
}

/// A compiled job for one scene and structure.
// Many fields: one for each buffer and pass that lives as long as the job.
pub struct Renderer<'a> {
    gpu: &'a Gpu,
    player: Player,
    size: [u32; 2],
    integrator: ConfiguredIntegrator,
    uniform: UniformValues,
    passes: Passes,
    bands: Vec<Band>,
    /// The listed blocks, if only some take samples.
    chosen: Option<Blocks>,
    status: wgpu::Buffer,
    /// Samples per pixel since the last reset.
    done: Cell<u32>,
    /// Samples of these in the sums on the device.
    pending: Cell<u32>,
    /// The sums of earlier blocks; empty if there were none.
    blocks: RefCell<Vec<[f64; 3]>>,
    slices: Slices,
    /// Capacity of the buffers between passes, in samples.
    most: u64,
    /// Greatest samples of a slice that takes no longer than asked, see [`Renderer::in_slices_of`].
    short: Cell<u64>,
    short_ms: Option<f64>,
    /// GPU milliseconds of each stage since the last reset.
    stages: RefCell<BTreeMap<String, f64>>,
    /// Time of all slices since the last reset.
    spent: Cell<Elapsed>,
}

/// Buffers for the sums of an image, each with as many rows as the adapter can bind.
fn bands(gpu: &Gpu, [width, height]: [u32; 2]) -> Result<Vec<Band>, GpuError> {
    let row_bytes = u64::from(width) * 16;
    // Slices are multiples of eight rows, the height of a workgroup.
    let fitting = gpu.limits.max_storage_buffer_binding_size / row_bytes.max(1) / 8 * 8;
    let rows = fitting.clamp(8, 1 << 31) as usize;
    (0..height)
        .step_by(rows)
        .map(|start| {
            let rows = start..height.min(start + rows as u32);
            let bytes = u64::from(rows.end - rows.start) * row_bytes;
            let sums = gpu.zeroed("accumulation", bytes)?;
            Ok(Band { rows, sums })
        })
        .collect()
}

/// Adds a sampler to a kernel that draws; its words are bound as `sampler_table`.
#[must_use]
pub fn with_sampler(mut composition: Composition, sampler: &Sampler) -> Composition {
    for (name, value) in sampler.constants() {
        composition = composition.constant(name, value);
    }
    let [sequence, decorrelation] = sampler.kernels();
    composition
        .with("sequence", &sequence)
        .with("decorrelation", &decorrelation)
}

/// Number of samples that fit into an integrator's buffers between passes.
fn most_samples(gpu: &Gpu, integrator: &ConfiguredIntegrator) -> u64 {
    let scratch = integrator.kind.scratch().iter();
    let limit = gpu
        .limits
        .max_storage_buffer_binding_size
        .min(SCRATCH_BYTES);
    let fitting = scratch.map(|(_, bytes)| limit / (*bytes).max(1));
    let organised = integrator.organisation.samples_at_once(limit);
    fitting.chain([organised]).min().unwrap_or(u64::MAX)
}

impl<'a> Renderer<'a> {
    /// Compiles the job's kernels and allocates its buffers.
    ///
    /// # Errors
    /// A kernel does not compose or compile, the integrator needs another kind of structure, or the
    /// scene or one row of the image is too large for a buffer.
    pub fn new(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
        ray_counts: bool,
    ) -> Result<Self, GpuError> {
        Self::compiled(gpu, scene, traced, job, [ray_counts, false])
    }

    /// The same with a kernel that samples only listed blocks, see [`Renderer::only`]; initially
    /// all.
    ///
    /// # Errors
    /// As for [`Renderer::new`], or the integrator has its own passes, or the sums do not fit into
    /// one buffer.
    pub fn by_blocks(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
    ) -> Result<Self, GpuError> {
        Self::compiled(gpu, scene, traced, job, [false, true])
    }

    fn compiled(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
        [ray_counts, by_blocks]: [bool; 2],
    ) -> Result<Self, GpuError> {
        let refusal = job.integrator.refusal(traced);
        if let Some(reason) = refusal.or_else(|| scene.mirrors.refusal(job.integrator)) {
            return Err(GpuError::Kernel(reason));
        }
        let status = gpu.zeroed("status", STATUS_BYTES)?;
        let renderer = Self {
            gpu,
            player: Player::new(gpu),
            size: job.size,
            integrator: job.integrator.clone(),
            uniform: job_uniform(job, scene),
            passes: Passes::new(gpu, scene, traced, job, &status, [ray_counts, by_blocks])?,
            bands: bands(gpu, job.size)?,
            chosen: if by_blocks {
                Some(Blocks::all(gpu, job.size)?)
            } else {
                None
            },
            status,
            done: Cell::new(0),
            pending: Cell::new(0),
            blocks: RefCell::default(),
            slices: Slices::starting_with(FIRST_SLICE).on(gpu),
            most: most_samples(gpu, job.integrator),
            short: Cell::new(u64::MAX),
            short_ms: None,
            stages: RefCell::default(),
            spent: Cell::default(),
        };
        let own_passes =
            job.integrator.kind.kernel().is_empty() || !job.integrator.organisation.takes_any();
        if by_blocks && (own_passes || renderer.bands.len() > 1) {
            return Err(GpuError::Kernel(format!(
                "`{}` at {:?} pixels cannot take samples by blocks: that needs an integrator of one kernel and sums in one buffer",
                job.integrator.kind.name(),
                job.size
            )));
        }
        if let Some(band) = renderer.bands.first() {
            renderer.record(&mut Recording::new(), band, &Slice::default())?;
        }
        Ok(renderer)
    }

    /// Shortens slices to about `ms` milliseconds, for a host that wants to do something between them.
    #[must_use]
    pub fn in_slices_of(mut self, ms: f64) -> Self {
        self.short_ms = Some(ms);
        self
    }

    /// Changes the camera for subsequent samples.
    ///
    /// # Errors
    /// As [`Renderer::reset`], which discards earlier samples.
    pub fn look(&mut self, camera: Camera) -> Result<(), GpuError> {
        wait_for(self.look_async(camera))
    }

    /// The same as a future, as are all that end in `_async`: see [`Player::play_async`].
    ///
    /// # Errors
    /// As [`Renderer::look`].
    pub async fn look_async(&mut self, camera: Camera) -> Result<(), GpuError> {
        self.uniform = lens(self.uniform.clone(), camera, self.size);
        if let Some(visibility) = self.visibility() {
            visibility.draw(camera)?;
        }
        self.reset_async().await
    }

    /// The rasterised visibility, if paths begin there.
    pub fn visibility(&self) -> Option<&Visibility> {
        self.passes.visibility.as_ref()
    }

    /// Feature flags of the kernels.
    pub fn features(&self) -> Vec<String> {
        self.passes.features()
    }

    /// Features that other scenes need but these kernels omit; empty if nothing is traced.
    pub fn left_out(&self) -> Vec<String> {
        self.passes.left_out()
    }

    /// Texts of the composed kernels.
    pub fn kernel_text(&self) -> String {
        let texts = self.passes.texts();
        let texts: Vec<String> = texts.into_iter().map(|(_, text)| text).collect();
        texts.join("\n")
    }

    /// BLAKE3 of the text of the only kernel, or of the names and texts of all passes.
    pub fn kernel_hash(&self) -> String {
        let texts = self.passes.texts();
        match &texts[..] {
            [(_, only)] => blake3::hash(only.as_bytes()).to_hex().to_string(),
            all => {
                let parts: Vec<_> = all.iter().map(|(p, t)| (p.as_str(), t.as_str())).collect();
                cell_hash(&parts)
            }
        }
    }

    /// Clears the sum, the error word, the ray counts and the clock.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn reset(&self) -> Result<(), GpuError> {
        wait_for(self.reset_async())
    }

    async fn reset_async(&self) -> Result<(), GpuError> {
        let mut recording = Recording::new();
        recording.clear(&self.status);
        self.clear_sums(&mut recording);
        self.player.play_async(&recording).await?;
        self.pending.set(0);
        self.done.set(0);
        self.blocks.borrow_mut().clear();
        self.stages.borrow_mut().clear();
        self.spent.set(Elapsed::nothing(self.gpu.has_clock()));
        Ok(())
    }

    fn clear_sums(&self, recording: &mut Recording) {
        for band in &self.bands {
            recording.clear(&band.sums);
        }
    }

    /// Adds samples `first … first + count - 1` to every pixel, in slices.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains; a finished block is incomplete.
    pub fn add_samples(&self, first: u32, count: u32, seed: u32) -> Result<(), GpuError> {
        wait_for(self.add_samples_until_async((first, count), seed, &|| false)).map(|_| ())
    }

    /// [`Renderer::add_samples`], unless `stop` says between two slices that they are no longer wanted: then `false` is
    /// returned, pixels have different numbers of samples, and the next step has to be [`Renderer::reset`].
    ///
    /// # Errors
    /// As [`Renderer::add_samples`].
    pub async fn add_samples_until_async(
        &self,
        (first, count): (u32, u32),
        seed: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let mut sample = first;
        let end = first + count;
        while sample < end {
            if sample.is_multiple_of(BLOCK_SAMPLES) && self.pending.get() > 0 {
                self.close_block().await?;
            }
            let left_in_block = BLOCK_SAMPLES - sample % BLOCK_SAMPLES;
            let samples = self.samples_at_once().min(left_in_block).min(end - sample);
            for band in &self.bands {
                let whole = match &self.chosen {
                    Some(blocks) => {
                        self.add_to_blocks(band, blocks, (sample, samples), seed, stop)
                            .await?
                    }
                    None => {
                        self.add_to_band(band, (sample, samples), seed, stop)
                            .await?
                    }
                };
                if !whole {
                    return Ok(false);
                }
            }
            sample += samples;
            self.done.set(self.done.get() + samples);
            self.pending.set(self.pending.get() + samples);
        }
        Ok(true)
    }

    /// Samples of a slice, pixels times samples per pixel.
    fn fitting(&self) -> u64 {
        let fitting = self.slices.fitting().min(self.most);
        fitting.min(self.short.get())
    }

    /// Samples of all pixels that fit into a slice's time. If the driver ends loops, only one, so
    /// that only a sample that exceeds the driver's limit by itself is refused.
    fn samples_at_once(&self) -> u32 {
        if self.gpu.loop_limit.is_some() {
            return 1;
        }
        let [width, height] = self.size.map(u64::from);
        let blocks = self.chosen.as_ref().map(Blocks::pixels);
        let pixels = blocks.unwrap_or(width * height);
        (self.fitting() / pixels.max(1)).clamp(1, u64::from(BLOCK_SAMPLES)) as u32
    }

    /// Samples, from the next reset on, only these blocks of [`BLOCK_EDGE`](super::BLOCK_EDGE)
    /// pixels squared, by column and row; all other pixels are black. Has no effect on a renderer
    /// that was not created [by blocks](Renderer::by_blocks).
    pub fn only(&self, blocks: &[[u32; 2]]) {
        if let Some(known) = &self.chosen {
            known.set(self.gpu, blocks);
        }
    }

    async fn add_to_blocks(
        &self,
        band: &Band,
        blocks: &Blocks,
        (first_sample, samples): (u32, u32),
        seed: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let fitting = self.fitting() / (u64::from(samples) * Blocks::PIXELS).max(1);
        let mut first = 0;
        while first < blocks.len() {
            if stop() {
                return Ok(false);
            }
            let count = (fitting.clamp(1, Blocks::MOST) as u32).min(blocks.len() - first);
            let slice = Slice {
                band_row: 0,
                first_row: first,
                rows: count,
                first_sample,
                samples,
                seed,
            };
            let items = u64::from(count) * u64::from(samples) * Blocks::PIXELS;
            self.run_slice(band, &slice, items).await?;
            first += count;
        }
        Ok(true)
    }

    async fn add_to_band(
        &self,
        band: &Band,
        (first_sample, samples): (u32, u32),
        seed: u32,
        stop: &dyn Fn() -> bool,
    ) -> Result<bool, GpuError> {
        let mut row = band.rows.start;
        while row < band.rows.end {
            if stop() {
                return Ok(false);
            }
            let row_samples = u64::from(self.size[0]) * u64::from(samples);
            let fitting = self.fitting() / row_samples.max(1) / 8 * 8;
            let rows = fitting.clamp(8, 1 << 31) as u32;
            let slice = Slice {
                band_row: band.rows.start,
                first_row: row,
                rows: rows.min(band.rows.end - row),
                first_sample,
                samples,
                seed,
            };
            let items = row_samples * u64::from(slice.rows);
            self.run_slice(band, &slice, items).await?;
            row += slice.rows;
        }
        Ok(true)
    }

    fn record(
        &self,
        recording: &mut Recording,
        band: &Band,
        slice: &Slice,
    ) -> Result<(), GpuError> {
        let of_job = (self.size[0], &self.uniform);
        let (sums, scratch) = (&band.sums, self.integrator.kind.scratch());
        self.integrator.record(&mut ImageSteps::new(
            &self.passes,
            recording,
            of_job,
            slice,
            sums,
            scratch,
            self.chosen.as_ref().map(Blocks::list),
        ))
    }

    async fn run_slice(&self, band: &Band, slice: &Slice, items: u64) -> Result<(), GpuError> {
        let mut recording = Recording::new();
        self.record(&mut recording, band, slice)?;
        let played = self.player.play_async(&recording).await?;
        let elapsed = played.elapsed();
        let mut stages = self.stages.borrow_mut();
        for (stage, ms) in played.runs {
            let Some(ms) = ms else { continue };
            *stages.entry(stage).or_default() += ms;
        }
        self.slices.learn(items, elapsed);
        if let Some(ms) = self.short_ms {
            let fitting = items as f64 * ms / elapsed.ms().max(0.1);
            self.short.set((fitting as u64).max(1));
        }
        let mut spent = self.spent.get();
        spent += elapsed;
        self.spent.set(spent);
        Ok(())
    }

    /// The device.
    pub fn gpu(&self) -> &Gpu {
        self.gpu
    }

    /// Time of all slices since the last reset.
    pub fn spent(&self) -> Elapsed {
        self.spent.get()
    }

    /// Milliseconds of the longest slice so far: no dispatch took longer.
    pub fn longest_slice_ms(&self) -> f64 {
        self.slices.longest_ms()
    }

    /// GPU milliseconds of each stage since the last reset, summed over its runs:
    /// [`RAY_QUERIES`](super::RAY_QUERIES) and those of the organisation. Empty without timestamps.
    pub fn stages(&self) -> BTreeMap<String, f64> {
        self.stages.borrow().clone()
    }

    /// Renders from scratch and returns the images after each of `spps` (ascending) samples.
    ///
    /// # Errors
    /// As for [`Renderer::image`], or the driver complains.
    pub fn render(&self, spps: &[u32], seed: u32) -> Result<Vec<Snapshot>, GpuError> {
        self.reset()?;
        let mut done = 0;
        let mut out = Vec::with_capacity(spps.len());
        for &spp in spps {
            self.add_samples(done, spp - done, seed)?;
            done = spp;
            out.push(Snapshot {
                spp,
                image: self.image()?,
            });
        }
        Ok(out)
    }

    /// Adds the sums of a whole block on the host.
    async fn close_block(&self) -> Result<(), GpuError> {
        let earlier = self.blocks.take();
        let totals = self.with_pending(earlier).await?;
        self.blocks.replace(totals);
        let mut recording = Recording::new();
        self.clear_sums(&mut recording);
        self.player.play_async(&recording).await?;
        self.pending.set(0);
        Ok(())
    }
}
