//! Volumes from procedures: a ball of glass in fog, a cloud, a gyroid, and the lens of Luneburg.

use crate::{MediaError, Volume};
use glam::{DVec3, IVec3};
use raystone_core::random::Pcg32;

/// Coefficients of the fog: scattering, absorption, in lengths of the box.
const FOG: [f32; 2] = [1.0, 0.1];
/// Refractive index of glass.
const GLASS: f32 = 1.5;
/// Taps of the blur of a refractive index: a Gaussian of standard deviation 1.5 voxels, cut at four (Pfeuti 2009, §3.2).
const BLUR: [f32; 5] = [0.26656, 0.21344, 0.10959, 0.03607, 0.00761];
/// Sub-voxels along each axis at a border.
const COVERAGE: u32 = 4;

/// A ball of glass, of radius 0.3, in a box of fog: the first scene of Pfeuti 2009. Its border is covered in parts,
/// by 4³ points of a voxel, and its index blurred.
///
/// # Errors
/// The resolution is not allowed.
pub fn glass_ball(side: u32) -> Result<Volume, MediaError> {
    ball(side, 0.3)
}

/// The same with another radius.
///
/// # Errors
/// The resolution is not allowed.
pub fn ball(side: u32, radius: f64) -> Result<Volume, MediaError> {
    let inside = |p: DVec3| (p - 0.5).length_squared() < radius * radius;
    solid(side, inside, |_| 1.0)
}

/// A gyroid of glass in a box of fog: a closed surface with holes everywhere, three periods along each axis.
///
/// # Errors
/// The resolution is not allowed.
pub fn gyroid(side: u32) -> Result<Volume, MediaError> {
    let inside = |p: DVec3| {
        let q = p * (3.0 * std::f64::consts::TAU);
        let value = q.x.sin() * q.y.cos() + q.y.sin() * q.z.cos() + q.z.sin() * q.x.cos();
        let border = (p - 0.5).abs().max_element();
        value > 0.4 && border < 0.4
    };
    solid(side, inside, |_| 1.0)
}

/// A cube of glass whose index and scattering Perlin noise disturbs: the second scene of Pfeuti 2009.
///
/// # Errors
/// The resolution is not allowed.
pub fn noisy_cube(side: u32) -> Result<Volume, MediaError> {
    let inside = |p: DVec3| (p - 0.5).abs().max_element() < 0.25;
    let noise = cube_noise();
    solid(side, inside, move |p| 1.0 + 0.2 * noise(p))
}

/// The noise of [`noisy_cube`], about ±1.
pub fn cube_noise() -> impl Fn(DVec3) -> f32 {
    let noise = Perlin::new(1);
    move |p| noise.turbulence(p * 6.0, 3) as f32
}

/// A cloud: Perlin noise above a level, in nothing. Its index is 1.
///
/// # Errors
/// The resolution is not allowed.
pub fn cloud(side: u32) -> Result<Volume, MediaError> {
    let noise = Perlin::new(2);
    Volume::new([side; 3], |p| {
        let fall = 1.0 - ((p - 0.5).length() / 0.5).powi(2);
        let density = (noise.turbulence(p * 4.0, 4) + 0.7 * fall - 0.35).clamp(0.0, 1.0) as f32;
        [8.0 * density, 0.5 * density, 1.0]
    })
}

/// The lens of Luneburg (1944) of radius 0.4: rays that enter in parallel meet at its far side.
///
/// # Errors
/// The resolution is not allowed.
pub fn luneburg_lens(side: u32) -> Result<Volume, MediaError> {
    Volume::new([side; 3], |p| {
        let r2 = (p - 0.5).length_squared() / 0.16;
        [0.0, 0.0, (2.0 - r2.min(1.0)).sqrt() as f32]
    })
}

/// A solid of glass in fog; `factor` scales its scattering and what its index has above 1.
fn solid(
    side: u32,
    inside: impl Fn(DVec3) -> bool + Sync,
    factor: impl Fn(DVec3) -> f32 + Sync,
) -> Result<Volume, MediaError> {
    let glass = |p: DVec3| {
        let factor = factor(p);
        [0.5 * factor, 0.0, 1.0 + (GLASS - 1.0) * factor]
    };
    covered(
        side,
        |p| coverage_of(side, p, &inside),
        [FOG[0], FOG[1], 1.0],
        glass,
    )
}

/// The part of a voxel, of `side` along an axis, that is inside: of 4³ points around its centre.
pub fn coverage_of(side: u32, centre: DVec3, inside: impl Fn(DVec3) -> bool) -> f32 {
    let sub = 1.0 / f64::from(side * COVERAGE);
    let corner = centre - f64::from(COVERAGE) / 2.0 * sub;
    let is_covered = |i: &u32| {
        let [x, y, z] = [
            i % COVERAGE,
            i / COVERAGE % COVERAGE,
            i / (COVERAGE * COVERAGE),
        ];
        let at = DVec3::new(x.into(), y.into(), z.into()) + 0.5;
        inside(corner + at * sub)
    };
    let all = COVERAGE.pow(3);
    (0..all).filter(is_covered).count() as f32 / all as f32
}

/// A solid in a medium of `side`³ voxels, by the part of each voxel that it covers: σ_s, σ_a and n of both are mixed by that part, and
/// n is blurred (Pfeuti 2009, §3.2).
///
/// # Errors
/// The resolution is not allowed, or a value is none that a medium has.
pub fn covered(
    side: u32,
    coverage: impl Fn(DVec3) -> f32 + Sync,
    outside: [f32; 3],
    inside: impl Fn(DVec3) -> [f32; 3] + Sync,
) -> Result<Volume, MediaError> {
    let mut volume = Volume::new([side; 3], |centre| {
        let (part, inside) = (coverage(centre), inside(centre));
        [0, 1, 2].map(|k| outside[k] + part * (inside[k] - outside[k]))
    })?;
    volume.refraction = blurred(&volume.refraction, side as usize);
    volume.checked()
}

/// The Gaussian of [`BLUR`] along each axis; beyond the grid are the values of its border.
fn blurred(values: &[f32], side: usize) -> Vec<f32> {
    let mut values = values.to_vec();
    for stride in [1, side, side * side] {
        let along = |index: usize, offset: isize| {
            let place = (index / stride % side) as isize;
            let moved = (place + offset).clamp(0, side as isize - 1) - place;
            values[(index as isize + moved * stride as isize) as usize]
        };
        let sum = |index: usize| {
            let pairs = (1..=4).map(|k| BLUR[k as usize] * (along(index, k) + along(index, -k)));
            BLUR[0] * along(index, 0) + pairs.sum::<f32>()
        };
        // Taps that round to a little more than 1 must not make an index below 1.
        let limit = |value: f32| value.max(1.0);
        values = (0..values.len()).map(|index| limit(sum(index))).collect();
    }
    values
}

/// Gradient noise (Perlin 2002).
pub(crate) struct Perlin(Vec<u8>);

impl Perlin {
    pub(crate) fn new(seed: u64) -> Self {
        let mut random = Pcg32::new(seed);
        let mut order: Vec<u8> = (0..=255).collect();
        for last in (1..order.len()).rev() {
            order.swap(last, random.below(last + 1));
        }
        Self(order)
    }

    /// The sum of `octaves` of noise, each of twice the frequency and half the height.
    pub(crate) fn turbulence(&self, p: DVec3, octaves: u32) -> f64 {
        let octave = |k: u32| self.noise(p * f64::from(1 << k)) / f64::from(1 << k);
        (0..octaves).map(octave).sum()
    }

    /// Noise in [−1, 1], 0 at whole positions.
    fn noise(&self, p: DVec3) -> f64 {
        let cell = p.floor();
        let local = p - cell;
        let fade = local * local * local * (local * (local * 6.0 - 15.0) + 10.0);
        let corner = |i: i32| {
            let offset = IVec3::new(i & 1, i >> 1 & 1, i >> 2);
            let weights = [0, 1, 2].map(|a| match offset[a] {
                0 => 1.0 - fade[a],
                _ => fade[a],
            });
            let gradient = self.gradient(cell.as_ivec3() + offset);
            weights.iter().product::<f64>() * gradient.dot(local - offset.as_dvec3())
        };
        (0..8).map(corner).sum()
    }

    /// One of the twelve directions to the middles of a cube's edges.
    fn gradient(&self, at: IVec3) -> DVec3 {
        let hashed = [at.z, at.y, at.x].into_iter().fold(0_u8, |hash, place| {
            self.0[usize::from(hash.wrapping_add(place.rem_euclid(256) as u8))]
        });
        let sign = |bit: u8| if hashed >> bit & 1 == 0 { 1.0 } else { -1.0 };
        match hashed / 4 % 3 {
            0 => DVec3::new(sign(0), sign(1), 0.0),
            1 => DVec3::new(0.0, sign(0), sign(1)),
            _ => DVec3::new(sign(0), 0.0, sign(1)),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn procedures_fill_what_they_say() {
        let ball = glass_ball(32).unwrap();
        let glass = ball.refraction.iter().filter(|n| **n > 1.25).count() as f64;
        let ball_of = 4.0 / 3.0 * std::f64::consts::PI * (0.3_f64 * 32.0).powi(3);
        assert!((glass / ball_of - 1.0).abs() < 0.1, "{glass} of {ball_of}");
        let at = |x: usize| ball.refraction[x + 32 * (16 + 32 * 16)];
        assert!(at(0) == 1.0 && (at(16) - 1.5).abs() < 1e-3);
        // A blurred border rises over about eight voxels and nowhere falls.
        let rise: Vec<f32> = (0..16).map(at).collect();
        assert!(rise.is_sorted(), "{rise:?}");
        assert!(rise.iter().filter(|n| **n > 1.005 && **n < 1.495).count() >= 5);
        let lens = luneburg_lens(31).unwrap();
        let middle = lens.refraction[15 + 31 * (15 + 31 * 15)];
        assert!((middle - 2.0_f32.sqrt()).abs() < 1e-6);
        for volume in [
            cloud(24).unwrap(),
            noisy_cube(24).unwrap(),
            gyroid(24).unwrap(),
        ] {
            let values = volume.scattering.iter();
            let dense = values.clone().filter(|v| **v > 0.6).count();
            assert!(dense > 24 * 24 * 24 / 50 && dense < 24 * 24 * 24, "{dense}");
            assert!(values.clone().any(|v| *v != volume.scattering[0]));
        }
    }

    #[test]
    fn the_taps_of_the_blur_are_a_gaussian_that_sums_to_one() {
        let tap = |k: f64| (-k * k / (2.0 * 1.5 * 1.5)).exp();
        let sum: f64 = (-4..=4).map(|k| tap(f64::from(k))).sum();
        for (k, found) in BLUR.iter().enumerate() {
            assert!(
                (tap(k as f64) / sum - f64::from(*found)).abs() < 6e-6,
                "{k}"
            );
        }
    }

    #[test]
    fn noise_is_smooth_and_zero_at_whole_positions() {
        let noise = Perlin::new(7);
        assert_eq!(noise.noise(DVec3::new(3.0, -2.0, 5.0)), 0.0);
        let mut random = Pcg32::new(3);
        let mut largest = 0.0_f64;
        for _ in 0..10_000 {
            let p = random.in_cube() * 20.0;
            let step = noise.noise(p + 1e-5) - noise.noise(p);
            assert!(step.abs() < 1e-4, "{p}: {step}");
            largest = largest.max(noise.noise(p).abs());
        }
        assert!(largest > 0.5 && largest <= 1.0, "{largest}");
    }
}
