//! Positions of meshes: the ladder of scales and translations that every swept family climbs.

use glam::{DVec3, Vec3};

/// Direction of translations, by the position of Embree's watertightness test.
const AWAY: DVec3 = DVec3::new(148_376.0 / 223_423.0, 1234.0 / 223_423.0, -1.0);

/// A scale and a translation.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Placement {
    /// Factor on all coordinates.
    pub scale: f64,
    /// Greatest coordinate of the translation, after scaling.
    pub shift: f64,
}

impl Placement {
    /// The placement of models: about two units around the origin.
    pub const ORDINARY: Self = Self {
        scale: 1.0,
        shift: 0.0,
    };

    /// The position of Embree's watertightness test, (148376, 1234, −223423).
    pub const FAR: Self = Self {
        scale: 1.0,
        shift: 223_423.0,
    };

    /// Returns every rung, or the few most informative ones.
    pub(crate) fn ladder(quick: bool) -> Vec<Self> {
        let scaled = |exponent: i32| Self {
            scale: 10f64.powi(exponent),
            shift: 0.0,
        };
        let shifted = |exponent: i32| Self {
            scale: 1.0,
            shift: 10f64.powi(exponent),
        };
        let (scales, shifts): (&[i32], &[i32]) = if quick {
            (&[0, -8, 8], &[])
        } else {
            (
                &[0, -8, -6, -4, -2, 2, 4, 6, 8],
                &[-8, -6, -4, -2, 0, 2, 4, 6, 8],
            )
        };
        let scales = scales.iter().copied().map(scaled);
        let shifts = shifts.iter().copied().map(shifted);
        scales.chain(shifts).chain([Self::FAR]).collect()
    }

    /// Returns a modelled point in the scene, rounded once.
    pub fn point(&self, modelled: DVec3) -> Vec3 {
        (modelled * self.scale + AWAY * self.shift).as_vec3()
    }

    /// Returns the error bound of a rounded coordinate, at a mesh of about two units.
    pub fn resolution(&self) -> f64 {
        (self.shift + 2.0 * self.scale) * f64::from(f32::EPSILON)
    }

    /// Returns `true` if the mesh still has an inside: a hundred steps of rounding across.
    pub(crate) fn keeps_shape(&self) -> bool {
        2.0 * self.scale > 50.0 * self.resolution()
    }
}

impl std::fmt::Display for Placement {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match (self.scale, self.shift) {
            (1.0, 0.0) => write!(f, "ordinary"),
            (1.0, shift) if *self == Self::FAR => write!(f, "far ({shift})"),
            (scale, 0.0) => write!(f, "scale {scale:e}"),
            (_, shift) => write!(f, "shift {shift:e}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_far_place_is_that_of_embree() {
        let centre = Placement::FAR.point(DVec3::ZERO);
        assert_eq!(centre, Vec3::new(148_376.0, 1234.0, -223_423.0));
    }

    #[test]
    fn the_ladder_reaches_from_ten_to_the_minus_eight_to_ten_to_the_eight_both_ways() {
        let ladder = Placement::ladder(false);
        for end in [1e-8, 1e8] {
            assert!(ladder.iter().any(|p| p.scale == end && p.shift == 0.0));
            assert!(ladder.iter().any(|p| p.scale == 1.0 && p.shift == end));
        }
        assert_eq!(ladder[0], Placement::ORDINARY);
        let names: std::collections::BTreeSet<_> =
            ladder.iter().map(Placement::to_string).collect();
        assert_eq!(names.len(), ladder.len());
        assert!(Placement::ladder(true).iter().all(|p| ladder.contains(p)));
    }

    #[test]
    fn a_mesh_that_rounding_has_crushed_has_no_inside() {
        assert!(Placement::FAR.keeps_shape() && Placement::ORDINARY.keeps_shape());
        let shifted = |shift| Placement { scale: 1.0, shift };
        assert!(!shifted(1e8).keeps_shape() && !shifted(1e6).keeps_shape());
        assert!(shifted(1e4).keeps_shape());
    }
}
