//! A closed room with any number of triangles, and the rays that a mirror ball in it reflects: a set-up in which counts of
//! a descent with rays are known without a scene that has to be had.

use glam::Vec3;
use rayon::prelude::*;
use raystone_accel::triangle::TriangleRecord;
use raystone_accel::{CpuTwin, Ray, TriangleSoup};
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;
use std::f32::consts::{PI, TAU};

/// Half an edge of the room, scene units; the mirror has radius 1 and stands in its middle.
const HALF: f32 = 5.0;
/// Balls at random places, none of which reaches nearer to the middle than this.
const BALLS: u32 = 24;
const FREE: f32 = 1.8;
/// The camera, which looks at the mirror with a field of view of 45°.
const EYE: Vec3 = Vec3::new(4.0, 0.0, 0.0);
/// A point light between mirror and balls.
const LIGHT: Vec3 = Vec3::new(0.0, 1.5, 0.0);
/// How far waves turn the normals of the mirror.
const AMPLITUDE: f32 = 0.15;
/// How far rays start off the walls.
const OFFSET: f32 = 1e-4;

/// The room: walls of `squares`² squares, and 24 balls of `squares` by `squares` / 2 patches:
/// 36 n² − 48 n triangles, if n is even.
pub fn room(squares: u32) -> TriangleSoup {
    let n = squares as usize;
    let mut triangles: Vec<[Vec3; 3]> = Vec::new();
    let mut square = |corner: &dyn Fn(usize, usize) -> Vec3, i, j| {
        let [a, b, c, d] = [(0, 0), (1, 0), (1, 1), (0, 1)].map(|(u, v)| corner(i + u, j + v));
        // A patch at a pole of a ball is one triangle.
        let has_area = |[a, b, c]: &[Vec3; 3]| (*b - *a).cross(*c - *a).length() > 1e-7;
        triangles.extend([[a, b, c], [a, c, d]].into_iter().filter(has_area));
    };
    let cells = |rows: usize| (0..n).flat_map(move |i| (0..rows).map(move |j| (i, j)));
    for wall in 0..6 {
        let corner = |i: usize, j: usize| {
            let [u, v] = [i, j].map(|k| 2.0 * HALF * k as f32 / n as f32 - HALF);
            let mut at = [0.0; 3];
            at[wall / 2] = if wall % 2 == 0 { -HALF } else { HALF };
            (at[(wall / 2 + 1) % 3], at[(wall / 2 + 2) % 3]) = (u, v);
            Vec3::from(at)
        };
        cells(n).for_each(|(i, j)| square(&corner, i, j));
    }
    let mut random = Pcg32::new(24);
    let mut part = |low: f32, high: f32| low + (high - low) * random.uniform() as f32;
    for _ in 0..BALLS {
        let radius = part(0.25, 0.55);
        let centre = loop {
            let at = Vec3::from([0; 3].map(|_| part(-4.4, 4.4)));
            if at.length() > FREE + radius {
                break at;
            }
        };
        let corner = |i: usize, j: usize| {
            let around = TAU * i as f32 / n as f32;
            let down = PI * j as f32 / (n / 2) as f32;
            let [x, y] = [around.cos(), around.sin()].map(|x| down.sin() * x);
            centre + radius * Vec3::new(x, y, down.cos())
        };
        cells(n / 2).for_each(|(i, j)| square(&corner, i, j));
    }
    let record = |(id, vertices)| TriangleRecord::new(&Triangle { vertices }, id as u32, 0);
    let records = triangles.into_iter().enumerate().map(record);
    records.collect::<Vec<_>>().into()
}

/// The room whose balls a smooth field moves by up to `by` scene units, each vertex by another distance; walls stay.
pub(super) fn moved(room: &TriangleSoup, by: f32) -> TriangleSoup {
    let along = |place: [f32; 3]| {
        let [x, y, z] = place;
        // 0 at each wall.
        let inside: f32 = place.iter().map(|c| 1.0 - (c / HALF).powi(2)).product();
        let turns = [1.3 * y + 0.4, 1.1 * z + 1.7, 0.9 * x + 2.9].map(f32::sin);
        Vec3::from(place) + by * inside * Vec3::from(turns) / 3.0_f32.sqrt()
    };
    let record = |(id, record): (usize, &TriangleRecord)| {
        let vertices = record.vertices().map(along);
        TriangleRecord::new(&Triangle { vertices }, id as u32, 0)
    };
    let records = room.records.iter().enumerate().map(record);
    records.collect::<Vec<_>>().into()
}

/// A point at which a path leaves a surface.
#[derive(Debug, Clone, Copy)]
pub struct Vertex {
    place: Vec3,
    /// Of unit length, on the side that the path came from.
    normal: Vec3,
    /// From where the path came, of unit length.
    direction: Vec3,
    /// Number of its pixel, row by row.
    pixel: u32,
}

/// Pixels of a square image along a Morton curve, and the directions of the camera's rays.
fn camera(side: u32) -> impl Iterator<Item = (u32, Vec3)> {
    let slope = 22.5_f32.to_radians().tan();
    (0..side * side).map(move |code| {
        let even = |bits: u32| (0..16).fold(0, |x, k| x | (((bits >> (2 * k)) & 1) << k));
        let [x, y] = [even(code), even(code >> 1)];
        let [u, v] = [x, y].map(|k| (2.0 * (k as f32 + 0.5) / side as f32 - 1.0) * slope);
        (y * side + x, Vec3::new(-1.0, u, -v).normalize())
    })
}

/// The rays of the camera.
pub(super) fn primary(side: u32) -> Vec<Ray> {
    camera(side).map(|(_, d)| Ray::new(EYE, d)).collect()
}

/// Where the camera sees the mirror, pixel by pixel along a Morton curve of a square image; `waves`
/// per unit of length turn its normals.
pub fn on_mirror(side: u32, waves: f32) -> Vec<Option<Vertex>> {
    let seen = |(pixel, direction): (u32, Vec3)| {
        let b = EYE.dot(direction);
        let root = b * b - EYE.length_squared() + 1.0;
        if root < 0.0 {
            return None;
        }
        let place = EYE + direction * (-b - root.sqrt());
        // Without waves their sines are 0.
        let [x, y, z] = (waves * place).to_array();
        let turned = [(y, z), (z, x), (x, y)].map(|(a, b)| a.sin() * b.cos());
        Some(Vertex {
            place,
            normal: (place + AMPLITUDE * Vec3::from(turned)).normalize(),
            direction,
            pixel,
        })
    };
    camera(side).map(seen).collect()
}

/// What is traced for a pixel that sees no mirror.
fn no_ray() -> Ray {
    Ray::new([0.0; 3], [0.0; 3])
}

/// The rays that the mirror reflects, one or none a pixel.
pub fn mirrored(from: &[Option<Vertex>]) -> Vec<Ray> {
    let leave = |vertex: &Option<Vertex>| {
        vertex.map_or_else(no_ray, |v| Ray::new(v.place, v.mirror_direction()))
    };
    from.iter().map(leave).collect()
}

impl Vertex {
    fn mirror_direction(&self) -> Vec3 {
        self.direction - 2.0 * self.direction.dot(self.normal) * self.normal
    }

    /// A direction within `spread` radians of the mirror's, even in solid angle, on the side of the
    /// normal.
    fn in_lobe(&self, spread: f32, [u, v]: [f32; 2]) -> Vec3 {
        if spread == 0.0 {
            return self.mirror_direction();
        }
        let cosine = 1.0 - u * (1.0 - spread.cos());
        let sine = (1.0 - cosine * cosine).max(0.0).sqrt();
        let (around, axis) = (TAU * v, self.mirror_direction().normalize());
        let (tangent, bitangent) = axis.any_orthonormal_pair();
        let out = axis * cosine + (tangent * around.cos() + bitangent * around.sin()) * sine;
        let below = out.dot(self.normal).min(0.0);
        (out - 2.0 * below * self.normal).normalize()
    }
}

/// A scene with what answers rays on the host.
pub(super) type Host<'a> = (&'a TriangleSoup, &'a dyn CpuTwin);

/// Where rays of unit length hit the room.
fn hits(from: &[Option<Vertex>], rays: &[Ray], (soup, twin): Host) -> Vec<Option<Vertex>> {
    let hit = |(vertex, ray): (&Option<Vertex>, &Ray)| {
        let pixel = vertex.as_ref()?.pixel;
        let hit = twin.closest_hit(ray, &mut Default::default());
        // What is missed has no such triangle.
        let [a, b, c] = soup.records.get(hit.triangle as usize)?.vertices();
        let [a, b, c] = [a, b, c].map(Vec3::from);
        let direction = Vec3::from(ray.direction);
        let normal = (b - a).cross(c - a).try_normalize()?;
        let normal = -normal * normal.dot(direction).signum();
        Some(Vertex {
            place: Vec3::from(ray.origin) + direction * hit.t + normal * OFFSET,
            normal,
            direction,
            pixel,
        })
    };
    from.par_iter().zip(rays).map(hit).collect()
}

/// Rays of the `bounce`-th reflection of paths that begin at `from`, one or none a pixel, each in a
/// lobe of half-angle `spread` radians; `draw` has two numbers in [0, 1) for a pixel and a bounce.
pub(super) fn bounced(
    from: Vec<Option<Vertex>>,
    (bounce, spread): (u32, f32),
    draw: &(dyn Fn(u32, u32) -> [f32; 2] + Sync),
    host: Host,
) -> Vec<Ray> {
    let mut vertices = from;
    let mut number = 0;
    loop {
        let leave = |vertex: &Option<Vertex>| {
            let drawn = |v: Vertex| v.in_lobe(spread, draw(v.pixel, number));
            vertex.map_or_else(no_ray, |v| Ray::new(v.place, drawn(v)))
        };
        let rays: Vec<Ray> = vertices.par_iter().map(leave).collect();
        number += 1;
        if number >= bounce {
            return rays;
        }
        vertices = hits(&vertices, &rays, host);
    }
}

/// Edge of the stratified samples of a lobe that count as all of it.
const STRATA: u32 = 24;

/// Lobes of half-angle `spread` radians around the directions in which a mirror reflects.
pub(super) struct Lobes<'a> {
    /// Where they begin.
    pub(super) from: &'a [Option<Vertex>],
    /// Radians.
    pub(super) spread: f32,
    /// What they see.
    pub(super) host: Host<'a>,
}

impl Lobes<'_> {
    /// The mean brightness of what each sees through samples of it, whose two numbers in [0, 1) `draw` has for a
    /// pixel and a sample. Walls brighten from 0 at the floor to 1 at the ceiling, balls are black.
    pub(super) fn means(
        &self,
        samples: u32,
        draw: &(dyn Fn(u32, u32) -> [f32; 2] + Sync),
    ) -> Vec<f64> {
        let twin = self.host.1;
        let brightness = |vertex: &Vertex, sample| {
            let direction = vertex.in_lobe(self.spread, draw(vertex.pixel, sample));
            let hit = twin.closest_hit(&Ray::new(vertex.place, direction), &mut Default::default());
            let place = vertex.place + direction * hit.t;
            // Balls touch no wall.
            if place.abs().max_element() > HALF * (1.0 - 1e-4) {
                f64::from((place.y / HALF + 1.0) / 2.0)
            } else {
                0.0
            }
        };
        let mean = |vertex: &Vertex| {
            let all = (0..samples).map(|sample| brightness(vertex, sample));
            all.sum::<f64>() / f64::from(samples)
        };
        self.from.par_iter().flatten().map(mean).collect()
    }

    /// The same through so many stratified samples that what is left of their error is small beside that of a few.
    pub(super) fn truth(&self) -> Vec<f64> {
        self.means(STRATA * STRATA, &|pixel, sample| {
            let seed = u64::from(pixel) << 32 | u64::from(sample);
            let mut random = Pcg32::new(seed);
            [sample % STRATA, sample / STRATA]
                .map(|stratum| (stratum as f32 + random.uniform() as f32) / STRATA as f32)
        })
    }
}

/// Rays between a point light and what the mirror shows, from there or from the light, one or none
/// a pixel.
pub(super) fn shadows(from: &[Option<Vertex>], reversed: bool, host: Host) -> Vec<Ray> {
    let between = |vertex: Option<Vertex>| match vertex {
        None => no_ray(),
        Some(Vertex { place, .. }) if reversed => Ray::new(LIGHT, place - LIGHT).between(0.0, 1.0),
        Some(Vertex { place, .. }) => Ray::new(place, LIGHT - place).between(0.0, 1.0),
    };
    let seen = hits(from, &mirrored(from), host);
    seen.into_iter().map(between).collect()
}
