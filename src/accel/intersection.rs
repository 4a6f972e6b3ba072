//! The tests of rays against triangles and boxes that every structure follows, on the device by composition and on
//! the host through [`Reciprocal`].

use super::ray::{Ray, raised};
use super::triangle::{AnyTriangleTest, Watertight};
use raystone_core::params::Named;
use raystone_gpu::{ArithmeticProbe, Composition};
use std::ops::Deref;

/// The tests of one run. Hits of every structure are bit-identical to brute force with the same
/// choice if [`BoxTest`] is padded by at least `PROVEN_ULPS`; smaller pads exist for measurements.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Intersection {
    /// The ray–triangle test.
    pub triangle: AnyTriangleTest,
    /// The ray–box test.
    pub box_test: BoxTest,
}

impl Default for Intersection {
    fn default() -> Self {
        Self {
            triangle: &Watertight,
            box_test: BoxTest::default(),
        }
    }
}

/// A slab test: its reciprocal of the direction, and its pad.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct BoxTest {
    /// Name used in configurations.
    pub name: &'static str,
    /// One-line description with source.
    pub description: &'static str,
    /// True if components near 0 are raised ([`super::ray::raised`]), so that 1/d is finite: WGSL
    /// does not define infinity or 0 · ∞.
    pub finite: bool,
    /// A box is entered if `enter <= exit * (1 + pad_ulps · 2⁻²³)`.
    pub pad_ulps: u32,
}

impl Default for BoxTest {
    fn default() -> Self {
        Self::ALL[0]
    }
}

impl Named for BoxTest {
    fn built_in() -> Vec<&'static Self> {
        Self::ALL.iter().collect()
    }

    fn name(&self) -> &'static str {
        self.name
    }

    fn description(&self) -> &'static str {
        self.description
    }
}

impl BoxTest {
    /// The smallest pad for which the theorem of [`super::triangle`] holds: (1 + p) / (1 − p) for
    /// the pad p of triangles, and their roundings.
    pub(crate) const PROVEN_ULPS: u32 = 9;

    /// All box tests. The first one is the default: 2⁻¹⁹ is more than twice `TRIANGLE_PAD`.
    pub const ALL: [BoxTest; 6] = [
        Self::padded(
            16,
            "padded-16",
            "slabs, finite reciprocal, far side times 1 + 16 ulp: the pad that the proof needs, twice",
        ),
        Self::padded(
            4,
            "padded-4",
            "slabs, finite reciprocal, far side times 1 + 4 ulp",
        ),
        Self::padded(
            3,
            "padded-3",
            "slabs, finite reciprocal, far side times 1 + 3 ulp (Embree's robust mode)",
        ),
        Self::padded(
            2,
            "padded-2",
            "slabs, finite reciprocal, far side times 1 + 2 ulp (Ize 2013)",
        ),
        Self::padded(0, "padded-0", "slabs, finite reciprocal, no pad"),
        Self {
            name: "plain",
            description: "slabs with 1/d, no pad: relies on infinity and on minimum and maximum of NaN",
            finite: false,
            pad_ulps: 0,
        },
    ];

    const fn padded(pad_ulps: u32, name: &'static str, description: &'static str) -> Self {
        Self {
            name,
            description,
            finite: true,
            pad_ulps,
        }
    }

    /// The factor on the far side of a box, `BOX_PAD` of `kernels/accel/bounds.wesl`.
    pub fn pad(&self) -> f32 {
        1.0 + self.pad_ulps as f32 * f32::EPSILON
    }
}

impl Intersection {
    /// True if hard rays are checked. With triangle tests that are not watertight, the oracle's
    /// bounds and grid cells are inconclusive for rays in triangle planes, and boxes padded by less
    /// than the proof needs lose hits by design.
    pub fn bears_hard_rays(&self) -> bool {
        let padded = self.box_test.finite && self.box_test.pad_ulps >= BoxTest::PROVEN_ULPS;
        padded && self.triangle.is_watertight()
    }

    /// The tests of the reference tracer: these, or where the triangle test is not exact, the default one.
    #[must_use]
    pub fn exact(self) -> Self {
        if self.triangle.is_exact() {
            self
        } else {
            Self {
                triangle: Self::default().triangle,
                ..self
            }
        }
    }

    /// Checks that an adapter supports this choice.
    ///
    /// # Errors
    /// The reason if not: without exact two-products the compensated test is a different test.
    pub fn kept_by(self, probe: &ArithmeticProbe) -> Result<(), String> {
        if !self.triangle.needs_exact_products() || probe.exact_products {
            return Ok(());
        }
        Err(format!(
            "this adapter does not keep the two-products of the triangle test `{}`; choose `{}`",
            self.triangle.name(),
            Self::default().triangle.name()
        ))
    }

    /// `composition` with these tests, unless it already selects others.
    #[must_use]
    pub fn activate(&self, mut composition: Composition) -> Composition {
        if !composition.active.contains_key(TRIANGLE) {
            composition = composition
                .with(TRIANGLE, self.triangle.kernel())
                .feature(BARE, !self.triangle.is_exact());
        }
        if !composition.constants.contains_key(PAD_CONSTANT) {
            composition = composition
                .constant(PAD_CONSTANT, self.box_test.pad_ulps)
                .feature("plain_reciprocal", !self.box_test.finite);
        }
        composition
    }

    /// The ray as traced. CPU version of `raised` in `kernels/accel/ray.wesl`.
    pub fn raised(&self, ray: &Ray) -> Ray {
        if self.box_test.finite {
            raised(ray)
        } else {
            *ray
        }
    }

    /// Data of a raised ray's direction for the tests, computed once per ray.
    pub fn inverse(&self, direction: [f32; 3]) -> Reciprocal {
        Reciprocal {
            inverse: direction.map(|d| 1.0 / d),
            pad: self.box_test.pad(),
            triangle: self.triangle,
        }
    }
}

/// Role of the triangle test in a composition.
const TRIANGLE: &str = "triangle";
/// Feature of `kernels/accel/triangle.wesl`: the test alone.
const BARE: &str = "bare_triangles";
const PAD_CONSTANT: &str = "BOX_PAD_ULPS";

/// The reciprocal of a ray's direction, which it dereferences to, and the tests to use with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reciprocal {
    inverse: [f32; 3],
    /// The factor on the far side of boxes; `BOX_PAD` of kernels.
    pub pad: f32,
    /// The triangle test.
    pub triangle: AnyTriangleTest,
}

impl Deref for Reciprocal {
    type Target = [f32; 3];

    fn deref(&self) -> &[f32; 3] {
        &self.inverse
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::ray::SMALLEST_SLOPE;
    use crate::triangle::Compensated;

    #[test]
    fn the_default_pad_is_two_to_the_minus_nineteen() {
        assert_eq!(BoxTest::default().pad(), 1.0 + 2.0_f32.powi(-19));
        assert_eq!(BoxTest::default().name, "padded-16");
    }

    #[test]
    fn what_an_experiment_says_nothing_of_are_the_default_tests() {
        use raystone_config::Axis;
        let tests = Intersection::default();
        let names = [Axis::Triangle, Axis::BoxTest].map(Axis::default_name);
        assert_eq!(
            names,
            [Some(tests.triangle.name()), Some(tests.box_test.name)]
        );
    }

    #[test]
    fn only_an_adapter_that_keeps_two_products_gets_the_compensated_test() {
        let probe = |exact_products| ArithmeticProbe {
            unfused: true,
            exact_division: true,
            exact_sqrt: true,
            exact_products,
            denormals: true,
        };
        let tests = Intersection {
            triangle: &Compensated,
            ..Default::default()
        };
        assert_eq!(tests.kept_by(&probe(true)), Ok(()));
        let reason = tests.kept_by(&probe(false)).unwrap_err();
        assert!(reason.contains("two-products") && reason.contains("`compensated`"));
        assert_eq!(Intersection::default().kept_by(&probe(false)), Ok(()));
    }

    #[test]
    fn only_the_finite_reciprocal_is_finite() {
        let of = |box_test| {
            let tests = Intersection {
                box_test,
                ..Default::default()
            };
            let ray = Ray {
                origin: [0.0; 3],
                t_min: 0.0,
                direction: [0.0, -0.0, 2.0],
                t_max: 1.0,
            };
            tests.inverse(tests.raised(&ray).direction)
        };
        let limit = 0.5 / SMALLEST_SLOPE;
        assert_eq!(*of(BoxTest::default()), [limit, -limit, 0.5]);
        assert_eq!(
            *of(BoxTest::ALL[5]),
            [f32::INFINITY, f32::NEG_INFINITY, 0.5]
        );
    }
}
