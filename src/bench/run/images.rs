//! Estimators of a run's images, their compiled kernels, and image file metadata.

use super::device::Device;
use super::error::Fault;
use super::registries::Registries;
use super::session::Session;
use super::words;
use super::world::World;
use raystone_config::{Axis, Cell};
use raystone_core::geometry::Camera;
use raystone_core::params::Variant;
use raystone_core::program::Program;
use raystone_image::{Attribute, Image};
use raystone_record::{IMAGE_AXES, SPREAD};
use raystone_render::{ConfiguredIntegrator, RayOffset, RenderJob, Renderer, Traced};
use raystone_sampling::Sampler;

/// Why an integrator cannot render through a structure; such a cell is skipped.
pub(super) fn unfit(session: &Session, cell: &Cell, traced: &Traced) -> Option<String> {
    match session.registries.integrator(cell) {
        Ok(integrator) => integrator.refusal(traced),
        Err(reason) => Some(reason),
    }
}

/// Image file attributes: known properties of the rendering by name.
pub fn attributes(
    program: &Program,
    cell: &Cell,
    sampler: &str,
    spp: u32,
    seed: impl ToString,
) -> Vec<Attribute<'static>> {
    let label = |axis| cell.get(axis).map(|v: &Variant| v.label.clone());
    let changed = program.dirty == Some(true);
    let commit = program.commit.map(|commit| {
        if changed {
            format!("{commit} with uncommitted changes")
        } else {
            commit.to_owned()
        }
    });
    let software = format!("raystone {}", program.version);
    let known = [
        ("software", Some(software)),
        ("commit", commit),
        ("scene", label(Axis::Scene)),
        ("integrator", label(Axis::Integrator)),
        ("sampler", Some(sampler.to_owned())),
        ("spp", Some(spp.to_string())),
        ("seed", Some(seed.to_string())),
    ];
    let known = known.into_iter();
    known
        .filter_map(|(name, value)| Some((name, value?)))
        .collect()
}

/// Writes mean and single variance over all replicates, by pixel and channel, on request.
pub(super) fn write_spread(
    session: &Session,
    cell: &Cell,
    spp: u32,
    replicates: &[Image],
) -> Result<(), Fault> {
    if session.options.images.is_none() || replicates.len() < 2 {
        return Ok(());
    }
    let labels = cell.labels(&IMAGE_AXES);
    let seeds = &session.experiment.seeds().replicates[..replicates.len()];
    let seeds: Vec<String> = seeds.iter().map(u32::to_string).collect();
    let about = attributes(
        &session.options.program,
        cell,
        &sampler_label(cell),
        spp,
        seeds.join(" "),
    );
    let mean = Image::mean_of(replicates).map_err(|e| e.to_string())?;
    let variance = Image::variance_of(replicates).map_err(|e| e.to_string())?;
    for (kind, image) in SPREAD.into_iter().zip([mean, variance]) {
        session.linear(kind, &labels, &image, &about)?;
    }
    Ok(())
}

/// Formats `sequence × decorrelation`.
pub(super) fn sampler_label(cell: &Cell) -> String {
    let labels = [&cell[Axis::Sequence], &cell[Axis::Decorrelation]].map(|v| v.label.as_str());
    labels.join(" × ")
}

/// An integrator and a sampler with their kernels.
pub struct Estimator {
    /// The source of random numbers.
    pub sampler: Sampler,
    /// What is computed.
    pub integrator: ConfiguredIntegrator,
    offset: RayOffset,
    kernels: Variant,
}

impl Estimator {
    /// The estimator of a cell, for `samples` samples per pixel.
    ///
    /// # Errors
    /// A name is not registered, or the sampler has too few dimensions or samples.
    pub(super) fn new(session: &Session, cell: &Cell, samples: u32) -> Result<Self, String> {
        let width = session.experiment.run.resolution[0];
        Self::of(session.registries, cell, samples, width)
    }

    /// The estimator of a cell, for `samples` samples per pixel of images of this width.
    ///
    /// # Errors
    /// A name is not registered, or the sampler has too few dimensions or samples.
    pub fn of(
        registries: &Registries,
        cell: &Cell,
        samples: u32,
        width: u32,
    ) -> Result<Self, String> {
        let integrator = registries.integrator(cell)?;
        let (sequence, decorrelation) = (&cell[Axis::Sequence], &cell[Axis::Decorrelation]);
        let demand = integrator.demand(samples, width);
        let sampler = (registries.samplers).sampler(sequence, decorrelation, &demand);
        Ok(Self {
            sampler: sampler.map_err(|e| e.to_string())?,
            integrator,
            offset: registries.offset(cell)?,
            kernels: cell[Axis::Kernels].clone(),
        })
    }

    pub(super) fn job(
        &self,
        session: &Session,
        camera: Camera,
        runtime_checks: bool,
    ) -> RenderJob<'_> {
        self.image(session.experiment.run.resolution, camera, runtime_checks)
    }

    /// Its image of this size.
    pub fn image(&self, size: [u32; 2], camera: Camera, runtime_checks: bool) -> RenderJob<'_> {
        RenderJob {
            size,
            camera,
            sampler: &self.sampler,
            integrator: &self.integrator,
            offset: self.offset,
            runtime_checks,
        }
    }

    /// [`Self::renderer`] for selected blocks of pixels.
    ///
    /// # Errors
    /// As [`Estimator::renderer`], or the integrator does not support it.
    pub(super) fn by_blocks<'a>(
        &self,
        session: &mut Session,
        world: &'a World,
        traced: &Traced,
        seeds: &[u32],
    ) -> Result<Renderer<'a>, String> {
        let device: &'a Device = world.device;
        let gpu = device.of(&self.kernels).map_err(|e| e.to_string())?;
        words::check(session, gpu, &self.sampler, seeds)?;
        let job = self.job(session, world.camera, true);
        let compiled = session.clock.time("gpu", || {
            Renderer::by_blocks(gpu, &world.buffers, traced, &job)
        });
        compiled.map_err(|e| e.to_string())
    }

    /// Compiles the image of a world, after checking the sampler's words for all `seeds`.
    ///
    /// # Errors
    /// A word differs, or the kernel does not compile.
    pub(super) fn renderer<'a>(
        &self,
        session: &mut Session,
        world: &'a World,
        traced: &Traced,
        seeds: &[u32],
        [runtime_checks, ray_counts]: [bool; 2],
    ) -> Result<Renderer<'a>, String> {
        let device: &'a Device = world.device;
        let gpu = device.of(&self.kernels).map_err(|e| e.to_string())?;
        words::check(session, gpu, &self.sampler, seeds)?;
        let job = self.job(session, world.camera, runtime_checks);
        let compiled = session.clock.time("gpu", || {
            Renderer::new(gpu, &world.buffers, traced, &job, ray_counts)
        });
        compiled.map_err(|e| e.to_string())
    }
}
