//! The Utah teapot (Martin Newell, 1975): bicubic Bézier patches, tessellated.
//!
//! Of Newell's 32 patches, 28 are revolution-like (rim, body, lid, bottom: a profile swept around
//! four quarters), the others mirrored halves of handle and spout; the tables store exactly that.
//! Newell's coordinates have z up; the bottom was added later (Blinn).

use glam::{DVec2, DVec3, Vec3};

/// Control points (radius, height) of rim, upper body, lower body, knob, lid, bottom.
const PROFILES: [[[f64; 2]; 4]; 6] = [
    [[1.4, 2.4], [1.3375, 2.53125], [1.4375, 2.53125], [1.5, 2.4]],
    [[1.5, 2.4], [1.75, 1.875], [2.0, 1.35], [2.0, 0.9]],
    [[2.0, 0.9], [2.0, 0.45], [1.5, 0.225], [1.5, 0.15]],
    [[0.0, 3.15], [0.8, 3.15], [0.0, 2.85], [0.2, 2.7]],
    [[0.2, 2.7], [0.4, 2.55], [1.3, 2.55], [1.3, 2.4]],
    [[1.5, 0.15], [1.5, 0.075], [1.425, 0.0], [0.0, 0.0]],
];

/// Control points of Newell's quarter circle of radius 1.
const QUARTER: [[f64; 2]; 4] = [[1.0, 0.0], [1.0, 0.56], [0.56, 1.0], [0.0, 1.0]];

/// One row of half a handle or spout patch: points (x, z) of the inner and outer curves in the
/// plane of symmetry, and the half width.
type HalfRow = ([f64; 2], [f64; 2], f64);

/// The two half patches of the handle, then of the spout.
const HALVES: [[HalfRow; 4]; 4] = [
    [
        ([-1.6, 2.025], [-1.5, 2.25], 0.3),
        ([-2.3, 2.025], [-2.5, 2.25], 0.3),
        ([-2.7, 2.025], [-3.0, 2.25], 0.3),
        ([-2.7, 1.8], [-3.0, 1.8], 0.3),
    ],
    [
        ([-2.7, 1.8], [-3.0, 1.8], 0.3),
        ([-2.7, 1.575], [-3.0, 1.35], 0.3),
        ([-2.5, 1.125], [-2.65, 0.9375], 0.3),
        ([-2.0, 0.9], [-1.9, 0.6], 0.3),
    ],
    [
        ([1.7, 1.425], [1.7, 0.6], 0.66),
        ([2.6, 1.425], [3.1, 0.825], 0.66),
        ([2.3, 2.1], [2.4, 2.025], 0.25),
        ([2.7, 2.4], [3.3, 2.4], 0.25),
    ],
    [
        ([2.7, 2.4], [3.3, 2.4], 0.25),
        ([2.8, 2.475], [3.525, 2.49375], 0.25),
        ([2.9, 2.475], [3.45, 2.5125], 0.15),
        ([2.8, 2.4], [3.2, 2.4], 0.15),
    ],
];

type Patch = [[DVec3; 4]; 4];

/// The teapot's triangles, y up, standing on y = 0, about 6.4 units long: `subdivision` squared
/// quadrilaterals per patch, single triangles at poles. Below 2, handle and spout are flat.
pub(super) fn tessellate(subdivision: usize) -> Vec<[Vec3; 3]> {
    let n = subdivision.max(1);
    let mut triangles = Vec::new();
    for patch in patches() {
        let grid: Vec<Vec3> = (0..=n)
            .flat_map(|i| (0..=n).map(move |j| (i, j)))
            .map(|(i, j)| evaluate(&patch, i as f64 / n as f64, j as f64 / n as f64))
            .collect();
        for (i, j) in (0..n).flat_map(|i| (0..n).map(move |j| (i, j))) {
            let at = |i: usize, j: usize| grid[i * (n + 1) + j];
            let [a, b, c, d] = [at(i, j), at(i, j + 1), at(i + 1, j + 1), at(i + 1, j)];
            let both = [[a, b, c], [a, c, d]];
            triangles.extend(
                both.into_iter()
                    .filter(|[a, b, c]| a != b && b != c && c != a),
            );
        }
    }
    triangles
}

/// All 32 patches; the first index runs down or along, the second around.
fn patches() -> Vec<Patch> {
    let mut patches = Vec::new();
    for profile in PROFILES {
        for quarter in 0..4 {
            patches.push(profile.map(|[radius, height]| {
                QUARTER.map(|[x, z]| {
                    let mut ring = DVec2::new(radius * x, radius * z);
                    for _ in 0..quarter {
                        ring = DVec2::new(-ring.y, ring.x);
                    }
                    DVec3::new(ring.x, height, ring.y)
                })
            }));
        }
    }
    for half in HALVES {
        for side in [1.0, -1.0] {
            patches.push(half.map(|([x0, y0], [x1, y1], width)| {
                let z = side * width;
                [
                    DVec3::new(x0, y0, 0.0),
                    DVec3::new(x0, y0, z),
                    DVec3::new(x1, y1, z),
                    DVec3::new(x1, y1, 0.0),
                ]
            }));
        }
    }
    patches
}

fn evaluate(patch: &Patch, u: f64, v: f64) -> Vec3 {
    de_casteljau(patch.map(|row| de_casteljau(row, v)), u).as_vec3()
}

/// In f64, so that patches meet in equal f32 points, and equal control points are preserved.
fn de_casteljau([a, b, c, d]: [DVec3; 4], t: f64) -> DVec3 {
    let [ab, bc, cd] = [a.lerp(b, t), b.lerp(c, t), c.lerp(d, t)];
    ab.lerp(bc, t).lerp(bc.lerp(cd, t), t)
}
