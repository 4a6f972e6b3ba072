//! Hard rays: rays that cameras, lights and surfaces hardly ever produce, and behind which faults
//! hide.
//!
//! Half of them are whole rays: through corners, edges and interiors of triangles, along edges and
//! in triangle planes, along axes with zeros of both signs and components near zero, along the
//! diagonals of the scene; from corners, triangle planes, box and cell planes, and far outside;
//! with direction lengths from 1e-10 to 1e10. The other half are parts of these: they end or begin
//! exactly at, just before or just behind the hit, are a point, or are empty. A few more see a triangle
//! nearly edge-on, just above and just below the limit at which it is no longer hit; and the last go to the triangles that lists
//! begin and end with.
//!
//! They depend only on the scene and a seed, and are never timed.

use crate::end_rays::{END_RAYS, end_rays};
use glam::Vec3;
use raystone_accel::triangle::edge_on_share;
use raystone_accel::{Counters, CpuTwin, NO_HIT, Ray, TriangleSoup};
use raystone_core::random::Pcg32;

/// Whole rays and parts of them.
const WHOLE_AND_PARTS: usize = 4100;
/// Rays in the planes of triangles, near the limit of what is edge-on.
const EDGE_ON: usize = 192;
/// Number of hard rays; not a multiple of a workgroup.
pub const HARD_RAYS: usize = WHOLE_AND_PARTS + EDGE_ON + END_RAYS;

/// Rays tried for each of these: one in sixty is near the limit, and of flat rectangles none.
const TRIES: usize = 1000;

/// Origins outside the scene are up to this many diagonals away, as far as grid margins allow.
const OUTSIDE: f32 = 15.0;

const LENGTHS: [f32; 8] = [1.0, 1e-4, 1e-7, 1e-10, 1e4, 1e7, 1e10, 0.3];

/// Replacements for direction components.
const NEXT_TO_ZERO: [f32; 8] = [0.0, -0.0, 1e-12, -1e-12, 1e-25, -1e-25, 1e-37, -1e-37];

/// The hard rays of a scene. Intervals end at hits found by `judge`.
pub fn hard_rays(soup: &TriangleSoup, reference: &dyn CpuTwin, seed: u64) -> Vec<Ray> {
    if soup.records.is_empty() {
        return Vec::new();
    }
    let mut maker = Maker::new(soup, seed);
    let mut rays: Vec<Ray> = (0..WHOLE_AND_PARTS / 2)
        .map(|kind| maker.whole(kind))
        .collect();
    let parts: Vec<Ray> = rays
        .iter()
        .enumerate()
        .map(|(turn, ray)| {
            let hit = reference.closest_hit(ray, &mut Counters::default());
            let t = (hit.triangle != NO_HIT).then_some(hit.t);
            part(ray, t.unwrap_or(maker.diagonal), turn)
        })
        .collect();
    rays.extend(parts);
    rays.extend((0..EDGE_ON).map(|turn| maker.edge_on(turn)));
    rays.extend(end_rays(soup));
    rays
}

/// Zero for a denormal number: WGSL lets an adapter flush them, so a ray with one has no single right answer.
fn flushed(x: f32) -> f32 {
    if x.is_subnormal() { 0.0 } else { x }
}

/// The next number above `t` that is not denormal.
fn next_above(t: f32) -> f32 {
    let next = t.next_up();
    if next.is_subnormal() {
        f32::MIN_POSITIVE
    } else {
        next
    }
}

/// A part of a whole ray, around the distance `t` of its hit.
fn part(ray: &Ray, t: f32, turn: usize) -> Ray {
    let t = flushed(t);
    let (above, below) = (next_above(t), -next_above(-t));
    let [t_min, t_max] = match turn % 16 {
        0..=2 => [0.0, t],
        3 | 4 => [0.0, below],
        5 => [0.0, above],
        6 | 7 => [t, Ray::FAR],
        8 | 9 => [above, Ray::FAR],
        10 => [below, Ray::FAR],
        11 => [t, t],
        12 => [t, below],
        13 => [0.0, 0.0],
        14 => [0.5 * t, 1e37],
        _ => [-0.0, 2.0 * t],
    };
    ray.between(t_min, t_max)
}

struct Maker<'a> {
    soup: &'a TriangleSoup,
    random: Pcg32,
    low: Vec3,
    high: Vec3,
    diagonal: f32,
}

impl<'a> Maker<'a> {
    fn new(soup: &'a TriangleSoup, seed: u64) -> Self {
        let bounds = soup.bounds();
        let [low, high] = [bounds.min, bounds.max].map(Vec3::from);
        Self {
            soup,
            random: Pcg32::with_stream(seed, 0x4841_5244),
            low,
            high,
            diagonal: (high - low).length().max(f32::MIN_POSITIVE),
        }
    }

    /// A ray from zero to far away; `kind` selects the construction.
    fn whole(&mut self, kind: usize) -> Ray {
        let (origin, direction) = match kind % 8 {
            0 => self.along_an_axis(),
            1 => self.in_a_plane(),
            2 => self.along_a_diagonal(),
            3 => {
                let (origin, direction) = self.towards_a_triangle();
                (origin, self.with_components_next_to_zero(direction))
            }
            4 => {
                let (origin, direction) = self.towards_a_triangle();
                let length = self.random.one_of(&LENGTHS);
                (origin, direction.normalize_or(Vec3::X) * length)
            }
            5 => {
                let origin = self.origin();
                (origin, self.any_direction())
            }
            _ => self.towards_a_triangle(),
        };
        let [origin, direction] = [origin, direction].map(|v| v.map(flushed));
        let usable = direction.is_finite() && direction.abs().max_element() > 1e-16;
        Ray::new(origin, if usable { direction } else { Vec3::Y })
    }

    fn unit(&mut self) -> f32 {
        self.random.uniform() as f32
    }

    fn triangle(&mut self) -> [Vec3; 3] {
        let at = self.random.below(self.soup.records.len());
        let mut corners = self.soup.records[at].triangle().vertices;
        corners.rotate_left(self.random.below(3));
        corners
    }

    /// A corner, an edge point, the centroid, or an interior point of a random triangle.
    fn point_of_a_triangle(&mut self) -> Vec3 {
        let [a, b, c] = self.triangle();
        match self.random.below(5) {
            0 | 1 => a,
            2 => 0.5 * (a + b),
            3 => a + self.unit() * (b - a),
            _ => (a + b + c) / 3.0,
        }
    }

    fn inside(&mut self) -> Vec3 {
        let at = Vec3::new(self.unit(), self.unit(), self.unit());
        self.low + at * (self.high - self.low)
    }

    fn any_direction(&mut self) -> Vec3 {
        let coordinate = |x: f32| 2.0 * x - 1.0;
        let direction = Vec3::new(self.unit(), self.unit(), self.unit()).map(coordinate);
        direction.normalize_or(Vec3::X)
    }

    /// An origin inside, outside, on a triangle, or on a plane: of the scene's box, of its halves,
    /// quarters, …, or of a triangle's box.
    fn origin(&mut self) -> Vec3 {
        let mut origin = match self.random.below(6) {
            0 | 1 => self.inside(),
            2 => {
                let away = self.unit() * OUTSIDE * self.diagonal;
                0.5 * (self.low + self.high) + away * self.any_direction()
            }
            3 => self.point_of_a_triangle(),
            4 => {
                let cells = f32::from(1u8 << self.random.below(7));
                let steps = self.inside() - self.low;
                let size = (self.high - self.low) / cells;
                let step = |x: f32, size: f32| if size > 0.0 { (x / size).round() } else { 0.0 };
                let [x, y, z] = [0, 1, 2].map(|a| step(steps[a], size[a]));
                self.low + Vec3::new(x, y, z) * size
            }
            _ => {
                let at = Vec3::new(self.unit(), self.unit(), self.unit());
                Vec3::select(at.cmplt(Vec3::splat(0.5)), self.low, self.high)
            }
        };
        if self.random.below(3) == 0 {
            let axis = self.random.below(3);
            origin[axis] = self.triangle()[0][axis];
        }
        origin
    }

    fn towards_a_triangle(&mut self) -> (Vec3, Vec3) {
        let (origin, target) = (self.origin(), self.point_of_a_triangle());
        (origin, target - origin)
    }

    /// Along an axis, through a point of a triangle or from anywhere; the other components are
    /// zeros of either sign or close to zero.
    fn along_an_axis(&mut self) -> (Vec3, Vec3) {
        let axis = self.random.below(3);
        let mut origin = match self.random.below(3) {
            0 => self.origin(),
            _ => self.point_of_a_triangle(),
        };
        let mut direction = Vec3::ZERO;
        for other in 0..3 {
            direction[other] =
                NEXT_TO_ZERO[self.random.below(4) * self.random.below(2) + self.random.below(2)];
        }
        let sign = if self.random.below(2) == 0 { 1.0 } else { -1.0 };
        direction[axis] = sign * self.random.one_of(&LENGTHS);
        origin[axis] -= sign * self.unit() * 2.0 * (self.high - self.low)[axis];
        (origin, direction)
    }

    /// In the plane of a triangle, to f32 precision: along an edge, through a corner, or beside it.
    fn in_a_plane(&mut self) -> (Vec3, Vec3) {
        let [a, b, c] = self.triangle();
        let (e, f) = (b - a, c - a);
        let [s, t] = [self.unit(), self.unit()].map(|x| 6.0 * x - 3.0);
        match self.random.below(4) {
            0 => (a, e),
            1 => (a - s.abs() * e, e),
            2 => (a + s * e + t * f, -(s * e + t * f)),
            _ => (a + s * e + t * f, self.unit() * e - self.unit() * f),
        }
    }

    /// In the plane of a triangle and towards it, which it sees at half to twice the limit of what is edge-on, or anyhow
    /// if no try does. Every other one ends soon behind the triangle and begins before it.
    fn edge_on(&mut self, turn: usize) -> Ray {
        let tests = self.soup.intersection;
        let (mut ray, mut reach) = (Ray::new(Vec3::ZERO, Vec3::Y), 1.0);
        for _ in 0..TRIES {
            let record = self.soup.records[self.random.below(self.soup.records.len())];
            let mut corners = record.triangle().vertices;
            corners.rotate_left(self.random.below(3));
            let [a, b, c] = corners;
            let (e, f) = (b - a, c - a);
            // Few edges away, and towards a point at whole parts of them: of small triangles rounding leaves such rays in the plane.
            let mut below = |n: usize| self.random.below(n) as f32;
            let [s, t] = [below(7) - 3.0, below(7) - 3.0];
            let parts = 3.0 + below(4);
            let along = 1.0 + below(parts as usize - 2);
            let beside = 1.0 + below((parts - along) as usize);
            let origin = (a + s * e + t * f).map(flushed);
            let direction = (along - parts * s) * e + (beside - parts * t) * f;
            let direction = direction.map(flushed);
            if !direction.is_finite() || direction.abs().max_element() <= 1e-16 {
                continue;
            }
            (ray, reach) = (Ray::new(origin, direction), 1.0 / parts);
            let raised = tests.raised(&ray);
            let share = edge_on_share(&record, &raised, &tests.inverse(raised.direction));
            if share.is_some_and(|share| (0.5..2.0).contains(&share)) {
                break;
            }
        }
        match turn % 2 {
            0 => ray,
            _ => ray.between(0.5 * reach, 1.5 * reach),
        }
    }

    /// Along a diagonal of the scene or of one of its faces, either way: passes many boxes.
    fn along_a_diagonal(&mut self) -> (Vec3, Vec3) {
        let pick = [(); 3].map(|()| self.random.below(2) == 0);
        let [mut from, mut to] = [self.low, self.high];
        for (axis, swap) in pick.into_iter().enumerate() {
            if swap {
                (from[axis], to[axis]) = (to[axis], from[axis]);
            }
        }
        let jitter = 1e-3 * self.random.below(4) as f32 * self.diagonal;
        let beside = jitter * self.any_direction();
        let mut direction = to - from;
        if self.random.below(4) == 0 {
            let axis = self.random.below(3);
            direction[axis] = 0.0;
        }
        (from + beside - self.unit() * direction, direction)
    }

    fn with_components_next_to_zero(&mut self, mut direction: Vec3) -> Vec3 {
        let longest = direction.abs().max_element();
        for axis in 0..3 {
            if direction[axis].abs() < longest && self.random.below(2) == 0 {
                direction[axis] = self.random.one_of(&NEXT_TO_ZERO);
            }
        }
        direction
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_accel::{AccelRegistry, BuildLog};
    use raystone_core::params::{Params, Variant};
    use raystone_scene::{LoadOptions, load};

    fn of_scene(name: &str) -> (TriangleSoup, Vec<Ray>) {
        let variant = Variant {
            name: name.to_owned(),
            params: Params::default(),
            label: String::new(),
        };
        let scene = load(&variant, &LoadOptions::default()).expect("a built-in scene");
        let soup = TriangleSoup::new(&scene);
        let registry = AccelRegistry::default();
        let kind = registry.get("bvh").expect("a structure");
        let built = kind.build(&soup, &Params::default(), &mut BuildLog::default());
        let built = built.unwrap_or_else(|e| panic!("{e}"));
        let rays = {
            let twin = built.cpu_twin(&soup).expect("a twin");
            hard_rays(&soup, &*twin, 1)
        };
        (soup, rays)
    }

    /// A limit of half or twice the size gives other hits.
    #[test]
    fn rays_see_triangles_on_both_sides_of_the_limit_of_what_is_edge_on() {
        let (soup, rays) = of_scene("displaced-sphere");
        let near = |ray: &Ray, shares: std::ops::Range<f32>| {
            let inverse = soup.intersection.inverse(ray.direction);
            let share = |record| edge_on_share(record, ray, &inverse);
            let mut shares_of = soup.records.iter().filter_map(share);
            shares_of.any(|share| shares.contains(&share))
        };
        let rays: Vec<Ray> = rays[WHOLE_AND_PARTS..][..EDGE_ON]
            .iter()
            .map(|ray| soup.intersection.raised(ray))
            .collect();
        let count = |shares: std::ops::Range<f32>| {
            rays.iter().filter(|ray| near(ray, shares.clone())).count()
        };
        let (below, above) = (count(0.5..1.0), count(1.0..2.0));
        assert!(
            below >= 40 && above >= 40,
            "{below} below and {above} above the limit of {EDGE_ON}"
        );
    }

    #[test]
    fn no_hard_ray_holds_a_denormal_number_and_some_end_beside_zero() {
        let (_, rays) = of_scene("cornell-box");
        assert_eq!(rays.len(), HARD_RAYS);
        let ends = |ray: &Ray| [ray.t_min, ray.t_max];
        for ray in &rays {
            let numbers = [ray.origin, ray.direction].into_iter().flatten();
            let denormal = numbers.chain(ends(ray)).any(f32::is_subnormal);
            assert!(!denormal, "{ray}");
        }
        let beside = rays.iter().flat_map(ends);
        let beside = beside.filter(|t| t.abs() == f32::MIN_POSITIVE).count();
        assert!(beside > 100, "{beside} ends beside zero");
    }
}
