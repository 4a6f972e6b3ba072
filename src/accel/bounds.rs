//! Axis-aligned bounds and the slab test. CPU version of `kernels/accel/bounds.wesl`.

use super::ray::Ray;

/// An axis-aligned box, scene units.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Bounds {
    /// Minimum corner.
    pub min: [f32; 3],
    /// Maximum corner.
    pub max: [f32; 3],
}

impl Bounds {
    /// Identity of [`Bounds::union`].
    pub const EMPTY: Bounds = Bounds {
        min: [f32::INFINITY; 3],
        max: [f32::NEG_INFINITY; 3],
    };

    pub(crate) const EVERYTHING: Bounds = Bounds {
        min: [f32::NEG_INFINITY; 3],
        max: [f32::INFINITY; 3],
    };

    /// The smallest box around both.
    pub fn union(&self, other: &Bounds) -> Bounds {
        let mut out = *self;
        for axis in 0..3 {
            // One instruction each, unlike f32::min; bounds hold no NaN.
            out.min[axis] = if other.min[axis] < out.min[axis] {
                other.min[axis]
            } else {
                out.min[axis]
            };
            out.max[axis] = if other.max[axis] > out.max[axis] {
                other.max[axis]
            } else {
                out.max[axis]
            };
        }
        out
    }

    /// The common part; `min > max` on some axis if it is empty.
    pub fn intersection(&self, other: &Bounds) -> Bounds {
        Bounds {
            min: std::array::from_fn(|axis| self.min[axis].max(other.min[axis])),
            max: std::array::from_fn(|axis| self.max[axis].min(other.max[axis])),
        }
    }

    /// True if `other` lies inside.
    pub fn contains(&self, other: &Bounds) -> bool {
        (0..3).all(|axis| self.min[axis] <= other.min[axis] && self.max[axis] >= other.max[axis])
    }

    /// Side lengths; negative for the empty box.
    pub fn extent(&self) -> [f32; 3] {
        std::array::from_fn(|axis| self.max[axis] - self.min[axis])
    }

    /// Twice the centre: sufficient for sorting and binning, without the division.
    pub fn doubled_centre(&self) -> [f32; 3] {
        std::array::from_fn(|axis| self.min[axis] + self.max[axis])
    }

    /// Half the surface area; 0 for the empty box.
    pub fn half_area(&self) -> f32 {
        let [x, y, z] = self.extent();
        if x < 0.0 { 0.0 } else { x * y + y * z + z * x }
    }
}

/// Distances at which the ray's line enters and exits the slab of each axis.
pub(crate) fn slabs(bounds: &Bounds, ray: &Ray, inverse: [f32; 3]) -> ([f32; 3], [f32; 3]) {
    let low = |axis: usize| (bounds.min[axis] - ray.origin[axis]) * inverse[axis];
    let high = |axis: usize| (bounds.max[axis] - ray.origin[axis]) * inverse[axis];
    let (x1, x2) = (low(0), high(0));
    let (y1, y2) = (low(1), high(1));
    let (z1, z2) = (low(2), high(2));
    let near = [x1.min(x2), y1.min(y2), z1.min(z2)];
    let far = [x1.max(x2), y1.max(y2), z1.max(z2)];
    (near, far)
}

/// Distances at which the ray's line enters and exits the box (enter > exit: a miss).
pub(crate) fn slab(bounds: &Bounds, ray: &Ray, inverse: [f32; 3]) -> (f32, f32) {
    let (near, far) = slabs(bounds, ray, inverse);
    let enter = near[0].max(near[1]).max(near[2]);
    let exit = far[0].min(far[1]).min(far[2]);
    (enter, exit)
}

/// Distance at which the segment `[t_min, t_best]` enters the padded box, or `None`. With the default
/// pad ([`super::intersection::BoxTest`]) no accepted hit is culled.
pub(crate) fn enter_box(
    bounds: &Bounds,
    ray: &Ray,
    inverse: [f32; 3],
    pad: f32,
    t_best: f32,
) -> Option<f32> {
    let (enter, exit) = slab(bounds, ray, inverse);
    let enter = enter.max(ray.t_min);
    (enter <= exit.min(t_best) * pad).then_some(enter)
}
