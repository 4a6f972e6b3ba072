//! Triangles, rays and the camera, shared by experiments, scenes, structures and the oracle.

use glam::{DVec3, Vec3};
use serde::{Deserialize, Serialize};
use std::fmt;
use std::str::FromStr;

/// A triangle in world space, vertices in file order (f32, scene units).
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
#[repr(C)]
pub struct Triangle {
    /// The three corners.
    pub vertices: [Vec3; 3],
}

impl Triangle {
    /// Applies `to` to each corner.
    pub fn map(self, to: impl FnMut(Vec3) -> Vec3) -> Self {
        self.vertices.map(to).into()
    }

    /// True if no ray can hit the triangle. Differences and products of f32 are computed in f64, so
    /// the answer does not depend on the triangle's position.
    pub fn has_zero_area(&self) -> bool {
        let [a, b, c] = self.vertices.map(Vec3::as_dvec3);
        (b - a).cross(c - a) == DVec3::ZERO
    }
}

impl From<[Vec3; 3]> for Triangle {
    fn from(vertices: [Vec3; 3]) -> Self {
        Self { vertices }
    }
}

/// A ray segment of 32 bytes, with the layout of the ray buffers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, bytemuck::Pod, bytemuck::Zeroable)]
pub struct Ray {
    /// Origin, scene units.
    pub origin: [f32; 3],
    /// Minimum hit distance, ≥ 0, in units of the direction's length.
    pub t_min: f32,
    /// Direction; need not be normalised.
    pub direction: [f32; 3],
    /// Maximum hit distance; the oracle also accepts infinity.
    pub t_max: f32,
}

impl Ray {
    /// `t_max` of unbounded rays; a kernel can multiply it by pads without overflow.
    pub const FAR: f32 = 1e30;

    /// Ray from distance 0 to [`Ray::FAR`].
    pub fn new(origin: impl Into<[f32; 3]>, direction: impl Into<[f32; 3]>) -> Self {
        Self {
            origin: origin.into(),
            t_min: 0.0,
            direction: direction.into(),
            t_max: Self::FAR,
        }
    }

    /// The ray with other ends.
    #[must_use]
    pub fn between(self, t_min: f32, t_max: f32) -> Self {
        Self {
            t_min,
            t_max,
            ..self
        }
    }
}

/// Prints eight numbers that parse to the same bits: origin, direction, t_min, t_max.
impl fmt::Display for Ray {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let ([ox, oy, oz], [dx, dy, dz]) = (self.origin, self.direction);
        let (t_min, t_max) = (self.t_min, self.t_max);
        write!(
            f,
            "{ox:?} {oy:?} {oz:?} {dx:?} {dy:?} {dz:?} {t_min:?} {t_max:?}"
        )
    }
}

/// Parses eight numbers, or six as in [`Ray::new`]; errors name the invalid number or the count.
impl FromStr for Ray {
    type Err = String;

    fn from_str(text: &str) -> Result<Self, String> {
        let words = text.split(|c: char| c.is_whitespace() || c == ',');
        let number = |word: &str| {
            let number = word.parse::<f32>();
            number.map_err(|_| format!("`{word}` is not a number"))
        };
        let numbers: Result<Vec<f32>, String> =
            words.filter(|word| !word.is_empty()).map(number).collect();
        match numbers?[..] {
            [ox, oy, oz, dx, dy, dz] => Ok(Self::new([ox, oy, oz], [dx, dy, dz])),
            [ox, oy, oz, dx, dy, dz, t_min, t_max] => {
                Ok(Self::new([ox, oy, oz], [dx, dy, dz]).between(t_min, t_max))
            }
            ref others => Err(format!(
                "a ray is `ox oy oz dx dy dz t_min t_max`, or the first six; there are {} numbers",
                others.len()
            )),
        }
    }
}

/// A pinhole camera. Rays start at `eye`; pixel (0, 0) is the top left one.
#[derive(Debug, Clone, Copy, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Camera {
    /// Position of the pinhole, scene units.
    #[schemars(with = "[f32; 3]")]
    pub eye: Vec3,
    /// Point that projects to the centre of the image.
    #[schemars(with = "[f32; 3]")]
    pub target: Vec3,
    /// Up direction; need not be normalised or orthogonal to the viewing direction.
    #[schemars(with = "[f32; 3]")]
    pub up: Vec3,
    /// Vertical field of view, degrees, in (0, 180).
    pub vertical_fov_degrees: f32,
}

/// A direction needs a component of at least 2⁻⁵⁶: raising a shorter one exceeds rounding.
pub const SMALLEST_DIRECTION: f32 = 1.387_778_8e-17;

impl Ray {
    /// True for a valid ray: finite origin and direction, a direction component of at least
    /// [`SMALLEST_DIRECTION`], and ends that are not NaN. Invalid rays hit nothing. Twin: `is_ray`
    /// in `kernels/integrator/trace_rays.wesl`.
    pub fn is_ray(&self) -> bool {
        let greatest = |x: [f32; 3]| x.map(f32::abs).into_iter().fold(0.0, f32::max);
        let finite = self.origin.iter().chain(&self.direction);
        finite.into_iter().all(|x| x.is_finite())
            && greatest(self.direction) >= SMALLEST_DIRECTION
            && !self.t_min.is_nan()
            && !self.t_max.is_nan()
    }
}

impl Camera {
    /// A camera with y up.
    pub fn upright(eye: Vec3, target: Vec3, vertical_fov_degrees: f32) -> Self {
        Self {
            eye,
            target,
            up: Vec3::Y,
            vertical_fov_degrees,
        }
    }
}

impl Camera {
    /// Unit viewing direction, and half extents of the image plane at distance 1, right and up.
    pub fn basis(&self, [width, height]: [u32; 2]) -> [Vec3; 3] {
        let forward = (self.target - self.eye).normalize();
        let right = forward.cross(self.up).normalize();
        let up = right.cross(forward);
        let half_height = (0.5 * self.vertical_fov_degrees.to_radians()).tan();
        let half_width = half_height * width as f32 / height as f32;
        [forward, right * half_width, up * half_height]
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::random::Pcg32;

    #[test]
    fn rays_read_back_to_the_same_bits() {
        let mut random = Pcg32::new(5);
        for _ in 0..2000 {
            let mut float = || loop {
                let x = f32::from_bits(random.next_u32());
                if !x.is_nan() {
                    return x;
                }
            };
            let ray = Ray::new([float(), float(), float()], [float(), -0.0, float()]);
            let ray = ray.between(float(), float());
            let back: Ray = ray.to_string().parse().unwrap();
            assert_eq!(bytemuck::bytes_of(&back), bytemuck::bytes_of(&ray));
        }
        for (text, wrong) in [("1 2 3", "3 numbers"), ("1 2 3 4 5 six", "`six`")] {
            assert!(text.parse::<Ray>().unwrap_err().contains(wrong));
        }
    }
}
