//! A medium on a grid, as structures over it see it. Kernel: `kernels/volume/medium.wesl`.

use crate::volume::{to_half, voxel_at};
use crate::{Volume, VolumeStructure};
use glam::{BVec3, DVec3, UVec3, Vec2};
use raystone_core::clock::Instant;
use raystone_core::parameters;
use std::collections::HashMap;
use std::sync::Arc;

parameters! {
    /// What a homogeneous box is.
    pub enum Key {
        /// its refractive index is nearly constant (Pfeuti 2009)
        Refraction = "n",
        /// its extinction is nearly constant
        Extinction = "sigma",
        /// both are nearly constant
        Both = "both",
        /// it is empty: n = 1 and σ = 0
        Empty = "empty",
    }

    /// When a box of voxels counts as homogeneous.
    #[derive(Copy)]
    pub struct Homogeneity {
        /// quantities that must be nearly constant
        key: Key = Key::Extinction;
        /// how much n may differ, and σ as a share of its maximum
        epsilon: f64 = 0.0, in 0.0..=10.0;
    }
}

/// Least and greatest value of n and of σ.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Pair {
    /// Of the refractive index.
    pub n: Vec2,
    /// Of the extinction.
    pub sigma: Vec2,
}

impl Pair {
    /// Of no voxel.
    pub const NONE: Self = Self {
        n: Vec2::new(65504.0, 0.0),
        sigma: Vec2::new(65504.0, 0.0),
    };

    /// Of two sets of voxels.
    #[must_use]
    pub fn joined(self, other: Self) -> Self {
        let join = |a: Vec2, b: Vec2| Vec2::new(a.x.min(b.x), a.y.max(b.y));
        Self {
            n: join(self.n, other.n),
            sigma: join(self.sigma, other.sigma),
        }
    }

    fn packed(self) -> [u32; 2] {
        [self.n, self.sigma].map(pack_halves)
    }
}

/// Voxels `low ≤ v < high`, with bounds for what is read trilinearly in them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Region {
    /// The lowest voxel.
    pub low: UVec3,
    /// One beyond the highest.
    pub high: UVec3,
    /// Least and greatest refractive index.
    pub n: Vec2,
    /// Least and greatest extinction.
    pub sigma: Vec2,
    /// True if it counts as homogeneous.
    pub homogeneous: bool,
}

/// A volume with a structure over it, ready for the device.
#[derive(Clone)]
pub struct Medium {
    /// Voxels along each axis.
    pub resolution: UVec3,
    /// The longest axis has at most 2^levels voxels.
    pub levels: u32,
    /// The highest level of cubes that the structure asks for.
    pub top: u32,
    /// What n and σ may differ by in a homogeneous box.
    pub spans: Vec2,
    /// 1 if such a box also has n = 1 and σ = 0.
    pub empty: u32,
    /// n and σ of each voxel, as half floats.
    pub field: Vec<u32>,
    /// Bounds, as half floats.
    pub pairs: Vec<[u32; 2]>,
    /// What leads to them.
    pub index: Vec<u32>,
    /// Milliseconds of the build: dilation, bounds and what leads to them.
    pub build_ms: f64,
    /// The structure.
    pub structure: Arc<dyn VolumeStructure>,
    low: DVec3,
    voxel: DVec3,
}

impl Medium {
    /// Builds a structure over a volume.
    pub fn new(
        volume: &Volume,
        structure: Arc<dyn VolumeStructure>,
        homogeneity: Homogeneity,
    ) -> Self {
        let sigma = (volume.scattering.iter().zip(&volume.absorption)).map(|(s, a)| s + a);
        let field: Vec<u32> = (volume.refraction.iter().zip(sigma))
            .map(|(n, sigma)| pack_halves(Vec2::new(*n, sigma)))
            .collect();
        Self::over(volume, field, structure, homogeneity)
    }

    /// Builds a structure over pairs of half floats, of each voxel of a volume.
    pub(crate) fn over(
        volume: &Volume,
        field: Vec<u32>,
        structure: Arc<dyn VolumeStructure>,
        homogeneity: Homogeneity,
    ) -> Self {
        let resolution = UVec3::from(volume.resolution);
        let most = field
            .iter()
            .map(|v| unpack_halves(*v).y)
            .fold(0.0, f32::max);
        let epsilon = homogeneity.epsilon as f32;
        let [n, sigma] = match homogeneity.key {
            Key::Refraction => [epsilon, f32::MAX],
            Key::Extinction => [f32::MAX, epsilon * most],
            Key::Both => [epsilon, epsilon * most],
            Key::Empty => [0.0, 0.0],
        };
        let mut medium = Self {
            resolution,
            levels: resolution.max_element().next_power_of_two().ilog2(),
            top: 0,
            spans: Vec2::new(n, sigma),
            empty: u32::from(homogeneity.key == Key::Empty),
            field,
            pairs: Vec::new(),
            index: Vec::new(),
            build_ms: 0.0,
            structure,
            low: volume.low,
            voxel: (volume.high - volume.low) / resolution.as_dvec3(),
        };
        let start = Instant::now();
        let parts = medium.structure.parts(&medium);
        medium.pairs = parts.pairs.iter().map(|pair| pair.packed()).collect();
        medium.index = parts.index;
        medium.top = parts.top;
        medium.build_ms = start.elapsed().as_secs_f64() * 1e3;
        medium
    }

    /// Bytes of the structure, without the field.
    pub fn bytes(&self) -> u64 {
        (self.pairs.len() * 8 + self.index.len() * 4) as u64
    }

    /// Returns a position in voxels.
    pub fn in_voxels(&self, position: DVec3) -> DVec3 {
        (position - self.low) / self.voxel
    }

    /// Returns a direction or another difference of positions in voxels.
    pub fn difference_in_voxels(&self, difference: DVec3) -> DVec3 {
        difference / self.voxel
    }

    /// Size of a voxel in the world.
    pub fn size_of_voxel(&self) -> DVec3 {
        self.voxel
    }

    /// The region of a structure around a voxel; `fetches` counts what is read.
    pub fn region_of(&self, voxel: UVec3, fetches: &mut u32) -> Region {
        self.structure.region_of(self, voxel, fetches)
    }

    /// Of each voxel the bounds of what is read trilinearly in it: of the voxel and its 26 neighbours.
    pub fn dilated(&self) -> Vec<Pair> {
        let mut pairs: Vec<Pair> = (self.field.iter())
            .map(|value| {
                let value = unpack_halves(*value);
                Pair {
                    n: Vec2::splat(value.x),
                    sigma: Vec2::splat(value.y),
                }
            })
            .collect();
        self.dilate(&mut pairs);
        pairs
    }

    /// Joins the bounds of each voxel with those of its 26 neighbours.
    pub fn dilate(&self, pairs: &mut Vec<Pair>) {
        use rayon::prelude::*;
        let sides = self.resolution.to_array().map(|n| n as usize);
        let strides = [1, sides[0], sides[0] * sides[1]];
        for (side, stride) in sides.into_iter().zip(strides) {
            let joined = |place: usize| {
                let along = place / stride % side;
                let mut pair = pairs[place];
                if along > 0 {
                    pair = pair.joined(pairs[place - stride]);
                }
                if along + 1 < side {
                    pair = pair.joined(pairs[place + stride]);
                }
                pair
            };
            *pairs = (0..pairs.len()).into_par_iter().map(joined).collect();
        }
    }

    /// Bounds of all cubes of 2^level voxels, level by level, from dilated bounds of voxels (Pfeuti 2009, §3.3).
    pub fn pyramid(&self, voxels: &[Pair]) -> Vec<Pair> {
        let side = 1_u32 << self.levels;
        let total = self.level_start(self.levels) + 1;
        let mut pyramid = vec![Pair::NONE; total as usize];
        for (place, pair) in voxels.iter().enumerate() {
            let voxel = UVec3::from(voxel_at(self.resolution.to_array(), place));
            pyramid[self.cube_index(voxel, 0) as usize] = *pair;
        }
        for level in 1..=self.levels {
            let cubes = (side >> level).pow(3);
            for cube in 0..cubes {
                let low = UVec3::from(voxel_at([side >> level; 3], cube as usize)) << level;
                let child = |k: u32| {
                    let offset = UVec3::new(k & 1, k >> 1 & 1, k >> 2) << (level - 1);
                    pyramid[self.cube_index(low + offset, level - 1) as usize]
                };
                let pair = (0..8).map(child).fold(Pair::NONE, Pair::joined);
                pyramid[self.cube_index(low, level) as usize] = pair;
            }
        }
        pyramid
    }

    /// A region with these bounds.
    pub fn bounded(&self, low: UVec3, high: UVec3, pair: [u32; 2]) -> Region {
        let [n, sigma] = pair.map(unpack_halves);
        Region {
            low,
            high,
            n,
            sigma,
            homogeneous: self.is_homogeneous(n, sigma),
        }
    }

    /// True if these bounds are those of a homogeneous box.
    pub fn is_homogeneous(&self, n: Vec2, sigma: Vec2) -> bool {
        let even = n.y - n.x <= self.spans.x && sigma.y - sigma.x <= self.spans.y;
        even && (self.empty == 0 || (n.x == 1.0 && n.y == 1.0 && sigma.y == 0.0))
    }

    /// Place of a voxel.
    pub fn voxel_index(&self, voxel: UVec3) -> u32 {
        voxel.x + self.resolution.x * (voxel.y + self.resolution.y * voxel.z)
    }

    /// Where a level begins in a pyramid of cubes of 2^level voxels.
    pub fn level_start(&self, level: u32) -> u32 {
        let side = 1_u32 << self.levels;
        let above = side >> level;
        (side * side * side - above * above * above) / 7 * 8
    }

    /// Place of the cube of 2^level voxels around a voxel.
    pub fn cube_index(&self, voxel: UVec3, level: u32) -> u32 {
        let side = (1_u32 << self.levels) >> level;
        let cube = voxel >> level;
        self.level_start(level) + cube.x + side * (cube.y + side * cube.z)
    }

    /// The cube of 2^level voxels around a voxel, or what the grid has of it.
    pub fn cube_of(&self, voxel: UVec3, level: u32, pair: [u32; 2]) -> Region {
        let low = (voxel >> level) << level;
        self.bounded(low, (low + (1 << level)).min(self.resolution), pair)
    }

    pub(crate) fn fetch_pair(&self, place: u32, fetches: &mut u32) -> [u32; 2] {
        *fetches += 1;
        self.pairs[place as usize]
    }

    pub(crate) fn fetch_index(&self, place: u32, fetches: &mut u32) -> u32 {
        *fetches += 1;
        self.index[place as usize]
    }

    pub(crate) fn fetch_field(&self, place: u32) -> u32 {
        self.field[place as usize]
    }

    /// Byte `place` of the index.
    pub(crate) fn fetch_byte(&self, place: u32, fetches: &mut u32) -> u32 {
        (self.fetch_index(place >> 2, fetches) >> (8 * (place & 3))) & 255
    }

    /// n and σ at a position in voxels, in f64: see [`crate::walk::field_at`].
    pub fn exact_at(&self, position: DVec3) -> [f64; 2] {
        let most = (self.resolution - 1).as_dvec3();
        let local = (position - 0.5).max(DVec3::ZERO).min(most);
        let low = local.as_uvec3();
        let w = local - low.as_dvec3();
        let mut sum = [0.0; 2];
        for k in 0..8 {
            let offset = UVec3::new(k & 1, k >> 1 & 1, k >> 2);
            let place = self.voxel_index((low + offset).min(self.resolution - 1));
            let value = unpack_halves(self.field[place as usize]).as_dvec2();
            let weight = DVec3::select(offset.cmpeq(UVec3::ONE), w, 1.0 - w).element_product();
            sum = [sum[0] + weight * value.x, sum[1] + weight * value.y];
        }
        sum
    }

    /// Checks the structure's answer for one voxel of `every` against the field: the region of each holds it, lies in the grid, and
    /// its bounds and its homogeneity are those of its voxels and their neighbours.
    ///
    /// # Errors
    /// The first voxel with a wrong answer, and what is wrong.
    pub fn validate(&self, every: usize) -> Result<(), crate::MediaError> {
        let dilated = self.dilated();
        let invalid = |voxel: UVec3, problem: String| crate::MediaError::Invalid {
            voxel: voxel.to_array(),
            problem,
        };
        let mut known = HashMap::new();
        for place in (0..self.field.len()).step_by(every) {
            let voxel = UVec3::from(voxel_at(self.resolution.to_array(), place));
            let region = self.region_of(voxel, &mut 0);
            let inside = voxel.cmpge(region.low) & voxel.cmplt(region.high);
            if inside != BVec3::TRUE || region.high.cmpgt(self.resolution).any() {
                return Err(invalid(
                    voxel,
                    format!("that it lies in {} to {}", region.low, region.high),
                ));
            }
            let of_region = known.entry((region.low, region.high));
            let truth = *of_region.or_insert_with(|| self.truth_of(&region, &dilated));
            if region.n != truth.n || region.sigma != truth.sigma {
                let told = (region.n, region.sigma);
                let problem = format!("bounds {told:?} where its voxels have {truth:?}");
                return Err(invalid(voxel, problem));
            }
            if region.homogeneous != self.is_homogeneous(truth.n, truth.sigma) {
                return Err(invalid(
                    voxel,
                    "homogeneous of a box that is not, or the opposite".to_owned(),
                ));
            }
        }
        Ok(())
    }

    /// The bounds of a region, from those of its voxels.
    fn truth_of(&self, region: &Region, dilated: &[Pair]) -> Pair {
        let mut truth = Pair::NONE;
        for z in region.low.z..region.high.z {
            for y in region.low.y..region.high.y {
                let row = self.voxel_index(UVec3::new(region.low.x, y, z)) as usize;
                let row = &dilated[row..row + (region.high.x - region.low.x) as usize];
                truth = row.iter().fold(truth, |all, pair| all.joined(*pair));
            }
        }
        truth
    }
}

/// Two floats as halves, the first in the lower bits.
pub fn pack_halves(value: Vec2) -> u32 {
    let [low, high] = value.to_array().map(|v| u32::from(to_half(v).to_bits()));
    low | high << 16
}

/// The opposite of [`pack_halves`].
pub fn unpack_halves(word: u32) -> Vec2 {
    Vec2::new(from_half(word & 0xffff), from_half(word >> 16))
}

/// A half float, which is 0 or normal and not negative.
fn from_half(bits: u32) -> f32 {
    if bits == 0 {
        0.0
    } else {
        f32::from_bits((bits << 13) + 0x3800_0000)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_come_back() {
        for bits in (0..=0x7bff_u32).filter(|bits| *bits == 0 || *bits >= 0x400) {
            let value = half::f16::from_bits(bits as u16).to_f32();
            assert_eq!(from_half(bits), value);
            assert_eq!(pack_halves(Vec2::new(value, 1.0)), bits | 0x3c00_0000);
        }
        assert_eq!(
            unpack_halves(pack_halves(Vec2::new(1e-9, 65504.0))),
            Vec2::new(0.0, 65504.0)
        );
    }

    #[test]
    fn with_both_keys_the_extinction_may_vary_by_a_share_of_its_greatest() {
        let volume = Volume::new([4, 1, 1], |at| {
            [if at.x < 0.5 { 10.0 } else { 2.0 }, 0.0, 1.0]
        });
        let homogeneity = Homogeneity {
            key: Key::Both,
            epsilon: 0.25,
        };
        let dda = crate::structure::registry();
        let dda = dda
            .iter()
            .next()
            .expect("a structure")
            .make(&Default::default());
        let medium = Medium::new(&volume.unwrap(), dda.unwrap(), homogeneity);
        let even = |n: [f32; 2], sigma: [f32; 2]| medium.is_homogeneous(n.into(), sigma.into());
        assert!(even([1.0, 1.25], [7.5, 10.0]) && even([1.0, 1.0], [0.0, 2.5]));
        assert!(!even([1.0, 1.5], [10.0, 10.0]) && !even([1.0, 1.0], [7.0, 10.0]));
    }
}
