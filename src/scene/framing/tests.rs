//! Tests of automatic framing.

use super::*;
use crate::Material;
use crate::builder::{Look as SceneLook, SceneBuilder};

/// Corner `i` of the box from −`half` to `half`.
fn corner(half: Vec3, i: usize) -> Vec3 {
    let sign = |bit: usize| if i >> bit & 1 == 1 { 1.0 } else { -1.0 };
    half * Vec3::new(sign(0), sign(1), sign(2))
}

/// A box without the sides in `missing` (0 … 5: −x, x, −y, y, −z, z), facing inwards or outwards.
fn walls(half: Vec3, missing: &[usize], inwards: bool) -> SceneData {
    // Counter-clockwise seen from outside.
    let sides = [
        [0, 4, 6, 2],
        [1, 3, 7, 5],
        [0, 1, 5, 4],
        [2, 6, 7, 3],
        [0, 2, 3, 1],
        [4, 5, 7, 6],
    ];
    let mut builder = SceneBuilder::new(false, 12);
    for (_, side) in sides
        .iter()
        .enumerate()
        .filter(|(i, _)| !missing.contains(i))
    {
        let mut quad = side.map(|i| corner(half, i));
        if inwards {
            quad.reverse();
        }
        builder.push_quad(quad, 0);
    }
    finish(builder)
}

fn finish(builder: SceneBuilder) -> SceneData {
    let look = SceneLook {
        materials: vec![Material::diffuse("grey", Vec3::splat(0.5))],
        ..SceneLook::default()
    };
    builder.finish("test.obj", look).unwrap()
}

/// Largest image coordinate of a vertex, 1 at the border; infinite behind the camera.
fn extent(scene: &SceneData, camera: &Camera, aspect: f32) -> f32 {
    let [forward, right, up] = basis((camera.target - camera.eye).normalize(), camera.up);
    let tangent = (0.5 * camera.vertical_fov_degrees.to_radians()).tan();
    let vertices = scene.triangles.iter().flat_map(|t| t.vertices);
    let coordinates = vertices.map(|v| {
        let to = v - camera.eye;
        let ahead = to.dot(forward);
        let x = to.dot(right).abs() / (aspect * tangent * ahead);
        let y = to.dot(up).abs() / (tangent * ahead);
        if ahead > 0.0 { x.max(y) } else { f32::INFINITY }
    });
    coordinates.fold(0.0, f32::max)
}

#[test]
fn an_object_fills_images_of_any_aspect_at_any_scale() {
    for half in [
        Vec3::new(1.0, 2.0, 0.5),
        Vec3::splat(1e-4),
        Vec3::splat(1e-10),
        Vec3::splat(1e8),
    ] {
        let scene = walls(half, &[], false);
        for aspect in [0.3, 1.0, 16.0 / 9.0, 4.0] {
            let camera = scene.view(aspect);
            crate::check_camera(&camera).unwrap();
            let extent = extent(&scene, &camera, aspect);
            assert!((extent - FILL).abs() < 0.01, "{half}, {aspect}: {extent}");
        }
        let sky = scene.daylight.unwrap();
        assert_eq!(sky.reach, f32::MAX, "an object is no room");
    }
}

#[test]
fn a_room_is_seen_from_inside_along_its_length() {
    for (half, along) in [
        (Vec3::new(8.0, 2.0, 3.0), Vec3::X),
        (Vec3::new(3.0, 2.0, 8.0), Vec3::Z),
    ] {
        let scene = walls(half, &[], true);
        let camera = scene.view(1.0);
        assert!(camera.eye.abs().cmplt(half).all(), "{camera:?}");
        let forward = (camera.target - camera.eye).normalize();
        assert!(forward.dot(along).abs() > 0.9, "{camera:?}");
        assert!(
            camera.eye.dot(forward) < -0.5 * half.max_element(),
            "{camera:?}"
        );
        assert_eq!(
            scene.daylight.unwrap().reach,
            1.0,
            "a quarter of the height"
        );
    }
}

#[test]
fn a_room_without_a_wall_is_seen_through_the_gap() {
    for (missing, towards_eye) in [(5, Vec3::Z), (4, -Vec3::Z), (1, Vec3::X), (0, -Vec3::X)] {
        let scene = walls(Vec3::ONE, &[missing], true);
        let camera = scene.view(1.0);
        let towards = (camera.eye - camera.target).normalize();
        assert!(towards.dot(towards_eye) > 0.9999, "{camera:?}");
        assert!((extent(&scene, &camera, 1.0) - FILL).abs() < 0.01);
    }
}

#[test]
fn two_walls_and_a_floor_are_seen_from_where_their_fronts_are() {
    let scene = walls(Vec3::ONE, &[1, 3, 4], true);
    let camera = scene.view(1.0);
    assert!(camera.eye.x > 0.0 && camera.eye.z < 0.0, "{camera:?}");
}

#[test]
fn what_stands_on_the_z_axis_is_seen_upright_unless_the_format_says_that_y_is_up() {
    // A pyramid on the ground z = 0.
    let mut builder = SceneBuilder::new(false, 6);
    let base = [(-1.0, -1.0), (-1.0, 1.0), (1.0, 1.0), (1.0, -1.0)];
    let base = base.map(|(x, y)| Vec3::new(x, y, 0.0));
    builder.push_quad(base, 0);
    for i in 0..4 {
        builder.push([base[(i + 1) % 4], base[i], 2.0 * Vec3::Z], 0);
    }
    let mut scene = finish(builder);
    assert_eq!(scene.view(1.0).up, Vec3::Z);
    assert_eq!(scene.daylight.unwrap().up, Vec3::Z);
    scene.name = "pyramid.glb".into();
    assert_eq!(Framing::of(&scene).up, Vec3::Y);
}

#[test]
fn points_lines_and_planes_still_give_a_camera() {
    for size in [
        Vec3::ZERO,
        Vec3::X,
        Vec3::new(1.0, 1.0, 0.0),
        Vec3::new(0.0, 3.0, 2.0),
    ] {
        for center in [Vec3::ZERO, Vec3::splat(1e6), Vec3::splat(-9e8)] {
            let mut builder = SceneBuilder::new(false, 3);
            let corners = [0, 1, 2, 3].map(|i| center + corner(size, [0, 1, 7, 6][i]));
            builder.push_quad(corners, 0);
            let camera = finish(builder).view(1.5);
            crate::check_camera(&camera).unwrap_or_else(|e| panic!("{size}, {center}: {e}"));
        }
    }
}

#[test]
fn a_scene_with_a_light_gets_no_sky() {
    let lit = crate::builtin::tests::load_default("cornell-box");
    assert_eq!((lit.daylight, lit.framing), (None, None));
}
