//! Ray cones: the axis of a cone meets one triangle, and its texture is read at the level whose texels are as wide as
//! the cone there (Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 2021; the
//! width is 2 t tan(α/2), by their erratum). Kernel: `kernels/cones/level.wesl`.

use crate::disk::c;
use crate::trace::clamp;
use raystone_specular::real::{Real, V3};

/// Texels along each side of the texture of the tiles: of two by two, a unit wide, repeated over the floor.
pub const TEXELS: u32 = 32;
/// Its levels, each with half the texels of the one before along each side.
pub const LEVELS: u32 = 6;

/// The level whose texels are as wide as a cone on a plane that it meets at this depth: the cone's width there, over
/// the cosine of the plane. The normal is that of the cone's frame, in which the cone is one wide at depth one.
pub(crate) fn level_of<T: Real>(n: V3<T>, tangent: T, depth: T) -> T {
    let along = n.z * tangent;
    let length = (n.x * n.x + n.y * n.y + along * along).sqrt();
    let texels = c::<T>(2.0) * T::of(f64::from(TEXELS)) * depth * length / n.z.abs();
    T::of(texels.f64().log2())
}

/// The tiles about a place, between the two nearest levels.
pub(crate) fn tiles<T: Real>(texels: &[T], place: V3<T>, level: T) -> T {
    let level = clamp(level, c(0.0), T::of(f64::from(LEVELS - 1)));
    let low = (level.f64() as u32).min(LEVELS - 2);
    let part = level - T::of(f64::from(low));
    let (fine, coarse) = (texel(texels, place, low), texel(texels, place, low + 1));
    fine + (coarse - fine) * part
}

/// Between the four nearest texels of a level.
fn texel<T: Real>(texels: &[T], place: V3<T>, level: u32) -> T {
    let side = TEXELS >> level;
    // What is before a level: 1024 + 256 + … texels.
    let first = (TEXELS * TEXELS - side * side) / 3 * 4;
    let whole = T::of(f64::from(side));
    // One turn further, so that it is not below 0.
    let x = (place.x - place.x.floor()) * whole + (whole - c(0.5));
    let y = (place.y - place.y.floor()) * whole + (whole - c(0.5));
    let (column, row) = (x.floor(), y.floor());
    let (u, v) = (x - column, y - row);
    let at = |i: u32, j: u32| {
        let i = (column.f64() as u32 + i) % side;
        let j = (row.f64() as u32 + j) % side;
        texels[(first + j * side + i) as usize]
    };
    let lower = at(0, 0) + (at(1, 0) - at(0, 0)) * u;
    let upper = at(0, 1) + (at(1, 1) - at(0, 1)) * u;
    lower + (upper - lower) * v
}
