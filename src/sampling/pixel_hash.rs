//! `pixel-hash`: independent random numbers by hashing pixel, sample, dimension and seed. Twin of
//! `kernels/sampling/pixel_hash.wesl`.

use super::hash::{pcg_hash, wang_hash};
use super::{Coordinate, Sequence};
use crate::config::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// The registry entry.
pub struct PixelHash;

const HASHES: &[&str] = &["pcg", "wang"];

impl Sequence for PixelHash {
    fn name(&self) -> &'static str {
        "pixel-hash"
    }

    fn description(&self) -> &'static str {
        "independent numbers: a hash of pixel, sample, dimension and seed (Jarzynski & Olano 2020; Wang 1997)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/pixel_hash"
    }

    fn parameters(&self) -> ParameterSchema {
        vec![Parameter {
            name: "hash",
            description: "which hash",
            default: ParamValue::Name("pcg".to_owned()),
            range: ParamRange::Choice(HASHES),
        }]
    }

    fn is_random(&self) -> bool {
        true
    }

    fn max_dimensions(&self) -> Option<u32> {
        None
    }

    fn constants(&self, params: &Params) -> Vec<(&'static str, u32)> {
        vec![("WANG", u32::from(params.name("hash") == "wang"))]
    }

    fn sequence(&self, params: &Params, _: &[u32], at: Coordinate) -> u32 {
        let hash = if params.name("hash") == "wang" {
            wang_hash
        } else {
            pcg_hash
        };
        let inner = hash(
            at.sample
                .wrapping_add(hash(at.pixel.wrapping_add(hash(at.seed)))),
        );
        hash(at.dimension.wrapping_add(inner))
    }
}
