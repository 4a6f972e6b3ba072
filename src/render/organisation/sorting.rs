//! Sorting of the queue of live paths.

use super::queued::Queues;
use crate::ImageSteps;
use raystone_gpu::{Bindings, Composition, GpuError, Pairs, RadixSort, Storage, UniformValues};

/// Bits of a ray's key: an octant, and seven per axis.
const RAY_KEY_BITS: u32 = 24;
/// Bits of a material number used for sorting.
const MATERIAL_BITS: u32 = 16;
/// Cells of a ray's key along an axis.
const CELLS: f32 = 128.0;

/// Keys and values, one per slot.
fn pairs(queues: &Queues) -> Pairs {
    let scratch = |name: &str| Storage::scratch(name, 4 * u64::from(queues.capacity));
    Pairs {
        keys: scratch("image sort keys"),
        values: scratch("image sort values"),
        count: queues.capacity,
    }
}

/// Writes keys with this kernel and sorts them; the result contains the sorted `values`.
fn sorted(
    steps: &mut ImageSteps,
    queues: &Queues,
    kernel: &str,
    bits: u32,
    special: &Bindings,
) -> Result<Storage, GpuError> {
    let unsorted = pairs(queues);
    let mut bindings = queues.bindings.merged(special);
    bindings
        .buffer("keys", &unsorted.keys)
        .buffer("values", &unsorted.values);
    let keys = queues.kernel(&format!("organisation/{kernel}"));
    let place = steps.recording().len();
    steps.run(kernel, keys, queues.all(), &bindings)?;
    let sort = RadixSort::new(steps.gpu())?;
    let order = sort.record(steps.recording(), &unsorted, bits).values;
    steps.recording().name_since(place, "sorting");
    Ok(order)
}

/// Sorts the queue by the octants and origins of its rays.
pub(super) fn by_ray(steps: &mut ImageSteps, queues: &Queues) -> Result<(), GpuError> {
    let [low, high] = steps.bounds();
    let scale = [0, 1, 2].map(|axis| CELLS / (high[axis] - low[axis]).max(f32::MIN_POSITIVE));
    let scale = scale.map(|s| s.min(f32::MAX));
    let mut special = Bindings::new();
    let extent = UniformValues::new().vec("low", &low).vec("scale", &scale);
    special.uniform("extent", extent);
    let values = sorted(steps, queues, "ray_keys", RAY_KEY_BITS, &special)?;
    let mut bindings = queues.bindings.clone();
    bindings.buffer("values", &values);
    let kernel: Composition = queues.kernel("organisation/take_order");
    steps.run("take_order", kernel, queues.live_groups(), &bindings)
}

/// The order in which answers of one material are contiguous.
pub(super) fn by_material(steps: &mut ImageSteps, queues: &Queues) -> Result<Storage, GpuError> {
    sorted(
        steps,
        queues,
        "material_keys",
        MATERIAL_BITS,
        &Bindings::new(),
    )
}
