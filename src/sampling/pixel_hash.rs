//! `pixel-hash`: independent random numbers by hashing pixel, sample, dimension and seed. Twin of
//! `kernels/sampling/pixel_hash.wesl`.

use super::hash::{pcg_hash, wang_hash};
use super::trig_hash::trig_hash;
use super::{Coordinate, Facts, SamplerTable, Seeding, Sequence};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// The registry entry.
pub struct PixelHash;

const HASHES: &[&str] = &["pcg", "wang", "trig"];
const WANG: u32 = 1;
const TRIG: u32 = 2;

impl Sequence for PixelHash {
    fn name(&self) -> &'static str {
        "pixel-hash"
    }

    fn description(&self) -> &'static str {
        "independent numbers: a hash of pixel, sample, dimension and seed (Jarzynski & Olano 2020; Wang 1997; Dufay 2017 Alg. 5.1)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/pixel_hash"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![
            Parameter {
                name: "hash",
                description: "which hash; trig is a negative control",
                default: ParamValue::Name("pcg".to_owned()),
                range: ParamRange::Choice(HASHES),
            },
            Seeding::parameter(),
        ]
    }

    fn facts(&self, _: &Params) -> Facts {
        Facts {
            random: true,
            independent: true,
            ..Facts::default()
        }
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        let hash = match params.name("hash") {
            "wang" => WANG,
            "trig" => TRIG,
            _ => 0,
        };
        vec![("HASH", hash)]
    }

    fn sequence(&self, params: &Params, _: &SamplerTable, at: Coordinate) -> u32 {
        let hash = match params.name("hash") {
            "trig" => return trig_hash(at),
            "wang" => wang_hash,
            _ => pcg_hash,
        };
        let pixel = hash(at.pixel.wrapping_add(hash(at.seed)));
        hash(
            at.dimension
                .wrapping_add(hash(at.sample.wrapping_add(pixel))),
        )
    }
}
