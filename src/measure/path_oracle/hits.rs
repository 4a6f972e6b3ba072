//! Nearest hits in f64, over all triangles whose group is near the ray.

use crate::geometry::Triangle;
use crate::measure::holes::SceneHoles;
use crate::oracle::{Groups, Line};
use crate::scene::SceneData;
use glam::{DVec2, DVec3};

/// Where a shadow ray ends, as a part of the distance to its light that is left out.
pub const SHORT: f64 = 1e-7;

/// Hits nearer than this, in the greatest coordinate of the scene, are the surface that the ray leaves.
const START: f64 = 1e-9;

/// By so much a barycentric may be negative, so that no ray slips through between two triangles.
const EDGE: f64 = 1e-12;

/// Distances that differ by less, relative, are equal: the lowest triangle counts.
const EQUAL: f64 = 1e-12;

/// Beyond this f32 distances are open-ended.
const FAR: f64 = 1e30;

/// The triangles of a scene.
pub(super) struct Hits<'a> {
    triangles: &'a [Triangle],
    holes: Option<SceneHoles<'a>>,
    groups: Groups,
    start: f64,
}

/// Where a ray meets a triangle: distance, and the weights of the second and third corner.
#[derive(Debug, Clone, Copy)]
pub(super) struct Hit {
    pub triangle: u32,
    pub distance: f64,
    pub weights: [f64; 2],
}

/// A ray with a unit direction; what it does not see again.
#[derive(Debug, Clone, Copy)]
pub(super) struct Segment {
    /// The point of the surface or lens that it leaves: where light is measured.
    pub start: DVec3,
    /// Of the triangle there, on the viewer's side.
    pub normal: DVec3,
    /// Where it is traced from: `start`, unless an offset is played.
    pub origin: DVec3,
    pub direction: DVec3,
    /// The triangle that it leaves.
    pub from: Option<u32>,
    /// The triangles that it goes to.
    pub to: Option<[u32; 2]>,
    pub length: f64,
    /// How far masks are off their places on it, texels: see [`Rounding::texel`](super::Rounding::texel).
    pub shift: DVec2,
}

impl Segment {
    pub fn endless(origin: DVec3, direction: DVec3, from: Option<u32>) -> Self {
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

    /// Point and normal where it begins.
    pub fn place(&self) -> (DVec3, DVec3) {
        (self.start, self.normal)
    }
}

impl<'a> Hits<'a> {
    pub fn new(scene: &'a SceneData) -> Self {
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

    /// The nearest hit of a segment.
    pub fn nearest(&self, segment: &Segment) -> Option<Hit> {
        let mut best: Option<Hit> = None;
        self.visit(segment, |hit| {
            let is_better = best.is_none_or(|known| {
                let apart = hit.distance - known.distance;
                let tie = apart.abs() <= EQUAL * known.distance;
                if tie {
                    hit.triangle < known.triangle
                } else {
                    apart < 0.0
                }
            });
            if is_better {
                best = Some(hit);
            }
            // The end as f32, rounded away by more than rounding.
            best.map_or(f32::INFINITY, |b| (b.distance * (1.0 + 1e-6)) as f32)
        });
        best
    }

    /// A hit as it is from the point that the ray leaves; as it is found, where the line from there passes the triangle.
    pub fn unmoved(&self, hit: Hit, segment: &Segment) -> Hit {
        let from_there = Segment {
            origin: segment.start,
            ..*segment
        };
        let triangle = &self.triangles[hit.triangle as usize];
        meet(triangle, hit.triangle, &from_there).unwrap_or(hit)
    }

    /// Whether anything lies on a segment.
    pub fn blocked(&self, segment: &Segment) -> bool {
        let mut found = false;
        self.visit(segment, |_| {
            found = true;
            f32::NEG_INFINITY
        });
        found
    }

    /// Whether there is no surface at a point of a triangle.
    pub fn is_cut_out(&self, triangle: u32, weights: [f64; 2], shift: DVec2) -> bool {
        let holes = self.holes.as_ref();
        holes.is_some_and(|holes| holes.is_cut_out(triangle, weights, shift))
    }

    /// Calls `found` with every hit; it returns the end of what is still of interest.
    fn visit(&self, segment: &Segment, mut found: impl FnMut(Hit) -> f32) {
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
                let hit = hit.filter(within);
                if let Some(hit) = hit.filter(|h| !self.is_cut_out(id, h.weights, segment.shift)) {
                    end = end.min(found(hit));
                }
            }
            end
        });
    }
}

/// The point at which the line of a segment meets a triangle, by Cramer's rule.
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
