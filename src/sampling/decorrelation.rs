//! What a decorrelation is.

use super::{Coordinate, Demand, Facts, SamplerTable, Seeding};
use raystone_core::params::{Parameters, Registered};
use std::sync::Arc;

/// The sequence that a decorrelation is to work on.
#[derive(Debug, Clone, Copy)]
pub struct Partner<'a> {
    /// Its name.
    pub name: &'a str,
    /// What is to be known of it.
    pub facts: Facts,
}

impl Partner<'_> {
    /// A reason to refuse a sequence whose pixels are independent already.
    pub fn without_structure(&self) -> Option<String> {
        let reason = || {
            format!(
                "{} draws independent numbers in every pixel, there is nothing to decorrelate; take none",
                self.name
            )
        };
        self.facts.independent.then(reason)
    }

    /// A reason to refuse a sequence whose structure exclusive or destroys.
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

    /// A reason to refuse a sequence whose index must not be moved.
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

/// A decorrelation of pixels: the struct of its parameters, one line in the registry.
pub trait Decorrelation: Send + Sync {
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
    /// Whether another seed gives other points.
    fn is_random(&self) -> bool {
        true
    }
    /// Whether the mean over seeds of an estimate by a fixed sequence is the integral, at any number of
    /// samples: every number that it makes is uniform in [0, 1). One that is not, by design, may be
    /// found to be biased without being at fault.
    fn is_unbiased(&self) -> bool {
        self.is_random()
    }
    /// Whether it depends on how many samples are drawn.
    fn by_count(&self) -> bool {
        false
    }
    /// Whether it depends on where the pixel lies in the image.
    fn by_width(&self) -> bool {
        false
    }
    /// Dimensions and samples it has; `None` is any number.
    fn limits(&self) -> [Option<u32>; 2] {
        [None, None]
    }
    /// Why it makes no sense with this sequence, if so.
    fn refusal(&self, partner: &Partner) -> Option<String>;
    /// Words that the kernel reads by `decorrelation_word`.
    ///
    /// # Errors
    /// A file cannot be read or holds something else, or the demand cannot be met: in words.
    fn table(&self, _partner: &Partner, _demand: &Demand) -> Result<Vec<u32>, String> {
        Ok(Vec::new())
    }
    /// Constants of `package::active::constants` that the kernel imports.
    fn constants(&self) -> Vec<(&'static str, u32)> {
        Vec::new()
    }
    /// Twin of the kernel's `index`: which point of the sequence the sample takes.
    fn index(&self, table: &SamplerTable, at: Coordinate) -> u32;
    /// Twin of the kernel's `decorrelate`: moves the fraction `x` of 2³².
    fn decorrelate(&self, x: u32, table: &SamplerTable, at: Coordinate) -> u32;
}

/// The decorrelation that `D` declares, under this name; the doc comment of `D` describes it.
pub fn decorrelation_kind<D: Decorrelation + Parameters + 'static>(
    name: &str,
) -> Registered<dyn Decorrelation> {
    Registered::new::<D>(name, |params| Ok(Arc::new(D::from_params(params)?)))
}
