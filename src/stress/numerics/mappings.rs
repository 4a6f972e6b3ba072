//! Directions of the hemisphere at the ends of the unit square and for awkward normals. Checks
//! `kernels/shading/hemisphere.wesl` through `kernels/stress/mappings.wesl`.

use super::{Gauge, NumericsError, U};
use glam::DVec3;
use raystone_gpu::{Composition, Gpu, UniformValues, groups_for};

/// Points and normals drawn at random besides the ends.
const RANDOM: [usize; 2] = [1 << 20, 1 << 16];
/// Largest absolute error that WGSL allows to `sin` and `cos` in [−π, π].
const WGSL_SIN: f64 = 1.0 / 2048.0;
const TWO_PI: f32 = 6.283_185_5;

/// Measures lengths, sides and errors of the kernel's result for each point.
pub(super) fn figures(gpu: &Gpu, quick: bool) -> Result<Vec<Gauge>, NumericsError> {
    let (points, normals) = inputs(RANDOM[usize::from(quick)]);
    let (directions, functions) = map(gpu, &points, &normals)?;
    let mut worst = Worst::default();
    for (k, direction) in directions.iter().enumerate() {
        worst.direction(&points[k], &normals[k], direction);
        worst.functions(&points[k], &functions[k]);
    }
    let tried = format!("of {} points and normals", points.len());
    let ends = "draws at both ends of the square included";
    let inside = "how far below; a point of it would start inside";
    let disc = "the disc under the hemisphere: all of it inside the unit circle up to this";
    Ok(vec![
        Gauge::new("directions that are not finite", worst.not_finite, tried).at_most(0.0),
        Gauge::new("length of directions, off 1", worst.length, ends).at_most(2.0 * WGSL_SIN),
        Gauge::new("directions below their surface", worst.below, inside)
            .at_most(4.0 * U)
            .in_unit("cosine"),
        Gauge::new("radius of the disc, off √u", worst.radius, disc).at_most(2.0 * WGSL_SIN),
        Gauge::new(
            "error of sin and cos in [0, 2π)",
            worst.sin,
            "WGSL allows 2⁻¹¹",
        )
        .at_most(WGSL_SIN),
        Gauge::new("error of √(1 − u)", worst.sqrt, ends).at_most(4.0 * U),
        Gauge::new("error of acos in [−1, 1]", worst.acos, "no kernel calls it"),
    ])
}

/// The worst that was found.
#[derive(Default)]
struct Worst {
    not_finite: f64,
    length: f64,
    below: f64,
    radius: f64,
    sin: f64,
    sqrt: f64,
    acos: f64,
}

impl Worst {
    fn direction(&mut self, point: &[f32; 4], normal: &[f32; 4], direction: &[f32; 4]) {
        let [normal, direction] =
            [normal, direction].map(|v| DVec3::new(v[0].into(), v[1].into(), v[2].into()));
        if !direction.is_finite() {
            self.not_finite += 1.0;
            return;
        }
        let length = direction.length();
        let cosine = direction.dot(normal);
        self.length = self.length.max((length - 1.0).abs());
        self.below = self.below.max(-cosine);
        let radius = (direction - cosine * normal).length();
        self.radius = self.radius.max((radius - f64::from(point[0]).sqrt()).abs());
    }

    fn functions(&mut self, point: &[f32; 4], found: &[f32; 4]) {
        let [sin, cos, acos, root] = found.map(f64::from);
        // The argument as the kernel rounds it.
        let angle = f64::from(TWO_PI * point[1]);
        let error = (sin - angle.sin()).abs().max((cos - angle.cos()).abs());
        let note =
            |worst: &mut f64, error: f64| *worst = if error <= *worst { *worst } else { error };
        note(&mut self.sin, error);
        note(
            &mut self.acos,
            (acos - f64::from(2.0 * point[0] - 1.0).acos()).abs(),
        );
        note(
            &mut self.sqrt,
            (root - f64::from(1.0 - point[0]).sqrt()).abs(),
        );
    }
}

type Vectors = Vec<[f32; 4]>;

/// Returns all pairs of end points with awkward normals, then random ones.
fn inputs(random: usize) -> (Vectors, Vectors) {
    let u = U as f32;
    let ends = [
        0.0,
        u,
        2.0 * u,
        0.25 - u,
        0.25,
        0.5 - u,
        0.5,
        0.5 + u,
        0.75,
        1.0 - 2.0 * u,
        1.0 - u,
    ];
    let (mut points, mut normals) = (Vec::new(), Vec::new());
    for normal in awkward_normals() {
        for x in ends {
            for y in ends {
                points.push([x, y, 0.0, 0.0]);
                normals.push(normal);
            }
        }
    }
    let mut state = 1_u64;
    let mut next = || {
        state = state
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        raystone_sampling::to_unit((state >> 32) as u32)
    };
    for _ in 0..random {
        points.push([next(), next(), 0.0, 0.0]);
        let [x, y, z] = [(); 3].map(|()| f64::from(next()) - 0.5);
        normals.push(unit(DVec3::new(x, y, z)));
    }
    (points, normals)
}

/// Returns the axes with both zeros, and normals that nearly are the axes where the basis turns over.
fn awkward_normals() -> Vectors {
    let mut normals = Vec::new();
    for axis in [DVec3::X, DVec3::Y, DVec3::Z] {
        normals.extend([unit(axis), unit(-axis)]);
    }
    for z in [1.0, -1.0] {
        for tilt in [1e-3, 1e-4, 2.5e-4, 1e-6, 1e-8, 1e-20, 1e-38] {
            normals.push(unit(DVec3::new(tilt, 0.0, z)));
            normals.push(unit(DVec3::new(-tilt, tilt, z)));
            // Nearly in the plane z = 0, on either side.
            normals.push(unit(DVec3::new(1.0, tilt, z * tilt)));
        }
    }
    normals
}

fn unit(v: DVec3) -> [f32; 4] {
    let [x, y, z] = v.normalize_or(DVec3::Z).to_array().map(|c| c as f32);
    [x, y, z, 0.0]
}

/// Directions and values of functions that the kernel makes of each point.
fn map(
    gpu: &Gpu,
    points: &Vectors,
    normals: &Vectors,
) -> Result<(Vectors, Vectors), NumericsError> {
    let (count, bytes) = (points.len() as u32, points.len() as u64 * 16);
    let played = gpu.evaluate(
        &Composition::new("stress/mappings"),
        ("mappings", UniformValues::new().u32("count", count)),
        &[
            ("points", bytemuck::cast_slice(points)),
            ("normals", bytemuck::cast_slice(normals)),
        ],
        &[("directions", bytes), ("functions", bytes)],
        groups_for(count),
    )?;
    Ok((
        played.download("directions")?,
        played.download("functions")?,
    ))
}
