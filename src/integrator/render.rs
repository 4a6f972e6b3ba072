//! The renderer: runs an image kernel in slices of about a quarter of a second and keeps the sum at
//! every power of two of samples, so that one run yields the error at spp = 1, 2, 4, ….
//!
//! Every image that it hands out was checked: no kernel raised its error word, and every pixel took
//! exactly the samples asked for.

use super::kind::ConfiguredIntegrator;
use super::slice::{Slice, job_uniform};
use super::tables::SceneBuffers;
use crate::accel::Traced;
use crate::geometry::Camera;
use crate::gpu::{
    Bindings, Composition, Dispatch, Elapsed, Gpu, GpuError, Pipeline, UniformValues,
};
use crate::image::Image;
use crate::sampling::Sampler;
use std::cell::{Cell, RefCell};
use std::ops::Range;
use std::sync::Arc;

/// No dispatch should run longer than this, so that no watchdog strikes and progress moves.
const SLICE_MS: f64 = 250.0;
/// Samples per millisecond that the first slice assumes: slow, so that it is short.
const CAUTIOUS_RATE: f64 = 100.0;

/// Samples of a pixel that are summed in f32 on the device before the host adds the sum in f64. Blocks
/// begin at multiples of it, so that an image does not depend on slices.
pub const BLOCK_SAMPLES: u32 = 256;

/// How far rounding alone may move a pixel of an image of `spp` samples, relative to the mean of the
/// samples' magnitudes: one rounding per addition within a block, and one of the mean to f32 (N. Higham,
/// "Accuracy and Stability of Numerical Algorithms", 2nd ed., 2002, section 4.2). What f64 adds to that
/// stays below a millionth of it.
pub fn rounding_bound(spp: u32) -> f64 {
    let roundings = f64::from(spp.min(BLOCK_SAMPLES));
    roundings * 0.5 * f64::from(f32::EPSILON) * (1.0 + 1e-6)
}

/// One image to render.
#[derive(Clone, Copy)]
pub struct RenderJob<'a> {
    /// Width and height, pixels.
    pub size: [u32; 2],
    /// Where it is taken from.
    pub camera: Camera,
    /// What draws the samples.
    pub sampler: &'a Sampler,
    /// What is computed per sample.
    pub integrator: &'a ConfiguredIntegrator,
    /// Whether the driver's checks are on.
    pub runtime_checks: bool,
}

/// The image after so many samples.
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

/// A compiled job on one scene and structure.
pub struct Renderer<'a> {
    gpu: &'a Gpu,
    width: u32,
    height: u32,
    uniform: UniformValues,
    pipeline: Arc<Pipeline>,
    bindings: Bindings,
    bands: Vec<Band>,
    status: wgpu::Buffer,
    /// Samples per pixel since the last reset.
    done: Cell<u32>,
    /// Of these, how many the sums on the device hold.
    pending: Cell<u32>,
    /// The sums of the blocks before; empty if there were none.
    blocks: RefCell<Vec<[f64; 3]>>,
    /// Samples per millisecond seen so far.
    rate: Cell<f64>,
    /// GPU milliseconds and wall milliseconds of all dispatches since the last reset.
    spent: Cell<Elapsed>,
}

/// Buffers for the sums of an image, as many rows in each as the adapter can bind.
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

/// The composition of a job's kernel.
fn composition(
    traced: &Traced,
    scene: &SceneBuffers,
    job: &RenderJob,
    ray_counts: bool,
) -> Composition {
    let kernel = scene
        .triangles
        .intersection
        .activate(Composition::new("integrator/render"));
    let kernel = traced.compose(scene.offset.activate(kernel));
    let mut out = with_sampler(kernel, job.sampler)
        .with("integrator", job.integrator.kind.kernel())
        .feature("ray_counts", ray_counts);
    for (name, on) in scene.features.flags() {
        out = out.feature(name, on);
    }
    out = scene.bindings.merged(&traced.bindings).compose(out);
    for (name, value) in job.integrator.kind.constants(&job.integrator.params) {
        out = out.constant(name, value);
    }
    out
}

/// Puts a sampler into a kernel that draws; its words are bound as `sampler_table`.
#[must_use]
pub fn with_sampler(mut composition: Composition, sampler: &Sampler) -> Composition {
    for (name, value) in sampler.constants() {
        composition = composition.constant(name, value);
    }
    composition
        .with("sequence", sampler.sequence.kernel())
        .with("decorrelation", sampler.decorrelation.kernel())
}

impl<'a> Renderer<'a> {
    /// Compiles the job's kernel and makes its buffers.
    ///
    /// # Errors
    /// The kernel does not compose or compile, or the scene or one row of the image is too large for a
    /// buffer.
    pub fn new(
        gpu: &'a Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
        ray_counts: bool,
    ) -> Result<Self, GpuError> {
        let pipeline = gpu.pipeline(
            &composition(traced, scene, job, ray_counts),
            job.runtime_checks,
        )?;
        let bands = bands(gpu, job.size)?;
        let status = gpu.zeroed("status", 64)?;
        let mut bindings = scene.bindings.merged(&traced.bindings);
        bindings.buffer("status", &status).buffer(
            "sampler_table",
            &gpu.storage("sampler_table", job.sampler.table.words())?,
        );
        Ok(Self {
            gpu,
            width: job.size[0],
            height: job.size[1],
            uniform: job_uniform(job, scene),
            pipeline,
            bindings,
            bands,
            status,
            done: Cell::new(0),
            pending: Cell::new(0),
            blocks: RefCell::default(),
            rate: Cell::new(CAUTIOUS_RATE),
            spent: Cell::default(),
        })
    }

    /// Feature flags of the kernel.
    pub fn features(&self) -> Vec<String> {
        self.pipeline
            .kernel
            .composition
            .features
            .iter()
            .cloned()
            .collect()
    }

    /// Text of the composed kernel.
    pub fn kernel_text(&self) -> &str {
        &self.pipeline.kernel.wgsl
    }

    /// BLAKE3 of that text.
    pub fn kernel_hash(&self) -> String {
        self.pipeline.kernel.hash()
    }

    /// Clears the sum, the error word, the ray counts and the clock.
    pub fn reset(&self) {
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        encoder.clear_buffer(&self.status, 0, None);
        self.gpu.queue.submit([encoder.finish()]);
        self.clear_sums();
        self.done.set(0);
        self.blocks.borrow_mut().clear();
        self.spent.set(Elapsed {
            gpu_ms: self.gpu.timestamp_period.map(|_| 0.0),
            wall_ms: 0.0,
        });
    }

    fn clear_sums(&self) {
        let mut encoder = self
            .gpu
            .device
            .create_command_encoder(&wgpu::CommandEncoderDescriptor::default());
        for band in &self.bands {
            encoder.clear_buffer(&band.sums, 0, None);
        }
        self.gpu.queue.submit([encoder.finish()]);
        self.pending.set(0);
    }

    /// Adds samples `first … first + count - 1` to every pixel, in slices.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains; a block of samples that ended is not whole.
    pub fn add_samples(&self, first: u32, count: u32, seed: u32) -> Result<(), GpuError> {
        let mut sample = first;
        let end = first + count;
        while sample < end {
            if sample.is_multiple_of(BLOCK_SAMPLES) && self.pending.get() > 0 {
                self.close_block()?;
            }
            let left_in_block = BLOCK_SAMPLES - sample % BLOCK_SAMPLES;
            let samples = self.samples_at_once().min(left_in_block).min(end - sample);
            for band in &self.bands {
                self.add_to_band(band, sample, samples, seed)?;
            }
            sample += samples;
            self.done.set(self.done.get() + samples);
            self.pending.set(self.pending.get() + samples);
        }
        Ok(())
    }

    /// Samples of all pixels that a dispatch has time for. Where a driver ends loops, one alone, so
    /// that only a sample that needs more turns than the driver allows is refused.
    fn samples_at_once(&self) -> u32 {
        if self.gpu.loop_limit.is_some() {
            return 1;
        }
        let pixels = f64::from(self.width) * f64::from(self.height);
        ((self.rate.get() * SLICE_MS / pixels) as u32).max(1)
    }

    fn add_to_band(
        &self,
        band: &Band,
        first_sample: u32,
        samples: u32,
        seed: u32,
    ) -> Result<(), GpuError> {
        let mut bindings = self.bindings.clone();
        bindings.buffer("accumulation", &band.sums);
        let mut row = band.rows.start;
        while row < band.rows.end {
            let row_samples = f64::from(self.width) * f64::from(samples);
            let fitting = (self.rate.get() * SLICE_MS / row_samples) as u32;
            let rows = (fitting / 8 * 8).max(8).min(band.rows.end - row);
            let slice = Slice {
                band_row: band.rows.start,
                first_row: row,
                rows,
                first_sample,
                samples,
                seed,
            };
            self.run_slice(&mut bindings, &slice)?;
            row += rows;
        }
        Ok(())
    }

    fn run_slice(&self, bindings: &mut Bindings, slice: &Slice) -> Result<(), GpuError> {
        bindings.uniform("frame", slice.uniform(&self.uniform));
        let groups = [self.width.div_ceil(8), slice.rows.div_ceil(8), 1];
        let elapsed = self.gpu.run(&Dispatch {
            pipeline: &self.pipeline,
            bindings,
            groups,
        })?;
        let work = f64::from(self.width) * f64::from(slice.rows) * f64::from(slice.samples);
        self.rate.set(work / elapsed.ms().max(1e-3));
        let spent = self.spent.get();
        self.spent.set(Elapsed {
            gpu_ms: spent.gpu_ms.zip(elapsed.gpu_ms).map(|(a, b)| a + b),
            wall_ms: spent.wall_ms + elapsed.wall_ms,
        });
        Ok(())
    }

    /// Time of all slices since the last reset.
    pub fn spent(&self) -> Elapsed {
        self.spent.get()
    }

    /// Renders from nothing and returns the images after each of `spps` (ascending) samples.
    ///
    /// # Errors
    /// As for [`Renderer::image`], or the driver complains.
    pub fn render(&self, spps: &[u32], seed: u32) -> Result<Vec<Snapshot>, GpuError> {
        self.reset();
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

    /// The mean so far.
    ///
    /// # Errors
    /// A kernel raised its error word, a pixel did not take every sample, or the device is lost or
    /// hangs.
    pub fn image(&self) -> Result<Image, GpuError> {
        let mut totals = self.blocks.borrow().clone();
        self.add_pending(&mut totals)?;
        let count = f64::from(self.done.get());
        let mean = |total: &[f64; 3]| total.map(|sum| (sum / count) as f32);
        Ok(Image {
            width: self.width,
            height: self.height,
            pixels: totals.iter().map(mean).collect(),
        })
    }

    /// Takes the sums of a whole block over to the host.
    fn close_block(&self) -> Result<(), GpuError> {
        self.add_pending(&mut self.blocks.borrow_mut())?;
        self.clear_sums();
        Ok(())
    }

    /// Whether everything since the last reset is sound.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn check(&self) -> Result<(), GpuError> {
        self.add_pending(&mut Vec::new())
    }

    /// Adds the sums on the device to those of the blocks before, if they are sound.
    fn add_pending(&self, totals: &mut Vec<[f64; 3]>) -> Result<(), GpuError> {
        self.gpu.check_error_word(self.error_word()?)?;
        let [width, height] = [self.width, self.height].map(|edge| edge as usize);
        totals.resize(width * height, [0.0; 3]);
        let wanted = self.pending.get();
        let (mut wrong, mut first) = (0, None);
        for band in &self.bands {
            let sums: Vec<[f32; 4]> = self.gpu.read(&band.sums)?;
            let [start, end] = [band.rows.start, band.rows.end].map(|row| row as usize * width);
            let pixels = totals[start..end].iter_mut().zip(&sums);
            for (pixel, (total, [r, g, b, taken])) in (start..).zip(pixels) {
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
            None => Ok(()),
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

    /// Rays per class since the last reset, in the order of [`CountedRays`](super::CountedRays); zeros unless the
    /// kernel was compiled to count.
    ///
    /// # Errors
    /// As for [`Renderer::image`].
    pub fn ray_counts(&self) -> Result<[u64; 4], GpuError> {
        self.check()?;
        let words: Vec<u32> = self.gpu.read(&self.status)?;
        Ok(std::array::from_fn(|c| {
            u64::from(words[1 + 2 * c]) | u64::from(words[2 + 2 * c]) << 32
        }))
    }
}
