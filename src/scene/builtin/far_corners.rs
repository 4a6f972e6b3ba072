//! A small scene that exercises code which otherwise only large or deep scenes reach: multiple rows
//! of texels, inseparable triangles, trees of nearly thirty levels, needles, empty space around
//! dense spots, and instances whose boxes have to grow.

use super::super::builder::{Look, SceneBuilder};
use super::super::{Material, Transform};
use super::BuiltinScene;
use super::numeric::sin_cos_turns;
use super::sphere::SphereGrid;
use glam::Vec3;
use raystone_core::geometry::Triangle;
use raystone_core::parameters;
use raystone_core::random::Pcg32;

parameters! {
    /// `far-corners`.
    pub(super) struct FarCorners {}
}

/// Quadrilaterals along each edge of the sheet: enough to fill rows of texels.
const SHEET: usize = 64;
/// Nested shells, each half as large as the previous one: levels of a tree.
const SHELLS: i32 = 44;
/// Coincident triangles.
const COPIES: usize = 72;
/// Long thin triangles across the scene.
const NEEDLES: usize = 48;
/// Triangles in a spot a thousandth of the scene in size.
const SPOT: usize = 300;

impl BuiltinScene for FarCorners {
    const NAME: &'static str = "far-corners";
    const DESCRIPTION: &'static str =
        "what only large or deep scenes reach, in little: the gate's second scene";

    fn build(&self) -> (SceneBuilder, Look) {
        let mut builder = SceneBuilder::new(false, 2 * SHEET * SHEET + 2048);
        builder.add_object(ground());
        builder.add_object(bumpy());
        builder.place(0, Transform::IDENTITY, 0);
        for to_world in places() {
            builder.place(1, to_world, 1);
        }
        let colors = [(0.7, 0.7, 0.65), (0.75, 0.4, 0.3)];
        let materials = colors.map(|color| Material::diffuse("corner", color.into()));
        let (eye, target) = (Vec3::new(2.6, 1.9, 3.1), Vec3::new(0.4, 0.3, 0.4));
        (
            builder,
            Look::under_sky(materials.into(), eye, target, 40.0),
        )
    }
}

/// Everything that is not an instance.
fn ground() -> Vec<Triangle> {
    let mut builder = SceneBuilder::new(false, 0);
    let mut pcg = Pcg32::with_stream(1, Pcg32::DEFAULT_STREAM);
    let mut point = || Vec3::new(pcg.uniform_f32(), pcg.uniform_f32(), pcg.uniform_f32());
    sheet(&mut builder);
    // Shells around a corner: all contain the origin, so rays reach small ones past the large ones.
    for level in 0..SHELLS {
        let s = 2.0_f32.powi(-level);
        let [x, y, z] = [Vec3::X, Vec3::Y, Vec3::Z].map(|axis| s * axis);
        builder.push([x, y, z], 0);
        builder.push([x + 0.25 * y, y + 0.25 * z, Vec3::splat(0.125 * s)], 0);
    }
    let copy = [
        Vec3::new(-0.5, 0.25, -0.5),
        Vec3::new(-0.25, 0.5, -0.5),
        Vec3::new(-0.5, 0.5, -0.25),
    ];
    for turn in 0..COPIES {
        let mut vertices = copy;
        vertices.rotate_left(turn % 3);
        builder.push(vertices, 0);
    }
    for _ in 0..NEEDLES {
        let (from, to) = (2.0 * point() - 1.0, 2.0 * point() - 1.0);
        builder.push([from, to, to + 1e-5 * point()], 0);
    }
    for _ in 0..SPOT {
        let at = Vec3::splat(0.9375) + 0.001 * point();
        builder.push([at, at + 2e-4 * point(), at + 2e-4 * point()], 0);
    }
    builder.into_triangles()
}

/// Half lies in an axis-aligned plane and is cut at binary fractions, half is wavy.
fn sheet(builder: &mut SceneBuilder) {
    builder.push_grid(SHEET, 0, |i, k| {
        let [x, z] = [i, k].map(|n| n as f32 / SHEET as f32);
        let wave = f64::from(x) * 3.0;
        let y = if k > SHEET / 2 {
            (sin_cos_turns(wave).0 * f64::from(z - 0.5) * 0.2) as f32
        } else {
            0.0
        };
        Vec3::new(2.0 * x - 1.0, y - 0.5, 2.0 * z - 1.0)
    });
}

/// A closed, uneven object away from the origin.
fn bumpy() -> Vec<Triangle> {
    let mut builder = SceneBuilder::new(false, 0);
    SphereGrid::with_at_most(72).push(&mut builder, 0, |direction| {
        let radius = 1.0 + 0.3 * sin_cos_turns(direction.x + 0.7 * direction.y).0;
        (radius * direction).as_vec3() + Vec3::new(0.5, -0.25, 2.0)
    });
    builder.into_triangles()
}

/// Rotated, tiny, mirrored, flat, and far away and large.
fn places() -> [Transform; 6] {
    let turned = |axis: f64, scale: Vec3, offset: Vec3| {
        let (s, c) = sin_cos_turns(axis);
        let (s, c) = (s as f32, c as f32);
        let x = Vec3::new(c, s, 0.0);
        let y = Vec3::new(-s * 0.6, c * 0.6, 0.8);
        let z = Vec3::new(s * 0.8, -c * 0.8, 0.6);
        Transform::new([x * scale.x, y * scale.y, z * scale.z], offset)
    };
    let even = Vec3::splat;
    [
        turned(0.125, even(0.2), Vec3::new(0.4, 0.3, -0.6)),
        turned(0.37, even(1e-3), Vec3::new(0.7, 0.2, 0.7)),
        turned(0.8, Vec3::new(-0.15, 0.2, 0.1), Vec3::new(-0.4, 0.5, 0.3)),
        turned(0.6, Vec3::new(0.3, 0.004, 0.2), Vec3::new(0.1, 0.6, 0.4)),
        turned(0.05, even(0.25), Vec3::new(0.35, 0.35, -0.5)),
        turned(0.27, even(9.0), Vec3::new(-60.0, 35.0, -80.0)),
    ]
}
