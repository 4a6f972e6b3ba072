//! `owen-sobol`: Sobol points with order and digits scrambled by hashes. CPU version of
//! `kernels/sampling/owen_sobol.wesl`.
//!
//! Source: B. Burley, "Practical hash-based Owen scrambling", JCGT 9(4), 2020, as in the crate
//! `sobol_burley`: the numbers of a pixel are bit-identical to `sobol_burley::sample(sample,
//! dimension, pixel_number)`. Words: 16 direction numbers per dimension, bits in reverse order,
//! which limits it to 2¹⁶ samples.

use super::hash::pixel_number;
use super::owen::{owen_key, scramble_reversed};
use super::sobol::direction_numbers;
use super::{Coordinate, Demand, Facts, SamplerTable, Seeded, Seeding, Sequence};
use raystone_core::parameters;

parameters! {
    /// Sobol points Owen-scrambled and shuffled by hashing, as the crate sobol_burley (Burley 2020)
    pub(crate) struct OwenSobol {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

const BITS: usize = 16;
const INDEX_KEY: u32 = 0x79c6_8e4a;
const SEED_FACTOR: u32 = 0x9c8f_2d3b;

impl Sequence for OwenSobol {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn facts(&self) -> Facts {
        Facts {
            random: true,
            independent: self.seeded.seeding == Seeding::PixelSample,
            base_2: true,
            dimensions: Some(256),
            samples: Some(1 << BITS),
            ..Facts::default()
        }
    }

    fn table(&self, demand: &Demand) -> Vec<u32> {
        let numbers = direction_numbers(demand.dimensions, BITS);
        numbers.into_iter().map(u32::reverse_bits).collect()
    }

    fn sequence(&self, table: &SamplerTable, at: Coordinate) -> u32 {
        let seed = pixel_number(at);
        let index = scramble_reversed(at.sample.reverse_bits(), owen_key(seed ^ INDEX_KEY));
        let mut rest = index & 0xffff_0000;
        let mut column = at.dimension * BITS as u32;
        let mut x = 0;
        while rest > 0 {
            if rest & 0x8000_0000 != 0 {
                x ^= table.sequence_word(column);
            }
            rest <<= 1;
            column += 1;
        }
        let lanes = [0x912f_69ba, 0x174f_18ab, 0x691e_72ca, 0xb40c_c1b8];
        let lane: u32 = lanes[at.dimension as usize & 3];
        let key = (at.dimension >> 2) ^ seed.wrapping_mul(SEED_FACTOR) ^ lane;
        scramble_reversed(x, owen_key(key)).reverse_bits()
    }
}
