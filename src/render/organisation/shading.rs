//! A queue and a kernel per kind of material (Laine, Karras & Aila 2013, section 4).

use super::queued::{Queues, Wavefront};
use crate::ImageSteps;
use raystone_gpu::compaction::{Compaction, Stays};
use raystone_gpu::{Bindings, GpuError, Groups, Storage};
use std::sync::Arc;

/// The queue of a kind, or of misses; flags are one larger: `kernels/organisation/kinds.wesl`.
fn queue_of(kind: Option<usize>) -> u32 {
    kind.map_or(0, |kind| kind as u32 + 1)
}

/// Queues of path indices, by material kind.
struct Kinds<'a> {
    queues: &'a Queues<'a>,
    number: u32,
    method: Arc<dyn Compaction>,
    places: Storage,
    /// Indices in queue order, and the queue lengths: all queues if the compaction keeps them
    /// apart, otherwise one at a time.
    kept: Storage,
    count: Storage,
}

/// Shades the hits of each kind of material, and the misses, one kind after the other. A queue's
/// paths are in `order`, if given and the compaction is stable.
pub(super) fn by_kind(
    steps: &mut ImageSteps,
    queues: &Queues,
    wavefront: &Wavefront,
    order: Option<Storage>,
) -> Result<(), GpuError> {
    let method = wavefront.compaction.on(steps.gpu())?;
    let words = |of: u32| 4 * u64::from(queues.capacity) * u64::from(of);
    let number = steps.material_kinds().count() as u32 + 1;
    let parts = if method.keeps_apart() { number } else { 1 };
    let kinds = Kinds {
        queues,
        number,
        method,
        places: order.unwrap_or_else(|| queues.scratch("places", words(1))),
        kept: queues.scratch("kind queues", words(parts)),
        count: queues.scratch("kind counts", 4 * u64::from(number)),
    };
    kinds.fill(steps)?;
    let met: Vec<_> = steps.material_kinds().present().map(Some).collect();
    for kind in met.into_iter().chain([None]) {
        kinds.shade(steps, kind)?;
    }
    Ok(())
}

impl Kinds<'_> {
    /// Flags all live paths by the kind they hit, and fills all queues if one compaction can.
    fn fill(&self, steps: &mut ImageSteps) -> Result<(), GpuError> {
        let place = steps.recording().len();
        let mut bindings = self.queues.bindings.clone();
        bindings.buffer("places", &self.places);
        let kernel = self.queues.kernel("organisation/kinds");
        steps.run("kinds", kernel, self.queues.live_groups(), &bindings)?;
        if self.method.keeps_apart() {
            self.keep(steps, Stays::Apart(self.number))?;
        }
        steps.recording().name_since(place, "kinds");
        Ok(())
    }

    fn keep(&self, steps: &mut ImageSteps, stays: Stays) -> Result<(), GpuError> {
        let buffers = [&self.places, &self.kept, &self.count];
        self.queues.keep(steps, &*self.method, stays, buffers)
    }

    /// Shades the paths that hit this kind of material, by its number, or missed.
    fn shade(&self, steps: &mut ImageSteps, kind: Option<usize>) -> Result<(), GpuError> {
        let place = steps.recording().len();
        let mut queue = queue_of(kind);
        if !self.method.keeps_apart() {
            self.keep(steps, Stays::Bucket(queue + 1))?;
            queue = 0;
        }
        let groups = self.queues.scratch("kind groups", 16);
        let mut bindings: Bindings = self.queues.bindings.clone();
        bindings
            .buffer("order", &self.kept)
            .buffer("kind_counts", &self.count)
            .buffer("live_groups", &groups);
        let name = kind.map_or("nothing", |kind| steps.material_kinds().kind(kind).name);
        let plan = self.queues.kernel("organisation/plan_kind");
        let plan = plan.constant("QUEUE", queue);
        steps.run(&format!("plan {name}"), plan, [1, 1, 1], &bindings)?;
        steps.recording().name_since(place, "kinds");
        let kernel = self.queues.kernel("organisation/shade");
        let kernel = kernel
            .constant("QUEUE", queue)
            .feature("nothing_met", kind.is_none());
        let groups = Groups::Indirect(groups, 0);
        steps.run_on(kind, &format!("shade {name}"), kernel, groups, &bindings)
    }
}
