//! The picture by cones in f64, written again from the thesis: an oracle of [`trace`](crate::trace) that shares with it
//! neither the overlap, nor the frames, nor the lists.
//!
//! Where two layers are as far away as f32 can tell, their order is open, and so is whether a share is above the cut:
//! what that may change is allowed for, pixel by pixel.

use crate::cone::Camera;
use crate::quadrature;
use crate::rays::Lens;
use crate::scene::Patch;
use crate::trace::{Blend, Given, LEAST_SHARE};
use glam::{DVec2, DVec3};
use std::f64::consts::PI;
use std::sync::LazyLock;

/// The widest cone that a curved mirror makes, and the least cosine there: bounds of the method.
const WIDEST: f64 = 0.5;
const LEAST_COSINE: f64 = 1e-3;
const LEAST_NEAR: f64 = 1e-3;

/// What f32 may be off in a share, in a place of the disk and in a depth.
const OFF_SHARE: f64 = 2e-6;
const OFF_PLACE: f64 = 2e-6;
const OFF_DEPTH: f64 = 2e-6;
/// What rounding of colours and sums may change.
const OFF_COLOUR: f64 = 2e-4;
/// What a mean of a lobe may be off, and how steep means are that are known at sixteenths.
const OFF_LOBE: f64 = 2e-3;
const STEEPEST: f64 = 16.0;
/// What a direction of a mask may change that falls to another layer: its own weight, and that of its layer's others.
const OPEN_BIT: f64 = 2.0 / 64.0;

/// What f32 may be off in the place of a vertex in the disk, in its radii. Directions are known to 2⁻²³, of which a
/// narrow cone has few. Off the sphere the discriminant, a difference of numbers up to 16, is known to 2⁻²⁰ and is the
/// square of the cosine: the point and with it the axis are off by that over the cosine, the width by that over its square.
fn reach_of(beam: &Beam) -> f64 {
    let cancelled = if beam.is_curved {
        2.0_f64.powi(-20)
    } else {
        0.0
    };
    let axis = 4e-7 + cancelled / beam.cosine;
    OFF_PLACE + axis / beam.angle + cancelled / beam.cosine.powi(2)
}

static LOBES: LazyLock<quadrature::LobeMeans> = LazyLock::new(quadrature::LobeMeans::new);

/// A cone with what stands behind its numbers.
pub(crate) struct Beam {
    pub(crate) apex: DVec3,
    pub(crate) axis: DVec3,
    pub(crate) angle: f64,
    pub(crate) near: f64,
    /// At the mirror, and whether that is curved.
    cosine: f64,
    is_curved: bool,
    /// What the narrower of the pixel's cone and the lobe has of its width.
    narrow: f64,
}

/// The cone of a pixel.
pub(crate) fn beam(camera: &Camera<f64>, lens: &Lens, pixel: u32) -> Beam {
    let (axis, tangent) = lens.pixel(pixel);
    let eye = camera.eye.f64();
    let Some((at, mirrored)) = lens.mirrored(eye, axis) else {
        return Beam {
            apex: eye,
            axis,
            angle: tangent.atan(),
            near: LEAST_NEAR,
            cosine: 1.0,
            is_curved: false,
            narrow: 0.0,
        };
    };
    let t = eye.distance(at);
    // The normal halves the angle between the mirrored direction and the way back.
    let cosine = ((mirrored - axis).length() * 0.5).max(LEAST_COSINE);
    let curvature = if camera.mirror == 1 { 1.0 } else { 0.0 };
    let tangential = 1.0 + 2.0 * t * curvature / cosine;
    let sagittal = 1.0 + 2.0 * t * curvature * cosine;
    let wider = if camera.is_mean {
        (tangential * sagittal).sqrt()
    } else {
        tangential
    };
    let own = (tangent * wider).min(WIDEST);
    let angle = own.atan() + camera.gloss.atan();
    // As wide at the mirror as the pixel's cone is there.
    let behind = tangent * t / angle.tan();
    Beam {
        apex: at - mirrored * behind,
        axis: mirrored,
        angle,
        near: behind,
        cosine,
        is_curved: camera.mirror == 1,
        narrow: own.min(camera.gloss) / (own + camera.gloss),
    }
}

struct Part {
    share: f64,
    depth: f64,
    /// What f32 may be off in the depth.
    off: f64,
    colour: DVec3,
    bits: u64,
    is_thin: bool,
    /// Directions so near an edge that f32 may see them on either side.
    open: u32,
    /// How much of the lobe passes where it is, over the mean of the cone, and what that may be off.
    lobe: [f64; 2],
}

/// A pixel, with what f32 may be off.
#[derive(Debug, Clone, Copy)]
pub struct Expected {
    /// Linear colour.
    pub colour: DVec3,
    /// Part of the cone that layers cover.
    pub covered: f64,
    /// What a component of the colour and the covered part may be off.
    pub slack: f64,
    /// Layers met.
    pub met: u32,
}

/// A convex polygon without its part before a plane across the axis.
fn before_cut(points: &[DVec3], depth: impl Fn(DVec3) -> f64, near: f64) -> Vec<DVec3> {
    let mut kept = Vec::new();
    for (k, p) in points.iter().enumerate() {
        let q = points[(k + 1) % points.len()];
        let (a, b) = (depth(*p) - near, depth(q) - near);
        if a >= 0.0 {
            kept.push(*p);
        }
        if (a >= 0.0) != (b >= 0.0) {
            kept.push(p.lerp(q, a / (a - b)));
        }
    }
    kept
}

/// Parts of the barycentric coordinates of a point of a triangle's plane, none below 0.
fn barycentric(corners: [DVec3; 3], p: DVec3) -> [f64; 3] {
    let [a, b, c] = corners;
    let n = (b - a).cross(c - a);
    let size = n.length_squared();
    let second = ((p - a).cross(c - a).dot(n) / size).clamp(0.0, 1.0);
    let third = ((b - a).cross(p - a).dot(n) / size).clamp(0.0, 1.0 - second);
    [1.0 - second - third, second, third]
}

/// The mean of tiles half a unit wide over a texel, the square from (`x`, `y`) on: texels of up to half a unit lie
/// within a tile, one of a whole unit has two of each colour.
fn texel_mean(x: f64, y: f64, wide: f64) -> f64 {
    if wide > 0.5 {
        return 0.49;
    }
    let of = |at: f64| (2.0 * (at + 0.5 * wide)).floor() as i64;
    if (of(x) + of(y)).rem_euclid(2) == 0 {
        0.9
    } else {
        0.08
    }
}

/// The tiles about a place of the floor as a texture has them whose texels are 1/32 to 1 unit wide: means over texels,
/// weighted by how near their middles are, and between the two widths next to `width` on a line of logarithms.
fn about(x: f64, y: f64, width: f64) -> f64 {
    let level = (32.0 * width).log2().clamp(0.0, 5.0);
    let of = |level: f64| {
        let wide = level.exp2() / 32.0;
        let corner = |at: f64| {
            (
                (at / wide - 0.5).floor() * wide,
                (at / wide - 0.5).rem_euclid(1.0),
            )
        };
        let ((left, u), (below, v)) = (corner(x), corner(y));
        let row =
            |y: f64| texel_mean(left, y, wide) * (1.0 - u) + texel_mean(left + wide, y, wide) * u;
        row(below) * (1.0 - v) + row(below + wide) * v
    };
    let part = level.fract();
    of(level.floor()) * (1.0 - part) + of(level.ceil()) * part
}

/// What is traced.
pub struct Oracle<'a> {
    /// What is kept of a cone.
    pub given: &'a Given<f64>,
    /// Triangles.
    pub patches: &'a [Patch<f64>],
    /// Directions of masks, in the unit disk.
    pub directions: &'a [[f64; 2]],
    /// The camera.
    pub lens: Lens<'a>,
}

impl Oracle<'_> {
    fn has_mask(&self) -> bool {
        [Blend::MaskArea, Blend::MaskCount]
            .map(Blend::word)
            .contains(&self.given.blend)
    }

    fn part(&self, beam: &Beam, [x, y]: [DVec3; 2], patch: &Patch<f64>) -> Option<Part> {
        let tangent = beam.angle.tan();
        let corners = patch.corners.map(|p| p.f64());
        let depth = |p: DVec3| (p - beam.apex).dot(beam.axis);
        let seen = before_cut(&corners, depth, beam.near);
        let flat = |p: DVec3| {
            let w = p - beam.apex;
            DVec2::new(w.dot(x), w.dot(y)) / (w.dot(beam.axis) * tangent)
        };
        let polygon: Vec<DVec2> = seen.iter().map(|p| flat(*p)).collect();
        let bound = |of: fn(DVec2, DVec2) -> DVec2, from: f64| {
            polygon.iter().copied().fold(DVec2::splat(from), of)
        };
        let (low, high) = (bound(DVec2::min, f64::MAX), bound(DVec2::max, f64::MIN));
        if polygon.len() < 3 || low.max_element() >= 1.0 || high.min_element() <= -1.0 {
            return None;
        }
        let (area, middle) = quadrature::overlap(&polygon);
        let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
        let height = n.dot(corners[0] - beam.apex);
        let towards = |at: DVec2| beam.axis + (x * at.x + y * at.y) * tangent;
        let depths = corners.map(depth);
        let (low, high) = (
            depths
                .iter()
                .copied()
                .fold(f64::MAX, f64::min)
                .max(beam.near),
            depths.iter().copied().fold(f64::MIN, f64::max),
        );
        let depth_at = |at: DVec2| (height / n.dot(towards(at))).max(low).min(high);
        if area <= 0.0 {
            return None;
        }
        let at = depth_at(middle);
        // A centroid is a quotient of sums.
        let reach = OFF_PLACE / area.min(1.0) + reach_of(beam);
        let beside = [DVec2::X, -DVec2::X, DVec2::Y, -DVec2::Y];
        let off = beside.map(|d| (depth_at(middle + d * reach) - at).abs());
        let p = beam.apex + towards(middle) * at;
        let parts = barycentric(corners, p);
        let colours = patch.colours.map(|p| p.f64());
        let bits = self.bits(beam, [x, y], &corners, n);
        let lobe = self.lobe(beam, area / PI, middle.length(), reach);
        let nearest = || {
            let far = |d: &[f64; 2]| DVec2::from(*d).distance_squared(middle);
            let all = 0..self.directions.len();
            all.min_by(|a, b| far(&self.directions[*a]).total_cmp(&far(&self.directions[*b])))
        };
        Some(Part {
            share: area / PI,
            depth: at,
            off: off.iter().copied().fold(0.0, f64::max) + OFF_DEPTH * at,
            colour: (0..3).map(|k| colours[k] * parts[k]).sum(),
            is_thin: bits == 0,
            lobe,
            open: self.open_bits(&polygon, reach_of(beam)),
            bits: if bits == 0 {
                nearest().map_or(1, |k| 1 << k)
            } else {
                bits
            },
        })
    }

    /// The weight of a part by the lobe. It changes by its own size over an eighth of the cone at most.
    fn lobe(&self, beam: &Beam, share: f64, distance: f64, reach: f64) -> [f64; 2] {
        if self.given.blend != Blend::Lobe.word() {
            return [1.0, 0.0];
        }
        let weight = LOBES.of(share, distance, beam.narrow);
        [weight, OFF_LOBE + STEEPEST * reach]
    }

    /// Directions whose rays meet the triangle beyond the plane at `near`.
    fn bits(&self, beam: &Beam, [x, y]: [DVec3; 2], corners: &[DVec3; 3], n: DVec3) -> u64 {
        if !self.has_mask() {
            return 0;
        }
        let mut bits = 0;
        for (k, at) in self.directions.iter().enumerate() {
            let d = beam.axis + (x * at[0] + y * at[1]) * beam.angle.tan();
            let t = n.dot(corners[0] - beam.apex) / n.dot(d);
            if t.is_nan() || t < beam.near {
                continue;
            }
            let p = beam.apex + d * t;
            let is_left = |k: usize| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                (b - a).cross(p - a).dot(n) > 0.0
            };
            if (0..3).all(is_left) {
                bits |= 1 << k;
            }
        }
        bits
    }

    /// Directions within reach of an edge.
    fn open_bits(&self, polygon: &[DVec2], reach: f64) -> u32 {
        if !self.has_mask() {
            return 0;
        }
        let is_near = |d: &&[f64; 2]| {
            let d = DVec2::from(**d);
            polygon.iter().enumerate().any(|(k, p)| {
                let along = polygon[(k + 1) % polygon.len()] - *p;
                let square = along.length_squared().max(f64::MIN_POSITIVE);
                let t = ((d - *p).dot(along) / square).clamp(0.0, 1.0);
                (*p + along * t).distance(d) < reach
            })
        };
        self.directions.iter().filter(is_near).count() as u32
    }

    /// The colour of what a ray from the beam's near plane meets.
    fn met(&self, beam: &Beam, direction: DVec3) -> Option<DVec3> {
        let hits = self.patches.iter().filter_map(|patch| {
            let corners = patch.corners.map(|p| p.f64());
            let n = (corners[1] - corners[0]).cross(corners[2] - corners[0]);
            let t = n.dot(corners[0] - beam.apex) / n.dot(direction);
            let p = beam.apex + direction * t;
            let is_left = |k: usize| {
                let (a, b) = (corners[k], corners[(k + 1) % 3]);
                (b - a).cross(p - a).dot(n) >= 0.0
            };
            let is_met = t.is_finite() && t >= beam.near && (0..3).all(is_left);
            is_met.then_some((t, p, n.normalize(), patch))
        });
        let (t, p, n, patch) = hits.min_by(|a, b| a.0.total_cmp(&b.0))?;
        let parts = barycentric(patch.corners.map(|p| p.f64()), p);
        let colours = patch.colours.map(|p| p.f64());
        let colour: DVec3 = (0..3).map(|k| colours[k] * parts[k]).sum();
        if patch.tile == 0.0 {
            return Some(colour);
        }
        let width = 2.0 * t * beam.angle.tan() / n.dot(beam.axis).abs();
        Some(colour / patch.tile * about(p.x, p.y, width))
    }

    /// The pixel of a cone of which only the axis counts. What rounding may change is what axes beside it see.
    fn axis_pixel(&self, beam: &Beam, [x, y]: [DVec3; 2]) -> Expected {
        let seen = |at: DVec2| {
            let direction = beam.axis + (x * at.x + y * at.y) * beam.angle.tan();
            self.met(beam, direction)
        };
        let background = self.given.background.f64();
        let own = seen(DVec2::ZERO);
        let colour = own.unwrap_or(background);
        let reach = reach_of(beam);
        let beside = (0..8).map(|k| DVec2::from_angle(PI / 4.0 * f64::from(k)) * reach);
        let off = beside.map(|at| {
            let other = seen(at);
            let apart = (other.unwrap_or(background) - colour).abs().max_element();
            apart.max(f64::from(u8::from(own.is_some() != other.is_some())))
        });
        Expected {
            colour,
            covered: f64::from(u8::from(own.is_some())),
            slack: OFF_COLOUR + 2.0 * off.fold(0.0, f64::max),
            met: u32::from(own.is_some()),
        }
    }

    /// The pixel of a cone.
    pub fn pixel(&self, pixel: u32) -> Expected {
        let beam = beam(&self.given.camera, &self.lens, pixel);
        // The same frame as cones have, so that the 64 directions are the same.
        let helper = if beam.axis.z.abs() > 0.9 {
            DVec3::X
        } else {
            DVec3::Z
        };
        let x = helper.cross(beam.axis).normalize();
        let frame = [x, beam.axis.cross(x)];
        if self.given.blend == Blend::Level.word() {
            return self.axis_pixel(&beam, frame);
        }
        let parts = self
            .patches
            .iter()
            .filter_map(|patch| self.part(&beam, frame, patch));
        let least = self.given.cut.max(f64::from(LEAST_SHARE));
        let mut slack = OFF_COLOUR;
        let mut kept: Vec<Part> = Vec::new();
        for part in parts {
            let off = OFF_SHARE + reach_of(&beam);
            if (part.share - least).abs() < off {
                slack += 2.0 * part.share.max(least);
            }
            slack += off.min(part.share) + OPEN_BIT * f64::from(part.open);
            if part.share > least {
                kept.push(part);
            }
        }
        kept.sort_by(|a, b| a.depth.total_cmp(&b.depth));
        slack += open_order(&kept, self.given.most as usize);
        let met = kept.len() as u32;
        kept.truncate(self.given.most as usize);
        let (colour, covered) = self.blended(&kept);
        if self.given.blend == Blend::Lobe.word() {
            slack = lobe_slack(&kept, slack);
        }
        Expected {
            colour,
            covered,
            slack,
            met,
        }
    }

    fn blended(&self, parts: &[Part]) -> (DVec3, f64) {
        let mut colour = DVec3::ZERO;
        let mut free = 1.0;
        let mut passed = 0.0;
        let mut open = u64::MAX;
        for part in parts {
            let of = |bits: u64| f64::from(bits.count_ones());
            let weight: f64 = match self.given.blend {
                0 | 4 => part.share,
                1 => part.share * of(part.bits & open) / of(part.bits),
                _ if part.is_thin => 0.0,
                _ => of(part.bits & open) / 64.0,
            };
            let weight = weight.min(free);
            colour += part.colour * weight * part.lobe[0];
            passed += weight * part.lobe[0];
            free -= weight;
            if !part.is_thin {
                open &= !part.bits;
            }
        }
        if self.has_mask() && open == 0 && free < 1.0 {
            return (colour / (1.0 - free), 1.0);
        }
        // What passes is shared among layers as if it were all that they cover.
        if passed > 0.0 {
            colour *= (1.0 - free) / passed;
        }
        (colour + self.given.background.f64() * free, 1.0 - free)
    }
}

/// What may be off where layers weigh by a lobe: that of shares as much more as a weight exceeds their mean, and that of
/// the weights themselves.
fn lobe_slack(parts: &[Part], slack: f64) -> f64 {
    let (mut free, mut covered, mut passed, mut off, mut most) = (1.0_f64, 0.0, 0.0, 0.0, 0.0_f64);
    for part in parts {
        let weight = part.share.min(free);
        free -= weight;
        covered += weight;
        passed += weight * part.lobe[0];
        off += weight * part.lobe[1];
        most = most.max(part.lobe[0]);
    }
    if passed <= 0.0 {
        return slack + covered;
    }
    slack * (most * covered / passed).max(1.0) + 2.0 * off * covered / passed
}

/// What another order of layers that are as far away as f32 can tell may change.
///
/// Of two layers that are both kept it is the lesser share; of two of which one is kept, the greater.
fn open_order(parts: &[Part], most: usize) -> f64 {
    let mut slack = 0.0;
    for (k, a) in parts.iter().enumerate() {
        for (j, b) in parts.iter().enumerate().skip(k + 1) {
            if b.depth - a.depth > a.off + b.off {
                continue;
            }
            slack += match (k < most, j < most) {
                (true, false) => a.share.max(b.share),
                _ => a.share.min(b.share),
            };
        }
    }
    slack
}
