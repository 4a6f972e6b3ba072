//! A sequence and a decorrelation of a library user.

use raystone::parameters;
use raystone::sampling::hash::dimension_number;
use raystone::sampling::{Coordinate, Decorrelation, Facts, Partner, SamplerTable, Sequence};

parameters! {
    /// multiples of the golden ratio (an example)
    pub struct Weyl {}
}

impl Sequence for Weyl {
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[("sampling/weyl", include_str!("kernels/sampling/weyl.wesl"))]
    }

    fn facts(&self) -> Facts {
        Facts {
            extensible: true,
            ..Facts::default()
        }
    }

    fn sequence(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        let multiple = at.sample.wrapping_add(1);
        let odd = at.dimension.wrapping_mul(2).wrapping_add(1);
        multiple.wrapping_mul(odd).wrapping_mul(0x9e37_79b9)
    }
}

parameters! {
    /// a random shift for each pixel and dimension (an example)
    pub struct Rotation {}
}

impl Decorrelation for Rotation {
    fn sources(&self) -> &'static [(&'static str, &'static str)] {
        &[(
            "sampling/rotation",
            include_str!("kernels/sampling/rotation.wesl"),
        )]
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure()
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        x.wrapping_add(dimension_number(at))
    }
}
