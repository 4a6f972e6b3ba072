//! Reasons why a question has no winner: a failed check behind its figures.

use super::data::{SceneGroup, View};
use super::samplers::MeasuredSampler;
use raystone_record::GateVerdict;

/// Returns the reason why no structure may be called the fastest on a scene.
pub(crate) fn doubt_of_rays(scene: &SceneGroup) -> Option<String> {
    let gates = || scene.structures.iter().filter_map(|s| s.gate.as_ref());
    let differs = |gate: &GateVerdict| gate.brute_force.wrong > 0 || gate.oracle.wrong > 0;
    if gates().any(differs) {
        return Some("the reference tracer differs from brute force or the oracle".into());
    }
    let failed = scene.structures.iter().filter(|s| s.fault().is_some());
    let names: Vec<&str> = failed.map(|s| s.structure.as_str()).collect();
    let verb = if names.len() == 1 { "has" } else { "have" };
    (!names.is_empty()).then(|| format!("{} {verb} failed the gate", names.join(", ")))
}

/// Returns the reason why no structure may be called the fastest for rendering.
pub(crate) fn doubt_of_rendering(scene: &SceneGroup, view: &View) -> Option<String> {
    let unequal = view
        .times
        .iter()
        .find(|time| !time.image_equal && time.failure.is_none());
    let unequal = unequal.map(|time| {
        format!(
            "the image of {} with {} differs",
            time.structure, time.sampler
        )
    });
    unequal.or_else(|| doubt_of_rays(scene))
}

/// Returns the reason why no sampler may be called the best: the reference, the check of the integrator, or a check
/// of its images.
pub(crate) fn doubt_of_errors(view: &View) -> Option<String> {
    let judged = || {
        let fault = view.paths_fault.as_ref()?;
        Some(format!(
            "the integrator differs from its reference: {fault}"
        ))
    };
    view.reference_fault()
        .or_else(judged)
        .or_else(|| view.samplers.iter().find_map(failure))
}

/// Describes the fault that a check found with a sampler, unless it is meant to be so.
fn failure(sampler: &MeasuredSampler) -> Option<String> {
    Some(format!(
        "{} is at fault ({})",
        sampler.name,
        sampler.failure()?
    ))
}
