//! A queue and a kernel for each kind of material (Laine, Karras & Aila 2013, section 4).

use super::queued::{Queues, Wavefront};
use crate::gpu::{GpuError, Groups, Storage};
use crate::integrator::ImageSteps;
use crate::scene::MATERIAL_KINDS;

/// Flag of what has met nothing; those of the kinds are the next: as in `kernels/organisation/kinds.wesl`.
const MISSED: u32 = 1;

/// Shades what each kind of material was met by, and what has met nothing, kind after kind: the queue of one takes the place of that
/// before it. In a queue paths stand in `order`, if there is one and the compaction is stable.
pub(super) fn by_kind(
    steps: &mut ImageSteps,
    queues: &Queues,
    wavefront: &Wavefront,
    order: Option<Storage>,
) -> Result<(), GpuError> {
    let place = steps.recording().len();
    let places = order.unwrap_or_else(|| {
        let words = 4 * u64::from(queues.capacity);
        queues.scratch("places", words)
    });
    let mut bindings = queues.bindings.clone();
    bindings.buffer("places", &places);
    let kernel = queues.kernel("organisation/kinds");
    steps.run("kinds", kernel, queues.live_groups(), &bindings)?;
    steps.recording().name_since(place, "kinds");
    let met = steps.material_kinds().into_iter().map(Some);
    for kind in met.chain([None]) {
        shade_kind(steps, queues, wavefront, &places, kind)?;
    }
    Ok(())
}

/// Shades the paths at these places that have met a kind of material, by its number, or nothing.
fn shade_kind(
    steps: &mut ImageSteps,
    queues: &Queues,
    wavefront: &Wavefront,
    places: &Storage,
    kind: Option<usize>,
) -> Result<(), GpuError> {
    let place = steps.recording().len();
    let flag = kind.map_or(MISSED, |kind| MISSED + 1 + kind as u32);
    let queue = queues.keep(steps, wavefront, places, Some(flag))?;
    let groups = queues.scratch("kind_groups", 16);
    let mut bindings = queues.bindings.clone();
    bindings
        .buffer("order", queue)
        .buffer("live_groups", &groups);
    let plan = queues.kernel("organisation/plan_kind");
    steps.run("plan_kind", plan, [1, 1, 1], &bindings)?;
    steps.recording().name_since(place, "kinds");
    let name = kind.map_or("nothing", |kind| MATERIAL_KINDS[kind].name);
    let kernel = queues.kernel("organisation/shade");
    let kernel = kernel.feature("nothing_met", kind.is_none());
    let groups = Groups::Indirect(groups, 0);
    steps.run_on(kind, &format!("shade {name}"), kernel, groups, &bindings)
}
