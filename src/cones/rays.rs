//! Rays through a scene in f64: what cones stand for. Shares no code with cones.

use crate::cone::Camera;
use crate::scene::{BACKGROUND, Patch};
use glam::DVec3;
use std::f64::consts::PI;

/// Triangles of a leaf.
const LEAF: usize = 4;
/// A hit is farther than this.
const LEAST: f64 = 1e-9;

struct Box3 {
    low: DVec3,
    high: DVec3,
}

enum Node {
    /// The node after it begins the first half; this one the second.
    Inner { bounds: Box3, second: usize },
    Leaf {
        bounds: Box3,
        first: usize,
        end: usize,
    },
}

/// A triangle in f64.
struct Face {
    corners: [DVec3; 3],
    colours: [DVec3; 3],
}

/// Triangles in boxes, halved at the median of the longest axis.
pub struct Rays {
    faces: Vec<Face>,
    nodes: Vec<Node>,
}

impl Rays {
    /// Sorts triangles into boxes.
    pub fn new(patches: &[Patch<f32>]) -> Self {
        let face = |patch: &Patch<f32>| Face {
            corners: patch.corners.map(|p| p.f64()),
            colours: patch.colours.map(|p| p.f64()),
        };
        let mut rays = Self {
            faces: patches.iter().map(face).collect(),
            nodes: Vec::new(),
        };
        rays.build(0, patches.len());
        rays
    }

    fn bounds(&self, first: usize, end: usize) -> Box3 {
        let points = self.faces[first..end].iter().flat_map(|face| face.corners);
        let empty = Box3 {
            low: DVec3::INFINITY,
            high: DVec3::NEG_INFINITY,
        };
        points.fold(empty, |all, p| Box3 {
            low: all.low.min(p),
            high: all.high.max(p),
        })
    }

    fn build(&mut self, first: usize, end: usize) {
        let bounds = self.bounds(first, end);
        let at = self.nodes.len();
        if end - first <= LEAF {
            self.nodes.push(Node::Leaf { bounds, first, end });
            return;
        }
        let size = bounds.high - bounds.low;
        let axis = (0..3).fold(0, |k, j| if size[j] > size[k] { j } else { k });
        let key = |face: &Face| face.corners.iter().map(|p| p[axis]).sum::<f64>();
        self.faces[first..end].sort_by(|a, b| key(a).total_cmp(&key(b)));
        self.nodes.push(Node::Inner { bounds, second: 0 });
        let middle = first.midpoint(end);
        self.build(first, middle);
        let here = self.nodes.len();
        if let Node::Inner { second, .. } = &mut self.nodes[at] {
            *second = here;
        }
        self.build(middle, end);
    }

    /// The distance and colour of the nearest hit, by boxes.
    pub fn closest(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let inverse = direction.recip();
        let mut stack = vec![0];
        let mut best: Option<(f64, DVec3)> = None;
        while let Some(at) = stack.pop() {
            let (Node::Inner { bounds, .. } | Node::Leaf { bounds, .. }) = &self.nodes[at];
            let most = best.map_or(f64::INFINITY, |hit| hit.0);
            if !bounds.is_met(origin, inverse, most) {
                continue;
            }
            match &self.nodes[at] {
                Node::Inner { second, .. } => stack.extend([*second, at + 1]),
                Node::Leaf { first, end, .. } => {
                    for face in &self.faces[*first..*end] {
                        best = nearer(best, face.hit(origin, direction));
                    }
                }
            }
        }
        best
    }

    /// The same through all triangles, for tests.
    #[cfg(test)]
    pub(crate) fn closest_of_all(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let hits = self.faces.iter().map(|face| face.hit(origin, direction));
        hits.fold(None, nearer)
    }
}

fn nearer(a: Option<(f64, DVec3)>, b: Option<(f64, DVec3)>) -> Option<(f64, DVec3)> {
    match (a, b) {
        (Some(x), Some(y)) => Some(if y.0 < x.0 { y } else { x }),
        _ => a.or(b),
    }
}

impl Box3 {
    fn is_met(&self, origin: DVec3, inverse: DVec3, most: f64) -> bool {
        let a = (self.low - origin) * inverse;
        let b = (self.high - origin) * inverse;
        // Of a ray within a plane of the box both are NaN, which `min` and `max` pass over.
        let near = (0..3).map(|k| a[k].min(b[k])).fold(0.0, f64::max);
        let far = (0..3).map(|k| a[k].max(b[k])).fold(most, f64::min);
        near <= far * (1.0 + 1e-12)
    }
}

impl Face {
    /// Distance, in lengths of the direction, and colour, after Möller and Trumbore.
    fn hit(&self, origin: DVec3, direction: DVec3) -> Option<(f64, DVec3)> {
        let [a, b, c] = self.corners;
        let (u, v) = (b - a, c - a);
        let p = direction.cross(v);
        let facing = u.dot(p);
        if facing == 0.0 {
            return None;
        }
        let w = origin - a;
        let second = w.dot(p) / facing;
        let q = w.cross(u);
        let third = direction.dot(q) / facing;
        let t = v.dot(q) / facing;
        let is_in = second >= 0.0 && third >= 0.0 && second + third <= 1.0 && t > LEAST;
        let [x, y, z] = self.colours;
        is_in.then(|| (t, x * (1.0 - second - third) + y * second + z * third))
    }
}

/// Two directions across an axis, as Duff et al. 2017 have them.
fn across(n: DVec3) -> [DVec3; 2] {
    let sign = 1.0_f64.copysign(n.z);
    let a = -1.0 / (sign + n.z);
    let b = n.x * n.y * a;
    [
        DVec3::new(1.0 + sign * n.x * n.x * a, sign * b, -sign * n.x),
        DVec3::new(b, sign + n.y * n.y * a, -n.y),
    ]
}

/// A direction of a cone with this tangent about an axis of length 1: evenly over its disk.
fn within(axis: DVec3, tangent: f64, [u, v]: [f64; 2]) -> DVec3 {
    let [x, y] = across(axis);
    let (sine, cosine) = (2.0 * PI * v).sin_cos();
    axis + (x * cosine + y * sine) * (tangent * u.sqrt())
}

/// The picture that rays of a pixel's cone see: off the mirror's true surface, then spread over the lobe.
pub struct Lens<'a> {
    camera: Camera<f64>,
    rays: &'a Rays,
}

impl<'a> Lens<'a> {
    /// A camera before a scene.
    pub fn new(camera: Camera<f64>, rays: &'a Rays) -> Self {
        Self { camera, rays }
    }

    /// The axis of a pixel's cone and the tangent of its angle: a circle of the pixel's solid angle.
    pub fn pixel(&self, pixel: u32) -> (DVec3, f64) {
        let camera = &self.camera;
        let middle = 0.5 * f64::from(camera.side);
        let column = f64::from(pixel % camera.side) + 0.5 - middle;
        let row = f64::from(pixel / camera.side) + 0.5 - middle;
        let picture = camera.forward.f64() * camera.distance
            + (camera.right.f64() * column - camera.up.f64() * row) * camera.stride;
        // A pixel is a unit square of the picture, seen aslant.
        let solid_angle = camera.distance / picture.length().powi(3);
        let angle = (1.0 - solid_angle / (2.0 * PI)).acos();
        (picture.normalize(), angle.tan())
    }

    /// What the ray of four numbers in [0, 1) sees: two choose it in the pixel, two in the lobe.
    pub fn sample(&self, pixel: u32, u: [f64; 4]) -> DVec3 {
        self.hit(pixel, u).map_or(BACKGROUND, |hit| hit.1)
    }

    /// The distance that it ends at, from the mirror if it meets one, and the colour there.
    pub fn hit(&self, pixel: u32, u: [f64; 4]) -> Option<(f64, DVec3)> {
        let (axis, tangent) = self.pixel(pixel);
        let direction = within(axis, tangent, [u[0], u[1]]).normalize();
        let eye = self.camera.eye.f64();
        match self.mirrored(eye, direction) {
            Some((at, mirrored)) => {
                let lobe = within(mirrored, self.camera.gloss, [u[2], u[3]]);
                self.rays.closest(at, lobe)
            }
            None => self.rays.closest(eye, direction),
        }
    }

    /// Where a ray meets the mirror, and its direction from there.
    pub fn mirrored(&self, eye: DVec3, direction: DVec3) -> Option<(DVec3, DVec3)> {
        let (at, normal) = match self.camera.mirror {
            0 => return None,
            1 => {
                let half = eye.dot(direction);
                let inner = half * half - eye.length_squared() + 1.0;
                if inner <= 0.0 || half >= 0.0 {
                    return None;
                }
                let at = eye - direction * (half + inner.sqrt());
                (at, at.normalize())
            }
            _ => {
                if direction.x >= 0.0 {
                    return None;
                }
                (eye - direction * (eye.x / direction.x), DVec3::X)
            }
        };
        let mirrored = direction - normal * (2.0 * direction.dot(normal));
        Some((at, mirrored.normalize()))
    }
}
