//! `r2`: multiples of powers of a generalised golden ratio. Twin of `kernels/sampling/r2.wesl`.
//!
//! Source: M. Roberts, "The unreasonable effectiveness of quasirandom sequences", 2018:
//! x_j(i) = ½ + (i + 1) φ_d^(−j−1) modulo 1, where φ_d is the positive root of x^(d+1) = x + 1. The
//! powers are fractions of 2³², so point i is off by less than (i + 1) / 2³³.

use super::{Coordinate, Demand, Facts, SamplerTable, Sequence};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// The registry entry.
pub struct R2;

/// φ_d by Newton's method from above, with nothing but products: the same on every machine.
fn generalised_golden_ratio(dimensions: u32) -> f64 {
    let mut x = 2.0_f64;
    for _ in 0..64 {
        let power = (0..dimensions).fold(1.0, |power, _| power * x);
        let slope = f64::from(dimensions + 1) * power - 1.0;
        x -= (power * x - x - 1.0) / slope;
    }
    x
}

impl Sequence for R2 {
    fn name(&self) -> &'static str {
        "r2"
    }

    fn description(&self) -> &'static str {
        "additive recurrence with powers of a generalised golden ratio (Roberts 2018)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/r2"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![Parameter {
            name: "dimensions",
            description: "d of the ratio's equation x^(d+1) = x + 1: all dimensions that are drawn",
            default: ParamValue::Integer(2),
            range: ParamRange::Integer { min: 1, max: 256 },
        }]
    }

    fn facts(&self, params: &Params) -> Facts {
        Facts {
            extensible: true,
            dimensions: Some(params.integer("dimensions") as u32),
            ..Facts::default()
        }
    }

    fn table(&self, params: &Params, demand: &Demand) -> Vec<u32> {
        let step = 1.0 / generalised_golden_ratio(params.integer("dimensions") as u32);
        let mut power = 2.0_f64.powi(32);
        let mut next = |_| {
            power *= step;
            power.round() as u32
        };
        (0..demand.dimensions).map(&mut next).collect()
    }

    fn sequence(&self, _: &Params, table: &SamplerTable, at: Coordinate) -> u32 {
        let multiple = at
            .sample
            .wrapping_add(1)
            .wrapping_mul(table.sequence_word(at.dimension));
        multiple.wrapping_add(0x8000_0000)
    }
}
