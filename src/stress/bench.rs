//! Structures built over a case, and batches of rays on the adapter.

use super::case::Case;
use raystone_accel::{
    AccelKind, BuildLog, BuiltAccel, Hit, Query, Ray, Space, Traced, TriangleSoup,
    brute_force_hits, brute_force_instances,
};
use raystone_core::params::Params;
use raystone_core::random::Pcg32;
use raystone_gpu::{GpuError, kernel_errors};
use raystone_render::Stage;

/// Builds a structure and checks its invariants.
///
/// # Errors
/// The refusal or the violated invariant, in words.
pub(crate) fn build_with(
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

/// Returns the error word in words; `None` if there is no error.
pub(crate) fn error_text(errors: u32) -> Option<String> {
    (errors != 0).then(|| kernel_errors(errors).join("; "))
}

/// Brute force's answers.
pub(crate) struct Expected {
    world: Vec<Hit>,
    instances: Option<Vec<Hit>>,
}

impl Expected {
    /// Computes the answers of brute force on the host in each space.
    pub(crate) fn new(soup: &TriangleSoup, rays: &[Ray]) -> Self {
        let placed = soup.placed.as_ref();
        Self {
            world: brute_force_hits(soup, rays),
            instances: placed.map(|placed| brute_force_instances(placed, rays)),
        }
    }

    /// Returns the answers for a structure that intersects triangles in this space.
    pub(crate) fn of(&self, space: Space) -> &[Hit] {
        match (space, &self.instances) {
            (Space::Instances, Some(hits)) => hits,
            _ => &self.world,
        }
    }
}

/// Returns the time of one set of rays over that of another through the same structure: the least of a few rounds
/// each, in turns.
///
/// # Errors
/// As for [`Stage::closest`].
pub(crate) fn ratio(
    stage: &Stage,
    traced: &Traced,
    rays: &[Ray],
    others: &[Ray],
) -> Result<f64, GpuError> {
    const ROUNDS: usize = 3;
    let batch = |rays| stage.tracer(traced, Query::Closest)?.batch(rays);
    let [a, b] = [rays, others].map(batch);
    let (a, b) = (a?, b?);
    // Compiles, and finds the number of rays per dispatch.
    a.trace()?;
    b.trace()?;
    let mut least = [f64::INFINITY; 2];
    for _ in 0..ROUNDS {
        for (batch, least) in [&a, &b].into_iter().zip(&mut least) {
            *least = least.min(batch.trace()?.measured()?.ms());
        }
    }
    Ok(least[0] / least[1].max(1e-6))
}

/// Repeats the rays until there are `count`.
pub(crate) fn repeated(rays: &[Ray], count: usize) -> Vec<Ray> {
    rays.iter().copied().cycle().take(count).collect()
}

/// Returns ordinary rays for the mesh of a case: chords between points of its box.
pub(crate) fn ordinary_rays(case: &Case, seed: u64, count: usize) -> Vec<Ray> {
    let bounds = case.scene.bounds();
    let (low, size) = (bounds.min.as_dvec3(), (bounds.max - bounds.min).as_dvec3());
    let mut random = Pcg32::with_stream(seed, 0x0c0d);
    let mut point = || (low + size * (0.5 * (random.in_cube() + glam::DVec3::ONE))).as_vec3();
    (0..count)
        .map(|_| super::case::towards(point(), point()))
        .collect()
}
