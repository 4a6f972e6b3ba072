//! The radical inverse in one base. CPU version of `kernels/sampling/van_der_corput.wesl`.

use super::radical_inverse::radical_inverse;
use super::{Coordinate, Facts, SamplerTable, Sequence};
use raystone_core::parameters;

parameters! {
    /// radical inverse in one base, one-dimensional, from index 0 (van der Corput 1935)
    pub(crate) struct VanDerCorput {
        /// base of the digits
        base: u32 = 2, in 2..=1024;
    }
}

impl Sequence for VanDerCorput {
    fn facts(&self) -> Facts {
        Facts {
            base_2: self.base == 2,
            extensible: true,
            dimensions: Some(1),
            ..Facts::default()
        }
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        vec![("BASE", self.base)]
    }

    fn sequence(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        radical_inverse(at.sample, self.base)
    }
}
