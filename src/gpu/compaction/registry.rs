//! The registry of compactions: one line each.

use super::{
    Atomic, Blelloch, BucketSort, Compaction, Horn, NoCompaction, RadixSorted, ReduceScanScatter,
    Roger, Subgroup, Workgroup,
};
use raystone_core::params::{Parameters, Registered, Registry, Variant};
use raystone_core::text::did_you_mean;
use std::sync::Arc;

/// All compactions by name; more can be added.
#[derive(Clone)]
pub struct CompactionRegistry(pub Registry<dyn Compaction>);

impl Default for CompactionRegistry {
    fn default() -> Self {
        Self(Registry::new(vec![
            compaction_kind::<NoCompaction>("none"),
            compaction_kind::<Atomic>("atomic"),
            compaction_kind::<Workgroup>("workgroup"),
            compaction_kind::<Subgroup>("subgroup"),
            compaction_kind::<ReduceScanScatter>("reduce-scan-scatter"),
            compaction_kind::<Horn>("horn"),
            compaction_kind::<Blelloch>("blelloch"),
            compaction_kind::<Roger>("roger"),
            compaction_kind::<BucketSort>("bucket-sort"),
            compaction_kind::<RadixSorted>("radix-sort"),
        ]))
    }
}

impl CompactionRegistry {
    /// The compaction of a variant, with its parameters.
    ///
    /// # Errors
    /// A description of an unknown name or parameter.
    pub fn configured(&self, variant: &Variant) -> Result<Arc<dyn Compaction>, String> {
        let Some(kind) = self.0.find(&variant.name) else {
            let near = did_you_mean(&variant.name, self.0.iter().map(Registered::name));
            return Err(format!("no compaction is called `{}`{near}", variant.name));
        };
        let made = kind.make(&variant.params);
        made.map_err(|error| format!("{}: {error}", variant.name))
    }
}

/// A compaction that is its own parameter struct.
pub fn compaction_kind<C: Compaction + Parameters + 'static>(
    name: &str,
) -> Registered<dyn Compaction> {
    Registered::new::<C>(name, |params| Ok(Arc::new(C::from_params(params)?)))
}
