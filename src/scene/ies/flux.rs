//! Luminous intensity by direction, and total luminous flux.

use super::{IesProfile, Photometry};
use glam::DVec3;
use std::f64::consts::TAU;

/// Tolerance beyond the last angle, degrees: rounding of the kernel's f32.
const SLACK: f64 = 1e-3;

/// The interval of ascending values around `x`, and the fraction along it; `None` outside.
fn bracket(values: &[f32], x: f64) -> Option<(usize, f64)> {
    let [first, last] = [values.first()?, values.last()?].map(|v| f64::from(*v));
    if x < first - SLACK || x > last + SLACK {
        return None;
    }
    if values.len() == 1 {
        return Some((0, 0.0));
    }
    let above = values.partition_point(|v| f64::from(*v) <= x);
    let low = above.clamp(1, values.len() - 1) - 1;
    let [a, b] = [values[low], values[low + 1]].map(f64::from);
    Some((low, ((x - a) / (b - a)).clamp(0.0, 1.0)))
}

/// Angle of (x, y) from the x axis; 0 if both are 0, whatever their signs: along the luminaire's
/// axis. Twin of `angle_of` in `kernels/shading/hemisphere.wesl`.
fn angle_of(y: f64, x: f64) -> f64 {
    if x == 0.0 && y == 0.0 {
        0.0
    } else {
        y.atan2(x)
    }
}

impl IesProfile {
    /// Intensity (cd) along a unit vector in the luminaire's axes. Twin of `ies_candela` in
    /// `kernels/shading/light/ies.wesl`.
    pub fn intensity(&self, direction: DVec3) -> f64 {
        let [x, y, z] = direction.to_array();
        let (v, h) = match self.photometry {
            Photometry::C => {
                let around = angle_of(y, x);
                let turn = if around < 0.0 { around + TAU } else { around };
                (x.hypot(y).atan2(z), turn)
            }
            Photometry::B => (angle_of(y, z), x.atan2(y.hypot(z))),
            Photometry::A => (y.atan2(x.hypot(z)), angle_of(x, z)),
        };
        let (v, h) = (v.to_degrees(), h.to_degrees());
        let h = if self.horizontal.len() == 1 {
            f64::from(self.horizontal[0])
        } else {
            h
        };
        let cell = bracket(&self.vertical, v).zip(bracket(&self.horizontal, h));
        cell.map_or(0.0, |((row, s), (column, t))| {
            let last = self.horizontal.len() - 1;
            let at = |column: usize| {
                let first = column.min(last) * self.vertical.len() + row;
                let next = (row + 1).min(self.vertical.len() - 1) - row;
                let [a, b] = [first, first + next].map(|i| f64::from(self.candela[i]));
                a + s * (b - a)
            };
            let [a, b] = [at(column), at(column + 1)];
            a + t * (b - a)
        })
    }

    /// Luminous flux, lumens: the exact integral of the bilinear intensity over all directions.
    pub fn lumens(&self) -> f64 {
        let rows = self.vertical.len();
        // Solid angle is the product of one factor per angle.
        let (of_vertical, of_horizontal): (Primitive, Primitive) = match self.photometry {
            Photometry::C => (SINE, CONSTANT),
            Photometry::A => (COSINE, CONSTANT),
            Photometry::B => (CONSTANT, COSINE),
        };
        let columns: Vec<f64> = self
            .candela
            .chunks(rows)
            .map(|column| {
                let column: Vec<f64> = column.iter().map(|c| f64::from(*c)).collect();
                integral(&self.vertical, &column, of_vertical)
            })
            .collect();
        match columns.as_slice() {
            [axial] => TAU * axial,
            _ => integral(&self.horizontal, &columns, of_horizontal),
        }
    }
}

/// First and second antiderivative of a weight, as functions of an angle in radians.
type Primitive = [fn(f64) -> f64; 2];
const CONSTANT: Primitive = [|x| x, |x| 0.5 * x * x];
const SINE: Primitive = [|x| -x.cos(), |x| -x.sin()];
const COSINE: Primitive = [f64::sin, |x| -x.cos()];

/// Exact integral of a piecewise linear function times the weight, by parts.
fn integral(degrees: &[f32], values: &[f64], [first, second]: Primitive) -> f64 {
    let pairs = degrees.windows(2).zip(values.windows(2));
    pairs
        .map(|(angles, values)| {
            let [a, b] = [angles[0], angles[1]].map(|x| f64::from(x).to_radians());
            let slope = (values[1] - values[0]) / (b - a);
            values[1] * first(b) - values[0] * first(a) - slope * (second(b) - second(a))
        })
        .sum()
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;
    use std::f64::consts::PI;

    fn even(photometry: Photometry, vertical: &[f32], horizontal: &[f32]) -> IesProfile {
        IesProfile {
            name: "even".to_owned(),
            photometry,
            vertical: vertical.to_vec(),
            horizontal: horizontal.to_vec(),
            candela: vec![3.0; vertical.len() * horizontal.len()],
            rated_lumens: None,
            input_watts: 0.0,
            warnings: Vec::new(),
        }
    }

    #[test]
    fn even_light_has_its_intensity_times_the_solid_angle() {
        let half = [-90.0, -10.0, 30.0, 90.0];
        let around = [0.0, 100.0, 360.0];
        for (profile, solid_angle) in [
            (even(Photometry::C, &[0.0, 20.0, 180.0], &[0.0]), 4.0 * PI),
            (even(Photometry::C, &[0.0, 20.0, 90.0], &around), 2.0 * PI),
            (even(Photometry::A, &half, &half), 2.0 * PI),
            (even(Photometry::B, &half, &half), 2.0 * PI),
        ] {
            let error = profile.lumens() / (3.0 * solid_angle) - 1.0;
            assert!(error.abs() < 1e-12, "{profile:?}: {error}");
        }
    }

    #[test]
    fn the_flux_is_the_mean_intensity_over_directions() {
        let angles = [-90.0, -40.0, 0.0, 35.0, 90.0];
        for photometry in [Photometry::A, Photometry::B, Photometry::C] {
            let (vertical, horizontal) = match photometry {
                Photometry::C => (
                    [0.0, 20.0, 50.0, 100.0, 180.0],
                    [0.0, 50.0, 180.0, 300.0, 360.0],
                ),
                _ => (angles, angles),
            };
            let mut profile = even(photometry, &vertical, &horizontal);
            let mut random = Pcg32::new(5);
            let random_values = profile.candela.iter_mut();
            random_values.for_each(|c| *c = random.uniform() as f32);
            let last = profile.candela.len() - 5;
            profile.candela.copy_within(..5, last);
            let count = 400_000;
            let sum: f64 = (0..count)
                .map(|_| profile.intensity(random.direction()))
                .sum();
            let found = 4.0 * PI * sum / f64::from(count);
            let error = found / profile.lumens() - 1.0;
            assert!(error.abs() < 0.01, "{photometry:?}: {error}");
        }
    }
}
