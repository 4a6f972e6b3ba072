//! Integrals over the sphere, finer towards one direction, and the chi-square test over their cells.

use glam::DVec3;
use statrs::distribution::{ChiSquared, ContinuousCDF};
use std::f64::consts::PI;

/// Cells in the angle to the direction and around it, and points along each edge of a cell.
const RINGS: usize = 14;
const SECTORS: usize = 16;
const POINTS: usize = 40;
/// Cells with fewer expected samples are merged.
const LEAST_EXPECTED: f64 = 10.0;

/// The sphere in cells around a direction.
pub struct Grid {
    frame: [DVec3; 3],
}

impl Grid {
    pub fn around(z: DVec3) -> Self {
        let z = z.normalize();
        let x = z.any_orthonormal_vector();
        Self {
            frame: [x, z.cross(x), z],
        }
    }

    /// The direction at these fractions: rings are narrow in the middle, π s⁴.
    fn at(&self, s: f64, t: f64) -> DVec3 {
        let (sin, cos) = (PI * s.powi(4)).sin_cos();
        let (y, x) = (2.0 * PI * t).sin_cos();
        let [a, b, c] = self.frame;
        (sin * x * a + sin * y * b + cos * c).normalize()
    }

    fn cell_of(&self, direction: DVec3) -> usize {
        let [x, y, z] = self.frame.map(|axis| axis.dot(direction));
        let s = (x.hypot(y).atan2(z) / PI).powf(0.25);
        let t = (y.atan2(x) / (2.0 * PI)).rem_euclid(1.0);
        let part = |x: f64, n: usize| ((x * n as f64) as usize).min(n - 1);
        part(s, RINGS) * SECTORS + part(t, SECTORS)
    }

    /// A direction in each cell, none of them special.
    pub fn some(&self) -> impl Iterator<Item = DVec3> {
        let cells = (0..3 * RINGS).flat_map(|r| (0..SECTORS).map(move |c| (r, c)));
        cells.map(|(r, c)| {
            let s = (r as f64 + 0.37) / (3 * RINGS) as f64;
            self.at(s, (c as f64 + 0.41) / SECTORS as f64)
        })
    }

    /// Points of a cell, each with its solid angle.
    fn points(&self, cell: usize) -> impl Iterator<Item = (DVec3, f64)> {
        let (ring, sector) = (cell / SECTORS, cell % SECTORS);
        let (rings, sectors) = ((RINGS * POINTS) as f64, (SECTORS * POINTS) as f64);
        (0..POINTS * POINTS).map(move |k| {
            let s = ((ring * POINTS + k / POINTS) as f64 + 0.5) / rings;
            let t = ((sector * POINTS + k % POINTS) as f64 + 0.5) / sectors;
            let stretch = (PI * s.powi(4)).sin() * 4.0 * PI * s.powi(3) / rings;
            (self.at(s, t), stretch * 2.0 * PI / sectors)
        })
    }

    pub fn integral(&self, f: impl Fn(DVec3) -> DVec3) -> DVec3 {
        let cells = 0..RINGS * SECTORS;
        let points = cells.flat_map(|cell| self.points(cell));
        points.map(|(i, solid_angle)| f(i) * solid_angle).sum()
    }
}

/// Probability that directions with this density fit at least as badly as these. Zero if too many
/// or too few are below the surface, where there is no direction.
pub fn chi_square(grid: &Grid, directions: &[DVec3], pdf: impl Fn(DVec3) -> f64) -> f64 {
    let mut found = vec![0.0; RINGS * SECTORS];
    let mut above = 0.0;
    for direction in directions.iter().filter(|d| d.z > 0.0) {
        if !direction.is_finite() {
            return 0.0;
        }
        found[grid.cell_of(*direction)] += 1.0;
        above += 1.0;
    }
    let count = directions.len() as f64;
    let expected: Vec<f64> = (0..found.len())
        .map(|cell| {
            let points = grid.points(cell);
            count * points.map(|(i, solid)| pdf(i) * solid).sum::<f64>()
        })
        .collect();
    let total: f64 = expected.iter().sum();
    if (above - total).abs() > 5.0 * (count - total).max(1.0).sqrt() + 2e-3 * count {
        return 0.0;
    }
    let (mut statistic, mut cells) = (0.0, 0);
    let mut pooled = (0.0, 0.0);
    for (found, expected) in found.iter().zip(&expected) {
        if *expected < LEAST_EXPECTED {
            pooled = (pooled.0 + found, pooled.1 + expected);
        } else {
            statistic += (found - expected).powi(2) / expected;
            cells += 1;
        }
    }
    if pooled.1 > LEAST_EXPECTED {
        statistic += (pooled.0 - pooled.1).powi(2) / pooled.1;
        cells += 1;
    } else if pooled.0 > 5.0 * LEAST_EXPECTED {
        return 0.0;
    }
    let freedom = f64::from((cells - 1).max(1));
    let distribution = ChiSquared::new(freedom).expect("a positive number");
    1.0 - distribution.cdf(statistic)
}

/// Directions drawn from the density pass, and those of a density a tenth wider fail.
#[test]
fn the_test_sees_a_wrong_width_and_passes_the_right_one() {
    let mut random = raystone::random::Pcg32::with_stream(3, 5);
    let mut unit = || f64::from(random.next_u32()) / 4_294_967_296.0;
    // A cosine to the power of e about the z axis.
    let mut powers = |e: f64| -> Vec<DVec3> {
        let one = |(u, v): (f64, f64)| {
            let cos = u.powf(1.0 / (e + 1.0));
            let (y, x) = (2.0 * PI * v).sin_cos();
            let sin = (1.0 - cos * cos).sqrt();
            DVec3::new(sin * x, sin * y, cos)
        };
        (0..1 << 14).map(|_| one((unit(), unit()))).collect()
    };
    let grid = Grid::around(DVec3::Z);
    let pdf = |i: DVec3| 21.0 / (2.0 * PI) * i.z.max(0.0).powi(20);
    assert!((grid.integral(|i| DVec3::splat(pdf(i))).x - 1.0).abs() < 1e-4);
    assert!(chi_square(&grid, &powers(20.0), pdf) > 1e-3);
    assert!(chi_square(&grid, &powers(22.0), pdf) < 1e-6);
}
