//! Scenes of a few hundred triangles in a closed room, with colours at vertices.

use crate::level::{LEVELS, TEXELS};
use glam::DVec3;
use raystone_core::parameters;
use raystone_core::random::Pcg32;
use raystone_specular::real::{Real, V3};
use std::f64::consts::PI;

parameters! {
    /// A scene.
    pub enum Place {
        /// a room with a floor of black and white tiles
        Checker = "checker",
        /// the room with sixteen balls
        Balls = "balls",
        /// the room with a fence of thin bars and a pile of plates
        Thin = "thin",
    }
}

/// A triangle with the sphere around it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Patch<T> {
    /// Vertices.
    pub corners: [V3<T>; 3],
    /// Linear colours of the vertices; between them they are interpolated.
    pub colours: [V3<T>; 3],
    /// The middle of the smallest sphere around it.
    pub centre: V3<T>,
    /// Its radius, rounded up.
    pub radius: T,
    /// Colour of the tile that it is half of, by which its colours are multiplied; 0 if it is none.
    pub tile: T,
}

impl<T: Real> Patch<T> {
    /// The same triangle in f64.
    pub fn double(&self) -> Patch<f64> {
        let double = |v: V3<T>| V3::of(v.f64());
        Patch {
            corners: self.corners.map(double),
            colours: self.colours.map(double),
            centre: double(self.centre),
            radius: self.radius.f64(),
            tile: self.tile.f64(),
        }
    }
}

/// The smallest sphere around three points.
fn sphere_around(corners: [DVec3; 3]) -> (DVec3, f64) {
    let mut longest = 0;
    let edge = |k: usize| corners[(k + 1) % 3] - corners[k];
    for k in 1..3 {
        if edge(k).length_squared() > edge(longest).length_squared() {
            longest = k;
        }
    }
    let (a, b, c) = (
        corners[longest],
        corners[(longest + 1) % 3],
        corners[(longest + 2) % 3],
    );
    let (u, v) = (b - a, c - a);
    let n = u.cross(v);
    let is_acute = (a - c).dot(b - c) > 0.0 && n.length_squared() > 0.0;
    let centre = if is_acute {
        // The centre of the circle through all three.
        a + (n.cross(u) * v.length_squared() + v.cross(n) * u.length_squared())
            / (2.0 * n.length_squared())
    } else {
        (a + b) * 0.5
    };
    let centre = centre.as_vec3().as_dvec3();
    let radius = corners
        .iter()
        .map(|p| p.distance(centre))
        .fold(0.0, f64::max);
    (centre, radius * (1.0 + 1e-6) + 1e-12)
}

/// Half the room's width and depth, and the heights of floor and ceiling; the mirror is about the origin.
const HALF: f64 = 5.0;
const FLOOR: f64 = -1.5;
const CEILING: f64 = 4.0;
/// The lamp.
const LAMP: DVec3 = DVec3::new(1.5, -2.0, 3.6);

#[derive(Default)]
struct Builder {
    patches: Vec<Patch<f32>>,
}

/// Colours of the floor's tiles, which alternate; they are half a unit wide.
const TILES: [f64; 2] = [0.9, 0.08];

fn tile(row_and_column: u32) -> f64 {
    TILES[row_and_column as usize % 2]
}

/// Texels of the tiles' texture, row by row and level by level: of each level the means of four of the one before.
pub fn tile_levels() -> Vec<f32> {
    let half = TEXELS / 2;
    let texel = |k: u32| tile(k % TEXELS / half + k / TEXELS / half) as f32;
    let mut all: Vec<f32> = (0..TEXELS * TEXELS).map(texel).collect();
    let mut first = 0;
    for level in 1..LEVELS {
        let (wide, side) = ((TEXELS >> (level - 1)) as usize, (TEXELS >> level) as usize);
        for k in 0..side * side {
            let at = first + 2 * (k / side) * wide + 2 * (k % side);
            let four = [at, at + 1, at + wide, at + wide + 1];
            all.push(four.map(|k| all[k]).iter().sum::<f32>() * 0.25);
        }
        first += wide * wide;
    }
    all
}

/// A surface with this colour and normal at a point, lit by the lamp.
fn lit(p: DVec3, n: DVec3, colour: DVec3) -> DVec3 {
    let to_lamp = (LAMP - p).normalize();
    colour * (0.2 + 0.8 * n.dot(to_lamp).max(0.0))
}

impl Builder {
    /// Three vertices with their normals.
    fn triangle(&mut self, corners: [DVec3; 3], normals: [DVec3; 3], colour: DVec3) {
        let corners = corners.map(|p| p.as_vec3().as_dvec3());
        let (centre, radius) = sphere_around(corners);
        let colours = [0, 1, 2].map(|k| V3::of(lit(corners[k], normals[k], colour)));
        self.patches.push(Patch {
            corners: corners.map(V3::of),
            colours,
            centre: V3::of(centre),
            radius: radius as f32 * (1.0 + 2e-7),
            tile: 0.0,
        });
    }

    /// A parallelogram in rows and columns; colours by row and column.
    fn grid(
        &mut self,
        at: DVec3,
        [u, v]: [DVec3; 2],
        [n, m]: [u32; 2],
        of: impl Fn(u32, u32) -> DVec3,
    ) {
        let normals = [u.cross(v).normalize(); 3];
        let p = |i: u32, j: u32| {
            at + u * (f64::from(i) / f64::from(n)) + v * (f64::from(j) / f64::from(m))
        };
        for i in 0..n {
            for j in 0..m {
                let (a, b, c, d) = (p(i, j), p(i + 1, j), p(i + 1, j + 1), p(i, j + 1));
                self.triangle([a, b, c], normals, of(i, j));
                self.triangle([a, c, d], normals, of(i, j));
            }
        }
    }

    fn room(&mut self) {
        let (x, y, z) = (
            DVec3::X * 2.0 * HALF,
            DVec3::Y * 2.0 * HALF,
            DVec3::Z * (CEILING - FLOOR),
        );
        let low = DVec3::new(-HALF, -HALF, FLOOR);
        let first = self.patches.len();
        self.grid(low, [x, y], [20, 20], |i, j| DVec3::splat(tile(i + j)));
        // Two triangles a tile, column by column.
        for (k, patch) in (0..).zip(&mut self.patches[first..]) {
            patch.tile = tile(k / 2 / 20 + k / 2 % 20) as f32;
        }
        let stripe = |colour: DVec3| {
            move |i: u32, _: u32| colour * if i.is_multiple_of(2) { 1.0 } else { 0.6 }
        };
        self.grid(low + z, [y, x], [2, 2], stripe(DVec3::new(0.8, 0.8, 0.75)));
        self.grid(low, [y, z], [6, 2], stripe(DVec3::new(0.3, 0.45, 0.8)));
        self.grid(low + x, [z, y], [2, 6], stripe(DVec3::new(0.8, 0.5, 0.3)));
        self.grid(low, [z, x], [2, 6], stripe(DVec3::new(0.4, 0.75, 0.4)));
        self.grid(low + y, [x, z], [6, 2], stripe(DVec3::new(0.8, 0.35, 0.4)));
    }

    fn ball(&mut self, centre: DVec3, radius: f64, [n, m]: [u32; 2], colour: DVec3) {
        let normal = |i: u32, j: u32| {
            let (polar, around) = (
                PI * f64::from(i) / f64::from(n),
                2.0 * PI * f64::from(j % m) / f64::from(m),
            );
            DVec3::new(
                polar.sin() * around.cos(),
                polar.sin() * around.sin(),
                polar.cos(),
            )
        };
        for i in 0..n {
            for j in 0..m {
                let all = [
                    normal(i, j),
                    normal(i + 1, j),
                    normal(i + 1, j + 1),
                    normal(i, j + 1),
                ];
                let corners =
                    |k: [usize; 3]| (k.map(|k| centre + all[k] * radius), k.map(|k| all[k]));
                if i + 1 < n {
                    let (p, n) = corners([0, 1, 2]);
                    self.triangle(p, n, colour);
                }
                if i > 0 {
                    let (p, n) = corners([0, 2, 3]);
                    self.triangle(p, n, colour);
                }
            }
        }
    }

    fn balls(&mut self) {
        let mut random = Pcg32::new(5);
        for k in 0..16 {
            let around = 2.0 * PI * (f64::from(k) + 0.6 * random.uniform()) / 16.0;
            let distance = 2.0 + 2.0 * random.uniform();
            let radius = 0.2 + 0.25 * random.uniform();
            let height = FLOOR + radius + 2.0 * random.uniform().powi(2);
            let centre = DVec3::new(distance * around.cos(), distance * around.sin(), height);
            let colour =
                DVec3::new(random.uniform(), random.uniform(), random.uniform()) * 0.7 + 0.2;
            self.ball(centre, radius, [6, 10], colour);
        }
    }

    /// A closed box.
    fn slab(&mut self, low: DVec3, high: DVec3, colour: DVec3) {
        let d = high - low;
        let (x, y, z) = (DVec3::X * d.x, DVec3::Y * d.y, DVec3::Z * d.z);
        let of = |_: u32, _: u32| colour;
        for (at, sides) in [
            (low, [y, x]),
            (low + z, [x, y]),
            (low, [z, y]),
            (low + x, [y, z]),
            (low, [x, z]),
            (low + y, [z, x]),
        ] {
            self.grid(at, sides, [1, 1], of);
        }
    }

    fn thin(&mut self) {
        // Bars around the mirror, from 0.01 to 0.05 wide.
        for k in 0..40_u32 {
            let around = 2.0 * PI * (f64::from(k) + 0.5) / 40.0;
            let at = DVec3::new(2.6 * around.cos(), 2.6 * around.sin(), FLOOR);
            let half = 0.005 * f64::from(1 + k % 5);
            let low = at - DVec3::new(half, half, 0.0);
            let high = at + DVec3::new(half, half, 1.6);
            let colour = [DVec3::new(0.9, 0.85, 0.2), DVec3::new(0.1, 0.1, 0.12)][k as usize % 2];
            self.slab(low, high, colour);
        }
        // Two piles of plates.
        for k in 0..20_u32 {
            let side = if k % 2 == 0 { -1.6 } else { 1.6 };
            let low = DVec3::new(-2.2, side - 0.4, FLOOR + 0.06 * f64::from(k / 2));
            self.slab(low, low + DVec3::new(0.8, 0.8, 0.02), DVec3::splat(0.85));
        }
    }
}

/// The triangles of a scene.
pub fn patches(place: Place) -> Vec<Patch<f32>> {
    let mut builder = Builder::default();
    builder.room();
    match place {
        Place::Checker => {}
        Place::Balls => builder.balls(),
        Place::Thin => builder.thin(),
    }
    builder.patches
}

/// What is behind all triangles: nothing is, but for cracks.
pub const BACKGROUND: DVec3 = DVec3::new(0.5, 0.5, 0.5);
