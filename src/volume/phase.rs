//! Phase functions: the density of directions after scattering, over the sphere, by the cosine of the angle between
//! the directions of travel before and after. Kernel: `kernels/volume/phase.wesl`.

use glam::Vec3;

/// Isotropic scattering.
pub const ISOTROPIC: u32 = 0;
/// Schlick's approximation.
pub const SCHLICK: u32 = 1;
/// The function of Henyey and Greenstein.
pub const HENYEY_GREENSTEIN: u32 = 2;

const INVERSE_4_PI: f32 = 0.079_577_47;
const TWO_PI: f32 = 6.283_185_5;
/// Anisotropy below which Henyey and Greenstein's inversion loses its digits; isotropic there.
const NEARLY_ISOTROPIC: f32 = 0.001;

/// A phase function with its anisotropy.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Phase {
    /// [`ISOTROPIC`], [`SCHLICK`] or [`HENYEY_GREENSTEIN`].
    pub kind: u32,
    /// k of Schlick, g of Henyey and Greenstein, in (−1, 1): above 0 is forward.
    pub anisotropy: f32,
}

impl Phase {
    /// Equal in all directions.
    pub const ISOTROPIC: Self = Self {
        kind: ISOTROPIC,
        anisotropy: 0.0,
    };
}

/// The density at a cosine, per steradian (Blasi, Le Saëc & Schlick 1993, eq. 4; Henyey & Greenstein 1941).
pub fn phase_density(phase: Phase, cosine: f32) -> f32 {
    let a = phase.anisotropy;
    if phase.kind == SCHLICK {
        let b = 1.0 - a * cosine;
        return INVERSE_4_PI * (1.0 - a * a) / (b * b);
    }
    if phase.kind == HENYEY_GREENSTEIN && a.abs() >= NEARLY_ISOTROPIC {
        let b = (1.0 + a * a - 2.0 * a * cosine).max(0.0);
        return INVERSE_4_PI * (1.0 - a * a) / (b * b.sqrt());
    }
    INVERSE_4_PI
}

/// The cosine whose cumulative probability is `u` in [0, 1).
pub fn phase_cosine(phase: Phase, u: f32) -> f32 {
    let a = phase.anisotropy;
    let even = 1.0 - 2.0 * u;
    if phase.kind == SCHLICK {
        return (a - even) / (1.0 - a * even);
    }
    if phase.kind == HENYEY_GREENSTEIN && a.abs() >= NEARLY_ISOTROPIC {
        let b = (1.0 - a * a) / (1.0 - a * even);
        return ((1.0 + a * a - b * b) / (2.0 * a)).clamp(-1.0, 1.0);
    }
    -even
}

/// A direction after scattering, distributed as [`phase_density`], from two numbers in [0, 1).
pub fn phase_sample(phase: Phase, before: Vec3, u: [f32; 2]) -> Vec3 {
    let cosine = phase_cosine(phase, u[0]);
    let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
    let angle = TWO_PI * u[1];
    let (x, y) = before.any_orthonormal_pair();
    x * (sine * angle.cos()) + y * (sine * angle.sin()) + before * cosine
}

#[cfg(test)]
mod tests {
    use super::*;

    const PHASES: [(u32, f32); 9] = [
        (ISOTROPIC, 0.0),
        (SCHLICK, 0.0),
        (SCHLICK, 0.5),
        (SCHLICK, -0.9),
        (SCHLICK, 0.98),
        (HENYEY_GREENSTEIN, 0.0),
        (HENYEY_GREENSTEIN, 0.6),
        (HENYEY_GREENSTEIN, -0.8),
        (HENYEY_GREENSTEIN, 0.95),
    ];

    /// 2π ∫ f(cosine) density(cosine) over [−1, up to], by the midpoint rule.
    fn integral(phase: Phase, to: f64, f: impl Fn(f64) -> f64) -> f64 {
        let steps = 1 << 16;
        let width = (to + 1.0) / f64::from(steps);
        let at = |i: i32| {
            let cosine = -1.0 + (f64::from(i) + 0.5) * width;
            f(cosine) * f64::from(phase_density(phase, cosine as f32)) * width
        };
        std::f64::consts::TAU * (0..steps).map(at).sum::<f64>()
    }

    #[test]
    fn densities_integrate_to_one_and_have_the_mean_cosine_of_their_closed_form() {
        for (kind, anisotropy) in PHASES {
            let phase = Phase { kind, anisotropy };
            let total = integral(phase, 1.0, |_| 1.0);
            assert!((total - 1.0).abs() < 1e-4, "{phase:?}: {total}");
            let k = f64::from(anisotropy);
            let mean = match kind {
                HENYEY_GREENSTEIN => k,
                // ∫ x (1 − k²) / (2 (1 − kx)²) dx over [−1, 1].
                SCHLICK if k != 0.0 => {
                    let log = ((1.0 - k) / (1.0 + k)).ln();
                    1.0 / k + (1.0 - k * k) / (2.0 * k * k) * log
                }
                _ => 0.0,
            };
            let found = integral(phase, 1.0, |x| x);
            assert!(
                (found - mean).abs() < 2e-4,
                "{phase:?}: {found}, not {mean}"
            );
        }
    }

    #[test]
    fn cosines_invert_the_cumulative_density() {
        for (kind, anisotropy) in PHASES {
            let phase = Phase { kind, anisotropy };
            for u in [0.001_f32, 0.1, 0.25, 0.5, 0.9, 0.999] {
                let cosine = phase_cosine(phase, u);
                let below = integral(phase, cosine.into(), |_| 1.0);
                assert!(
                    (below - f64::from(u)).abs() < 1e-3,
                    "{phase:?} {u}: {below}"
                );
            }
        }
    }

    #[test]
    fn sampled_directions_are_units_at_their_cosine() {
        let awkward = [
            Vec3::Z,
            Vec3::NEG_Z,
            Vec3::new(1e-4, 0.0, -1.0).normalize(),
            Vec3::new(0.3, -0.5, 0.2).normalize(),
        ];
        for (kind, anisotropy) in PHASES {
            let phase = Phase { kind, anisotropy };
            for before in awkward {
                for u in [[0.0, 0.0], [0.5, 0.25], [0.999_999_94, 0.7]] {
                    let after = phase_sample(phase, before, u);
                    assert!((after.length() - 1.0).abs() < 1e-5, "{phase:?} {after}");
                    let cosine = phase_cosine(phase, u[0]);
                    assert!((after.dot(before) - cosine).abs() < 1e-5);
                }
            }
        }
    }
}
