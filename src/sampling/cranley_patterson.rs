//! `cranley-patterson`: each pixel and dimension adds its own random shift modulo 1. Twin of
//! `kernels/sampling/cranley_patterson.wesl`.
//!
//! Source: R. Cranley, T. Patterson, "Randomization of number theoretic methods for multiple
//! integration", SIAM J. Numer. Anal. 13, 1976. On fractions of 2³² the wrap is exact.

use super::hash::pcg_hash;
use super::{Coordinate, Decorrelation};

/// The registry entry.
pub struct CranleyPatterson;

impl Decorrelation for CranleyPatterson {
    fn name(&self) -> &'static str {
        "cranley-patterson"
    }

    fn description(&self) -> &'static str {
        "a random shift modulo 1 for each pixel and dimension (Cranley & Patterson 1976)"
    }

    fn kernel(&self) -> &'static str {
        "sampling/cranley_patterson"
    }

    fn is_random(&self) -> bool {
        true
    }

    fn decorrelate(&self, x: u32, at: Coordinate) -> u32 {
        let shift = pcg_hash(
            at.dimension
                .wrapping_add(pcg_hash(at.pixel.wrapping_add(pcg_hash(at.seed)))),
        );
        x.wrapping_add(shift)
    }
}
