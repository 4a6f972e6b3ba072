//! Ray cones: the axis of a cone meets one triangle, and its texture is read at the level whose texels are as wide as
//! the cone there (Akenine-Möller et al., "Improved Shader and Texture Level of Detail Using Ray Cones", JCGT 2021; the
//! width is 2 t tan(α/2), by their erratum). Kernel: `kernels/cones/level.wesl`.

use crate::cone::Cone;
use crate::disk::{Angle, c};
use crate::scene::{LEVELS, Patch, TEXELS};
use crate::trace::{Layer, Tracing, clamp, corner_parts, weighted};
use raystone_specular::real::{Real, V3};
use raystone_specular::reflector::{cross3, dot3};

impl<T: Angle> Tracing<'_, T> {
    /// The layer of a triangle that the cone's axis meets; its share is 1, or 0 where it does not.
    pub(crate) fn axis_layer(
        &self,
        cone: &Cone<T>,
        patch: &Patch<T>,
        [a, b, third]: [V3<T>; 3],
        index: u32,
    ) -> Layer<T> {
        let zero = c::<T>(0.0);
        let mut out = Layer {
            colour: V3::new(zero, zero, zero),
            share: zero,
            depth: zero,
            place: 2 * index,
            bits: [0; 2],
        };
        // The axis is the line x = y = 0 of the cone's frame.
        let sides = [(a, b), (b, third), (third, a)].map(|(p, q)| p.x * q.y - p.y * q.x);
        let is_left = sides.iter().all(|side| *side >= zero);
        let is_right = sides.iter().all(|side| *side <= zero);
        let n = cross3(b - a, third - a);
        if !(is_left || is_right) || n.z == zero {
            return out;
        }
        out.depth = dot3(n, a) / n.z;
        if out.depth < cone.near {
            return out;
        }
        out.share = c(1.0);
        let w = V3::new(zero, zero, out.depth) - a;
        let parts = corner_parts([b - a, third - a], w);
        out.colour = weighted(patch.colours, parts);
        if patch.tile > zero {
            let place = weighted(patch.corners, parts);
            let tiles = tiles(self.texels, place, level_of(n, cone.tangent, out.depth));
            out.colour = out.colour * (tiles / patch.tile);
        }
        out
    }
}

/// The level whose texels are as wide as a cone on a plane that it meets at this depth: the cone's width there, over
/// the cosine of the plane. The normal is that of the cone's frame, in which the cone is one wide at depth one.
fn level_of<T: Real>(n: V3<T>, tangent: T, depth: T) -> T {
    let along = n.z * tangent;
    let length = (n.x * n.x + n.y * n.y + along * along).sqrt();
    let texels = c::<T>(2.0) * T::of(f64::from(TEXELS)) * depth * length / n.z.abs();
    T::of(texels.f64().log2())
}

/// The tiles about a place, between the two nearest levels.
fn tiles<T: Real>(texels: &[T], place: V3<T>, level: T) -> T {
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
