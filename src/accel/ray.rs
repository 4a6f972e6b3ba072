//! Rays and hits as kernels see them. Twin of `kernels/accel/ray.wesl`.

use bytemuck::{Pod, Zeroable};

/// Triangle index of a miss.
pub const NO_HIT: u32 = u32::MAX;

/// Direction components smaller than this are replaced by it, sign kept, so that the reciprocal is
/// finite: WGSL promises no infinity. With scene coordinates below 1e12 (checked when a scene is
/// loaded) `(bounds - origin) / SMALLEST_DIRECTION` stays below the largest f32.
pub const SMALLEST_DIRECTION: f32 = 1e-20;

/// A ray segment, 32 bytes, the layout of the ray buffers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Ray {
    /// Origin, scene units.
    pub origin: [f32; 3],
    /// Least distance of a hit, ≥ 0, in units of the direction's length.
    pub t_min: f32,
    /// Direction; need not be normalised.
    pub direction: [f32; 3],
    /// Greatest distance of a hit.
    pub t_max: f32,
}

/// The nearest hit, 16 bytes, the layout of the hit buffers.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
pub struct Hit {
    /// Distance; `t_max` of the ray on a miss.
    pub t: f32,
    /// Index of the triangle in the scene, or [`NO_HIT`].
    pub triangle: u32,
    /// Barycentric weight of the second vertex.
    pub u: f32,
    /// Barycentric weight of the third vertex.
    pub v: f32,
}

impl Ray {
    /// Whether it is a ray at all: origin and direction finite, a component of the direction at least
    /// [`SMALLEST_DIRECTION`], ends that are numbers. Anything else hits nothing. Twin: `is_ray` in
    /// `kernels/integrator/trace_rays.wesl`.
    pub fn is_ray(&self) -> bool {
        let greatest = |x: [f32; 3]| x.map(f32::abs).into_iter().fold(0.0, f32::max);
        let finite = self.origin.iter().chain(&self.direction);
        finite.into_iter().all(|x| x.is_finite())
            && greatest(self.direction) >= SMALLEST_DIRECTION
            && !self.t_min.is_nan()
            && !self.t_max.is_nan()
    }
}

impl Hit {
    /// The answer before anything was hit.
    pub fn miss(ray: &Ray) -> Self {
        Self {
            t: ray.t_max,
            triangle: NO_HIT,
            u: 0.0,
            v: 0.0,
        }
    }

    /// Equality to the bit.
    pub fn same_bits(&self, other: &Hit) -> bool {
        bytemuck::bytes_of(self) == bytemuck::bytes_of(other)
    }
}

/// Finite, sign-keeping reciprocal of each component of a direction.
pub fn safe_inverse(direction: [f32; 3]) -> [f32; 3] {
    direction.map(|d| {
        if d.abs() < SMALLEST_DIRECTION {
            f32::from_bits((1.0 / SMALLEST_DIRECTION).to_bits() | (d.to_bits() & 0x8000_0000))
        } else {
            1.0 / d
        }
    })
}
