//! Where cases are traced: structures built over a case, and batches on the adapter.

use super::case::Case;
use crate::accel::{
    AccelKind, BuildLog, BuiltAccel, Hit, Intersection, Ray, Space, TriangleSoup, brute_force_hits,
    brute_force_instances,
};
use crate::gpu::{Gpu, GpuError, kernel_errors};
use crate::integrator::{SceneBuffers, Traced};
use crate::measure::batch::{Batch, Query};
use crate::params::Params;
use crate::scene::SceneData;

/// A scene on the adapter, met by one choice of tests.
pub struct Stage<'a> {
    gpu: &'a Gpu,
    /// The triangles.
    pub soup: TriangleSoup,
    /// The same on the adapter.
    pub buffers: SceneBuffers,
}

/// Answers with the error word of the kernels.
pub struct Answers<T> {
    /// One per ray.
    pub answers: Vec<T>,
    /// 0, or what went wrong.
    pub errors: u32,
}

/// Every parameter at its default.
pub fn default_params(kind: &dyn AccelKind) -> Params {
    let value = |p: &crate::params::Parameter| (p.name.to_owned(), p.default.clone());
    Params(kind.parameters().iter().map(value).collect())
}

/// Builds a structure with its default parameters and checks its invariants.
///
/// # Errors
/// What it refuses or violates, in words.
pub fn build(kind: &dyn AccelKind, soup: &TriangleSoup) -> Result<Box<dyn BuiltAccel>, String> {
    build_with(kind, &default_params(kind), soup)
}

/// The same with these parameters.
///
/// # Errors
/// As for [`build`].
pub fn build_with(
    kind: &dyn AccelKind,
    params: &Params,
    soup: &TriangleSoup,
) -> Result<Box<dyn BuiltAccel>, String> {
    let built = kind.build(soup, params, &mut BuildLog::default());
    let built = built.map_err(|e| format!("not built: {e}"))?;
    let checked = built.validate(soup);
    checked.map_err(|e| format!("not valid: {e}"))?;
    Ok(built)
}

/// The error word in words; `None` if there is no error.
pub fn error_text(errors: u32) -> Option<String> {
    (errors != 0).then(|| kernel_errors(errors).join("; "))
}

impl<'a> Stage<'a> {
    /// Uploads a scene.
    ///
    /// # Errors
    /// A buffer exceeds the adapter's limit.
    pub fn new(gpu: &'a Gpu, scene: &SceneData, tests: Intersection) -> Result<Self, GpuError> {
        let soup = TriangleSoup::new(scene).intersecting(tests);
        let buffers = SceneBuffers::upload(gpu, scene, &soup)?;
        Ok(Self { gpu, soup, buffers })
    }

    /// The same triangles met by another choice of tests that needs no other words.
    pub fn set(&mut self, tests: Intersection) {
        self.soup.intersection = tests;
        self.buffers.intersection = tests;
    }

    /// Uploads a structure.
    ///
    /// # Errors
    /// An array exceeds the adapter's limit.
    pub fn upload(&self, built: &dyn BuiltAccel) -> Result<Traced, GpuError> {
        Traced::upload(self.gpu, built)
    }

    /// A batch of rays through a structure.
    ///
    /// # Errors
    /// The kernel does not compile, or the rays exceed the adapter's limit.
    pub fn batch(
        &self,
        traced: &Traced,
        query: Query,
        rays: &[Ray],
    ) -> Result<Batch<'a>, GpuError> {
        Batch::new(self.gpu, &self.buffers, traced, query, rays, true)
    }

    /// Nearest hits.
    ///
    /// # Errors
    /// The kernel does not compile, or the device is lost or hangs.
    pub fn closest(&self, traced: &Traced, rays: &[Ray]) -> Result<Answers<Hit>, GpuError> {
        let batch = self.batch(traced, Query::Closest, rays)?;
        batch.trace()?;
        Ok(Answers {
            answers: batch.hits()?,
            errors: batch.error_word()?,
        })
    }

    /// Whether anything is hit.
    ///
    /// # Errors
    /// As for [`Stage::closest`].
    pub fn any(&self, traced: &Traced, rays: &[Ray]) -> Result<Answers<bool>, GpuError> {
        let batch = self.batch(traced, Query::Any, rays)?;
        batch.trace()?;
        Ok(Answers {
            // A ray without an answer is seen by the closest hit.
            answers: batch.found()?.iter().map(|a| *a == Some(true)).collect(),
            errors: batch.error_word()?,
        })
    }
}

/// Brute force's answers.
pub struct Expected {
    world: Vec<Hit>,
    instances: Option<Vec<Hit>>,
}

impl Expected {
    /// What brute force on the host answers in each space.
    pub fn new(soup: &TriangleSoup, rays: &[Ray]) -> Self {
        let placed = soup.placed.as_ref();
        Self {
            world: brute_force_hits(soup, rays),
            instances: placed.map(|placed| brute_force_instances(placed, rays)),
        }
    }

    /// Those for a structure that meets triangles in this space.
    pub fn of(&self, space: Space) -> &[Hit] {
        match (space, &self.instances) {
            (Space::Instances, Some(hits)) => hits,
            _ => &self.world,
        }
    }
}

/// Time of one set of rays against another through the same structure: the least of a few rounds each,
/// taken in turns.
///
/// # Errors
/// As for [`Stage::closest`].
pub fn ratio(
    stage: &Stage,
    traced: &Traced,
    rays: &[Ray],
    others: &[Ray],
) -> Result<f64, GpuError> {
    const ROUNDS: usize = 3;
    let [a, b] = [rays, others].map(|rays| stage.batch(traced, Query::Closest, rays));
    let (a, b) = (a?, b?);
    // Compiles, and finds how many rays a dispatch takes.
    a.trace()?;
    b.trace()?;
    let mut least = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        for (batch, least) in [&a, &b].into_iter().zip(&mut least) {
            *least = least.min(batch.trace()?.ms());
        }
    }
    Ok(least[0] / least[1].max(1e-6))
}

/// The rays over and over until there are `count`.
pub fn repeated(rays: &[Ray], count: usize) -> Vec<Ray> {
    rays.iter().copied().cycle().take(count).collect()
}

/// Ordinary rays for the mesh of a case: chords between points of its box.
pub fn ordinary_rays(case: &Case, seed: u64, count: usize) -> Vec<Ray> {
    let bounds = case.scene.bounds();
    let (low, size) = (bounds.min.as_dvec3(), (bounds.max - bounds.min).as_dvec3());
    let mut random = super::case::Random::with_stream(seed, 0x0c0d);
    let mut point = || (low + size * (0.5 * (random.in_cube() + glam::DVec3::ONE))).as_vec3();
    (0..count)
        .map(|_| super::case::towards(point(), point()))
        .collect()
}
