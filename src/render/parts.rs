//! Renders an image part by part, each part in its own dispatch, as assigned by [`Order`].

use super::order::{Order, Part, splat};
use super::passes::{ImageSteps, Passes};
use super::render::{BLOCK_SAMPLES, RenderJob};
use super::slice::{Slice, job_uniform};
use super::tables::SceneBuffers;
use super::{ConfiguredIntegrator, Traced};
use raystone_gpu::{
    Bindings, Composition, Elapsed, Gpu, GpuError, Player, Recording, UniformValues,
};
use raystone_image::Image;

/// A compiled job whose samples are rendered part by part.
pub struct PartRenderer {
    gpu: Gpu,
    player: Player,
    size: [u32; 2],
    integrator: ConfiguredIntegrator,
    uniform: UniformValues,
    passes: Passes,
    /// Sum of radiance and number of samples, per pixel.
    sums: wgpu::Buffer,
    status: wgpu::Buffer,
}

/// The time of an image in an order.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct InOrder {
    /// Passes for one sample of all pixels.
    pub passes: usize,
    /// All samples.
    pub total: Elapsed,
    /// Until the first picture without a gap.
    pub first_picture: Elapsed,
}

impl PartRenderer {
    /// Compiles the job's kernel and allocates its buffers.
    ///
    /// # Errors
    /// A kernel does not compose or compile, the integrator needs another kind of structure or has
    /// its own passes, or the image is too large for a buffer.
    pub fn new(
        gpu: &Gpu,
        scene: &SceneBuffers,
        traced: &Traced,
        job: &RenderJob,
    ) -> Result<Self, GpuError> {
        let name = job.integrator.kind.name();
        let own_passes = (job.integrator.kind.kernel().is_empty())
            .then(|| format!("`{name}` has passes of its own, and cannot be taken part by part"));
        if let Some(reason) = job.integrator.refusal(traced).or(own_passes) {
            return Err(GpuError::Kernel(reason));
        }
        let status = gpu.zeroed("status", 64)?;
        let pixels = u64::from(job.size[0]) * u64::from(job.size[1]);
        let renderer = Self {
            gpu: gpu.clone(),
            player: Player::new(gpu),
            size: job.size,
            integrator: job.integrator.clone(),
            uniform: job_uniform(job, scene),
            passes: Passes::new(gpu, scene, traced, job, &status, [false, false])?,
            sums: gpu.zeroed("accumulation", 16 * pixels)?,
            status,
        };
        renderer.record(&Order::OnePass.parts(job.size)[0], &Slice::default())?;
        Ok(renderer)
    }

    fn record(&self, part: &Part, slice: &Slice) -> Result<Recording, GpuError> {
        let mut recording = Recording::new();
        let of_job = (self.size[0], &self.uniform);
        let mut steps = ImageSteps::new(
            &self.passes,
            &mut recording,
            of_job,
            slice,
            &self.sums,
            &[],
            None,
        );
        let [columns, rows] = part.count;
        let uniform = UniformValues::new()
            .u32("first_x", part.first[0])
            .u32("first_y", part.first[1])
            .u32("columns", columns)
            .u32("rows", rows)
            .u32("step", part.step);
        let mut special = Bindings::new();
        special.uniform("part", uniform);
        let kernel = Composition::new("integrator/render_part");
        let kernel = kernel.with("integrator", self.integrator.kind.kernel());
        let groups = steps.shape().over(columns, rows);
        steps.run("render part", kernel, groups, &special)?;
        Ok(recording)
    }

    /// Discards all samples.
    ///
    /// # Errors
    /// The device is lost or hangs.
    pub fn reset(&self) -> Result<(), GpuError> {
        let mut recording = Recording::new();
        recording.clear(&self.status).clear(&self.sums);
        self.player.play(&recording).map(|_| ())
    }

    /// Renders one sample in each pixel of a part.
    ///
    /// # Errors
    /// The device is lost, hangs, or the driver complains.
    pub fn add(&self, part: &Part, sample: u32, seed: u32) -> Result<Elapsed, GpuError> {
        let slice = Slice {
            rows: self.size[1],
            first_sample: sample,
            samples: 1,
            seed,
            ..Slice::default()
        };
        let recording = self.record(part, &slice)?;
        Ok(self.player.play(&recording)?.elapsed())
    }

    /// Sums of radiance, and samples, of all pixels so far.
    ///
    /// # Errors
    /// A kernel raised its error word, or the device is lost or hangs.
    pub fn sums(&self) -> Result<Vec<[f32; 4]>, GpuError> {
        let mut recording = Recording::new();
        recording.download("status", &self.status);
        recording.download("sums", &self.sums);
        let played = self.player.play(&recording)?;
        let status: Vec<u32> = played.download("status")?;
        self.gpu.check_error_word(status[0])?;
        played.download("sums")
    }

    /// The picture so far, with gaps filled by [`splat`]; `None` while some remain.
    ///
    /// # Errors
    /// As [`PartRenderer::sums`].
    pub fn preview(&self) -> Result<Option<Image>, GpuError> {
        Ok(splat(&self.sums()?, self.size))
    }

    /// Renders from scratch in an order, waiting for each part's submission. Display time is
    /// excluded: `show` is called when the first picture without a gap is ready.
    ///
    /// # Errors
    /// There are more than [`BLOCK_SAMPLES`] samples, the device is lost or hangs, the driver
    /// complains, or showing fails.
    pub fn render<E: From<GpuError>>(
        &self,
        order: Order,
        (spp, seed): (u32, u32),
        mut show: impl FnMut(&Self) -> Result<(), E>,
    ) -> Result<InOrder, E> {
        if spp > BLOCK_SAMPLES {
            let text = format!(
                "{spp} samples per pixel are more than the {BLOCK_SAMPLES} that an image in parts can sum up"
            );
            return Err(GpuError::Kernel(text).into());
        }
        let parts = order.parts(self.size);
        let first = order.passes_to_first_picture(self.size);
        let nothing = || Elapsed::nothing(self.gpu.has_clock());
        let mut spent = InOrder {
            passes: parts.len(),
            total: nothing(),
            first_picture: nothing(),
        };
        self.reset()?;
        for sample in 0..spp {
            for (done, part) in (1..).zip(&parts) {
                spent.total += self.add(part, sample, seed)?;
                if (sample, done) == (0, first) {
                    spent.first_picture = spent.total;
                    show(self)?;
                }
            }
        }
        Ok(spent)
    }

    /// The image of `spp` samples in each pixel.
    ///
    /// # Errors
    /// A pixel has another number of samples, or as [`PartRenderer::sums`].
    pub fn image(&self, spp: u32) -> Result<Image, GpuError> {
        let sums = self.sums()?;
        let is_wrong = |sum: &&[f32; 4]| sum[3] != spp as f32;
        let wrong = sums.iter().filter(is_wrong).count();
        let image = splat(&sums, self.size).filter(|_| wrong == 0);
        image.ok_or_else(|| {
            let first = sums.iter().position(|sum| is_wrong(&sum)).unwrap_or(0) as u32;
            GpuError::Samples {
                wrong,
                wanted: spp,
                x: first % self.size[0],
                y: first / self.size[0],
                taken: sums[first as usize][3],
            }
        })
    }
}
