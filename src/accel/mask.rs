//! Alpha masks: rays pass through holes in a surface. CPU version of `kernels/accel/mask.wesl`.
//!
//! A triangle test first accepts a hit, including its weights u and v; then the mask decides
//! whether there is a surface at these weights. Like the test, this depends on ray and triangle
//! alone, so the proofs about boxes in `docs/design.md` hold, and a hit in a hole never shortens
//! the ray.
//!
//! u and v become integers (24 bits), and the rest is integer arithmetic: coordinates in units of
//! 1/256 texel, bilinear weights of 8 bits, the comparison with the threshold. Kernels and CPU
//! versions agree wherever the weights do.

use super::triangle::TriangleRecord;
use glam::DVec2;
use raystone_core::geometry::Ray;
use raystone_scene::{AlphaMask, SceneData, Texture, Wrap};
use std::collections::BTreeMap;

/// Set in a masked triangle's material word, which then holds the index of its mask words.
pub(crate) const MASKED: u32 = 0x8000_0000;
const MIRRORED: u32 = 1;
const CLAMPED: u32 = 2;
/// Set beside the wrap modes where a surface exists with the probability of its alpha.
const BLENDED: u32 = 16;
/// The alpha 1, in units of 2⁻⁸/255.
const OPAQUE: u32 = 65280;
/// A corner's weight at the corner itself.
const WHOLE: u32 = 1 << 24;
/// Coordinate units per texel.
const UNITS: f64 = 256.0;
/// Largest coordinate of a corner, in units: sums of three changes fit in 32 bits.
const GREATEST: f64 = 268_435_456.0;

/// Words of the masks of a scene's triangles, stored after the records in the buffer `triangles`.
///
/// First the images: a row with width, height, wrap modes (u plus 4 times v) and threshold, or the
/// factor in 2⁻¹⁶ of a blended mask; then alphas, sixteen per row. Then two rows per triangle:
/// coordinates of the first corner, and the differences to the second and third, in 1/256 texel
/// from the centre of the first texel; index of the image; the material.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Masks {
    /// Start in the buffer, in `vec4`.
    pub first: u32,
    /// Four words per row.
    pub rows: Vec<[u32; 4]>,
    /// True if some surface exists with the probability of its alpha.
    pub are_blended: bool,
}

impl Masks {
    /// The masks of a scene, to follow `first` rows, and the word that replaces the material's in
    /// each record; `None` if nothing is cut out.
    pub fn of(scene: &SceneData, first: u32) -> Option<(Self, Vec<u32>)> {
        let mut masks = Self {
            first,
            rows: Vec::new(),
            are_blended: false,
        };
        let mut images = BTreeMap::new();
        for (id, material) in (0_u32..).zip(&scene.materials) {
            if let Some(mask) = &material.mask {
                images.insert(id, (masks.end(), *mask));
                masks.append_image(mask, &scene.textures);
            }
        }
        if images.is_empty() {
            return None;
        }
        let mut words = scene.material_ids.clone();
        for (id, word) in words.iter_mut().enumerate() {
            if let Some((image, mask)) = images.get(word) {
                let (material, place) = (*word, masks.end());
                *word = MASKED | place;
                let uvs = scene.uvs.get(id).copied().unwrap_or_default();
                masks.append_triangle(uvs, mask, *image, material);
            }
        }
        Some((masks, words))
    }

    /// Index after the last row.
    pub fn end(&self) -> u32 {
        self.first + self.rows.len() as u32
    }

    fn append_image(&mut self, mask: &AlphaMask, textures: &[Texture]) {
        let (blended, limit) = match mask.threshold() {
            Some(threshold) => (0, threshold),
            None => (
                BLENDED,
                (f64::from(mask.factor) * 65536.0).clamp(0.0, 65536.0) as u32,
            ),
        };
        self.are_blended |= blended != 0;
        let Some(used) = mask.texture else {
            let opaque = [u32::MAX, 0, 0, 0];
            self.rows.extend([[1, 1, blended, limit], opaque]);
            return;
        };
        let texture = &textures[used.texture as usize];
        let number = |wrap| match wrap {
            Wrap::Repeat => 0,
            Wrap::Mirrored => MIRRORED,
            Wrap::Clamp => CLAMPED,
        };
        let [u, v] = used.wrap.map(number);
        self.rows
            .push([texture.width, texture.height, blended + 4 * v + u, limit]);
        let alpha = |texel: &[u8; 4]| mask.channel.value(*texel);
        let alphas: Vec<u8> = texture.texels.iter().map(alpha).collect();
        let row = |bytes: &[u8]| {
            let byte = |i: usize| bytes.get(i).copied().unwrap_or(0);
            [0, 4, 8, 12].map(|i| u32::from_le_bytes([0, 1, 2, 3].map(|k| byte(i + k))))
        };
        self.rows.extend(alphas.chunks(16).map(row));
    }

    fn append_triangle(
        &mut self,
        uvs: [glam::Vec2; 3],
        mask: &AlphaMask,
        image: u32,
        material: u32,
    ) {
        let [width, height, wraps, _] = self.rows[(image - self.first) as usize];
        let size = DVec2::new(width.into(), height.into());
        let corners = uvs.map(|uv| match mask.texture {
            Some(used) => {
                let at = used.linear.as_dmat2() * uv.as_dvec2() + used.offset.as_dvec2();
                (at * size - 0.5) * UNITS
            }
            None => DVec2::ZERO,
        });
        let axis = |axis: usize, wrap: u32| {
            let [a, b, c] = corners.map(|corner| corner[axis]);
            // Whole periods change nothing: subtracting them keeps large coordinates small.
            let period = size[axis] * UNITS * if wrap == MIRRORED { 2.0 } else { 1.0 };
            let moved = match wrap {
                CLAMPED => 0.0,
                _ => (a / period).floor() * period,
            };
            let within = |x: f64| (x - moved).round().clamp(-GREATEST, GREATEST) as i32;
            let [a, b, c] = [a, b, c].map(within);
            [a, b - a, c - a].map(|x| x as u32)
        };
        let ([x, x1, x2], [y, y1, y2]) = (axis(0, wraps & 3), axis(1, (wraps >> 2) & 3));
        self.rows
            .extend([[x, y, x1, y1], [x2, y2, image, material]]);
    }

    /// True if two triangles, given by their material words, have the same holes.
    pub(crate) fn cut_alike(&self, one: u32, other: u32) -> bool {
        let cut = |word: u32| {
            let own = (word >= MASKED).then_some(word & !MASKED)?;
            let [x2, y2, image, _] = self.row(own + 1);
            Some((self.row(own), [x2, y2, image]))
        };
        cut(one) == cut(other)
    }

    fn row(&self, place: u32) -> [u32; 4] {
        self.rows[(place - self.first) as usize]
    }
}

/// The share of a coordinate difference for a weight, rounded.
fn part_of(change: i32, weight: u32) -> i32 {
    let (high, low) = (weight >> 8, (weight & 255) as i32);
    let fraction = change as u32 & 0xffff;
    let rest = ((fraction * high) >> 8) as i32 + (((change >> 8) * low) >> 8);
    (change >> 16) * high as i32 + ((rest + 128) >> 8)
}

fn wrapped(at: i32, size: i32, wrap: u32) -> u32 {
    if wrap == CLAMPED {
        return at.clamp(0, size - 1) as u32;
    }
    let period = if wrap == MIRRORED { 2 * size } else { size };
    let there = (at % period + period) % period;
    there.min(2 * size - 1 - there) as u32
}

fn alpha_at(masks: &Masks, place: u32, image: [u32; 4], x: i32, y: i32) -> u32 {
    let [width, height, wraps, _] = image;
    let column = wrapped(x, width as i32, wraps & 3);
    let row = wrapped(y, height as i32, (wraps >> 2) & 3);
    let at = row * width + column;
    let word = masks.row(place + 1 + (at >> 4))[((at >> 2) & 3) as usize];
    (word >> (8 * (at & 3))) & 255
}

/// One round of the generator PCG over a number joined with the next (Jarzynski & Olano, "Hash
/// functions for GPU rendering", JCGT 9 (3), 2020).
fn mixed(number: u32, next: u32) -> u32 {
    let state = (number ^ next)
        .wrapping_mul(747_796_405)
        .wrapping_add(2_891_336_453);
    let word = ((state >> ((state >> 28) + 4)) ^ state).wrapping_mul(277_803_737);
    (word >> 22) ^ word
}

/// A random number of a ray and a triangle's mask, of 16 bits: every structure draws the same, in
/// any order of its tests.
fn chance(ray: &Ray, place: u32) -> u32 {
    // Compilers do not preserve the sign of 0.
    let bits = |x: f32| if x == 0.0 { 0 } else { x.to_bits() };
    let numbers = ray.origin.into_iter().chain(ray.direction).map(bits);
    numbers.fold(place, mixed) >> 16
}

/// True if a ray finds no surface at these weights of a triangle's second and third corners. A ray
/// is in the space in which its triangle is tested, with a raised direction.
pub fn is_cut_out(
    masks: Option<&Masks>,
    triangle: &TriangleRecord,
    ray: &Ray,
    [u, v]: [f32; 2],
) -> bool {
    let Some(masks) = masks.filter(|_| triangle.material >= MASKED) else {
        return false;
    };
    let own = triangle.material & !MASKED;
    let [x, y, x1, y1] = masks.row(own).map(|word| word as i32);
    let [x2, y2, place, _] = masks.row(own + 1);
    let second = ((u * WHOLE as f32) as u32).min(WHOLE);
    let third = ((v * WHOLE as f32) as u32).min(WHOLE - second);
    let x = x + part_of(x1, second) + part_of(x2 as i32, third);
    let y = y + part_of(y1, second) + part_of(y2 as i32, third);
    let image = masks.row(place);
    let (column, row) = (x >> 8, y >> 8);
    let (fx, fy) = ((x & 255) as u32, (y & 255) as u32);
    let alpha = |dx, dy| alpha_at(masks, place, image, column + dx, row + dy);
    let upper = alpha(0, 0) * (256 - fx) + alpha(1, 0) * fx;
    let lower = alpha(0, 1) * (256 - fx) + alpha(1, 1) * fx;
    let alpha = upper * (256 - fy) + lower * fy;
    if image[2] & BLENDED != 0 {
        return (alpha >> 8) * image[3] <= chance(ray, own) * OPAQUE;
    }
    alpha < image[3]
}

/// The material of a triangle.
pub fn material_of(masks: Option<&Masks>, triangle: &TriangleRecord) -> u32 {
    match masks.filter(|_| triangle.material >= MASKED) {
        Some(masks) => masks.row((triangle.material & !MASKED) + 1)[3],
        None => triangle.material,
    }
}
