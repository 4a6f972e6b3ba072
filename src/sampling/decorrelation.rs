//! The interface of decorrelations.

use super::{Coordinate, Demand, Facts, SamplerTable, Seeding};
use raystone_core::params::{Parameters, Registered};
use std::sync::Arc;

/// The sequence that a decorrelation is combined with.
#[derive(Debug, Clone, Copy)]
pub struct Partner<'a> {
    /// Its name.
    pub name: &'a str,
    /// Its properties.
    pub facts: Facts,
}

impl Partner<'_> {
    /// A reason to reject a sequence whose pixels are already independent.
    pub fn without_structure(&self) -> Option<String> {
        let reason = || {
            format!(
                "{} draws independent numbers in every pixel, there is nothing to decorrelate; take none",
                self.name
            )
        };
        self.facts.independent.then(reason)
    }

    /// A reason to reject a sequence whose structure is destroyed by exclusive or.
    pub(crate) fn not_base_2(&self) -> Option<String> {
        let reason = || {
            format!(
                "it works on the binary digits of points, and {} is not digital in base 2; take \
                 cranley-patterson",
                self.name
            )
        };
        (!self.facts.base_2).then(reason)
    }

    /// A reason to reject a sequence whose index must not be moved.
    pub(crate) fn not_extensible(&self) -> Option<String> {
        let reason = || {
            format!(
                "it moves the index, and {} is good from its first point on only; take a shift",
                self.name
            )
        };
        (!self.facts.extensible).then(reason)
    }
}

/// A decorrelation of pixels: its parameter struct, with one line in the registry.
pub trait Decorrelation: Send + Sync {
    /// Kernel module, relative to the kernel folder, if it differs from the name:
    /// `sampling/owen_sobol` for `owen-sobol`.
    fn kernel(&self) -> Option<&'static str> {
        None
    }
    /// Paths and texts of its own kernel modules, for decorrelations that are not built in.
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[]
    }
    /// Which pixels draw the same numbers from it.
    fn seeding(&self) -> Seeding {
        Seeding::PixelSample
    }
    /// True if another seed gives other points.
    fn is_random(&self) -> bool {
        true
    }
    /// True if the mean over seeds of an estimate with a fixed sequence is the integral, at any
    /// number of samples: every number is uniform in [0, 1). One that is biased by design may be
    /// found to be biased without being at fault.
    fn is_unbiased(&self) -> bool {
        self.is_random()
    }
    /// True if it depends on the number of samples.
    fn by_count(&self) -> bool {
        false
    }
    /// True if it depends on the pixel's position in the image.
    fn by_width(&self) -> bool {
        false
    }
    /// Maximum dimensions and samples; `None` is unlimited.
    fn limits(&self) -> [Option<u32>; 2] {
        [None, None]
    }
    /// The reason why it cannot be combined with this sequence, if any.
    fn refusal(&self, partner: &Partner) -> Option<String>;
    /// Words that the kernel reads by `decorrelation_word`.
    ///
    /// # Errors
    /// A description of a file that is unreadable or invalid, or of a demand that cannot be met.
    fn table(&self, _partner: &Partner, _demand: &Demand) -> Result<Vec<u32>, String> {
        Ok(Vec::new())
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// CPU version of the kernel's `index`: the index of the sample's point in the sequence.
    fn index(&self, table: &SamplerTable, at: Coordinate) -> u32;
    /// CPU version of the kernel's `decorrelate`: moves the fraction `x` of 2³².
    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32;
}

/// The decorrelation declared by `D`, under this name; the doc comment of `D` describes it.
pub fn decorrelation_kind<D: Decorrelation + Parameters + 'static>(
    name: &str,
) -> Registered<dyn Decorrelation> {
    Registered::new::<D>(name, |params| Ok(Arc::new(D::from_params(params)?)))
}
