//! A medium on the device.

use crate::Medium;
use raystone_gpu::{Bindings, Gpu, GpuError, UniformValues};

/// Uploads a medium for kernels that import `volume/medium`.
///
/// # Errors
/// An array exceeds what the adapter binds.
pub(crate) fn bindings(of: &Medium, gpu: &Gpu) -> Result<Bindings, GpuError> {
    let medium = UniformValues::new()
        .uvec("resolution", &of.resolution.to_array())
        .u32("levels", of.levels)
        .vec("spans", &of.spans.to_array())
        .u32("empty", of.empty)
        .u32("entries", of.index.len() as u32)
        .u32("top", of.top);
    let index: &[u32] = if of.index.is_empty() { &[0] } else { &of.index };
    let mut bindings = Bindings::new();
    bindings
        .uniform("medium", medium)
        .buffer("field", &gpu.storage("field", &of.field)?)
        .buffer("pairs", &gpu.storage("pairs", &of.pairs)?)
        .buffer("index", &gpu.storage("index", index)?);
    Ok(bindings)
}
