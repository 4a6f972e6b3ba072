//! `linear-scramble`: a random lower triangular matrix over the bits of a fraction, then a digital
//! shift. CPU version of `kernels/sampling/linear_scramble.wesl`.
//!
//! Source: J. Matoušek, "On the L2-discrepancy for anchored boxes", J. Complexity 14, 1998 (random
//! linear scrambling), with the shift of L'Ecuyer and Lemieux 2002. Bit j of the input, from the
//! highest, adds column j modulo 2: bit j itself and random ones below. The matrix preserves nets
//! in base 2, and the mean of squared errors over matrices and shifts is that of Owen's scrambling,
//! with 32 random words per dimension instead of a bit at each node of a tree. Columns are hashed
//! only where a bit is set: as many as the points have digits.

use super::hash::{dimension_number, pcg_hash};
use super::{Coordinate, Decorrelation, Partner, SamplerTable, Seeded, Seeding};
use raystone_core::parameters;

parameters! {
    /// random linear scrambling of binary digits and a digital shift, for each pixel and dimension
    /// (Matoušek 1998)
    pub(crate) struct LinearScramble {
        /// Whether pixels differ.
        seeded: Seeded;
    }
}

impl Decorrelation for LinearScramble {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn refusal(&self, partner: &Partner) -> Option<String> {
        partner.without_structure().or_else(|| partner.not_base_2())
    }

    fn index(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        at.sample
    }

    fn decorrelate(&self, x: u32, _: &SamplerTable, at: Coordinate) -> u32 {
        let key = dimension_number(at);
        let mut rest = x;
        let mut column = 0;
        let mut y = key;
        while rest > 0 {
            if rest & 0x8000_0000 != 0 {
                y ^= (0x8000_0000 | (pcg_hash(key.wrapping_add(column)) >> 1)) >> column;
            }
            rest <<= 1;
            column += 1;
        }
        y
    }
}
