//! Difficult triangles for device builders.

use crate::support::{Pcg, scenes};
use raystone::accel::TriangleSoup;

/// All triangles in one place: codes are equal, and only indices decide.
pub fn equal_positions(count: usize) -> TriangleSoup {
    let corner = glam::Vec3::new(0.25, 3.0, -7.0);
    scenes::soup((0..count).map(|_| [corner, corner + glam::Vec3::X, corner + glam::Vec3::Y]))
}

/// Clusters of very different sizes and distances.
pub fn clusters(random: &mut Pcg, count: usize) -> TriangleSoup {
    let mut point =
        |size: f32| size * glam::Vec3::new(random.signed(), random.signed(), random.signed());
    let triangle = |place: usize| {
        let size = 0.001 * 4.0_f32.powi((place % 5) as i32);
        let at = glam::Vec3::splat((place % 7) as f32).powf(3.0) + point(size);
        [at, at + point(size), at + point(size)]
    };
    scenes::soup((0..count).map(triangle).collect::<Vec<_>>())
}

/// Boxes that halve in size towards the origin: only the last two neighbours choose each other, so
/// most rounds of clustering are joined without a search.
pub fn shrinking(count: i32) -> TriangleSoup {
    let triangle = |i: i32| {
        let size = 2.0_f32.powf(50.0 - 0.08 * i as f32);
        let corner = glam::Vec3::splat(size);
        [
            corner,
            corner + glam::Vec3::X * size,
            corner + glam::Vec3::Y * size,
        ]
    };
    scenes::soup((0..count).map(triangle))
}
