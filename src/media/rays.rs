//! Rays through a medium: random ones, and ones that its voxels make hard.

use crate::walk::MediumRay;
use crate::{Medium, Volume};
use glam::DVec3;
use raystone_core::random::Pcg32;

/// A ray with the distances at which it enters and leaves what is filled of the medium's box.
#[derive(Debug, Clone, Copy)]
pub struct SegmentRay {
    /// The ray, in voxels.
    pub ray: MediumRay,
    /// First distance.
    pub from: f32,
    /// Last distance.
    pub to: f32,
}

impl SegmentRay {
    /// The part of a line in a volume; `None` where it misses it. Distances count from where it enters, for the sake of
    /// their digits.
    pub fn new(volume: &Volume, medium: &Medium, origin: DVec3, direction: DVec3) -> Option<Self> {
        let [enter, leave] = volume.clip(origin, direction)?;
        let ray = MediumRay::new(medium, origin + direction * enter, direction);
        let [from, to] = [0.0, (leave - enter) as f32];
        (from < to).then_some(Self { ray, from, to })
    }

    /// The words that kernels read.
    pub(crate) fn words(&self) -> [f32; 8] {
        let ([a, b, c], [d, e, f]) = (self.ray.origin.to_array(), self.ray.direction.to_array());
        [a, b, c, self.from, d, e, f, self.to]
    }
}

/// `count` rays that meet a volume: half of them between random points around it, half hard. A hard ray goes along
/// an axis or a diagonal, exactly or nearly; begins at a corner, an edge, a face or the middle of a voxel; or lies in a
/// plane between voxels.
pub fn random_and_hard(
    volume: &Volume,
    medium: &Medium,
    count: usize,
    seed: u64,
) -> Vec<SegmentRay> {
    let mut random = Pcg32::new(seed);
    let mut rays = Vec::with_capacity(count);
    let size = volume.high - volume.low;
    let middle = (volume.low + volume.high) / 2.0;
    while rays.len() < count {
        let (origin, direction) = if rays.len() % 2 == 0 {
            let origin = middle + random.in_cube() * size;
            let to = middle + random.in_cube() * size / 2.0;
            (origin, (to - origin).normalize())
        } else {
            hard(volume, &mut random)
        };
        rays.extend(SegmentRay::new(volume, medium, origin, direction));
    }
    rays
}

fn hard(volume: &Volume, random: &mut Pcg32) -> (DVec3, DVec3) {
    let size = volume.high - volume.low;
    let n = DVec3::from(volume.resolution.map(f64::from));
    // A corner, a middle, or anything, on each axis.
    let place = [0, 1, 2].map(|axis| {
        let voxel = random.below(volume.resolution[axis] as usize + 1) as f64;
        match random.below(4) {
            0 | 1 => voxel,
            2 => voxel - 0.5,
            _ => random.uniform() * n[axis],
        }
    });
    let through = volume.low + DVec3::from(place) / n * size;
    let tiny = random.one_of(&[0.0, 1e-3, 1e-6, 1e-9, 1e-20]);
    let sign = [1.0, -1.0, 0.0];
    let mut direction = DVec3::from([(); 3].map(|()| random.one_of(&sign)));
    if direction == DVec3::ZERO {
        direction = DVec3::X;
    }
    let direction = ((direction * size / n) + random.in_cube() * tiny * size / n).normalize();
    let back = random.one_of(&[0.0, 0.0, 1.0, 3.0]);
    (through - direction * back, direction)
}
