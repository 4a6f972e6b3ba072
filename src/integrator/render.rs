//! The renderer: runs an image kernel in slices of about a quarter of a second and keeps the sum at
//! every power of two of samples, so that one run yields the error at spp = 1, 2, 4, ….

use super::Integrator;
use super::frame::{Frame, Slice};
use super::tables::SceneBuffers;
use super::traced::Traced;
use crate::config::Params;
use crate::gpu::{Bindings, Composition, Dispatch, Elapsed, Gpu, GpuError, Pipeline};
use crate::measure::image::Image;
use crate::sampling::Sampler;
use std::cell::Cell;
use std::sync::Arc;

/// Names of the ray classes that image kernels count, in the kernel's order.
pub const RAY_COUNT_CLASSES: [&str; 4] = ["primary", "shadow", "ao", "bounce"];

/// No dispatch should run longer than this, so that no watchdog strikes and progress moves.
const SLICE_MS: f64 = 250.0;
/// Samples per millisecond that the first slice assumes: slow, so that it is short.
const CAUTIOUS_RATE: f64 = 100.0;

/// How far rounding alone may move a pixel of an image of `spp` samples, relative to the mean of the
/// samples' magnitudes: one rounding per addition, and one of the mean (N. Higham, "Accuracy and
/// Stability of Numerical Algorithms", 2nd ed., 2002, section 4.2).
pub fn rounding_bound(spp: u32) -> f64 {
    f64::from(spp) * 0.5 * f64::from(f32::EPSILON)
}

/// One image to render.
pub struct RenderJob<'a> {
    /// Image and camera.
    pub frame: Frame,
    /// What draws the samples.
    pub sampler: &'a Sampler,
    /// What is computed per sample.
    pub integrator: &'static dyn Integrator,
    /// Its parameters.
    pub params: &'a Params,
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

/// A compiled job on one scene and structure.
pub struct Renderer<'a> {
    gpu: &'a Gpu,
    scene: &'a SceneBuffers,
    frame: Frame,
    pipeline: Arc<Pipeline>,
    bindings: Bindings,
    accumulation: wgpu::Buffer,
    status: wgpu::Buffer,
    /// Samples per millisecond seen so far.
    rate: Cell<f64>,
    /// GPU milliseconds and wall milliseconds of all dispatches since the last reset.
    spent: Cell<Elapsed>,
}

/// The composition of a job's kernel.
fn composition(
    traced: &Traced,
    scene: &SceneBuffers,
    job: &RenderJob,
    ray_counts: bool,
) -> Composition {
    let kernel = scene
        .intersection
        .activate(Composition::new("integrator/render"));
    let kernel = traced.compose(scene.offset.activate(kernel));
    let mut out = with_sampler(kernel, job.sampler)
        .with("integrator", job.integrator.kernel())
        .feature("ray_counts", ray_counts);
    for (name, on) in scene.features.flags() {
        out = out.feature(name, on);
    }
    out = scene.bindings.merged(&traced.bindings).compose(out);
    for (name, value) in job.integrator.constants(job.params) {
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
    /// The kernel does not compose or compile, or a buffer is too large.
    pub fn new(
        gpu: &'a Gpu,
        scene: &'a SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
        ray_counts: bool,
    ) -> Result<Self, GpuError> {
        let pipeline = gpu.pipeline(
            &composition(traced, scene, job, ray_counts),
            job.runtime_checks,
        )?;
        let pixels = u64::from(job.frame.width) * u64::from(job.frame.height);
        let accumulation = gpu.zeroed("accumulation", pixels * 16)?;
        let status = gpu.zeroed("status", 64)?;
        let mut bindings = scene.bindings.merged(&traced.bindings);
        bindings
            .buffer("accumulation", &accumulation)
            .buffer("status", &status);
        bindings.buffer(
            "sampler_table",
            &gpu.storage("sampler_table", job.sampler.table.words())?,
        );
        Ok(Self {
            gpu,
            scene,
            frame: job.frame,
            pipeline,
            bindings,
            accumulation,
            status,
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
        encoder.clear_buffer(&self.accumulation, 0, None);
        encoder.clear_buffer(&self.status, 0, None);
        self.gpu.queue.submit([encoder.finish()]);
        self.spent.set(Elapsed {
            gpu_ms: self.gpu.timestamp_period.map(|_| 0.0),
            wall_ms: 0.0,
        });
    }

    /// Adds samples `first … first + count - 1` to every pixel, in slices.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn add_samples(&self, first: u32, count: u32, seed: u32) -> Result<(), GpuError> {
        let row_samples = f64::from(self.frame.width);
        let mut sample = first;
        while sample < first + count {
            let mut row = 0;
            let budget = (self.rate.get() * SLICE_MS / row_samples).max(1.0);
            let whole = f64::from(self.frame.height);
            let samples = ((budget / whole) as u32).clamp(1, first + count - sample);
            while row < self.frame.height {
                let budget = (self.rate.get() * SLICE_MS / row_samples).max(8.0);
                let rows = ((budget / f64::from(samples)) as u32 / 8 * 8)
                    .clamp(8, self.frame.height.max(8));
                let rows = rows.min(self.frame.height - row);
                self.run_slice(&Slice {
                    first_row: row,
                    rows,
                    first_sample: sample,
                    samples,
                    seed,
                })?;
                row += rows;
            }
            sample += samples;
        }
        Ok(())
    }

    fn run_slice(&self, slice: &Slice) -> Result<(), GpuError> {
        let mut bindings = self.bindings.clone();
        bindings.uniform("frame", self.frame.uniform(self.scene, slice));
        let groups = [self.frame.width.div_ceil(8), slice.rows.div_ceil(8), 1];
        let elapsed = self.gpu.run(&Dispatch {
            pipeline: &self.pipeline,
            bindings: &bindings,
            groups,
        })?;
        let work = f64::from(self.frame.width) * f64::from(slice.rows) * f64::from(slice.samples);
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
    /// The device is lost, hangs, or the driver complains.
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
    /// The device is lost or hangs.
    pub fn image(&self) -> Result<Image, GpuError> {
        let sums: Vec<[f32; 4]> = self.gpu.read(&self.accumulation)?;
        let pixels = sums
            .iter()
            .take((self.frame.width * self.frame.height) as usize)
            .map(|[r, g, b, n]| [r / n, g / n, b / n])
            .collect();
        Ok(Image {
            width: self.frame.width,
            height: self.frame.height,
            pixels,
        })
    }

    /// The error word of the kernels since the last reset.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn error_word(&self) -> Result<u32, GpuError> {
        Ok(self.gpu.read::<u32>(&self.status)?[0])
    }

    /// Rays per class since the last reset, in the order of [`RAY_COUNT_CLASSES`]; zeros unless the
    /// kernel was compiled to count.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn ray_counts(&self) -> Result<[u64; 4], GpuError> {
        let words: Vec<u32> = self.gpu.read(&self.status)?;
        Ok(std::array::from_fn(|c| {
            u64::from(words[1 + 2 * c]) | u64::from(words[2 + 2 * c]) << 32
        }))
    }
}
