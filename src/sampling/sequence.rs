//! The interface of sequences.

use super::{Coordinate, Demand, SamplerTable, Seeding};
use raystone_core::params::{Parameters, Registered};
use std::sync::Arc;

/// Properties of a sequence with its parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Facts {
    /// Another seed gives other points.
    pub random: bool,
    /// Points are independent between pixels: no decorrelation is needed.
    pub independent: bool,
    /// Points are digital in base 2: exclusive or preserves their nets.
    pub base_2: bool,
    /// Every aligned block of indices is as good as the first one.
    pub extensible: bool,
    /// Points depend on their number, so each number of samples has its own set.
    pub by_count: bool,
    /// Maximum dimensions; `None` is unlimited.
    pub dimensions: Option<u32>,
    /// Maximum samples; `None` is unlimited.
    pub samples: Option<u32>,
}

/// A sequence of points: its parameter struct, with one line in the registry.
pub trait Sequence: Send + Sync {
    /// Kernel module, relative to the kernel folder, if it differs from the name:
    /// `sampling/owen_sobol` for `owen-sobol`.
    fn kernel(&self) -> Option<&'static str> {
        None
    }
    /// Paths and texts of its own kernel modules, for sequences that are not built in.
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Which pixels draw the same numbers from it.
    fn seeding(&self) -> Seeding {
        Seeding::PixelSample
    }
    /// Its properties.
    fn facts(&self) -> Facts;
    /// Words that the kernel reads by `sequence_word`, as many as the demand needs; the demand is
    /// within the limits of the facts.
    fn table(&self, _demand: &Demand) -> Vec<u32> {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// CPU version of the kernel's `sequence`: a fraction of 2³².
    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32;
}

/// The sequence declared by `S`, under this name; the doc comment of `S` describes it.
pub fn sequence_kind<S: Sequence + Parameters + 'static>(name: &str) -> Registered<dyn Sequence> {
    Registered::new::<S>(name, |params| Ok(Arc::new(S::from_params(params)?)))
}
