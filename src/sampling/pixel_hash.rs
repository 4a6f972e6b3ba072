//! `pixel-hash`: independent random numbers by hashing pixel, sample, dimension and seed. CPU
//! version of `kernels/sampling/pixel_hash.wesl`.

use super::hash::{pcg_hash, strided, wang_hash};
use super::trig_hash::trig_hash;
use super::{Coordinate, Facts, SamplerTable, Seeded, Seeding, Sequence};
use raystone_core::parameters;

parameters! {
    /// independent numbers: a hash of pixel, sample, dimension and seed (Jarzynski & Olano 2020; Wang
    /// 1997; Dufay 2017 Alg. 5.1)
    pub(crate) struct PixelHash {
        /// which hash; trig is a negative control
        hash: Hash = Hash::Pcg;
        /// Whether pixels differ.
        seeded: Seeded;
    }

    /// The hash function.
    pub enum Hash {
        /// PCG's output permutation (Jarzynski & Olano 2020).
        Pcg = "pcg",
        /// Wang's integer hash (1997).
        Wang = "wang",
        /// The fraction of a large sine.
        Trig = "trig",
    }
}

const WANG: u32 = 1;
const TRIG: u32 = 2;

impl Sequence for PixelHash {
    fn seeding(&self) -> Seeding {
        self.seeded.seeding
    }

    fn facts(&self) -> Facts {
        Facts {
            random: true,
            independent: true,
            ..Facts::default()
        }
    }

    fn constants(&self) -> Vec<(&'static str, u32)> {
        let hash = match self.hash {
            Hash::Pcg => 0,
            Hash::Wang => WANG,
            Hash::Trig => TRIG,
        };
        vec![("HASH", hash)]
    }

    fn sequence(&self, _: &SamplerTable, at: Coordinate) -> u32 {
        let hash = match self.hash {
            Hash::Trig => return trig_hash(at),
            Hash::Wang => wang_hash,
            Hash::Pcg => pcg_hash,
        };
        let pixel = hash(strided(hash(at.seed), at.pixel));
        hash(strided(hash(strided(pixel, at.sample)), at.dimension))
    }
}
