//! How rays meet triangles and boxes: the choice that every structure follows, on the device by
//! composition and on the host through [`Reciprocal`].

use super::ray::{Ray, raised};
use super::triangle::TriangleTest;
use crate::gpu::{ArithmeticProbe, Composition};
use crate::text::nearest;
use serde::{Deserialize, Serialize};
use std::ops::Deref;

/// The tests of one run. Hits of every structure equal those of brute force with the same choice to
/// the bit, if [`BoxTest`] is padded by [`BoxTest::PROVEN_ULPS`] or more; less is there to be measured.
#[derive(
    Debug, Clone, Copy, Default, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize,
)]
pub struct Intersection {
    /// The ray–triangle test.
    pub triangle: TriangleTest,
    /// The ray–box test.
    pub box_test: BoxTest,
}

/// A slab test: which reciprocal of the direction it uses, and how far it is padded.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize, Deserialize)]
pub struct BoxTest {
    /// Whether components near 0 are raised ([`super::ray::raised`]), so that 1/d is finite: infinity and 0 · ∞ WGSL
    /// does not define.
    pub finite: bool,
    /// A box is entered if `enter <= exit * (1 + pad_ulps · 2⁻²³)`.
    pub pad_ulps: u32,
}

impl Default for BoxTest {
    fn default() -> Self {
        Self {
            finite: true,
            pad_ulps: Self::DEFAULT_ULPS,
        }
    }
}

impl BoxTest {
    /// The default pad, 2⁻¹⁹: more than twice [`super::triangle::TRIANGLE_PAD`].
    pub const DEFAULT_ULPS: u32 = 16;
    /// The least pad for which the theorem of [`super::triangle`] holds: (1 + p) / (1 − p) for the pad p
    /// of triangles, and their roundings.
    pub const PROVEN_ULPS: u32 = 9;

    /// Every box test, by the name and the line that users see.
    pub const ALL: [(BoxTest, &'static str, &'static str); 6] = [
        (
            Self::finite(Self::DEFAULT_ULPS),
            "padded-16",
            "slabs, finite reciprocal, far side times 1 + 16 ulp: the pad that the proof needs, twice",
        ),
        (
            Self::finite(4),
            "padded-4",
            "slabs, finite reciprocal, far side times 1 + 4 ulp",
        ),
        (
            Self::finite(3),
            "padded-3",
            "slabs, finite reciprocal, far side times 1 + 3 ulp (Embree's robust mode)",
        ),
        (
            Self::finite(2),
            "padded-2",
            "slabs, finite reciprocal, far side times 1 + 2 ulp (Ize 2013)",
        ),
        (
            Self::finite(0),
            "padded-0",
            "slabs, finite reciprocal, no pad",
        ),
        (
            Self {
                finite: false,
                pad_ulps: 0,
            },
            "plain",
            "slabs with 1/d, no pad: relies on infinity and on minimum and maximum of NaN",
        ),
    ];

    const fn finite(pad_ulps: u32) -> Self {
        Self {
            finite: true,
            pad_ulps,
        }
    }

    /// The test of this name.
    pub fn named(name: &str) -> Option<Self> {
        let found = Self::ALL.iter().find(|(_, known, _)| *known == name);
        found.map(|(test, ..)| *test)
    }

    /// The name of one of [`BoxTest::ALL`], or `custom`.
    pub fn name(&self) -> &'static str {
        let found = Self::ALL.iter().find(|(test, ..)| test == self);
        found.map_or("custom", |(_, name, _)| name)
    }

    /// The factor on the far side of a box. Twin of `BOX_PAD` in `kernels/accel/bounds.wesl`.
    pub fn pad(&self) -> f32 {
        1.0 + self.pad_ulps as f32 * f32::EPSILON
    }
}

impl Intersection {
    /// The tests of these names, with what was wrong of an unknown one.
    ///
    /// # Errors
    /// A name is not known; the message names the nearest known one.
    pub fn named(triangle: &str, box_test: &str) -> Result<Self, String> {
        let unknown = |what: &str, name: &str, known: Vec<&'static str>| {
            let near = nearest(name, known).unwrap_or_default();
            format!("unknown {what} test `{name}`; did you mean `{near}`?")
        };
        Ok(Self {
            triangle: TriangleTest::named(triangle).ok_or_else(|| {
                let known = TriangleTest::ALL.map(TriangleTest::name);
                unknown("triangle", triangle, known.to_vec())
            })?,
            box_test: BoxTest::named(box_test).ok_or_else(|| {
                let known = BoxTest::ALL.map(|(_, name, _)| name);
                unknown("box", box_test, known.to_vec())
            })?,
        })
    }

    /// Whether the gate asks hard rays: with triangle tests that are not watertight the oracle's bounds and
    /// the cells of grids say nothing of rays in planes of triangles, and with boxes padded by less than the
    /// proof needs hits are lost by intention.
    pub fn bears_hard_rays(&self) -> bool {
        let watertight = [TriangleTest::Watertight, TriangleTest::Compensated];
        let padded = self.box_test.finite && self.box_test.pad_ulps >= BoxTest::PROVEN_ULPS;
        padded && watertight.contains(&self.triangle)
    }

    /// Whether an adapter keeps this choice.
    ///
    /// # Errors
    /// Why it does not: without exact two-products the compensated test is another one.
    pub fn kept_by(self, probe: &ArithmeticProbe) -> Result<(), String> {
        if self.triangle != TriangleTest::Compensated || probe.exact_products {
            return Ok(());
        }
        Err(format!(
            "this adapter does not keep the two-products of the triangle test `{}`; choose `{}`",
            TriangleTest::Compensated.name(),
            TriangleTest::Watertight.name()
        ))
    }

    /// `composition` with these tests, unless it chose others before.
    #[must_use]
    pub fn activate(&self, mut composition: Composition) -> Composition {
        if !composition.active.contains_key(TRIANGLE) {
            composition = composition.with(TRIANGLE, self.triangle.kernel());
        }
        if !composition.constants.contains_key(PAD_CONSTANT) {
            composition = composition
                .constant(PAD_CONSTANT, self.box_test.pad_ulps)
                .feature("plain_reciprocal", !self.box_test.finite);
        }
        composition
    }

    /// The ray as it is traced. Twin: `raised` in `kernels/accel/ray.wesl`.
    pub fn raised(&self, ray: &Ray) -> Ray {
        if self.box_test.finite {
            raised(ray)
        } else {
            *ray
        }
    }

    /// What the tests need of a raised ray's direction, computed once a ray.
    pub fn inverse(&self, direction: [f32; 3]) -> Reciprocal {
        Reciprocal {
            inverse: direction.map(|d| 1.0 / d),
            pad: self.box_test.pad(),
            triangle: self.triangle,
        }
    }
}

/// Role of the triangle test in a composition, and the constant of the pad.
const TRIANGLE: &str = "triangle";
const PAD_CONSTANT: &str = "BOX_PAD_ULPS";

/// The reciprocal of a ray's direction, which it dereferences to, and how to test with it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Reciprocal {
    inverse: [f32; 3],
    /// The factor on the far side of boxes; `BOX_PAD` of kernels.
    pub pad: f32,
    /// The triangle test.
    pub triangle: TriangleTest,
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
    use crate::accel::ray::SMALLEST_SLOPE;

    #[test]
    fn the_default_pad_is_two_to_the_minus_nineteen_and_names_are_found_again() {
        assert_eq!(BoxTest::default().pad(), 1.0 + 2.0_f32.powi(-19));
        for (test, name, description) in BoxTest::ALL {
            assert_eq!(BoxTest::named(name), Some(test));
            assert_eq!(test.name(), name);
            assert!(!description.is_empty());
        }
        assert_eq!(BoxTest::named("padded-5"), None);
    }

    #[test]
    fn experiment_files_know_every_test_and_nearest_names_are_told() {
        use crate::config::keys;
        let triangles = TriangleTest::ALL.map(TriangleTest::name);
        assert_eq!(triangles, keys::TRIANGLE_TESTS);
        assert_eq!(BoxTest::ALL.map(|(_, name, _)| name), keys::BOX_TESTS);
        for triangle in triangles {
            for (box_test, name, _) in BoxTest::ALL {
                let tests = Intersection::named(triangle, name).expect("known names");
                assert_eq!(
                    (tests.triangle.name(), tests.box_test),
                    (triangle, box_test)
                );
            }
        }
        let error = Intersection::named("watertigth", "plain").expect_err("no such test");
        assert!(error.contains("`watertight`"), "{error}");
        let error = Intersection::named("pluecker", "padded-5").expect_err("no such test");
        assert!(error.contains("`padded-"), "{error}");
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
            triangle: TriangleTest::Compensated,
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
        let plain = BoxTest::named("plain").expect("a known name");
        assert_eq!(*of(plain), [f32::INFINITY, f32::NEG_INFINITY, 0.5]);
    }
}
