//! Automatic framing of scenes without a camera: objects from outside, rooms from inside.
//!
//! A scene is a room if surfaces facing them surround most points in its box. (The inside of a
//! closed object is surrounded too, but by back faces.) Rays are cast on the host, against only the
//! largest triangles if there are many. The result depends on the triangles alone.

use super::{Bounds, SceneData};
use glam::{DVec3, Vec3, Vec3A};
use obvhs::bvh2::Bvh2;
use obvhs::ploc::{PlocBuilder, PlocSearchDistance, SortPrecision};
use obvhs::ray::{Ray, RayHit};
use raystone_core::geometry::{Camera, Triangle};
use std::borrow::Cow;

/// Vertical field of view outside, degrees.
const OUTSIDE_FOV: f32 = 35.0;
/// Vertical field of view inside a room, degrees.
const INSIDE_FOV: f32 = 60.0;
/// Fraction of the image's width or height that an object fills.
const FILL: f32 = 0.9;
/// Maximum number of triangles to cast rays against; larger scenes use the largest ones.
const MOST_TRIANGLES: usize = 1 << 14;
/// No rays are cast if a random one would meet more boxes: thousands of triangles in one place.
const MOST_BOXES: f32 = 2000.0;
/// A point is inside a room if this fraction of directions hits a front face.
const ENCLOSED: f32 = 0.7;
/// A scene is a room if this fraction of the points in its box is inside one.
const ROOM: f32 = 0.4;
/// A side of a room is open if it is unobstructed from this fraction of the inside points.
const OPEN_SIDE: f32 = 0.6;
/// A box extent below this fraction of the largest one counts as zero.
const FLAT: f32 = 0.01;

/// How an automatic camera views a scene, up to the aspect of the image.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Framing {
    bounds: Bounds,
    up: Vec3,
    place: Standpoint,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum Standpoint {
    /// From this direction, far enough away to see everything.
    Outside { towards_eye: Vec3, room: bool },
    /// From inside a room.
    Inside { eye: Vec3, forward: Vec3 },
}

impl SceneData {
    /// The file's camera, or one that shows the whole scene, or the inside of a room, in an image
    /// of this aspect (width over height).
    pub fn view(&self, aspect: f32) -> Camera {
        self.camera.unwrap_or_else(|| {
            let framing = self.framing.unwrap_or_else(|| Framing::of(self));
            framing.camera(&self.triangles, aspect)
        })
    }
}

impl Default for Framing {
    /// The view of an object around the origin, standing on the y axis.
    fn default() -> Self {
        Self {
            bounds: Bounds {
                min: -Vec3::ONE,
                max: Vec3::ONE,
            },
            up: Vec3::Y,
            place: Standpoint::Outside {
                towards_eye: three_quarter(Vec3::Y, 1.0, 1.0),
                room: false,
            },
        }
    }
}

impl Framing {
    /// Finds the best viewpoint. In glTF, y is up; otherwise the triangles decide.
    pub(super) fn of(scene: &SceneData) -> Self {
        let name = scene.name.to_ascii_lowercase();
        let says_y = name.ends_with(".gltf") || name.ends_with(".glb");
        let bounds = scene.bounds();
        if bounds.is_empty() {
            return Self::default();
        }
        // Back faces decide whether it is a room.
        let triangles: Cow<[Triangle]> = if scene.mirrored.is_empty() {
            Cow::Borrowed(&scene.triangles)
        } else {
            (0..scene.triangles.len())
                .map(|id| scene.outward(id).into())
                .collect()
        };
        let stage = UnitScene::new(&triangles, &bounds);
        let (up, place) = if stage.boxes_per_ray() <= MOST_BOXES {
            stage.place(says_y)
        } else {
            (Vec3::Y, Self::default().place)
        };
        Self { bounds, up, place }
    }

    pub(crate) fn is_room(&self) -> bool {
        !matches!(self.place, Standpoint::Outside { room: false, .. })
    }

    /// Unit vectors to the right, up and front of the scene.
    pub fn axes(&self) -> [Vec3; 3] {
        let front = if self.up == Vec3::Z {
            -Vec3::Y
        } else {
            Vec3::Z
        };
        [Vec3::X, self.up, front]
    }

    pub(super) fn least_extent(&self) -> f32 {
        (self.bounds.max - self.bounds.min).min_element()
    }

    /// The camera for an image of this aspect, given the scene's triangles.
    fn camera(&self, triangles: &[Triangle], aspect: f32) -> Camera {
        let (center, radius) = sphere_around(&self.bounds);
        let (eye, forward, fov) = match self.place {
            Standpoint::Inside { eye, forward } => (eye, 0.5 * forward, INSIDE_FOV),
            Standpoint::Outside { towards_eye, .. } => {
                let local = |v: Vec3| to_unit(v, center, radius);
                let vertices = triangles.iter().flat_map(|t| t.vertices).map(local);
                let (eye, distance) = fit(vertices, towards_eye, self.up, aspect);
                (eye, -distance * towards_eye, OUTSIDE_FOV)
            }
        };
        Camera {
            eye: center + radius * eye,
            target: center + radius * (eye + forward),
            up: self.up,
            vertical_fov_degrees: fov,
        }
    }
}

/// Smaller scenes are seen from as far as those of this size: squares of areas still are numbers there.
const SMALLEST: f32 = 1e-10;

/// Centre and radius of a sphere around the box; never of radius zero, even for a point.
fn sphere_around(bounds: &Bounds) -> (Vec3, f32) {
    let center = bounds.center();
    let least = 1e-3 * center.abs().max_element();
    (center, bounds.radius().max(least).max(SMALLEST))
}

fn to_unit(v: Vec3, center: Vec3, radius: f32) -> Vec3 {
    ((v.as_dvec3() - center.as_dvec3()) / f64::from(radius)).as_vec3()
}

/// Direction from the front (or back), the right (or left) and above.
fn three_quarter(up: Vec3, right: f32, front: f32) -> Vec3 {
    let [x, above, z] = [0.55 * right, 0.4, 0.75 * front];
    let direction = if up == Vec3::Z {
        Vec3::new(x, -z, above)
    } else {
        Vec3::new(x, above, z)
    };
    direction.normalize()
}

/// The closest eye towards `towards_eye` that sees all vertices, and its distance.
///
/// With a, b, c the coordinates of a vertex to the right, up and ahead, the eye must satisfy
/// |a − aₑ| ≤ k (c − cₑ), and the same for b: four planes that touch the vertices.
fn fit(
    vertices: impl Iterator<Item = Vec3>,
    towards_eye: Vec3,
    up: Vec3,
    aspect: f32,
) -> (Vec3, f32) {
    let [forward, right, up] = basis(-towards_eye, up);
    let tangent = FILL * (0.5 * OUTSIDE_FOV.to_radians()).tan();
    let slopes = [tangent * aspect, tangent];
    let [mut low, mut high] = [[f32::NEG_INFINITY; 2]; 2];
    for v in vertices {
        for (i, axis) in [right, up].into_iter().enumerate() {
            let (along, ahead) = (v.dot(axis), slopes[i] * v.dot(forward));
            high[i] = high[i].max(along - ahead);
            low[i] = low[i].max(-along - ahead);
        }
    }
    let aside = [0, 1].map(|i| 0.5 * (high[i] - low[i]));
    let ahead = [0, 1].map(|i| -0.5 * (high[i] + low[i]) / slopes[i]);
    // Keep a small distance, for points and flat scenes.
    let ahead = ahead[0].min(ahead[1]).min(-0.05);
    (aside[0] * right + aside[1] * up + ahead * forward, -ahead)
}

/// Forward, right and up vectors of an image.
fn basis(forward: Vec3, up: Vec3) -> [Vec3; 3] {
    let right = forward.cross(up).normalize_or(Vec3::X);
    [forward, right, right.cross(forward)]
}

struct UnitScene {
    bounds: Bounds,
    up: Vec3,
    solid: Vec<obvhs::triangle::Triangle>,
    bvh: Bvh2,
}

#[derive(Clone, Copy, PartialEq)]
enum Seen {
    Nothing,
    Back,
    Front(f32),
}

impl UnitScene {
    fn new(triangles: &[Triangle], bounds: &Bounds) -> Self {
        let (center, radius) = sphere_around(bounds);
        let local = |v: Vec3| to_unit(v, center, radius);
        let to_local = |t: &Triangle| {
            let [v0, v1, v2] = t.vertices.map(|v| local(v).into());
            obvhs::triangle::Triangle { v0, v1, v2 }
        };
        let solid: Vec<_> = if triangles.len() <= MOST_TRIANGLES {
            triangles.iter().map(to_local).collect()
        } else {
            let area = |t: &&Triangle| {
                let [v0, v1, v2] = t.vertices.map(local);
                (v1 - v0).cross(v2 - v0).length()
            };
            // Estimate the area threshold of the largest ones from a sample.
            let step = triangles.len() / MOST_TRIANGLES;
            let mut sample: Vec<_> = triangles.iter().step_by(step).map(|t| area(&t)).collect();
            let rank = MOST_TRIANGLES / step;
            let (_, &mut least, _) = sample.select_nth_unstable_by(rank, |a, b| b.total_cmp(a));
            let largest = triangles.iter().filter(|t| area(t) >= least);
            largest.take(MOST_TRIANGLES).map(to_local).collect()
        };
        let ids = (0..solid.len() as u32).collect();
        let bvh = PlocBuilder::new().build(
            PlocSearchDistance::Minimum,
            &solid,
            ids,
            SortPrecision::U64,
            0,
        );
        let bounds = Bounds {
            min: local(bounds.min),
            max: local(bounds.max),
        };
        Self {
            bounds,
            up: Vec3::Y,
            solid,
            bvh,
        }
    }

    /// Expected number of boxes that a random ray meets: the SAH cost of the boxes alone.
    fn boxes_per_ray(&self) -> f32 {
        let mut areas = self.bvh.nodes.iter().map(|node| node.aabb().half_area());
        let root = areas.next().unwrap_or(0.0);
        if root > 0.0 {
            areas.sum::<f32>() / root
        } else {
            f32::INFINITY
        }
    }

    /// Up vector and viewpoint.
    fn place(mut self, says_y: bool) -> (Vec3, Standpoint) {
        if !says_y && self.stands_on_z() {
            self.up = Vec3::Z;
        }
        let mut points = self.enclosed_points();
        if !says_y && self.up == Vec3::Y && points.as_ref().is_some_and(|p| self.is_open_to_z(p)) {
            self.up = Vec3::Z;
            points = self.enclosed_points().or(points);
        }
        let place = match points {
            Some(points) => self
                .open_side(&points)
                .unwrap_or_else(|| self.inside(&points)),
            None => Standpoint::Outside {
                towards_eye: self.side(),
                room: false,
            },
        };
        (self.up, place)
    }

    /// The direction to view an object from.
    fn side(&self) -> Vec3 {
        let flat = (self.bounds.max - self.bounds.min).cmplt(Vec3::splat(FLAT));
        // View a planar scene from the front.
        match (flat.x, flat.y, flat.z) {
            (false, false, true) => return Vec3::Z,
            (true, false, false) => return Vec3::X,
            _ => {}
        }
        // Avoid back faces if another side shows fronts.
        let sides = [(1.0, 1.0), (-1.0, 1.0), (1.0, -1.0), (-1.0, -1.0)];
        let sides = sides.map(|(right, front)| three_quarter(self.up, right, front));
        let backs = sides.map(|side| self.look(4.0 * side, -side, OUTSIDE_FOV).backs);
        let least = backs.into_iter().fold(1.0, f32::min);
        let chosen = backs.iter().position(|&share| share <= least + 0.2);
        sides[chosen.unwrap_or(0)]
    }

    /// Points inside rooms, if the scene is a room.
    fn enclosed_points(&self) -> Option<Vec<Vec3>> {
        const EDGE: usize = 7;
        const HEIGHTS: [f32; 3] = [0.25, 0.4, 0.55];
        let size = self.bounds.max - self.bounds.min;
        let needed = (ROOM * (EDGE * EDGE * HEIGHTS.len()) as f32) as usize;
        let mut points = Vec::new();
        let mut left = EDGE * EDGE * HEIGHTS.len();
        for height in HEIGHTS {
            for i in 0..EDGE * EDGE {
                let at = |k: usize| (k as f32 + 0.5) / EDGE as f32;
                let (u, v) = (at(i % EDGE), at(i / EDGE));
                let share = if self.up == Vec3::Z {
                    Vec3::new(u, v, height)
                } else {
                    Vec3::new(u, height, v)
                };
                let point = self.bounds.min + share * size;
                if self.is_enclosed(point) {
                    points.push(point);
                }
                left -= 1;
                if points.len() + left < needed {
                    return None;
                }
            }
        }
        Some(points)
    }

    fn is_enclosed(&self, point: Vec3) -> bool {
        const RAYS: usize = 96;
        const MOST_OTHERS: usize = ((1.0 - ENCLOSED) * RAYS as f32) as usize;
        let others = sphere(RAYS).filter(|&d| !matches!(self.cast(point, d), Seen::Front(_)));
        others.take(MOST_OTHERS + 1).count() <= MOST_OTHERS
    }

    /// Horizontal directions, including the four axes.
    fn horizontal(&self, count: usize) -> impl Iterator<Item = Vec3> {
        let z_up = self.up == Vec3::Z;
        (0..count).map(move |k| {
            let (sin, cos) = (std::f32::consts::TAU * k as f32 / count as f32).sin_cos();
            if z_up {
                Vec3::new(sin, cos, 0.0)
            } else {
                Vec3::new(sin, 0.0, -cos)
            }
        })
    }

    /// The view into a room with one side open, such as the Cornell box.
    fn open_side(&self, points: &[Vec3]) -> Option<Standpoint> {
        let open = self
            .horizontal(4)
            .find(|&d| self.openness(points, -d) > OPEN_SIDE)?;
        Some(Standpoint::Outside {
            towards_eye: -open,
            room: true,
        })
    }

    /// Fraction of the points from which this direction leaves the scene.
    fn openness(&self, points: &[Vec3], direction: Vec3) -> f32 {
        let out = points
            .iter()
            .filter(|&&p| self.cast(p, direction) == Seen::Nothing);
        out.count() as f32 / points.len().max(1) as f32
    }

    /// True if the z axis ends in an open roof. A missing wall is more open still.
    fn is_open_to_z(&self, points: &[Vec3]) -> bool {
        let roof = self.openness(points, Vec3::Z);
        (0.2..OPEN_SIDE).contains(&roof) && self.openness(points, Vec3::Y) < 0.02
    }

    /// The viewpoint near a wall or other backdrop that sees farthest.
    fn inside(&self, points: &[Vec3]) -> Standpoint {
        let mut best = f32::NEG_INFINITY;
        let mut place = Standpoint::Outside {
            towards_eye: three_quarter(self.up, 1.0, 1.0),
            room: true,
        };
        for &point in points {
            for forward in self.horizontal(8) {
                let Seen::Front(back) = self.cast(point, -forward) else {
                    continue;
                };
                let eye = point - 0.8 * back * forward;
                let depth = self.look(eye, forward, INSIDE_FOV).depth;
                if depth > best {
                    best = depth;
                    place = Standpoint::Inside { eye, forward };
                }
            }
        }
        place
    }

    /// Samples the view on a pixel grid of a 4:3 image.
    fn look(&self, eye: Vec3, forward: Vec3, fov: f32) -> Look {
        const EDGE: usize = 7;
        let [forward, right, up] = basis(forward, self.up);
        let tangent = (0.5 * fov.to_radians()).tan();
        let (mut backs, mut fronts, mut depth) = (0.0, 0.0, 0.0);
        for i in 0..EDGE * EDGE {
            let ndc = |k: usize| (2 * k + 1) as f32 / EDGE as f32 - 1.0;
            let (x, y) = (4.0 / 3.0 * ndc(i % EDGE), ndc(i / EDGE));
            let direction = forward + tangent * (x * right + y * up);
            // The centre of the image counts most.
            let weight = (-2.0 * (x * x + y * y)).exp();
            let distance: f32 = match self.cast(eye, direction.normalize()) {
                Seen::Front(t) => {
                    fronts += 1.0;
                    t.max(0.02)
                }
                Seen::Back => {
                    backs += 1.0;
                    0.01
                }
                Seen::Nothing => 0.1,
            };
            depth += weight * distance.ln();
        }
        Look {
            backs: backs / f32::max(backs + fronts, 1.0),
            depth,
        }
    }

    /// True if there is flat ground at the low end of z and hardly any at the low end of y.
    fn stands_on_z(&self) -> bool {
        let size = self.bounds.max - self.bounds.min;
        // Fraction of the box's bottom face covered by surfaces lying in it.
        let ground = |axis: usize| {
            let low = self.bounds.min[axis] + 0.02 * size[axis];
            let lies_low =
                |t: &&obvhs::triangle::Triangle| [t.v0, t.v1, t.v2].iter().all(|v| v[axis] <= low);
            let area = |t: &obvhs::triangle::Triangle| {
                0.5 * f64::from((t.v1 - t.v0).cross(t.v2 - t.v0)[axis].abs())
            };
            let covered: f64 = self.solid.iter().filter(lies_low).map(area).sum();
            let face = f64::from(size[(axis + 1) % 3]) * f64::from(size[(axis + 2) % 3]);
            covered / face.max(1e-12)
        };
        let (y, z) = (ground(1), ground(2));
        z > 0.1 && z > 3.0 * y && size.min_element() > FLAT
    }

    fn cast(&self, origin: Vec3, direction: Vec3) -> Seen {
        let ray = Ray::new(origin.into(), direction.into(), 1e-5, f32::INFINITY);
        let mut hit = RayHit::none();
        self.bvh.ray_traverse(ray, &mut hit, |ray, slot| {
            self.solid[self.bvh.primitive_indices[slot] as usize].intersect(ray)
        });
        if !hit.t.is_finite() {
            return Seen::Nothing;
        }
        let id = self.bvh.primitive_indices[hit.primitive_id as usize];
        let triangle = &self.solid[id as usize];
        let normal = (triangle.v1 - triangle.v0).cross(triangle.v2 - triangle.v0);
        if normal.dot(Vec3A::from(direction)) < 0.0 {
            Seen::Front(hit.t)
        } else {
            Seen::Back
        }
    }
}

struct Look {
    /// Fraction of hits on back faces.
    backs: f32,
    /// Sum of log distances: high if much is far away and nothing very near.
    depth: f32,
}

/// Evenly spread unit vectors: a Fibonacci lattice.
fn sphere(count: usize) -> impl Iterator<Item = Vec3> {
    const GOLDEN_ANGLE: f64 = 2.399_963_229_728_653;
    (0..count).map(move |k| {
        let z = 1.0 - (2 * k + 1) as f64 / count as f64;
        let (sin, cos) = (GOLDEN_ANGLE * k as f64).sin_cos();
        let r = (1.0 - z * z).sqrt();
        DVec3::new(r * cos, r * sin, z).as_vec3()
    })
}

#[cfg(test)]
mod tests;
