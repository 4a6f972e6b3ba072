//! Volumes: grids of scattering, absorption and refractive index over a box, and the part of it that they fill.

use crate::{MediaError, Phase};
use glam::DVec3;
use half::f16;

/// Most voxels along an axis: places of voxels are packed into ten bits.
pub const MOST_VOXELS: u32 = 512;

/// The part of its box that a medium fills.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Bounds {
    /// All of it.
    Box,
    /// The ball that touches its six sides; an ellipsoid where these differ.
    Sphere,
}

/// A medium on a grid. A constant medium is a grid of one voxel.
#[derive(Debug, Clone, PartialEq)]
pub struct Volume {
    /// Voxels along x, y, z.
    pub resolution: [u32; 3],
    /// Low corner of the box.
    pub low: DVec3,
    /// High corner of the box.
    pub high: DVec3,
    /// What is filled of the box.
    pub bounds: Bounds,
    /// Scattering coefficient σ_s of each voxel, per unit of length, x fastest.
    pub scattering: Vec<f32>,
    /// Absorption coefficient σ_a of each voxel, per unit of length.
    pub absorption: Vec<f32>,
    /// Refractive index n of each voxel.
    pub refraction: Vec<f32>,
    /// The phase function.
    pub phase: Phase,
}

impl Volume {
    /// A volume in the unit cube from a function of the position of each voxel's centre in [0, 1]³, which returns
    /// σ_s, σ_a and n.
    ///
    /// # Errors
    /// As [`Volume::checked`].
    pub fn new(
        resolution: [u32; 3],
        at: impl Fn(DVec3) -> [f32; 3] + Sync,
    ) -> Result<Self, MediaError> {
        use rayon::prelude::*;
        check_resolution(resolution)?;
        let [nx, ny, nz] = resolution;
        let size = DVec3::new(nx.into(), ny.into(), nz.into());
        let value = |index: usize| {
            let [x, y, z] = voxel_at(resolution, index);
            at((DVec3::new(x.into(), y.into(), z.into()) + 0.5) / size)
        };
        let count = voxels(resolution);
        let values: Vec<[f32; 3]> = (0..count).into_par_iter().map(value).collect();
        let part = |k: usize| values.iter().map(|value| value[k]).collect();
        Self {
            resolution,
            low: DVec3::ZERO,
            high: DVec3::ONE,
            bounds: Bounds::Box,
            scattering: part(0),
            absorption: part(1),
            refraction: part(2),
            phase: Phase::ISOTROPIC,
        }
        .checked()
    }

    /// A medium that is equal everywhere, in the unit cube.
    ///
    /// # Errors
    /// As [`Volume::checked`].
    pub fn constant(scattering: f32, absorption: f32, refraction: f32) -> Result<Self, MediaError> {
        Self::new([1; 3], |_| [scattering, absorption, refraction])
    }

    /// The volume, if its grids have the same size and values that a medium can have.
    ///
    /// # Errors
    /// A wrong size, a value that is not finite or negative, a refractive index below 1, flat or infinite bounds.
    pub fn checked(self) -> Result<Self, MediaError> {
        check_resolution(self.resolution)?;
        let size = self.high - self.low;
        if !size.is_finite() || size.min_element() <= 0.0 {
            return Err(MediaError::Bounds(format!("{} to {}", self.low, self.high)));
        }
        let coefficient = (0.0, "finite, not negative and below 65,504");
        let index = (1.0, "finite and at least 1");
        let grids = [
            ("scattering", &self.scattering, coefficient),
            ("absorption", &self.absorption, coefficient),
            ("the refractive index", &self.refraction, index),
        ];
        let expected = voxels(self.resolution);
        for (what, values, (least, range)) in grids {
            if values.len() != expected {
                return Err(MediaError::WrongSize {
                    what,
                    resolution: self.resolution,
                    expected,
                    found: values.len(),
                });
            }
            let allowed = least..f32::from(f16::MAX);
            if let Some(at) = values.iter().position(|value| !allowed.contains(value)) {
                return Err(MediaError::Value {
                    what,
                    voxel: voxel_at(self.resolution, at),
                    value: values[at],
                    range,
                });
            }
        }
        Ok(self)
    }

    /// Distances at which a line enters and leaves what is filled; `None` where it misses.
    pub fn clip(&self, origin: DVec3, direction: DVec3) -> Option<[f64; 2]> {
        let span = match self.bounds {
            Bounds::Box => {
                let [a, b] = [self.low, self.high].map(|plane| (plane - origin) / direction);
                // A NaN is a line in the plane, which `max` and `min` pass over.
                [a.min(b).max_element(), a.max(b).min_element()]
            }
            Bounds::Sphere => {
                let (centre, radius) = ((self.low + self.high) / 2.0, (self.high - self.low) / 2.0);
                let (o, d) = ((origin - centre) / radius, direction / radius);
                let (a, b, c) = (d.length_squared(), o.dot(d), o.length_squared() - 1.0);
                let root = (b * b - a * c).sqrt();
                [(-b - root) / a, (-b + root) / a]
            }
        };
        let enter = span[0].max(0.0);
        (enter < span[1]).then_some([enter, span[1]])
    }
}

fn check_resolution(resolution: [u32; 3]) -> Result<(), MediaError> {
    let fits = resolution.iter().all(|n| (1..=MOST_VOXELS).contains(n));
    fits.then_some(()).ok_or(MediaError::Resolution {
        resolution,
        most: MOST_VOXELS,
    })
}

/// Number of voxels.
pub fn voxels(resolution: [u32; 3]) -> usize {
    resolution.iter().map(|n| *n as usize).product()
}

/// The voxel with this place in a grid.
pub fn voxel_at([nx, ny, _]: [u32; 3], index: usize) -> [u32; 3] {
    let index = index as u32;
    [index % nx, index / nx % ny, index / (nx * ny)]
}

/// A number as a half float, the nearest; too small ones become 0, since an adapter may flush them.
pub fn to_half(value: f32) -> f16 {
    let half = f16::from_f32(value);
    if half.is_normal() { half } else { f16::ZERO }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn refused(change: impl Fn(&mut Volume)) -> String {
        let mut volume = Volume::new([2, 3, 4], |_| [1.0, 0.5, 1.5]).unwrap();
        change(&mut volume);
        volume.checked().unwrap_err().to_string()
    }

    #[test]
    fn what_no_medium_can_have_is_refused_by_name_and_place() {
        let short = refused(|v| v.scattering.truncate(23));
        assert!(short.contains("2 × 3 × 4 voxels need 24"), "{short}");
        let nan = refused(|v| v.absorption[5] = f32::NAN);
        assert!(
            nan.contains("absorption of voxel (1, 2, 0) is NaN"),
            "{nan}"
        );
        let negative = refused(|v| v.scattering[6] = -1e-9);
        assert!(negative.contains("voxel (0, 0, 1)"), "{negative}");
        let thin = refused(|v| v.refraction[23] = 0.99);
        assert!(thin.contains("at least 1"), "{thin}");
        let infinite = refused(|v| v.absorption[0] = f32::INFINITY);
        assert!(infinite.contains("finite"), "{infinite}");
        assert!(refused(|v| v.high.y = 0.0).contains("above zero"));
        let many = Volume::new([513, 1, 1], |_| [0.0, 0.0, 1.0]).unwrap_err();
        assert!(many.to_string().contains("1 to 512"), "{many}");
    }

    #[test]
    fn lines_are_clipped_to_what_is_filled() {
        let mut volume = Volume::constant(1.0, 0.0, 1.0).unwrap();
        let from = DVec3::new(-1.0, 0.5, 0.5);
        assert_eq!(volume.clip(from, DVec3::X), Some([1.0, 2.0]));
        assert_eq!(volume.clip(from, DVec3::NEG_X), None);
        volume.bounds = Bounds::Sphere;
        assert_eq!(volume.clip(from, DVec3::X), Some([1.0, 2.0]));
        let corner = DVec3::new(-1.0, 0.05, 0.05);
        assert_eq!(volume.clip(corner, DVec3::X), None);
        let inside = volume.clip(DVec3::splat(0.5), DVec3::Y).unwrap();
        assert_eq!(inside, [0.0, 0.5]);
    }
}
