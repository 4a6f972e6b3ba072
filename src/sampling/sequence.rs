//! What a sequence is.

use super::{Coordinate, Demand, SamplerTable, Seeding};
use raystone_core::params::{Parameters, Registered};
use std::sync::Arc;

/// What others have to know of a sequence with its parameters.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Facts {
    /// Another seed gives other points.
    pub random: bool,
    /// Points are independent from pixel to pixel by themselves: nothing is left to decorrelate.
    pub independent: bool,
    /// Points are digital in base 2: exclusive or keeps their nets.
    pub base_2: bool,
    /// Points go on as well as they begin: every aligned block of indices is as good as the first one.
    pub extensible: bool,
    /// Points depend on how many are drawn, so that each number of samples has a set of its own.
    pub by_count: bool,
    /// Dimensions it has; `None` is any number.
    pub dimensions: Option<u32>,
    /// Samples it has; `None` is any number.
    pub samples: Option<u32>,
}

/// A sequence of points: the struct of its parameters, one line in the registry.
pub trait Sequence: Send + Sync {
    /// Module of the kernel, relative to the kernel folder, if it is not that of the name: `sampling/owen_sobol`
    /// for `owen-sobol`.
    fn kernel(&self) -> Option<&'static str> {
        None
    }
    /// Paths and texts of the kernel modules that it brings along, because they are not the program's.
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Whether pixels draw different numbers from it.
    fn seeding(&self) -> Seeding {
        Seeding::PixelSample
    }
    /// What others have to know.
    fn facts(&self) -> Facts;
    /// Words that the kernel reads by `sequence_word`, as long as the demand needs; the demand is
    /// within the limits of the facts.
    fn table(&self, _demand: &Demand) -> Vec<u32> {
        Vec::new()
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Twin of the kernel's `sequence`: a fraction of 2³².
    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32;
}

/// The sequence that `S` declares, under this name; the doc comment of `S` describes it.
pub fn sequence_kind<S: Sequence + Parameters + 'static>(name: &str) -> Registered<dyn Sequence> {
    Registered::new::<S>(name, |params| Ok(Arc::new(S::from_params(params)?)))
}
