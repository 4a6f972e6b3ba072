//! `none`: every pixel uses the same points, as in the coherent path tracer of Dufay 2017. CPU
//! version of `kernels/sampling/no_decorrelation.wesl`.

use super::{Coordinate, Decorrelation, Partner, SamplerTable};
use raystone_core::parameters;

parameters! {
    /// every pixel uses the same points: coherent rays, structured error (Dufay 2017)
    pub(crate) struct NoDecorrelation {}
}

impl Decorrelation for NoDecorrelation {
    fn kernel(&self) -> Option<&'static str> {
        Some("sampling/no_decorrelation")
    }

    fn is_random(&self) -> bool {
        false
    }

    fn refusal(&self, _: &Partner) -> Option<String> {
        None
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, _: Coordinate) -> u32 {
        x
    }
}
