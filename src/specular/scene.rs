//! Eye, picture and vertices of a measurement, as in the digest's §2.10: the eye at (4, 0, 0), 512² pixels over 45°.

use crate::oracle::{Oracle, Point};
use crate::path::{Form, Setup};
use crate::real::{Real, V3};
use crate::reflector::{Reflector, Shape, radius_of};
use glam::DVec3;
use rayon::prelude::*;
use raystone_core::random::Pcg32;

/// Pixels along each side of the picture.
pub(crate) const PICTURE: f64 = 512.0;
/// The eye's distance from the origin.
const EYE: f64 = 4.0;
/// Half the field of view.
const HALF_VIEW: f64 = 22.5;
/// Multiples of the surface's distance at which vertices are; each up to 1.3 times as far.
const FAR: [f64; 5] = [1.02, 1.3, 2.0, 4.0, 8.0];
/// Distances from the centre of the bowl.
const IN_BOWL: [f64; 5] = [0.3, 0.6, 0.9, 1.2, 1.6];
/// The least cosines at the point of reflection, to eye and vertex.
const LEAST: [f64; 2] = [0.05, 0.02];
/// Tries for each vertex.
const TRIES: usize = 60;

/// A reflector with its bumps.
#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) struct Mirror {
    pub(crate) shape: Shape,
    pub(crate) amplitude: f64,
    pub(crate) frequency: f64,
}

impl Mirror {
    pub(crate) fn reflector<T: Real>(&self) -> Reflector<T> {
        Reflector {
            shape: self.shape.word(),
            amplitude: T::of(self.amplitude),
            frequency: T::of(self.frequency),
        }
    }

    pub(crate) fn oracle(&self) -> Oracle {
        Oracle::new(self.shape, self.amplitude, self.frequency)
    }
}

/// What is seen from an eye that was turned about z by `degrees`.
pub(crate) fn setup<T: Real>(mirror: &Mirror, form: Form, degrees: f64) -> Setup<T> {
    let (sine, cosine) = degrees.to_radians().sin_cos();
    Setup {
        reflector: mirror.reflector(),
        eye: V3::of(DVec3::new(EYE * cosine, EYE * sine, 0.0)),
        right: V3::of(DVec3::new(-sine, cosine, 0.0)),
        up: V3::of(DVec3::Z),
        forward: V3::of(DVec3::new(-cosine, -sine, 0.0)),
        pixels: T::of(0.5 * PICTURE / HALF_VIEW.to_radians().tan()),
        form: form.word(),
    }
}

/// A vertex and all its points of reflection, the shortest path first.
#[derive(Debug, Clone)]
pub(crate) struct Vertex {
    pub(crate) v: DVec3,
    pub(crate) points: Vec<Point>,
}

/// A vertex at random, or none where it cannot be one.
fn candidate(mirror: &Mirror, distance: f64, random: &mut Pcg32) -> Option<DVec3> {
    let u = random.direction();
    let far = random.one_of(&FAR) * (1.0 + 0.3 * random.uniform());
    let in_bowl = random.one_of(&IN_BOWL) * (1.0 + 0.2 * random.uniform());
    let r = radius_of(mirror.reflector::<f64>(), V3::of(u)).f64();
    match mirror.shape {
        Shape::Concave => {
            let v = u * if distance > 0.0 { distance } else { in_bowl };
            (v.x > 0.0 || v.length() < 0.98).then_some(v)
        }
        Shape::Plane if u.x < 0.05 => None,
        Shape::Torus if u.x < -0.3 => None,
        _ if distance > 0.0 => Some(u * (r + distance)),
        Shape::Bumpy => Some(u * far.max((far / FAR[0]) * (FAR[0] + mirror.amplitude))),
        _ => Some(u * (r * far)),
    }
}

/// As many vertices whose point of reflection is in the picture and not seen at a grazing angle.
pub(crate) fn vertices(
    mirror: &Mirror,
    oracle: &Oracle,
    distance: f64,
    count: usize,
    seed: u64,
) -> Result<Vec<Vertex>, String> {
    let mut random = Pcg32::new(seed);
    let seen: Setup<f64> = setup(mirror, Form::Transposed, 0.0);
    let eye = seen.eye.f64();
    let mut all = Vec::new();
    for _ in 0..TRIES {
        let some: Vec<DVec3> = (0..count)
            .filter_map(|_| candidate(mirror, distance, &mut random))
            .collect();
        let judged: Vec<Option<Vertex>> = some
            .into_par_iter()
            .map(|v| {
                let points = oracle.points(eye, v);
                let first = points.first()?;
                let is_fit = first.to_eye >= LEAST[0] && first.to_vertex >= LEAST[1];
                let at = pixel(&seen, first.p);
                let is_in = at.iter().all(|x| x.abs() < 0.5 * PICTURE);
                (is_fit && is_in && !is_inside(mirror, v)).then_some(Vertex { v, points })
            })
            .collect();
        all.extend(judged.into_iter().flatten());
        if all.len() >= count {
            all.truncate(count);
            return Ok(all);
        }
    }
    Err(format!(
        "only {} of {count} vertices have a point of reflection that is seen: try another `distance`",
        all.len()
    ))
}

/// Of the torus, which is not convex, a far vertex may be in another part.
fn is_inside(mirror: &Mirror, v: DVec3) -> bool {
    mirror.shape == Shape::Torus && (v.z.hypot(v.y + 1.5) - 1.5).hypot(v.x) < 0.6
}

/// Where a point is in the picture, in f64.
pub(crate) fn pixel<T: Real>(setup: &Setup<T>, p: DVec3) -> [f64; 2] {
    let d = p - setup.eye.f64();
    let scale = setup.pixels.f64() / d.dot(setup.forward.f64()).max(1e-9);
    [
        d.dot(setup.right.f64()) * scale,
        d.dot(setup.up.f64()) * scale,
    ]
}

/// Three directions a vertex, anywhere on the side that faces the eye.
pub(crate) fn random_begins(mirror: &Mirror, count: usize, seed: u64) -> Vec<DVec3> {
    let mut random = Pcg32::with_stream(seed, 1);
    let flip = if mirror.shape == Shape::Concave {
        -1.0
    } else {
        1.0
    };
    let mut one = || {
        let u = random.direction();
        DVec3::new(u.x.abs() * flip, u.y, u.z)
    };
    (0..3 * count).map(|_| one()).collect()
}

/// Directions on the side that faces the eye, spread by the golden angle.
pub(crate) fn spread_begins(mirror: &Mirror, count: usize) -> Vec<DVec3> {
    let flip = if mirror.shape == Shape::Concave {
        -1.0
    } else {
        1.0
    };
    let turn = std::f64::consts::PI * (3.0 - 5.0_f64.sqrt());
    (0..count)
        .map(|k| {
            let x = 1.0 - (k as f64 + 0.5) / count as f64 * 0.97;
            let r = (1.0 - x * x).sqrt();
            let angle = turn * k as f64;
            DVec3::new(x * flip, r * angle.cos(), r * angle.sin())
        })
        .collect()
}
