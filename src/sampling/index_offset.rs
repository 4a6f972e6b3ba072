//! `index-offset`: each pixel begins at another point of the sequence. Twin of
//! `kernels/sampling/index_offset.wesl`.
//!
//! Source: Dufay 2017, §5.3.2, eq. 5.7. He does not say from what range offsets are drawn; here it is a
//! parameter. Pixels with close offsets share points, and neighbouring rays need far-apart indices.

use super::fixed_point::mul_high;
use super::hash::pixel_number;
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeding};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// The registry entry.
pub struct IndexOffset;

fn offsets(params: &Params) -> u32 {
    params.integer("offsets") as u32
}

impl Decorrelation for IndexOffset {
    fn name(&self) -> &'static str {
        "index-offset"
    }

    fn description(&self) -> &'static str {
        "each pixel begins at a random index of the sequence (Dufay 2017 §5.3.2)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/index_offset"
    }

    fn parameters(&self) -> ParameterSchema {
        let offsets = Parameter {
            name: "offsets",
            description: "offsets are drawn from 0 to this, excluded",
            default: ParamValue::Integer(65_536),
            range: ParamRange::Integer {
                min: 2,
                max: 1 << 24,
            },
        };
        vec![offsets, Seeding::parameter()]
    }

    /// The mean is that of the first points of the sequence, as many as there are offsets.
    fn is_unbiased(&self, _: &Params) -> bool {
        false
    }

    fn refusal(&self, _: &Params, partner: &Partner) -> Option<String> {
        partner
            .without_structure()
            .or_else(|| partner.not_extensible())
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("OFFSETS", offsets(params))]
    }

    fn index(&self, params: &Params, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
            .wrapping_add(mul_high(pixel_number(at), offsets(params)))
    }

    fn decorrelate(&self, x: u32, _: &Params, _: &SamplerTable, _: Coordinate) -> u32 {
        x
    }
}
