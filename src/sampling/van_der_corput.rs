//! `van-der-corput`: the radical inverse in one base. Twin of `kernels/sampling/van_der_corput.wesl`.

use super::radical_inverse::radical_inverse;
use super::{Coordinate, Facts, SamplerTable, Sequence};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// The registry entry.
pub struct VanDerCorput;

fn base(params: &Params) -> u32 {
    params.integer("base") as u32
}

impl Sequence for VanDerCorput {
    fn name(&self) -> &'static str {
        "van-der-corput"
    }

    fn description(&self) -> &'static str {
        "radical inverse in one base, one-dimensional, from index 0 (van der Corput 1935)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/van_der_corput"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![Parameter {
            name: "base",
            description: "base of the digits",
            default: ParamValue::Integer(2),
            range: ParamRange::Integer { min: 2, max: 1024 },
        }]
    }

    fn facts(&self, params: &Params) -> Facts {
        Facts {
            base_2: base(params) == 2,
            extensible: true,
            dimensions: Some(1),
            ..Facts::default()
        }
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("BASE", base(params))]
    }

    fn sequence(&self, params: &Params, _: &SamplerTable, at: Coordinate) -> u32 {
        radical_inverse(at.sample, base(params))
    }
}
