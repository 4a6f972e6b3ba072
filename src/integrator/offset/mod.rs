//! Where rays that leave a surface start, so that they do not meet it again.

mod error_bound;
mod fixed;
mod integer;
mod none;

use crate::accel::TriangleSoup;
use crate::gpu::Composition;
use crate::scene::{Instance, row_sum_norm};
use serde::{Deserialize, Serialize};

/// How the origin of a ray is moved off the surface that it leaves.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
#[serde(rename_all = "kebab-case")]
pub enum RayOffset {
    /// Not at all.
    None,
    /// By the same distance everywhere.
    Fixed,
    /// C. Wächter, N. Binder, "A fast and robust method for avoiding self-intersection", 2019.
    Integer,
    /// By the bound of the point's error.
    #[default]
    ErrorBound,
}

impl RayOffset {
    /// Every offset.
    pub const ALL: [RayOffset; 4] = [Self::None, Self::Fixed, Self::Integer, Self::ErrorBound];

    /// Name as a user types it.
    pub fn name(self) -> &'static str {
        match self {
            Self::None => "none",
            Self::Fixed => "fixed",
            Self::Integer => "integer",
            Self::ErrorBound => "error-bound",
        }
    }

    /// The offset of this name.
    pub fn named(name: &str) -> Option<Self> {
        Self::ALL.into_iter().find(|offset| offset.name() == name)
    }

    /// One line: what it is and where it comes from.
    pub fn description(self) -> &'static str {
        match self {
            Self::None => "rays start at the point that was hit",
            Self::Fixed => "1e-4 scene units along the normal, whatever the scale",
            Self::Integer => {
                "up to 256 representable numbers along the normal (Wächter, Binder 2019)"
            }
            Self::ErrorBound => {
                "the rounding error of the point, from its triangle and the instances' transforms"
            }
        }
    }

    /// Module of the kernel, relative to the kernel folder.
    pub fn kernel(self) -> &'static str {
        match self {
            Self::None => "integrator/offset/none",
            Self::Fixed => "integrator/offset/fixed",
            Self::Integer => "integrator/offset/integer",
            Self::ErrorBound => "integrator/offset/error_bound",
        }
    }

    /// `composition` with this offset, unless it chose another before.
    #[must_use]
    pub fn activate(self, composition: Composition) -> Composition {
        if composition.active.contains_key("offset") {
            composition
        } else {
            composition.with("offset", self.kernel())
        }
    }

    /// The origin of a ray that leaves the point `p` on the side of the unit normal `n`; `error` is
    /// what [`position_error`] says of the point.
    pub fn offset_point(self, p: [f32; 3], n: [f32; 3], error: [f32; 3]) -> [f32; 3] {
        match self {
            Self::None => none::offset_point(p, n, error),
            Self::Fixed => fixed::offset_point(p, n, error),
            Self::Integer => integer::offset_point(p, n, error),
            Self::ErrorBound => error_bound::offset_point(p, n, error),
        }
    }
}

/// Eight roundings, 8 · 2⁻²⁴; see [`position_error`].
pub const POSITION_ERROR: f32 = 4.768_371_6e-7;

/// What instances add to the error of a point: a factor of its greatest coordinate, and scene units,
/// both to be multiplied by [`POSITION_ERROR`].
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TransformError {
    /// Greatest ‖M‖·‖M⁻¹‖ of all maps to objects; 0 if no ray is transformed.
    pub scale: f32,
    /// Greatest ‖M⁻¹‖ times the greatest coordinate of the translation.
    pub shift: f32,
}

impl TransformError {
    /// That of the instances of a scene.
    pub fn of(soup: &TriangleSoup) -> Self {
        let instances = soup.placed.iter().flat_map(|p| &p.instances);
        let moved = instances.filter(|instance| !instance.is_identity());
        moved.fold(Self::default(), |worst, instance: &Instance| {
            let (linear, offset) = instance.to_object.parts();
            let inverse = row_sum_norm(linear.inverse());
            let scale = (row_sum_norm(linear) * inverse) as f32;
            let shift = (inverse * offset.abs().max_element()) as f32;
            Self {
                scale: worst.scale.max(scale),
                shift: worst.shift.max(shift),
            }
        })
    }
}

/// Bound on the distance, per axis, between a triangle and a point v₀ − u·e₁ + v·e₂ that was computed
/// on it, with e₁ = v₀ − v₁ and e₂ = v₂ − v₀, as a triangle test sees it.
///
/// Two products and two sums make at most four roundings of |v₀| + |e₁| + |e₂|; a test takes differences
/// of vertices and shears them, at most four more. A point that is taken to an object's space adds a
/// transform of four products, forth, and its vertices one back: see [`TransformError`].
///
/// A ray that leaves must not meet the triangle either, although its distance to the plane errs by up to
/// sixteen roundings of the triangle's extent: a plane through 0 along an axis has an exact position, and
/// one that is nearly so an almost exact one. So twice [`POSITION_ERROR`] of the extent come on top.
/// Twin of `kernels/integrator/position_error.wesl`.
pub fn position_error(
    v0: [f32; 3],
    e1: [f32; 3],
    e2: [f32; 3],
    transform: &TransformError,
) -> [f32; 3] {
    let reach = [0, 1, 2].map(|a| v0[a].abs() + e1[a].abs() + e2[a].abs());
    let far = reach[0].max(reach[1]).max(reach[2]);
    let [x, y, z] = [0, 1, 2].map(|a| e1[a].abs() + e2[a].abs());
    let extent = x.max(y).max(z);
    let moved = transform.scale * far + transform.shift;
    reach.map(|r| POSITION_ERROR * (r + (2.0 * extent + moved)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::keys;
    use crate::random::Pcg32;

    #[test]
    fn experiment_files_know_every_offset() {
        assert_eq!(RayOffset::ALL.map(RayOffset::name), keys::RAY_OFFSETS);
        for offset in RayOffset::ALL {
            assert_eq!(RayOffset::named(offset.name()), Some(offset));
            assert!(!offset.description().is_empty());
        }
    }

    #[test]
    fn a_point_computed_on_a_triangle_lies_within_the_bound_and_not_within_a_sixteenth() {
        let mut rng = Pcg32::new(7);
        let mut next = || rng.uniform() as f32;
        let (mut beyond, mut beyond_part) = (0, 0);
        for _ in 0..100_000 {
            let corners: [[f32; 3]; 3] =
                std::array::from_fn(|_| std::array::from_fn(|_| 10.0 * next() - 5.0));
            let [v0, v1, v2] = corners;
            let (e1, e2) = (
                [0, 1, 2].map(|a| v0[a] - v1[a]),
                [0, 1, 2].map(|a| v2[a] - v0[a]),
            );
            let (u, v) = (next(), next());
            let error = position_error(v0, e1, e2, &TransformError::default());
            for a in 0..3 {
                let computed = v0[a] - u * e1[a] + v * e2[a];
                let [x, y, z, u, v] = [v0[a], v1[a], v2[a], u, v].map(f64::from);
                let exact = x - u * (x - y) + v * (z - x);
                let off = (f64::from(computed) - exact).abs();
                beyond += usize::from(off > f64::from(error[a]));
                beyond_part += usize::from(off > f64::from(error[a]) / 16.0);
            }
        }
        assert_eq!(beyond, 0);
        assert!(beyond_part > 0, "the bound is far from tight");
    }
}
