//! No sampler is rendered with before its kernel's words equal the twin's.

use super::session::Session;
use crate::words::{Used, check_words, kernel_hash};
use raystone_gpu::Gpu;
use raystone_sampling::Sampler;

/// Compares a sampler's kernel with its twin in all that a run draws from it; once for each kernel, table and
/// set of seeds.
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
