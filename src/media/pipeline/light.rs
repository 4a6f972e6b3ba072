//! Photons of a light: a point of a square each, with the share of power that it stands for.

use super::PipelineError;
use crate::rays::SegmentRay;
use crate::{Medium, Volume};
use glam::{DVec3, Vec3};

/// What photons come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Source {
    /// A point outside the box of the medium, with its radiant intensity in red, green and blue.
    Point {
        /// Its position.
        position: DVec3,
        /// Power per steradian.
        intensity: Vec3,
    },
    /// Parallel light through a square.
    Beam {
        /// The middle of the square.
        middle: DVec3,
        /// Where the light goes, of length 1.
        direction: DVec3,
        /// Half the side of the square.
        half: f64,
        /// Power of the whole square in red, green and blue.
        power: Vec3,
    },
}

/// A photon, and where it goes through the medium.
#[derive(Debug, Clone, Copy)]
pub struct Photon {
    /// Its way.
    pub ray: SegmentRay,
    /// Its direction in the world.
    pub direction: Vec3,
    /// Power in red, green and blue.
    pub energy: Vec3,
    /// The point of the light's square that it comes from.
    pub point: [f64; 2],
    /// One over the density of points there, relative to even ones.
    pub weight: f64,
}

impl Photon {
    /// The cell of a map of the light's square that it comes from.
    pub(crate) fn cell_of(&self, map: u32) -> [u32; 2] {
        self.point.map(|c| crate::photons::cell_of(c, map))
    }

    /// The words of a photon that meets nothing.
    pub(super) const MISSED: [[f32; 4]; 4] = [
        [0.0, 0.0, 0.0, -1.0],
        [1.0, 1.0, 1.0, 0.0],
        [1.0, 0.0, 0.0, 0.0],
        [0.0; 4],
    ];

    /// The words that the kernel reads; `marks` is what it counts of the photon.
    pub(super) fn words(&self, marks: [f32; 2]) -> [[f32; 4]; 4] {
        let ray = &self.ray.ray;
        let vector = |v: Vec3, last: f32| [v.x, v.y, v.z, last];
        [
            vector(ray.origin, self.ray.to),
            vector(ray.direction, marks[0]),
            vector(self.direction, marks[1]),
            vector(self.energy, 0.0),
        ]
    }
}

/// Two directions that make a right-handed base with a third.
fn base(normal: DVec3) -> [DVec3; 2] {
    let (x, y) = normal.any_orthonormal_pair();
    [x, y]
}

/// The square of a point light: it stands across the way to the box's middle, as near as the nearest corner, and hides
/// the whole box (Pfeuti 2009, §3.4). Returns its middle, its normal and half its side.
fn square_of(volume: &Volume, position: DVec3) -> Result<(DVec3, DVec3, f64), PipelineError> {
    let inside = position.cmpge(volume.low).all() && position.cmple(volume.high).all();
    if !position.is_finite() || inside {
        return Err(PipelineError::Light(format!(
            "a point light at {position} lies in the box of the medium, {} to {}: photons need a square between both",
            volume.low, volume.high
        )));
    }
    let middle = (volume.low + volume.high) / 2.0;
    let normal = (middle - position).normalize();
    let corners = (0..8).map(|k: u32| {
        let high = DVec3::from([k & 1, k >> 1 & 1, k >> 2].map(f64::from));
        volume.low + high * (volume.high - volume.low) - position
    });
    let near = corners
        .clone()
        .map(|c| c.dot(normal))
        .fold(f64::INFINITY, f64::min);
    if near <= 0.0 {
        return Err(PipelineError::Light(format!(
            "a point light at {position} is too near to the box of the medium: a corner lies behind it"
        )));
    }
    let axes = base(normal);
    let half = corners
        .flat_map(|c| axes.map(|axis| (c.dot(axis) / c.dot(normal) * near).abs()))
        .fold(0.0, f64::max);
    Ok((position + normal * near, normal, half))
}

/// The photons that meet a medium, of points of the unit square with densities relative to the uniform one. The power of
/// each is that of its part of the square: of a point light I (A / M) cos θ / r².
///
/// # Errors
/// A point light in the box or so near that no square lies between, or numbers that are no light.
pub fn photons(
    (volume, medium): (&Volume, &Medium),
    source: &Source,
    points: &[([f64; 2], f64)],
) -> Result<Vec<Photon>, PipelineError> {
    let (middle, normal, half) = match *source {
        Source::Point { position, .. } => square_of(volume, position)?,
        Source::Beam {
            middle,
            direction,
            half,
            ..
        } => {
            if !(half > 0.0 && half.is_finite() && direction.is_normalized()) {
                return Err(PipelineError::Light(format!(
                    "a beam needs half a side above 0 and a direction of length 1, not {half} and {direction}"
                )));
            }
            (middle, direction, half)
        }
    };
    let [x, y] = base(normal);
    let count = points.len() as f64;
    let photon = |([u, v], density): &([f64; 2], f64)| {
        let [a, b] = [u, v].map(|c| (2.0 * c - 1.0) * half);
        let at = middle + x * a + y * b;
        let (origin, direction, energy) = match *source {
            Source::Point {
                position,
                intensity,
            } => {
                let way = at - position;
                let direction = way.normalize();
                let angle = 4.0 * half * half * direction.dot(normal) / way.length_squared();
                (position, direction, intensity.as_dvec3() * angle)
            }
            Source::Beam {
                direction, power, ..
            } => (at, direction, power.as_dvec3()),
        };
        let ray = SegmentRay::new(volume, medium, origin, direction)?;
        Some(Photon {
            ray,
            direction: direction.as_vec3(),
            energy: (energy / (count * density)).as_vec3(),
            point: [*u, *v],
            weight: 1.0 / density,
        })
    };
    Ok(points.iter().filter_map(photon).collect())
}
