//! Reference images of Mitsuba 3's own tests, each with the variance of one sample. As in its own
//! tests, the mean of N independent samples is compared with a reference assumed exact.

use super::replicates_by;
use crate::support::sampler;
use glam::{Affine3A, Mat4, Vec3};
use raystone::geometry::{Camera, Triangle};
use raystone::image::{Image, luminance, read_linear};
use raystone::measure::hypothesis::student_t_two_sided;
use raystone::scene::{Light, Material, SceneData, encode_normal, named};
use std::path::PathBuf;

const FOLDER: &str = "../shared/scenes/mitsuba-refs";
/// Samples per pixel: few enough for the reference's noise to be small in comparison.
const SPP: u32 = 64;
const REPLICATES: u32 = 4;
/// Minimum variance of a sample, as there: noiseless pixels differ by rounding and filters.
const LEAST_VARIANCE: f64 = 1e-4;
const ACCEPTED: f64 = 0.9975;
const RATIO: f64 = 0.002;

fn below(path: &str) -> Option<PathBuf> {
    let path = PathBuf::from(env!("CARGO_MANIFEST_DIR"))
        .join(FOLDER)
        .join(path);
    let there = path.exists();
    if !there {
        crate::support::needs::skip("files", format!("{} is not there", path.display()));
    }
    there.then_some(path)
}

/// A mesh, with vertex normals if the file has them.
struct Mesh {
    triangles: Vec<Triangle>,
    normals: Vec<[Vec3; 3]>,
}

fn square() -> Mesh {
    let [a, b, c, d] = [(-1.0, -1.0), (1.0, -1.0), (1.0, 1.0), (-1.0, 1.0)]
        .map(|(x, y): (f32, f32)| Vec3::new(x, y, 0.0));
    let triangles = [[a, b, c], [a, c, d]].map(|vertices| Triangle { vertices });
    Mesh {
        triangles: triangles.to_vec(),
        normals: vec![[Vec3::Z; 3]; 2],
    }
}

/// The file's ball of radius 1 around 0, with the ball's normals.
fn ball() -> Option<Mesh> {
    let path = below("common/meshes/sphere.obj")?;
    let file = named(path.to_str().expect("UTF-8")).expect("a mesh");
    let out = |t: &Triangle| t.vertices.map(Vec3::normalize);
    Some(Mesh {
        normals: file.triangles.iter().map(out).collect(),
        triangles: file.triangles,
    })
}

/// A scene without triangles and light, with Mitsuba's default view: a 50 mm lens before 36 mm × 24
/// mm film, whose diagonal is that of a square image.
fn empty(eye: Vec3, target: Vec3) -> SceneData {
    let diagonal = 36_f32.hypot(24.0);
    let fov = 2.0 * (diagonal / 2.0 / 50.0 / 2_f32.sqrt()).atan();
    let camera = Camera {
        up: Vec3::Z,
        ..Camera::upright(eye, target, fov.to_degrees())
    };
    super::scene_of(&[], Vec::new(), camera)
}

fn add(scene: &mut SceneData, mesh: &Mesh, to_world: Mat4, albedo: Vec3) {
    let material = scene.materials.len() as u32;
    let name = format!("material {material}");
    scene.materials.push(Material::diffuse(&name, albedo));
    let place = Affine3A::from_mat4(to_world);
    let turned = to_world.inverse().transpose();
    for (triangle, normals) in mesh.triangles.iter().zip(&mesh.normals) {
        let vertices = triangle.vertices.map(|v| place.transform_point3(v));
        scene.triangles.push(Triangle { vertices });
        let words = normals.map(|n| encode_normal(turned.transform_vector3(n).normalize()));
        scene.normals.push(words);
        scene.material_ids.push(material);
    }
}

/// Share of accepted pixels, and ratio of the means.
fn compare(scene: SceneData, reference: &str, bounces: i64) -> Option<(f64, f64)> {
    let read = |ending: &str| Some(read_linear(&below(&format!("{reference}{ending}"))?));
    let theirs: Image = read(".exr")?.expect("an image");
    let variance: Image = read("_var.exr")?.expect("an image");
    let size = [theirs.width, theirs.height];
    let sampler = sampler("pixel-hash", "none");
    let ours = replicates_by(&sampler, scene, bounces, size, SPP, REPLICATES);
    let moments = ours.moments();
    let count = f64::from(SPP * REPLICATES);
    let level = 1.0 - 0.99_f64.powf(1.0 / moments.mean.len() as f64);
    let mut accepted = 0;
    let mut total = 0.0;
    for (at, mean) in moments.mean.iter().enumerate() {
        let expected = luminance(&theirs.pixels[at]);
        // Channels vary together.
        let spread = luminance(&variance.pixels[at].map(|v| v.max(0.0).sqrt()));
        let spread = spread.powi(2).max(LEAST_VARIANCE);
        let z = (mean - expected) * (count / spread).sqrt();
        accepted += usize::from(student_t_two_sided(z.abs(), 1e9) >= level);
        total += expected;
    }
    let pixels = moments.mean.len() as f64;
    let (share, ratio) = (accepted as f64 / pixels, moments.total() * pixels / total);
    println!(
        "{reference}: ratio of the means {ratio:.5}, {:.2} % of pixels accepted",
        100.0 * share
    );
    Some((share, ratio))
}

fn floating_sphere(irradiance: f32, albedo: f32) -> Option<(f64, f64)> {
    let mut scene = empty(Vec3::new(0.0, -5.0, 1.0), Vec3::new(0.0, 0.0, 0.5));
    let white = Vec3::splat(albedo);
    add(&mut scene, &square(), Mat4::IDENTITY, white);
    let small = Mat4::from_translation(Vec3::Z) * Mat4::from_scale(Vec3::splat(0.1));
    add(&mut scene, &ball()?, small, white);
    scene.lights = vec![Light::Directional {
        direction: Vec3::NEG_Z,
        irradiance: Vec3::splat(irradiance),
    }];
    let folder = "tests/scenes/floating_sphere/refs/test_directional_ref_rgb";
    compare(scene, folder, 1)
}

fn instances(intensity: f32, turn: f32) -> Option<(f64, f64)> {
    let eye = Vec3::new(-5.0, -6.0, 0.0);
    let mut scene = empty(eye, Vec3::ZERO);
    let ball = ball()?;
    let scale = |s: f32| Mat4::from_scale(Vec3::splat(s));
    let lift = |z: f32| Mat4::from_translation(Vec3::new(0.0, 0.0, z));
    let around_x = |degrees: f32| Mat4::from_rotation_x(degrees.to_radians());
    let around_y = |degrees: f32| Mat4::from_rotation_y(degrees.to_radians());
    let small = Mat4::from_translation(Vec3::NEG_X) * scale(0.5);
    let places = [
        Mat4::IDENTITY,
        lift(2.0) * scale(1.5) * around_y(45.0 + turn),
        lift(-2.0) * scale(1.5) * around_x(-25.0) * around_y(-45.0),
    ];
    for place in places {
        add(&mut scene, &ball, place, Vec3::new(0.2, 0.5, 0.3));
        add(&mut scene, &ball, place * small, Vec3::new(0.9, 0.5, 0.3));
        let plate = place * around_y(-80.0) * scale(1.2);
        add(&mut scene, &square(), plate, Vec3::new(0.9, 0.5, 0.9));
    }
    scene.lights = vec![Light::Point {
        position: eye,
        intensity: Vec3::splat(intensity),
    }];
    let folder = "tests/scenes/instancing/refs/test_instancing_ref_rgb";
    compare(scene, folder, 1)
}

fn is_same((accepted, ratio): (f64, f64)) -> bool {
    accepted >= ACCEPTED && (ratio - 1.0).abs() < RATIO
}

#[test]
fn a_floating_ball_in_parallel_light_is_that_of_mitsuba() {
    let Some(found) = floating_sphere(1.0, 1.0) else {
        return;
    };
    assert!(is_same(found), "{found:?}");
    for (irradiance, albedo) in [(1.005, 1.0), (1.0, 0.995)] {
        let changed = floating_sphere(irradiance, albedo).expect("as before");
        assert!(!is_same(changed), "{irradiance} {albedo}: {changed:?}");
    }
}

#[test]
fn turned_balls_and_plates_under_a_lamp_are_those_of_mitsuba() {
    let Some(found) = instances(300.0, 0.0) else {
        return;
    };
    assert!(is_same(found), "{found:?}");
    for (intensity, turn) in [(301.0, 0.0), (300.0, 2.0)] {
        let changed = instances(intensity, turn).expect("as before");
        assert!(!is_same(changed), "{intensity} {turn}: {changed:?}");
    }
}
