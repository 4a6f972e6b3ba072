//! Checks that a sampler's kernel draws the same words as its twin, before rendering with it.

use super::session::Session;
use crate::words::{Used, check_words, kernel_hash};
use raystone_gpu::Gpu;
use raystone_sampling::Sampler;

/// Compares a sampler's kernel with its twin over all draws; once per kernel, table and seeds.
///
/// # Errors
/// A word differs, or the kernel does not run.
pub(super) fn check(
    session: &mut Session,
    gpu: &Gpu,
    sampler: &Sampler,
    seeds: &[u32],
) -> Result<(), String> {
    let used = Used {
        samples: sampler.demand.samples.unwrap_or(1),
        dimensions: sampler.demand.dimensions,
        size: session.experiment.run.resolution,
        seeds: seeds.to_vec(),
    };
    let kernel = kernel_hash(gpu, sampler)?;
    let table = blake3::hash(bytemuck::cast_slice(sampler.table.words()));
    let key = format!("{} {used:?} {kernel} {table}", sampler.label());
    if session.checked.words.contains(&key) {
        return Ok(());
    }
    session
        .clock
        .time("gate", || check_words(gpu, sampler, &used))?;
    session.checked.words.insert(key);
    Ok(())
}
