//! Nearest hits in f64, over all triangles whose group is near the ray.

use super::rounding::{EPSILON, MOST_ROUNDINGS, Rounding};
use crate::holes::SceneHoles;
use glam::{DVec2, DVec3};
use raystone_accel::oracle::{Cut, Groups, Line};
use raystone_core::geometry::Triangle;
use raystone_scene::SceneData;

/// Fraction of the distance to its light by which a shadow ray ends early.
pub(crate) const SHORT: f64 = 1e-7;

/// Nearer hits, relative to the scene's largest coordinate, are the surface that the ray leaves.
const START: f64 = 1e-9;

/// Tolerance for negative barycentrics, so that no ray slips through between two triangles.
const EDGE: f64 = 1e-12;

/// Distances with a smaller relative difference are equal: the lowest triangle index wins.
const EQUAL: f64 = 1e-12;

/// Surfaces within this many f32 roundings are layers: a kernel may meet either first.
const LAYERED: f64 = 16.0;

/// Beyond this, f32 distances count as infinite.
const FAR: f64 = 1e30;

pub(crate) struct Hits<'a> {
    triangles: &'a [Triangle],
    holes: Option<SceneHoles<'a>>,
    groups: Groups,
    start: f64,
}

/// Intersection with a triangle: distance, and the weights of the second and third corners.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Hit {
    pub triangle: u32,
    pub distance: f64,
    pub weights: [f64; 2],
}

impl Hit {
    /// The smallest corner weight: the distance of the hit from an edge.
    fn margin(&self) -> f64 {
        let [u, v] = self.weights;
        u.min(v).min(1.0 - u - v)
    }
}

#[derive(Debug, Clone, Copy, PartialEq)]
pub(crate) enum Blocked {
    No,
    /// Only by a layer of the surface it leaves, or by surfaces that are there by chance: a kernel
    /// may have passed.
    ByLayer,
    Yes,
}

/// The nearest hit after simulated rounding.
pub(crate) struct Nearest {
    pub hit: Hit,
    /// True if only rounding or chance made it the nearest.
    pub is_swapped: bool,
    /// Surfaces that a kernel may meet instead: 1 for those within [`LAYERED`] roundings, and each
    /// that is there by chance.
    pub layers: usize,
}

/// A ray with a unit direction, and the triangles it ignores.
#[derive(Debug, Clone, Copy)]
pub(crate) struct Segment {
    /// The point of the surface or lens that it leaves; light is measured there.
    pub start: DVec3,
    /// Normal of the triangle there, on the viewer's side.
    pub normal: DVec3,
    /// The origin for tracing: `start`, unless an offset is simulated.
    pub origin: DVec3,
    pub direction: DVec3,
    /// The triangle that it leaves.
    pub from: Option<u32>,
    /// The target triangles.
    pub to: Option<[u32; 2]>,
    pub length: f64,
    /// Displacement of masks along it, texels: see [`Rounding::texel`](super::Rounding::texel).
    pub shift: DVec2,
}

impl Segment {
    pub(crate) fn endless(origin: DVec3, direction: DVec3, from: Option<u32>) -> Self {
        Self {
            start: origin,
            normal: DVec3::ZERO,
            origin,
            direction,
            from,
            to: None,
            length: FAR,
            shift: DVec2::ZERO,
        }
    }

    /// Its start point and normal.
    pub(crate) fn place(&self) -> (DVec3, DVec3) {
        (self.start, self.normal)
    }
}

impl<'a> Hits<'a> {
    pub(crate) fn new(scene: &'a SceneData) -> Self {
        let triangles = &scene.triangles;
        let corners = |id: usize| triangles[id].vertices.map(|v| v.to_array());
        let coordinates = triangles.iter().flat_map(|t| t.vertices);
        let greatest = coordinates.fold(0.0_f32, |most, v| most.max(v.abs().max_element()));
        Self {
            triangles,
            holes: SceneHoles::of(scene),
            groups: Groups::new(triangles.len(), true, corners),
            start: START * f64::from(greatest),
        }
    }

    pub(crate) fn nearest(&self, segment: &Segment, rounding: &mut Rounding) -> Option<Nearest> {
        let mut found: Vec<(Hit, Blur)> = Vec::new();
        let mut by_chance: Vec<Hit> = Vec::new();
        let mut end = f64::INFINITY;
        self.visit(segment, |hit, cut| {
            let blur = self.blur(&hit, segment);
            // Hits behind a triangle count where a kernel may miss it.
            if cut == Cut::Open {
                by_chance.push(hit);
            } else if hit.margin() > blur.of_weights * MOST_ROUNDINGS * EPSILON {
                end = end.min(hit.distance + 2.0 * blur.within(MOST_ROUNDINGS));
            }
            found.push((hit, blur));
            // The end as f32, rounded away by more than an ulp.
            (end * (1.0 + 1e-6)) as f32
        });
        // An order independent of the groups.
        found.sort_by_key(|(hit, _)| hit.triangle);
        found.retain(|(hit, blur)| {
            let is_by_chance = by_chance.iter().any(|other| other.triangle == hit.triangle);
            rounding.holds(hit.margin(), blur.of_weights) && (!is_by_chance || rounding.is_there())
        });
        let before = |a: &Hit, b: &Hit| {
            if (a.distance - b.distance).abs() <= EQUAL * b.distance {
                a.triangle < b.triangle
            } else {
                a.distance < b.distance
            }
        };
        let first = found
            .iter()
            .copied()
            .reduce(|a, b| if before(&b.0, &a.0) { b } else { a })?;
        let room = |blur: &Blur| blur.within(LAYERED) + first.1.within(LAYERED);
        let is_layer = |(hit, blur): &(Hit, Blur)| {
            hit.triangle != first.0.triangle && hit.distance - first.0.distance <= room(blur)
        };
        let is_layered = found.iter().any(is_layer);
        let is_played = rounding.is_played();
        let played = found.iter().map(|(hit, blur)| {
            (
                *hit,
                rounding.distance(hit.distance, blur.of_rounding, blur.most),
            )
        });
        let met = if is_played {
            played.reduce(|a, b| if b.1 < a.1 { b } else { a })?.0
        } else {
            first.0
        };
        by_chance.retain(|hit| hit.distance <= end);
        let is_by_chance = by_chance.iter().any(|hit| hit.distance <= met.distance);
        let is_swapped = met.triangle != first.0.triangle || self.is_at_start(&met, segment);
        let is_layered = is_layered || self.is_at_start(&first.0, segment);
        Some(Nearest {
            hit: met,
            is_swapped: is_swapped || is_by_chance,
            layers: usize::from(is_layered) + by_chance.len(),
        })
    }

    /// Error bound of the distance of a hit.
    fn blur(&self, hit: &Hit, segment: &Segment) -> Blur {
        let [a, b, c] = self.triangles[hit.triangle as usize]
            .vertices
            .map(|v| v.as_dvec3());
        let (e1, e2) = (b - a, c - a);
        let area = e1.cross(e2);
        let normal = area.normalize_or_zero();
        let terms = segment.origin.abs() + a.abs() + e1.abs() + e2.abs();
        let longest = e1.length().max(e2.length());
        let cosine = normal.dot(segment.direction).abs();
        Blur {
            of_rounding: normal.abs().dot(terms) / cosine.max(1e-12),
            most: longest,
            of_weights: Rounding::of_weights(terms.max_element() * longest, area.length()),
        }
    }

    /// The hit seen from the point that the ray leaves, unless the line from there misses.
    pub(crate) fn unmoved(&self, hit: Hit, segment: &Segment) -> Hit {
        let from_there = Segment {
            origin: segment.start,
            ..*segment
        };
        let triangle = &self.triangles[hit.triangle as usize];
        meet(triangle, hit.triangle, &from_there).unwrap_or(hit)
    }

    /// The occlusion of a segment, which may be only by a layer of the surface that it leaves, or
    /// only by chance.
    pub(crate) fn blocked(&self, segment: &Segment, rounding: &mut Rounding) -> Blocked {
        let (mut by_layer, mut by_other) = (false, false);
        self.visit(segment, |hit, cut| {
            if !rounding.holds(hit.margin(), self.blur(&hit, segment).of_weights) {
                return f32::INFINITY;
            }
            if cut == Cut::Open {
                by_layer |= rounding.is_there();
                return f32::INFINITY;
            }
            if self.is_at_start(&hit, segment) {
                by_layer = true;
                return f32::INFINITY;
            }
            by_other = true;
            f32::NEG_INFINITY
        });
        match (by_layer, by_other) {
            (_, true) => Blocked::Yes,
            (true, false) => Blocked::ByLayer,
            (false, false) => Blocked::No,
        }
    }

    /// True if a hit is on a layer of the surface that a segment leaves.
    fn is_at_start(&self, hit: &Hit, segment: &Segment) -> bool {
        segment.from.is_some() && hit.distance <= self.blur(hit, segment).within(LAYERED)
    }

    /// True if there is no surface at a point of a triangle.
    pub(crate) fn is_cut_out(
        &self,
        triangle: u32,
        weights: [f64; 2],
        rounding: &mut Rounding,
    ) -> bool {
        match self.cut(triangle, weights, rounding.texel()) {
            Cut::Surface => false,
            Cut::Hole => true,
            Cut::Open => !rounding.is_there(),
        }
    }

    fn cut(&self, triangle: u32, weights: [f64; 2], shift: DVec2) -> Cut {
        let holes = self.holes.as_ref();
        holes.map_or(Cut::Surface, |holes| holes.at(triangle, weights, shift))
    }

    /// Calls `found` with every hit, and whether its surface is there for certain; it returns the
    /// new end of the search interval.
    fn visit(&self, segment: &Segment, mut found: impl FnMut(Hit, Cut) -> f32) {
        let inverse = |d: f64| {
            let d = d as f32;
            1.0 / d.abs().max(1e-37).copysign(d)
        };
        let mut end = segment.length as f32;
        let origin = segment.origin.as_vec3().to_array();
        let direction = segment.direction.to_array();
        let line = Line::new(origin, direction.map(inverse), [0.0, end]);
        self.groups.visit(&line, |group| {
            for &id in self.groups.members(group) {
                if Some(id) == segment.from || segment.to.is_some_and(|to| to.contains(&id)) {
                    continue;
                }
                let hit = meet(&self.triangles[id as usize], id, segment);
                let within = |h: &Hit| h.distance > self.start && h.distance < segment.length;
                if let Some(hit) = hit.filter(within) {
                    let cut = self.cut(id, hit.weights, segment.shift);
                    if cut != Cut::Hole {
                        end = end.min(found(hit, cut));
                    }
                }
            }
            end
        });
    }
}

/// Error bound of a distance, scene units.
#[derive(Debug, Clone, Copy)]
struct Blur {
    /// Error of the distance over the relative error of the input coordinates.
    of_rounding: f64,
    /// Maximum: a hit stays on its triangle.
    most: f64,
    /// Error of the corner weights, over the same relative error.
    of_weights: f64,
}

impl Blur {
    fn within(&self, roundings: f64) -> f64 {
        (self.of_rounding * roundings * EPSILON).min(self.most)
    }
}

/// The intersection of a segment's line with a triangle, by Cramer's rule.
fn meet(triangle: &Triangle, id: u32, segment: &Segment) -> Option<Hit> {
    let [a, b, c] = triangle.vertices.map(|v| v.as_dvec3());
    let (e1, e2) = (b - a, c - a);
    let across = segment.direction.cross(e2);
    let det = e1.dot(across);
    if det == 0.0 {
        return None;
    }
    let to_origin = segment.origin - a;
    let u = to_origin.dot(across) / det;
    if !(-EDGE..=1.0 + EDGE).contains(&u) {
        return None;
    }
    let turned = to_origin.cross(e1);
    let v = segment.direction.dot(turned) / det;
    if v < -EDGE || u + v > 1.0 + EDGE {
        return None;
    }
    Some(Hit {
        triangle: id,
        distance: e2.dot(turned) / det,
        weights: [u, v],
    })
}
