//! A Cornell box without blocks against radiosity in f64: form factors from patch centres to whole
//! patches are exact (Lambert's formula), and there is no occlusion. One Jacobi step is one bounce,
//! so that paths and radiosity end after the same number of them.

use super::{replicates, scene_of};
use crate::support::Estimate;
use glam::{DVec3, Vec3};
use raystone::geometry::Camera;
use raystone::measure::known_images::closed::polygon;
use raystone::scene::Material;
use std::f64::consts::PI;

/// Patches along an edge of a wall. The lamp consists of whole ones.
const EDGE: usize = 20;
const BOUNCES: usize = 6;
const EMISSION: [f64; 3] = [18.4, 15.6, 8.0];
const ALBEDOS: [[f64; 3]; 4] = [
    [0.725, 0.71, 0.68],
    [0.63, 0.065, 0.05],
    [0.14, 0.45, 0.091],
    [0.78, 0.78, 0.78],
];
const LAMP: usize = 3;
/// Tolerance beyond five standard errors, due to the patches.
const TOLERANCE: f64 = 0.003;

/// A wall of the unit cube that is open at z = 0: corner and edges, cross product inwards.
struct Wall {
    corner: DVec3,
    edges: [DVec3; 2],
    material: usize,
}

impl Wall {
    fn normal(&self) -> DVec3 {
        self.edges[0].cross(self.edges[1]).normalize()
    }

    fn at(&self, s: f64, t: f64) -> DVec3 {
        self.corner + s * self.edges[0] + t * self.edges[1]
    }

    fn quad(&self, [s0, s1]: [f64; 2], [t0, t1]: [f64; 2]) -> [DVec3; 4] {
        [
            self.at(s0, t0),
            self.at(s1, t0),
            self.at(s1, t1),
            self.at(s0, t1),
        ]
    }
}

/// Floor, back, left, right, ceiling.
fn walls() -> [Wall; 5] {
    let (x, y, z) = (DVec3::X, DVec3::Y, DVec3::Z);
    let wall = |corner, edges, material| Wall {
        corner,
        edges,
        material,
    };
    [
        wall(DVec3::ZERO, [z, x], 0),
        wall(z, [y, x], 0),
        wall(DVec3::ZERO, [y, z], 1),
        wall(x, [z, y], 2),
        wall(y, [x, z], 0),
    ]
}

/// The lamp on the ceiling, in patches: from 7 to 13 in both directions.
const LIT: [usize; 2] = [7, 13];

struct Patch {
    centre: DVec3,
    normal: DVec3,
    corners: [DVec3; 4],
    wall: usize,
    material: usize,
}

fn patches() -> Vec<Patch> {
    let mut patches = Vec::new();
    for (index, wall) in walls().iter().enumerate() {
        for (i, k) in (0..EDGE).flat_map(|i| (0..EDGE).map(move |k| (i, k))) {
            let range = |i: usize| [i, i + 1].map(|v| v as f64 / EDGE as f64);
            let middle = |i: usize| (i as f64 + 0.5) / EDGE as f64;
            let is_lit = |i: usize| (LIT[0]..LIT[1]).contains(&i);
            let lamp = index == 4 && is_lit(i) && is_lit(k);
            patches.push(Patch {
                centre: wall.at(middle(i), middle(k)),
                normal: wall.normal(),
                corners: wall.quad(range(i), range(k)),
                wall: index,
                material: if lamp { LAMP } else { wall.material },
            });
        }
    }
    patches
}

/// Irradiance at a point of a wall from all patches, over π: to be multiplied by the albedo.
fn gathered(
    point: DVec3,
    normal: DVec3,
    wall: usize,
    patches: &[Patch],
    radiance: &[DVec3],
) -> DVec3 {
    let others = patches
        .iter()
        .zip(radiance)
        .filter(|(patch, _)| patch.wall != wall);
    others
        .map(|(patch, l)| *l * (polygon(point, normal, &patch.corners) / PI))
        .sum()
}

/// Radiance of every patch after a number of bounces.
fn solved(patches: &[Patch], bounces: usize) -> Vec<DVec3> {
    let emitted = |patch: &Patch| {
        if patch.material == LAMP {
            DVec3::from(EMISSION)
        } else {
            DVec3::ZERO
        }
    };
    let factors: Vec<Vec<f64>> = patches
        .iter()
        .map(|to| {
            let factor = |from: &Patch| {
                if from.wall == to.wall {
                    0.0
                } else {
                    polygon(to.centre, to.normal, &from.corners) / PI
                }
            };
            patches.iter().map(factor).collect()
        })
        .collect();
    let mut radiance: Vec<DVec3> = patches.iter().map(emitted).collect();
    for _ in 0..bounces {
        let next = patches.iter().zip(&factors).map(|(patch, row)| {
            let arriving: DVec3 = row.iter().zip(&radiance).map(|(f, l)| *f * *l).sum();
            emitted(patch) + DVec3::from(ALBEDOS[patch.material]) * arriving
        });
        radiance = next.collect();
    }
    radiance
}

/// The room for the path tracer: four walls, and a ceiling around the lamp.
fn polygons() -> Vec<(Vec<Vec3>, u32)> {
    let [low, high] = LIT.map(|i| i as f64 / EDGE as f64);
    let mut out = Vec::new();
    let mut push = |quad: [DVec3; 4], material: usize| {
        out.push((quad.map(|v| v.as_vec3()).to_vec(), material as u32));
    };
    let walls = walls();
    for wall in &walls[..4] {
        push(wall.quad([0.0, 1.0], [0.0, 1.0]), wall.material);
    }
    let ceiling = &walls[4];
    for (s, t) in [
        ([0.0, low], [0.0, 1.0]),
        ([high, 1.0], [0.0, 1.0]),
        ([low, high], [0.0, low]),
        ([low, high], [high, 1.0]),
    ] {
        push(ceiling.quad(s, t), ceiling.material);
    }
    push(ceiling.quad([low, high], [low, high]), LAMP);
    out
}

/// The largest relative difference between paths and radiosity, beyond five standard errors, over
/// small places in the middle of the walls. `albedos` are the path tracer's.
fn excess(albedos: [[f64; 3]; 4], patches: &[Patch], radiance: &[DVec3]) -> f64 {
    const SIZE: [u32; 2] = [8, 8];
    let mut worst = f64::NEG_INFINITY;
    for (index, wall) in walls().iter().enumerate().take(4) {
        let middle = wall.at(0.55, 0.4);
        let eye = DVec3::new(0.5, 0.55, 0.45);
        let camera = Camera {
            eye: eye.as_vec3(),
            target: middle.as_vec3(),
            up: Vec3::new(0.1, 1.0, 0.2),
            vertical_fov_degrees: 12.0,
        };
        let color = |c: [f64; 3]| DVec3::from(c).as_vec3();
        let material = |(k, c): (usize, &[f64; 3])| {
            let plain = Material::diffuse("wall", color(*c));
            if k == LAMP {
                plain.emitting(color(EMISSION))
            } else {
                plain
            }
        };
        let materials = albedos.iter().enumerate().map(material).collect();
        let images = replicates(
            scene_of(&polygons(), materials, camera),
            BOUNCES as i64,
            SIZE,
            256,
            8,
        );
        let means: Vec<f64> = images.0.iter().map(|image| image.mean()).collect();
        let found = Estimate::of(&means);
        let [forward, right, up] = camera.basis(SIZE).map(Vec3::as_dvec3);
        let eye = camera.eye.as_dvec3();
        let place = |k: u32| 2.0 * (f64::from(k) + 0.5) / f64::from(SIZE[0]) - 1.0;
        let seen = |(x, y): (u32, u32)| {
            let direction = forward + place(x) * right - place(y) * up;
            let normal = wall.normal();
            let along = (wall.corner - eye).dot(normal) / direction.dot(normal);
            let light = gathered(eye + along * direction, normal, index, patches, radiance);
            (DVec3::from(ALBEDOS[wall.material]) * light).element_sum() / 3.0
        };
        let places = (0..SIZE[1]).flat_map(|y| (0..SIZE[0]).map(move |x| (x, y)));
        let expected = places.map(seen).sum::<f64>() / f64::from(SIZE[0] * SIZE[1]);
        println!("wall {index}: {found:?} for {expected}");
        assert!(found.error < 0.003 * expected, "{found:?} proves nothing");
        worst = worst.max(((found.mean - expected).abs() - 5.0 * found.error) / expected);
    }
    worst
}

#[test]
fn a_box_without_blocks_is_as_bright_as_radiosity_says_and_a_grey_too_dark_is_found() {
    let patches = patches();
    // From the floor all directions lead to a wall or the open side, with the back wall's factor.
    let seen = |wall: usize| -> f64 {
        let of_wall = patches.iter().filter(|p| p.wall == wall);
        let middle = DVec3::new(0.5, 0.0, 0.5);
        of_wall
            .map(|p| polygon(middle, DVec3::Y, &p.corners) / PI)
            .sum()
    };
    let sum = 2.0 * seen(1) + seen(2) + seen(3) + seen(4);
    assert!((sum - 1.0).abs() < 1e-9, "{sum}");
    // The last bounce is gathered at the points seen by the camera.
    let radiance = solved(&patches, BOUNCES - 1);
    let right = excess(ALBEDOS, &patches, &radiance);
    assert!(right < TOLERANCE, "{right}");
    let mut darker = ALBEDOS;
    darker[0] = darker[0].map(|c| 0.95 * c);
    let wrong = excess(darker, &patches, &radiance);
    assert!(wrong > TOLERANCE, "{wrong}");
}
