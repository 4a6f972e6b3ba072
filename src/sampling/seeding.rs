//! Which pixels draw the same random numbers. CPU version of `kernels/sampling/seeding.wesl`.
//!
//! F. Nilsson and H. Otte dag (master's thesis, Chalmers 2018) seed by the sample alone, which
//! forces rays to be coherent at the price of a pattern that is the same in all pixels (Table 5.3).
//! They propose, but do not implement, a way to hide it (section 6.1.1): the pixels of a workgroup
//! share a seed, and are far apart. Here these are 8 × 8 pixels, each [`STRIDE`] from the next, of
//! a tile of 64 × 64; [`Seeding::Workgroup`] is the same with neighbours.

use raystone_core::parameters;

parameters! {
    /// The parameter of everything that hashes the pixel.
    pub(crate) struct Seeded {
        /// random numbers differ by pixel and sample, by sample only, or by sample and group of 64 pixels (Nilsson & Otte dag 2018)
        seeding: Seeding = Seeding::PixelSample;
    }

    /// Which pixels draw the same random numbers.
    pub enum Seeding {
        /// Each pixel draws its own.
        PixelSample = "pixel-sample",
        /// All pixels draw the same: forced coherence (Nilsson & Otte dag 2018, Table 5.3).
        Sample = "sample",
        /// The 8 × 8 neighbours of a workgroup draw the same.
        Workgroup = "workgroup",
        /// 8 × 8 pixels with a spacing of 8 draw the same (ibid., section 6.1.1).
        Sparse = "sparse",
    }
}

/// Kernel numbers of [`Seeding`], for `SEQUENCE_SEEDING` and `DECORRELATION_SEEDING`.
const PIXEL_SAMPLE: u32 = 0;
const SAMPLE: u32 = 1;
const WORKGROUP: u32 = 2;
const SPARSE: u32 = 3;

/// Pixels of a group in each direction, as in a workgroup.
const EDGE: u32 = 8;
/// Spacing of a sparse group's pixels in each direction.
pub(crate) const STRIDE: u32 = 8;

impl Seeding {
    pub(super) const fn number(self) -> u32 {
        match self {
            Self::PixelSample => PIXEL_SAMPLE,
            Self::Sample => SAMPLE,
            Self::Workgroup => WORKGROUP,
            Self::Sparse => SPARSE,
        }
    }

    /// True if it depends on the pixel's position in the image.
    pub(super) const fn by_width(self) -> bool {
        matches!(self, Self::Workgroup | Self::Sparse)
    }

    /// Spacing of a workgroup's pixels for which they draw the same.
    pub const fn stride(self) -> u32 {
        match self {
            Self::Sparse => STRIDE,
            _ => 1,
        }
    }

    /// CPU version of the kernel's `seed_pixel`: the pixel whose random numbers a pixel draws, in
    /// an image of this width.
    pub(crate) fn seed_pixel(self, pixel: u32, width: u32) -> u32 {
        match self {
            Self::PixelSample => pixel,
            Self::Sample => 0,
            Self::Workgroup | Self::Sparse => {
                let first = |at: u32| at - at % (EDGE * self.stride()) + at % self.stride();
                first(pixel / width) * width + first(pixel % width)
            }
        }
    }
}

/// The pixel for this position when workgroups have pixels of this spacing: a permutation within
/// tiles of `EDGE`·`stride` pixels.
pub fn paired([x, y]: [u32; 2], stride: u32) -> [u32; 2] {
    [x, y].map(|at| {
        let (tile, within) = (at / (EDGE * stride), at % (EDGE * stride));
        let (group, lane) = (within / EDGE, within % EDGE);
        tile * EDGE * stride + lane * stride + group
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::{BTreeMap, BTreeSet};

    /// The fault of a pairing of positions with pixels for an image of whole tiles, if any.
    fn fault(seeding: Seeding, paired: impl Fn([u32; 2], u32) -> [u32; 2]) -> Option<String> {
        let edge = 2 * EDGE * STRIDE;
        let places = || (0..edge).flat_map(|y| (0..edge).map(move |x| [x, y]));
        let pixel = |place| paired(place, seeding.stride());
        let pixels: BTreeSet<_> = places().map(pixel).collect();
        if !pixels.iter().copied().eq(places().map(|[x, y]| [y, x])) {
            return Some("it is no bijection".to_owned());
        }
        let mut seeds: BTreeMap<[u32; 2], BTreeSet<u32>> = BTreeMap::new();
        for place in places() {
            let [x, y] = pixel(place);
            let seed = seeding.seed_pixel(y * edge + x, edge);
            (seeds.entry(place.map(|at| at / EDGE)).or_default()).insert(seed);
        }
        let all: BTreeSet<_> = seeds.values().flatten().collect();
        if seeds.values().any(|of_group| of_group.len() > 1) {
            return Some("a workgroup has several seeds".to_owned());
        }
        (all.len() != seeds.len()).then(|| "workgroups share a seed".to_owned())
    }

    #[test]
    fn each_workgroup_has_one_seed_of_its_own_and_each_pixel_one_place() {
        for seeding in [Seeding::Workgroup, Seeding::Sparse] {
            assert_eq!(fault(seeding, paired), None, "{seeding:?}");
        }
        // Neighbours of a sparse group's pixel belong to others.
        let seed = |x| Seeding::Sparse.seed_pixel(x, 256);
        assert_eq!([seed(0), seed(8), seed(56), seed(64)], [0, 0, 0, 64]);
        let others: BTreeSet<u32> = (0..8).map(seed).collect();
        assert_eq!(others.len(), 8);
    }

    #[test]
    fn pairings_that_are_none_are_seen() {
        let sparse = |with: fn([u32; 2], u32) -> [u32; 2]| fault(Seeding::Sparse, with);
        let says = |fault: Option<String>, what: &str| assert_eq!(fault.as_deref(), Some(what));
        says(
            sparse(|at, stride| paired(at, stride / 2)),
            "a workgroup has several seeds",
        );
        says(
            sparse(|[x, y], stride| paired([x & !1, y], stride)),
            "it is no bijection",
        );
        says(sparse(|at, _| at), "a workgroup has several seeds");
        says(
            fault(Seeding::PixelSample, paired),
            "a workgroup has several seeds",
        );
        says(fault(Seeding::Sample, paired), "workgroups share a seed");
    }
}
