//! Small scenes and rays that are hard for traversals: ties, faces shared by boxes, origins on
//! planes, axis directions with zeros of both signs, segments that end exactly at a hit.

use super::Pcg;
use glam::Vec3;
use raystone::accel::bounds::Bounds;
use raystone::accel::triangle::TriangleRecord;
use raystone::accel::{NO_HIT, Ray, TriangleSoup};
use raystone::geometry::Triangle;

/// `t_max` of a ray without an end.
pub const FAR: f32 = 1.0e30;

/// A scene, named by its difficulty.
pub struct Case {
    pub name: &'static str,
    pub soup: TriangleSoup,
}

pub fn soup(triangles: impl IntoIterator<Item = [Vec3; 3]>) -> TriangleSoup {
    let record = |(id, vertices)| TriangleRecord::new(&Triangle { vertices }, id as u32, 0);
    let records: Vec<_> = triangles.into_iter().enumerate().map(record).collect();
    records.into()
}

fn lattice_point(rng: &mut Pcg, extent: i32) -> Vec3 {
    let mut coordinate = || rng.between(0, extent) as f32;
    Vec3::new(coordinate(), coordinate(), coordinate())
}

/// Triangles whose corners are points of the integer lattice 0..=extent; some repeat, some have no
/// area, many lie in a common plane.
pub fn lattice_soup(rng: &mut Pcg, count: usize, extent: i32) -> TriangleSoup {
    let mut triangles: Vec<[Vec3; 3]> = Vec::with_capacity(count);
    for _ in 0..count {
        let copied = !triangles.is_empty() && rng.below(8) == 0;
        let mut corners = [0; 3].map(|_| lattice_point(rng, extent));
        if copied {
            corners = triangles[rng.below(triangles.len() as u32) as usize];
            corners.rotate_left(rng.below(3) as usize);
        } else if rng.below(2) == 0 {
            // Into a plane of the lattice.
            let axis = rng.below(3) as usize;
            let height = rng.between(0, extent) as f32;
            corners.iter_mut().for_each(|c| c[axis] = height);
        }
        triangles.push(corners);
    }
    soup(triangles)
}

/// Rays from integer and half-integer points along axes (zeros of both signs) or small integer
/// directions; some end or start at an integer distance.
pub fn lattice_rays(rng: &mut Pcg, count: usize, extent: i32) -> Vec<Ray> {
    let ray = |_| {
        let origin = [0; 3].map(|_| rng.between(-3, 2 * extent + 3) as f32 * 0.5);
        let mut direction = [0; 3].map(|_| if rng.below(2) == 0 { 0.0 } else { -0.0_f32 });
        if rng.below(2) == 0 {
            direction[rng.below(3) as usize] = [1.0, -1.0, 2.0, -0.5][rng.below(4) as usize];
        } else {
            for d in &mut direction {
                let step = rng.between(-3, 3) as f32;
                *d = if step == 0.0 { *d } else { step };
            }
        }
        let [t_min, t_max] = match rng.below(4) {
            0 => [0.0, rng.between(0, extent) as f32],
            1 => [rng.between(0, extent) as f32 * 0.5, FAR],
            _ => [0.0, FAR],
        };
        Ray {
            origin,
            t_min,
            direction,
            t_max,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

fn random_triangle(rng: &mut Pcg, centre: Vec3, size: f32) -> [Vec3; 3] {
    [0; 3].map(|_| centre + size * Vec3::new(rng.signed(), rng.signed(), rng.signed()))
}

/// Scenes at the limits of builders.
pub fn degenerate_cases() -> Vec<Case> {
    let mut rng = Pcg::new(17);
    let one = [
        Vec3::ZERO,
        Vec3::new(1.0, 0.0, 0.0),
        Vec3::new(0.0, 1.0, 0.0),
    ];
    let case = |name, triangles: Vec<[Vec3; 3]>| Case {
        name,
        soup: soup(triangles),
    };
    let about = |rng: &mut Pcg, size: f32| {
        let [a, b, _] = random_triangle(rng, Vec3::ZERO, size);
        [a, b, -(a + b)]
    };
    let grid_plane = |i: usize| {
        let corner = Vec3::new((i % 16) as f32, (i / 16 % 16) as f32, 2.0);
        [corner, corner + Vec3::X, corner + Vec3::Y]
    };
    let needle = |rng: &mut Pcg| {
        let [a, b, _] = random_triangle(rng, Vec3::ZERO, 10.0);
        [
            a,
            b,
            b + 1e-4 * Vec3::new(rng.signed(), rng.signed(), rng.signed()),
        ]
    };
    let lined_up = |i: usize| {
        let x = i as f32;
        [
            Vec3::new(x, 0.0, 0.0),
            Vec3::new(x + 1.0, 1.0, 1.0),
            Vec3::new(x + 2.0, 2.0, 2.0),
        ]
    };
    vec![
        case("empty", vec![]),
        case("one triangle", vec![one]),
        case("two triangles", vec![one, one.map(|v| v + Vec3::Z)]),
        case("all triangles equal", vec![one; 200]),
        case("all centroids equal", {
            (1..200).map(|i| about(&mut rng, i as f32 * 0.05)).collect()
        }),
        case("one plane", (0..256).map(grid_plane).collect()),
        case(
            "two coincident planes",
            (0..512).map(|i| grid_plane(i % 256)).collect(),
        ),
        case("needles", (0..200).map(|_| needle(&mut rng)).collect()),
        case("no area", (0..100).map(lined_up).collect()),
        case("points", vec![[Vec3::splat(3.0); 3]; 50]),
        case("huge next to tiny", {
            let tiny = (0..100).map(|_| random_triangle(&mut rng, Vec3::ONE, 1e-2));
            let mut all: Vec<_> = tiny.collect();
            all.push([
                Vec3::new(-1e5, -1e5, 0.0),
                Vec3::new(1e5, -1e5, 0.0),
                Vec3::new(0.0, 1e5, 0.0),
            ]);
            all
        }),
        case("far from the origin", {
            let centre = Vec3::new(1e4, -2e4, 3e4);
            (0..150)
                .map(|_| random_triangle(&mut rng, centre, 4.0))
                .collect()
        }),
        case("a sphere of crumbs", {
            (0..300)
                .map(|_| {
                    let d = Vec3::new(rng.signed(), rng.signed(), rng.signed()).normalize();
                    random_triangle(&mut rng, 5.0 * d, 0.4)
                })
                .collect()
        }),
    ]
}

/// Corners of triangle `id`.
fn corners(soup: &TriangleSoup, id: usize) -> [Vec3; 3] {
    soup.records[id].vertices().map(Vec3::from)
}

/// The scene's box, or the unit box where there is nothing.
pub fn box_of(soup: &TriangleSoup) -> Bounds {
    if soup.records.is_empty() {
        let [min, max] = [[0.0; 3], [1.0; 3]];
        return Bounds { min, max };
    }
    soup.bounds()
}

fn point_in(rng: &mut Pcg, bounds: &Bounds, reach: f32) -> Vec3 {
    let [low, high] = [Vec3::from(bounds.min), Vec3::from(bounds.max)];
    let size = (high - low).max(Vec3::splat(1e-3 * (high - low).max_element() + 1e-3));
    let unit = Vec3::new(rng.signed(), rng.signed(), rng.signed());
    0.5 * (low + high) + 0.5 * reach * size * unit
}

fn towards(origin: Vec3, target: Vec3, t_max: f32) -> Ray {
    Ray {
        origin: origin.to_array(),
        t_min: 0.0,
        direction: (target - origin).to_array(),
        t_max,
    }
}

/// Rays aimed at corners, edges and insides of triangles, from outside, inside, and from the
/// triangles themselves; along axes through corners; between random points; and segments of length
/// exactly 1 that end on a triangle.
pub fn aimed_rays(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> Vec<Ray> {
    let bounds = box_of(soup);
    let target = |rng: &mut Pcg| {
        if soup.records.is_empty() {
            return point_in(rng, &bounds, 1.0);
        }
        let [a, b, c] = corners(soup, rng.below(soup.records.len() as u32) as usize);
        match rng.below(4) {
            0 => a,
            1 => 0.5 * (a + b),
            2 => 0.5 * (b + c),
            _ => {
                let (u, v) = (rng.unit(), rng.unit());
                a + 0.5 * u * (b - a) + 0.5 * v * (c - a)
            }
        }
    };
    let ray = |i: usize| {
        let at = target(rng);
        match i % 6 {
            0 => towards(point_in(rng, &bounds, 3.0), at, FAR),
            1 => towards(point_in(rng, &bounds, 1.0), at, 1.0),
            2 => towards(target(rng), at, FAR),
            3 => {
                let axis = rng.below(3) as usize;
                let mut origin = at;
                origin[axis] = [bounds.min, bounds.max][rng.below(2) as usize][axis];
                let mut direction = [0.0, -0.0, 0.0];
                direction[axis] = if rng.below(2) == 0 { 1.0 } else { -1.0 };
                Ray {
                    origin: origin.to_array(),
                    t_min: 0.0,
                    direction,
                    t_max: FAR,
                }
            }
            4 => towards(
                point_in(rng, &bounds, 1.0),
                point_in(rng, &bounds, 1.0),
                FAR,
            ),
            _ => towards(at, point_in(rng, &bounds, 2.0), FAR),
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

/// Rays that run in the planes, edges and corners of regular subdivisions of the scene's box, with
/// and without the small margin that grids add to it.
pub fn lattice_plane_rays(rng: &mut Pcg, soup: &TriangleSoup, count: usize) -> Vec<Ray> {
    let tight = box_of(soup);
    let extent = tight.extent();
    let diagonal = extent.iter().map(|e| e * e).sum::<f32>().sqrt();
    let margin = |axis: usize| {
        let far = tight.min[axis].abs().max(tight.max[axis].abs());
        (diagonal * 2.0_f32.powi(-18) + far * 2.0_f32.powi(-22)).max(1e-18)
    };
    let ray = |i: usize| {
        let pad = |axis: usize| {
            if i.is_multiple_of(2) {
                margin(axis)
            } else {
                0.0
            }
        };
        let divisions = 1 + rng.below(8);
        let origin = std::array::from_fn(|axis| {
            let [low, high] = [tight.min[axis] - pad(axis), tight.max[axis] + pad(axis)];
            let cell = (high - low) / divisions as f32;
            low + rng.below(divisions + 1) as f32 * cell
        });
        let mut direction = [0; 3].map(|_| if rng.below(2) == 0 { 0.0 } else { -0.0_f32 });
        let axes = 1 + rng.below(3) as usize;
        for _ in 0..axes {
            let axis = rng.below(3) as usize;
            // Along the diagonals of the cells as well as along their edges.
            direction[axis] = (extent[axis] + 2.0 * pad(axis)).max(1e-3)
                * if rng.below(2) == 0 { 1.0 } else { -1.0 };
        }
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: FAR,
        }
    };
    (0..).map(ray).filter(Ray::is_ray).take(count).collect()
}

/// Each ray that hits three times more: ending exactly at its hit (which counts), just before it,
/// and starting exactly at it.
pub fn cut_at_hits(rays: &[Ray], hits: &[raystone::accel::Hit]) -> Vec<Ray> {
    let mut out = Vec::new();
    for (ray, hit) in rays.iter().zip(hits) {
        if hit.triangle != NO_HIT && hit.t > 0.0 {
            out.push(Ray {
                t_max: hit.t,
                ..*ray
            });
            out.push(Ray {
                t_max: hit.t.next_down(),
                ..*ray
            });
            out.push(Ray {
                t_min: hit.t,
                ..*ray
            });
        }
    }
    out
}
