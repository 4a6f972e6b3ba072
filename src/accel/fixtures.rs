//! Triangles for the unit tests of structures.

use super::TriangleSoup;
use super::triangle::TriangleRecord;
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::random::Pcg32;

/// The record of triangle `id`; the material does not matter.
pub(crate) fn record(id: u32, vertices: [[f32; 3]; 3]) -> TriangleRecord {
    let vertices = vertices.map(Vec3::from);
    TriangleRecord::new(&Triangle { vertices }, id, 0)
}

pub(crate) fn soup(triangles: impl IntoIterator<Item = [[f32; 3]; 3]>) -> TriangleSoup {
    let numbered = (0..).zip(triangles);
    let records: Vec<_> = numbered.map(|(id, t)| record(id, t)).collect();
    records.into()
}

/// A 6 × 6 lattice of triangles in `layers` layers, each crossing planes between cells.
pub(crate) fn lattice(layers: usize) -> TriangleSoup {
    soup((0..36 * layers).map(|i| {
        let [x, y, z] = [i % 6, i / 6 % 6, i / 36].map(|k| k as f32);
        [
            [x, y, z],
            [x + 1.2, y + 0.1, z + 0.3],
            [x + 0.2, y + 1.3, z + 0.1],
        ]
    }))
}

/// A triangle of this size around a random position in the cube of side `spread`.
pub(crate) fn random_triangle(random: &mut Pcg32, spread: f32, size: f32) -> [[f32; 3]; 3] {
    let mut point = |s: f32| [0; 3].map(|_| s * random.uniform() as f32);
    let at = point(spread);
    let mut corner = || {
        let p = point(size);
        [0, 1, 2].map(|a| at[a] + p[a])
    };
    [corner(), corner(), corner()]
}
