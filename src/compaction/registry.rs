//! The registry of compactions: one line each.

use super::{
    Atomic, Blelloch, BucketSort, Compaction, Horn, NoCompaction, RadixSorted, ReduceScanScatter,
    Roger, Subgroup, Workgroup,
};
use crate::params::{Parameters, Registered, Registry, Variant};
use crate::text::nearest;
use std::sync::Arc;

/// Every compaction that can be named; more can be added.
#[derive(Clone)]
pub struct CompactionRegistry(pub Registry<dyn Compaction>);

impl Default for CompactionRegistry {
    fn default() -> Self {
        Self(Registry::new(vec![
            Registered::compaction::<NoCompaction>("none"),
            Registered::compaction::<Atomic>("atomic"),
            Registered::compaction::<Workgroup>("workgroup"),
            Registered::compaction::<Subgroup>("subgroup"),
            Registered::compaction::<ReduceScanScatter>("reduce-scan-scatter"),
            Registered::compaction::<Horn>("horn"),
            Registered::compaction::<Blelloch>("blelloch"),
            Registered::compaction::<Roger>("roger"),
            Registered::compaction::<BucketSort>("bucket-sort"),
            Registered::compaction::<RadixSorted>("radix-sort"),
        ]))
    }
}

impl CompactionRegistry {
    /// The compaction that a variant names, with its parameters.
    ///
    /// # Errors
    /// A name that is not registered, or parameters that it does not have; in words.
    pub fn configured(&self, variant: &Variant) -> Result<Arc<dyn Compaction>, String> {
        let Some(kind) = self.0.find(&variant.name) else {
            let near = nearest(&variant.name, self.0.iter().map(Registered::name));
            return Err(format!(
                "no compaction is called `{}`; did you mean `{}`?",
                variant.name,
                near.unwrap_or_default()
            ));
        };
        let made = kind.make(&variant.params);
        made.map_err(|error| format!("{}: {error}", variant.name))
    }
}

impl Registered<dyn Compaction> {
    /// A compaction whose parameters are its own struct.
    pub fn compaction<C: Compaction + Parameters + 'static>(name: &str) -> Self {
        Self::new::<C>(name, |params| Ok(Arc::new(C::from_params(params)?)))
    }
}
