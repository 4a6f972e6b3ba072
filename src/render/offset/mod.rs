//! Origins of rays that leave a surface, chosen so that they do not hit it again.

mod error_bound;
mod fixed;
mod integer;
mod known;
mod none;

pub use error_bound::ERROR_BOUND;
pub(crate) use fixed::FIXED;
pub(crate) use integer::INTEGER;
pub use known::fault_of_offset;
pub use none::NONE;

use glam::Vec3;
use raystone_accel::TriangleSoup;
use raystone_core::params::{Kinds, Named, Sources};
use raystone_gpu::{Composition, UniformValues};
use raystone_scene::{Instance, Transform, row_sum_norm};
use std::fmt;

/// An offset of ray origins from the surface.
#[derive(Clone, Copy)]
pub struct RayOffset {
    /// Name used in configurations.
    pub name: &'static str,
    /// One-line description with source.
    pub description: &'static str,
    /// Kernel module, relative to the kernel folder: it exports `offset_point`.
    pub kernel: &'static str,
    /// Paths and texts of its own kernel modules, for offsets that are not built in.
    pub sources: Sources,
    /// True if images should have neither light leaks nor self-shadowing. The bias of other offsets
    /// is measured, and is no fault.
    pub is_unbiased: bool,
    /// The origin of a ray that leaves the point p on the side of the unit normal n, from p, n and
    /// the error bound of [`position_error`]. CPU version of the kernel's function.
    pub offset_point: fn([f32; 3], [f32; 3], [f32; 3]) -> [f32; 3],
}

/// The values of the `offset` axis.
pub type OffsetRegistry = Kinds<RayOffset>;

impl Default for RayOffset {
    fn default() -> Self {
        ERROR_BOUND
    }
}

/// Offsets are compared by name.
impl PartialEq for RayOffset {
    fn eq(&self, other: &Self) -> bool {
        self.name == other.name
    }
}

impl fmt::Debug for RayOffset {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(self.name)
    }
}

impl Named for RayOffset {
    fn built_in() -> Vec<&'static Self> {
        vec![&NONE, &FIXED, &INTEGER, &ERROR_BOUND]
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        self.description
    }

    fn sources(&self) -> Sources {
        self.sources
    }
}

impl RayOffset {
    /// `composition` with this offset, unless it already selects another.
    #[must_use]
    pub fn activate(self, composition: Composition) -> Composition {
        if composition.active.contains_key("offset") {
            composition
        } else {
            composition.with("offset", self.kernel)
        }
    }
}

/// Eight roundings, 8 · 2⁻²⁴; see [`position_error`].
pub(crate) const POSITION_ERROR: f32 = 4.768_371_6e-7;

/// Error of a point from instance transforms: a factor of its largest coordinate, and scene units,
/// both to be multiplied by `POSITION_ERROR`.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct TransformError {
    /// Largest ‖M‖·‖M⁻¹‖ of all maps to objects; 0 if no ray is transformed.
    pub scale: f32,
    /// Largest ‖M⁻¹‖ times the largest coordinate of the translation.
    pub shift: f32,
}

impl TransformError {
    /// The error for the instances of a scene.
    pub fn of(soup: &TriangleSoup) -> Self {
        Self::of_instances(soup.placed.iter().flat_map(|p| &p.instances))
    }

    /// Adds it to the values of a job, by the names of the kernel.
    pub(crate) fn uniform(&self, values: UniformValues) -> UniformValues {
        values
            .f32("transform_scale", self.scale)
            .f32("transform_shift", self.shift)
    }

    fn of_instances<'a>(instances: impl Iterator<Item = &'a Instance>) -> Self {
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

/// The errors of two known instances, computed anew before any ray is offset.
///
/// # Errors
/// They are others: both.
pub fn check_known() -> Result<(), String> {
    // To the object 1/2, 1 and 4 along the axes and 1, 2, 3 on; back 2, 1 and 1/4. The other one is turned and moved less.
    let instance = |columns: [[f32; 3]; 3], shift: [f32; 3]| {
        let to_object = Transform::new(columns.map(Vec3::from), Vec3::from(shift));
        Instance {
            object: 0,
            first: 0,
            to_world: to_object,
            to_object,
        }
    };
    let instances = [
        instance(
            [[0.5, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 4.0]],
            [1.0, 2.0, 3.0],
        ),
        instance(
            [[0.0, 1.0, 0.0], [-1.0, 0.0, 0.0], [0.0, 0.0, 1.0]],
            [1.0; 3],
        ),
    ];
    let error = TransformError::of_instances(instances.iter());
    // What kernels multiply a distance by, and what they add to that.
    let values = error.uniform(UniformValues::new());
    let found = ["transform_scale", "transform_shift"].map(|name| {
        let words = values.words(name).unwrap_or_default();
        words.first().copied().map(f32::from_bits)
    });
    // A point 3 from the origin, on edges of 1: 8 · 3 + 6 for the instances, twice an edge, and what is within reach.
    let point = position_error([1.0, 2.0, 3.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], &error);
    let roundings = point.map(|x| x / POSITION_ERROR);
    if found == [Some(8.0), Some(6.0)] && roundings == [34.0, 35.0, 35.0] {
        return Ok(());
    }
    Err(format!(
        "the error of two known instances is {found:?} and that of a point {roundings:?}, and should be 8 and 6 and 34, 35, 35: this program offsets rays wrongly; build it anew, and \
         report what stays wrong"
    ))
}

/// Bound on the distance, per axis, between a triangle and a point v₀ − u·e₁ + v·e₂ computed on it,
/// with e₁ = v₀ − v₁ and e₂ = v₂ − v₀, as in a triangle test.
///
/// Two products and two sums make at most four roundings of |v₀| + |e₁| + |e₂|; a test takes
/// differences of vertices and shears them, at most four more. A point transformed to object space
/// adds a transform of four products, and its vertices one back: see [`TransformError`].
///
/// A ray that leaves must not hit the triangle either, although its distance to the plane errs by
/// up to sixteen roundings of the triangle's extent: an axis-aligned plane through 0 has an exact
/// position, and a nearly aligned one an almost exact one. So twice `POSITION_ERROR` of the extent
/// is added. CPU version of `kernels/integrator/position_error.wesl`.
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
    use raystone_core::random::Pcg32;

    #[test]
    fn what_an_experiment_says_nothing_of_is_the_default_offset() {
        let default = raystone_config::Axis::Offset.default_name();
        assert_eq!(default, Some(RayOffset::default().name));
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
