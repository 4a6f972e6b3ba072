//! One cone a pixel through all triangles: the nearest layers, sorted, and blended (Roger 2008, sections 5.3 and 5.4);
//! or its axis alone, which reads textures at the level that is as wide as the cone ([`level`](crate::level)).
//! Kernel: `kernels/cones/trace.wesl`.

use crate::cone::{Camera, Cone, cone_of, meets, seen_from};
use crate::disk::{Angle, Sum, c, edge, overlap};
use crate::level::{level_of, tiles};
use crate::lobe::lobe_weight;
use crate::scene::Patch;
use raystone_core::parameters;
use raystone_specular::real::{Real, V3};
use raystone_specular::reflector::{cross3, dot3};

const SATURATE: u32 = 0;
const MASK_AREA: u32 = 1;
const MASK_COUNT: u32 = 2;
const LEVEL: u32 = 3;
const LOBE: u32 = 4;

/// Directions of a mask.
pub const DIRECTIONS: u32 = 64;
/// Layers of a smaller part of the cone are noise of f32.
pub(crate) const LEAST_SHARE: f32 = 1e-6;
/// Triangles whose normal is shorter, squared, are seen from their edge.
const EDGE_ON: f32 = 1e-30;

parameters! {
    /// How layers of a cone hide each other.
    pub enum Blend {
        /// not, until the cone is full: the thesis's blending by saturated alpha
        Saturate = "saturate",
        /// by a mask of 64 directions, of which the free part weighs each exact area
        MaskArea = "mask-area",
        /// by a mask of 64 directions, which are counted in the place of areas
        MaskCount = "mask-count",
        /// by the axis alone, which meets one; textures are read at the level that is as wide as the cone
        Level = "level",
        /// not, as `saturate`; a layer weighs by its area and by how much of the lobe passes there, from a table: the thesis's F
        Lobe = "lobe",
    }
}

impl Blend {
    /// Its number in the kernel.
    pub fn word(self) -> u32 {
        match self {
            Self::Saturate => SATURATE,
            Self::MaskArea => MASK_AREA,
            Self::MaskCount => MASK_COUNT,
            Self::Level => LEVEL,
            Self::Lobe => LOBE,
        }
    }
}

/// What is kept of a cone, and how.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Given<T> {
    /// The picture.
    pub camera: Camera<T>,
    /// What is behind all triangles.
    pub background: V3<T>,
    /// Layers that are kept.
    pub most: u32,
    /// The least share of the cone that is a layer.
    pub cut: T,
    /// [`Blend::word`].
    pub blend: u32,
}

/// The part of a cone that a triangle covers.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Layer<T> {
    /// Colour at the centroid.
    pub colour: V3<T>,
    /// Part of the cone, from 0 to 1.
    pub share: T,
    /// Distance along the axis of the point behind the centroid.
    pub depth: T,
    /// Twice the triangle, and 1 if no direction of the mask meets it: then the bit is that of the nearest one.
    pub place: u32,
    /// Directions of the mask that meet it.
    pub bits: [u32; 2],
    /// Weight by the lobe, which kernels have in the place of the mask.
    pub weight: T,
}

/// A picture's pixel.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Found<T> {
    /// Linear colour.
    pub colour: V3<T>,
    /// Part of the cone that layers cover.
    pub covered: T,
    /// Layers met, layers kept, and triangles that were cut with the cone.
    pub counts: [u32; 3],
}

/// Edges of a polygon: what they cover of the disk, and directions to their left and right.
struct Covered<T> {
    sum: Sum<T>,
    left: [u32; 2],
    right: [u32; 2],
}

/// The picture to trace, and directions of masks.
#[derive(Clone, Copy)]
pub struct Tracing<'a, T> {
    /// What is kept.
    pub given: &'a Given<T>,
    /// Triangles.
    pub patches: &'a [Patch<T>],
    /// [`DIRECTIONS`] places in the unit disk.
    pub directions: &'a [[T; 2]],
    /// Texels of [`tile_levels`](crate::scene::tile_levels).
    pub texels: &'a [T],
    /// Densities of [`lobe_table`](crate::lobe::lobe_table).
    pub lobes: &'a [T],
}

impl<T: Angle> Tracing<'_, T> {
    fn has_mask(&self) -> bool {
        matches!(self.given.blend, MASK_AREA | MASK_COUNT)
    }

    /// Directions to the left and right of the line through an edge.
    fn add_edge(&self, covered: &mut Covered<T>, a: V3<T>, b: V3<T>) {
        covered.sum = edge(covered.sum, a, b);
        if !self.has_mask() {
            return;
        }
        let n = cross3(a, b);
        let mut left = [0; 2];
        let mut right = [0; 2];
        for (k, d) in self.directions.iter().enumerate() {
            let side = n.x * d[0] + n.y * d[1] + n.z;
            let bit = 1 << (k % 32);
            if side > c(0.0) {
                left[k / 32] |= bit;
            }
            if side < c(0.0) {
                right[k / 32] |= bit;
            }
        }
        for word in 0..2 {
            covered.left[word] &= left[word];
            covered.right[word] &= right[word];
        }
    }

    /// What a triangle covers, without its part nearer than `near`.
    fn covered_by(&self, v: [V3<T>; 3], near: T) -> Covered<T> {
        let mut out = Covered {
            sum: Sum::none(),
            left: [u32::MAX; 2],
            right: [u32::MAX; 2],
        };
        let mut leave = V3::new(c(0.0), c(0.0), c(0.0));
        let mut enter = leave;
        let mut is_cut = false;
        for k in 0..3 {
            let (a, b) = (v[k], v[(k + 1) % 3]);
            match (a.z >= near, b.z >= near) {
                (true, true) => self.add_edge(&mut out, a, b),
                (true, false) => {
                    leave = crossing(a, b, near);
                    is_cut = true;
                    self.add_edge(&mut out, a, leave);
                }
                (false, true) => {
                    enter = crossing(a, b, near);
                    self.add_edge(&mut out, enter, b);
                }
                (false, false) => {}
            }
        }
        if is_cut {
            self.add_edge(&mut out, leave, enter);
        }
        out
    }

    /// The bit of the direction nearest to a place in the disk.
    fn nearest_bit(&self, x: T, y: T) -> [u32; 2] {
        let mut least = c::<T>(1e30);
        let mut at = 0;
        for (k, d) in self.directions.iter().enumerate() {
            let (dx, dy) = (d[0] - x, d[1] - y);
            let square = dx * dx + dy * dy;
            if square < least {
                least = square;
                at = k;
            }
        }
        let mut bits = [0; 2];
        bits[at / 32] = 1 << (at % 32);
        bits
    }

    /// The part of the cone that a triangle covers; its share is 0 where it is none.
    pub fn layer_of(&self, cone: &Cone<T>, patch: &Patch<T>, index: u32) -> Layer<T> {
        let [a, b, third] = patch.corners.map(|p| seen_from(cone, p));
        if self.given.blend == LEVEL {
            return self.axis_layer(cone, patch, [a, b, third], index);
        }
        let covered = self.covered_by([a, b, third], cone.near);
        let part = overlap(covered.sum);
        let zero = c::<T>(0.0);
        let mut out = Layer {
            colour: V3::new(zero, zero, zero),
            share: part.area * T::PART,
            depth: zero,
            place: 2 * index,
            bits: [0; 2],
            weight: c(1.0),
        };
        let u = b - a;
        let v = third - a;
        let n = cross3(u, v);
        let size = dot3(n, n);
        let middle = V3::new(part.centroid.x, part.centroid.y, c(1.0));
        let facing = dot3(n, middle);
        let least = self.given.cut.max(c(LEAST_SHARE));
        if out.share <= least || size < c(EDGE_ON) || facing == zero {
            out.share = zero;
            return out;
        }
        // The point on the triangle's plane behind the centroid.
        let low = a.z.min(b.z).min(third.z).max(cone.near);
        let high = a.z.max(b.z).max(third.z);
        out.depth = clamp(dot3(n, a) / facing, low, high);
        let parts = corner_parts([u, v], middle * out.depth - a);
        out.colour = weighted(patch.colours, parts);
        if self.given.blend == LOBE {
            let at = part.centroid;
            let beside = (at.x * at.x + at.y * at.y).sqrt();
            out.weight = lobe_weight(self.lobes, out.share, beside, cone.narrow);
        }
        if self.has_mask() {
            out.bits = if covered.sum.area < zero {
                covered.right
            } else {
                covered.left
            };
            if part.area == T::PI {
                out.bits = [u32::MAX; 2];
            }
            if out.bits == [0; 2] {
                out.bits = self.nearest_bit(part.centroid.x, part.centroid.y);
                out.place += 1;
            }
        }
        out
    }

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
            weight: c(1.0),
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

    /// Puts a layer among those of a pixel, of which the nearest are kept.
    fn insert(&self, layers: &mut Vec<Layer<T>>, layer: Layer<T>) {
        let at = layers.partition_point(|other| !is_before(&layer, other));
        layers.insert(at, layer);
        layers.truncate(self.given.most as usize);
    }

    /// Layers of a pixel from front to back; colour and covered part.
    pub fn blend(&self, layers: &[Layer<T>]) -> (V3<T>, T) {
        let (zero, one) = (c::<T>(0.0), c::<T>(1.0));
        let given = self.given;
        let mut colour = V3::new(zero, zero, zero);
        let mut covered = zero;
        // The sum of the layers' weights by the lobe.
        let mut sum = zero;
        let mut mask = [0_u32; 2];
        for layer in layers {
            let is_thin = layer.place & 1 == 1;
            let ones =
                |bits: [u32; 2]| T::of(f64::from(bits[0].count_ones() + bits[1].count_ones()));
            let left = ones([layer.bits[0] & !mask[0], layer.bits[1] & !mask[1]]);
            let mut weight = layer.share;
            if given.blend == MASK_AREA {
                weight = weight * (left / ones(layer.bits));
            } else if given.blend == MASK_COUNT {
                weight = left / T::of(f64::from(DIRECTIONS));
                if is_thin {
                    weight = zero;
                }
            }
            weight = weight.min(one - covered);
            covered = covered + weight;
            if given.blend == LOBE {
                weight = weight * layer.weight;
                sum = sum + weight;
            }
            colour = colour + layer.colour * weight;
            if !is_thin {
                mask = [mask[0] | layer.bits[0], mask[1] | layer.bits[1]];
            }
        }
        // Weights of a cone without a gap sum to 1.
        if given.blend == LOBE && sum > zero {
            colour = colour * (covered / sum);
        }
        // All directions have met something, and so has all of the cone.
        if self.has_mask() && mask == [u32::MAX; 2] && covered > zero {
            colour = colour / covered;
            covered = one;
        }
        (colour + given.background * (one - covered), covered)
    }

    /// Layers of a cone that are kept, nearest first, and how many were met and cut.
    pub fn layers(&self, cone: &Cone<T>) -> (Vec<Layer<T>>, [u32; 2]) {
        let mut layers = Vec::new();
        let (mut met, mut cut) = (0, 0);
        for (i, patch) in self.patches.iter().enumerate() {
            if !meets(cone, patch.centre, patch.radius) {
                continue;
            }
            cut += 1;
            let layer = self.layer_of(cone, patch, i as u32);
            if layer.share > c(0.0) {
                met += 1;
                self.insert(&mut layers, layer);
            }
        }
        (layers, [met, cut])
    }

    /// The pixel of a cone.
    pub fn trace_cone(&self, pixel: u32) -> Found<T> {
        let cone = cone_of(&self.given.camera, pixel);
        let (layers, [met, cut]) = self.layers(&cone);
        let (colour, covered) = self.blend(&layers);
        Found {
            colour,
            covered,
            counts: [met, layers.len() as u32, cut],
        }
    }
}

/// The parts of a triangle's corners in a point of it, which is `w` from the first; `u` and `v` lead to the others.
fn corner_parts<T: Real>([u, v]: [V3<T>; 2], w: V3<T>) -> [T; 3] {
    let n = cross3(u, v);
    let size = dot3(n, n);
    let (zero, one) = (c::<T>(0.0), c::<T>(1.0));
    let second = clamp(dot3(n, cross3(w, v)) / size, zero, one);
    let third = clamp(dot3(n, cross3(u, w)) / size, zero, one - second);
    [one - (second + third), second, third]
}

/// The sum of three vectors by their parts.
fn weighted<T: Real>(corners: [V3<T>; 3], parts: [T; 3]) -> V3<T> {
    corners[0] * parts[0] + corners[1] * parts[1] + corners[2] * parts[2]
}

/// Where the edge from `a` to `b` crosses the plane z = `near`.
fn crossing<T: Real>(a: V3<T>, b: V3<T>, near: T) -> V3<T> {
    let t = (near - a.z) / (b.z - a.z);
    V3::new(a.x + (b.x - a.x) * t, a.y + (b.y - a.y) * t, near)
}

pub(crate) fn clamp<T: Real>(x: T, low: T, high: T) -> T {
    x.max(low).min(high)
}

fn is_before<T: Real>(a: &Layer<T>, b: &Layer<T>) -> bool {
    a.depth < b.depth || (a.depth == b.depth && a.place < b.place)
}
