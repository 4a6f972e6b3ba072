//! Parallel locally-ordered clustering by the crate `obvhs`.
//!
//! Source: D. Meister, J. Bittner, "Parallel locally-ordered clustering for bounding volume
//! hierarchy construction", 2018.

use super::Tree;
use super::depth::limit_depth;
use super::grow::lay_out;
use super::parameters::{Preset, TreeParameters};
use super::reference::{Box3, Reference};
use crate::AccelError;
use obvhs::aabb::Aabb;
use obvhs::bvh2::Bvh2;
use obvhs::bvh2::reinsertion::ReinsertionOptimizer;
use obvhs::ploc::PlocBuilder;
use obvhs::{Boundable, BvhBuildParams};

/// Boxes with larger coordinates have infinite areas, and obvhs compares areas.
pub(crate) const LARGEST_COORDINATE: f32 = 1e18;

impl Boundable for Reference {
    fn aabb(&self) -> Aabb {
        let Box3 { min, max } = self.bounds();
        Aabb { min, max }
    }
}

/// The parameters of obvhs' presets, without triangle splitting: see `sbvh`.
fn preset(preset: Preset) -> BvhBuildParams {
    match preset {
        Preset::Fastest => BvhBuildParams::fastest_build(),
        Preset::VeryFast => BvhBuildParams::very_fast_build(),
        Preset::Fast => BvhBuildParams::fast_build(),
        Preset::Medium => BvhBuildParams::medium_build(),
        Preset::Slow => BvhBuildParams::slow_build(),
        Preset::VerySlow => BvhBuildParams::very_slow_build(),
    }
}

/// The tree over `references`, with or without the reinsertion of obvhs' preset.
///
/// # Errors
/// A coordinate is too large or not a number.
pub(super) fn build(
    references: &[Reference],
    settings: &TreeParameters,
    reinsertion: bool,
) -> Result<Tree, AccelError> {
    let usable = |x: &f32| x.abs() <= LARGEST_COORDINATE;
    if let Some(bad) = references
        .iter()
        .find(|r| !r.min.iter().chain(&r.max).all(usable))
    {
        return Err(AccelError::Invalid(format!(
            "triangle {}: ploc takes coordinates up to {LARGEST_COORDINATE:e}; its box is {:?} to {:?}",
            bad.id, bad.min, bad.max
        )));
    }
    let preset = preset(settings.ploc_preset);
    let ids = references.iter().map(|r| r.id).collect();
    let mut bvh = PlocBuilder::with_capacity(references.len()).build(
        preset.ploc_search_distance,
        references,
        ids,
        preset.sort_precision,
        preset.search_depth_threshold,
    );
    if reinsertion {
        ReinsertionOptimizer::default().run(&mut bvh, preset.reinsertion_batch_ratio, None);
    }
    Ok(limit_depth(take_over(&bvh)))
}

fn take_over(bvh: &Bvh2) -> Tree {
    lay_out(0, |index: u32, _, order| {
        let node = &bvh.nodes[index as usize];
        let Aabb { min, max } = *node.aabb();
        let (first, count) = (node.first_index, node.prim_count);
        if !node.is_leaf() {
            return (Box3 { min, max }.into(), Some([first, first + 1]));
        }
        order.extend_from_slice(&bvh.primitive_indices[first as usize..(first + count) as usize]);
        (Box3 { min, max }.into(), None)
    })
}
