//! Rays and hits in kernel layout. CPU version of `kernels/accel/ray.wesl`.

use bytemuck::{Pod, Zeroable};
pub use raystone_core::geometry::{Ray, SMALLEST_DIRECTION};
use std::fmt;

/// Triangle index of a miss.
pub const NO_HIT: u32 = u32::MAX;

/// The smallest component of a raised direction, 2⁻⁸⁴, so that the reciprocal is finite: WGSL does
/// not guarantee infinities. With coordinates up to 1e9 (checked on scene load), and twice that
/// for a cell around them, `(bounds - origin) / SMALLEST_COMPONENT` stays below the largest f32.
pub(crate) const SMALLEST_COMPONENT: f32 = 5.169_879e-26;

/// The smallest component of a raised direction relative to its longest, 2⁻⁶⁰: far below rounding,
/// but with a square that is not denormal.
pub(crate) const SMALLEST_SLOPE: f32 = 8.673_617_4e-19;

/// The nearest hit, 16 bytes, in the layout of the hit buffers.
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

impl Hit {
    /// The initial value, without a hit.
    pub fn miss(ray: &Ray) -> Self {
        Self {
            t: ray.t_max,
            triangle: NO_HIT,
            u: 0.0,
            v: 0.0,
        }
    }

    /// Bitwise equality.
    pub fn same_bits(&self, other: &Hit) -> bool {
        bytemuck::bytes_of(self) == bytemuck::bytes_of(other)
    }
}

impl fmt::Display for Hit {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let Self { t, triangle, u, v } = self;
        match *triangle {
            NO_HIT => f.write_str("misses"),
            _ => write!(f, "hits triangle {triangle} at t {t:?} u {u:?} v {v:?}"),
        }
    }
}

/// The direction with too small components raised, sign kept: to [`SMALLEST_SLOPE`] of the longest,
/// and at least to [`SMALLEST_COMPONENT`].
fn raised_direction(d: [f32; 3]) -> [f32; 3] {
    let [x, y, z] = d.map(f32::abs);
    let shortest = (x.max(y).max(z) * SMALLEST_SLOPE).max(SMALLEST_COMPONENT);
    d.map(|d| {
        if d.abs() < shortest {
            shortest.copysign(d)
        } else {
            d
        }
    })
}

/// The ray as traced: no component of its direction is 0, or negligible relative to the longest.
///
/// Boxes and triangles must be tested with the *same* direction. If a component were 0 for a
/// triangle's edges but replaced by a finite value for its slabs, a vertex as near to the ray's
/// plane as that value diverts the ray could lie on one side of the ray for the edges and on the
/// other for the slabs: both neighbours along an edge would then reject the hit, and a closed
/// surface would have a crack. Raising is idempotent.
pub fn raised(ray: &Ray) -> Ray {
    Ray {
        direction: raised_direction(ray.direction),
        ..*ray
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn along(direction: [f32; 3]) -> Ray {
        Ray::new([0.0; 3], direction)
    }

    #[test]
    fn what_is_raised_has_a_finite_reciprocal_keeps_signs_and_stays() {
        let lengths = [SMALLEST_DIRECTION, 1e-10, 1.0, 1e10, 1e30, f32::MAX];
        let parts = [0.0, -0.0, 1e-45, -1e-38, 1e-30, -1e-20, 1e-10, 0.5];
        for length in lengths {
            for (a, b) in parts.iter().flat_map(|a| parts.iter().map(move |b| (a, b))) {
                let ray = along([a * length, -length, *b]);
                let once = raised(&ray);
                assert_eq!(raised(&once), once, "{ray:?}");
                let farthest = 4e12 * 1.1;
                for (was, is) in ray.direction.iter().zip(once.direction) {
                    assert!((farthest / is).is_finite(), "{ray:?}");
                    assert_eq!(was.is_sign_negative(), is.is_sign_negative(), "{ray:?}");
                    // A change below rounding, relative to the longest component.
                    let longest = length.max(b.abs());
                    assert!((was - is).abs() <= longest * f32::EPSILON / 16.0, "{ray:?}");
                }
            }
        }
    }

    #[test]
    fn a_direction_without_a_long_enough_component_is_no_ray() {
        assert!(along([0.0, -SMALLEST_DIRECTION, 0.0]).is_ray());
        assert!(!along([SMALLEST_DIRECTION.next_down(); 3]).is_ray());
    }
}
