//! Known images through the kernels, for `raystone verify --images`.

use super::error::RunError;
use super::kernels::Kernels;
use super::options::RunOptions;
use super::registries::Registries;
use rayon::prelude::*;
use raystone_accel::Intersection;
use raystone_config::Axis;
use raystone_core::params::{Params, Variant};
use raystone_gpu::{Gpu, GpuError};
use raystone_render::{RayOffset, RenderJob, Renderer, Stage, StageError};
use raystone_sampling::Sampler;
use raystone_verify::known_images::{KnownImage, SIZE, Seen, known_images_of, look, most_samples};
use std::path::Path;

/// The structure through which rays go, and the pair that draws the numbers.
const STRUCTURE: &str = "bvh";
const SEQUENCE: &str = "owen-sobol";
const DECORRELATION: &str = "none";

/// Renders every known image with the kernels of a folder, the embedded ones where there is none, and judges its views. `only` chooses
/// images by their names.
///
/// # Errors
/// No adapter, kernels that cannot be read, a lost device, or a program without what the images are made with. Kernels that do not
/// compile or fail are faults of their images.
pub fn verify_images(
    registries: &Registries,
    options: &RunOptions,
    folder: Option<&Path>,
    only: impl Fn(&str) -> bool + Sync,
) -> Result<Vec<Seen>, RunError> {
    let name = folder.map_or_else(String::new, |f| f.display().to_string());
    let kernels = Variant {
        label: name.clone(),
        name,
        params: Params::default(),
    };
    let loaded = Kernels::load(std::slice::from_ref(&kernels), registries)?;
    let device = loaded.open(options)?;
    let gpu = device.of(&kernels)?;
    let images = known_images_of(&registries.kinds).map_err(input)?;
    let images: Vec<_> = images.iter().filter(|image| only(image.name)).collect();
    // A driver compiles on one core.
    let seen = images.par_iter().map(|image| {
        views(registries, gpu, image).or_else(|error| match error {
            RunError::Gpu(error) if gpu.lost().is_none() => {
                Ok(vec![Seen::not_rendered(image, &error.to_string())])
            }
            error => Err(error),
        })
    });
    let seen: Result<Vec<_>, RunError> = seen.collect();
    Ok(seen?.into_iter().flatten().collect())
}

fn input(error: impl ToString) -> RunError {
    RunError::Input(error.to_string())
}

fn views(registries: &Registries, gpu: &Gpu, image: &KnownImage) -> Result<Vec<Seen>, RunError> {
    let stage = Stage::new(gpu, image.scene.clone(), Intersection::default())?;
    let traced = stage.structure(&registries.accel, STRUCTURE);
    let traced = traced.map_err(|error| match error {
        StageError::Gpu(error) => RunError::Gpu(error),
        other => input(other),
    })?;
    let (name, changes) = &image.trial;
    let mut params = Params::default();
    let changes = changes.iter().cloned();
    params
        .0
        .extend(changes.map(|(key, value)| (key.to_owned(), value)));
    let variant = Variant {
        name: (*name).to_owned(),
        params,
        label: (*name).to_owned(),
    };
    let integrator = registries.integrators.configured(&variant).map_err(input)?;
    let sampler = sampler(registries, &integrator.demand(most_samples(), SIZE[0]))?;
    let Some(first) = image.views.first() else {
        return Ok(Vec::new());
    };
    let job = RenderJob {
        size: SIZE,
        camera: first.camera,
        sampler: &sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let mut renderer = Renderer::new(gpu, &stage.buffers, &traced, &job, false)?;
    let seen: Result<Vec<Seen>, GpuError> = (image.views.iter())
        .map(|view| look(&mut renderer, image, view))
        .collect();
    Ok(seen?)
}

/// The sampler for so much.
fn sampler(
    registries: &Registries,
    demand: &raystone_sampling::Demand,
) -> Result<Sampler, RunError> {
    let catalogue = registries.catalogue();
    let variant = |axis: Axis, name: &str| {
        let entry = catalogue[axis].iter().find(|entry| entry.name == name);
        entry
            .map(raystone_core::params::Entry::default_variant)
            .ok_or_else(|| input(format!("there is no {name}")))
    };
    let sequence = variant(Axis::Sequence, SEQUENCE)?;
    let decorrelation = variant(Axis::Decorrelation, DECORRELATION)?;
    let made = (registries.samplers).sampler(&sequence, &decorrelation, demand);
    made.map_err(input)
}
