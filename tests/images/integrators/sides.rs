//! Front faces under mirroring: a negative determinant flips the winding (glTF 2.0, 3.7.4),
//! wherever the transform is and however the triangles are traced.

use crate::support::*;
use glam::{DMat4, DVec3, Vec2, Vec3};
use raystone::geometry::Camera;
use raystone::gpu::Gpu;
use raystone::measure::mitsuba::{MITSUBA_FILE, MitsubaSettings, export_mitsuba};
use raystone::params::{ParamValue, Variant};
use raystone::scene::{Light, Material, SceneData, Texture, TextureUse, Transform};
use std::path::Path;

const SIZE: [u32; 2] = [8, 8];
const RADIANCE: f64 = 5.0;

/// A node around mesh 0: scales from the outermost on, and the resulting z side of +z.
struct Placed {
    scales: &'static [[f32; 3]],
    front: f32,
}

/// Odd and even numbers of negative axes, in one node and in nested ones. Mirroring at a plane
/// through its normal keeps the front of a square; along the normal flips it; twice does not.
const PLACES: [Placed; 9] = [
    Placed {
        scales: &[[1.0, 1.0, 1.0]],
        front: 1.0,
    },
    Placed {
        scales: &[[-1.0, 1.0, 1.0]],
        front: 1.0,
    },
    Placed {
        scales: &[[1.0, -1.0, 1.0]],
        front: 1.0,
    },
    Placed {
        scales: &[[1.0, 1.0, -1.0]],
        front: -1.0,
    },
    Placed {
        scales: &[[-1.0, -1.0, 1.0]],
        front: 1.0,
    },
    Placed {
        scales: &[[-1.0, -1.0, -1.0]],
        front: -1.0,
    },
    Placed {
        scales: &[[-1.0, 1.0, 1.0], [1.0, 1.0, -1.0]],
        front: -1.0,
    },
    Placed {
        scales: &[[1.0, -1.0, 1.0], [-1.0, 1.0, -1.0]],
        front: -1.0,
    },
    Placed {
        scales: &[[-1e-15, 1e-15, 1e-15], [1e15, 1e15, 1e15]],
        front: 1.0,
    },
];

/// A glTF mesh of these triangles under nested nodes, with a distant second instance if `shared`.
fn model(corners: &[Vec3], scales: &[[f32; 3]], shared: bool) -> SceneData {
    use base64::Engine;
    let bytes: Vec<u8> = corners
        .iter()
        .flat_map(|c| c.to_array())
        .flat_map(f32::to_le_bytes)
        .collect();
    let data = base64::engine::general_purpose::STANDARD.encode(&bytes);
    let bound = |f: fn(Vec3, Vec3) -> Vec3| {
        let all = corners.iter().copied().reduce(f).expect("a corner");
        format!("[{},{},{}]", all.x, all.y, all.z)
    };
    let inner = scales.len() - 1;
    let node = |(index, scale): (usize, &[f32; 3])| {
        let what = if index == inner {
            "\"mesh\":0".to_owned()
        } else {
            format!("\"children\":[{}]", index + 1)
        };
        format!("{{{what},\"scale\":{scale:?}}}")
    };
    let mut nodes: Vec<String> = scales.iter().enumerate().map(node).collect();
    let mut roots = vec![0];
    if shared {
        roots.push(nodes.len());
        nodes.push("{\"mesh\":0,\"translation\":[0,0,1000]}".to_owned());
    }
    let json = format!(
        r#"{{"asset":{{"version":"2.0"}},"scenes":[{{"nodes":{roots:?}}}],"nodes":[{}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0}},"material":0}}]}}],
        "materials":[{{"emissiveFactor":[1,1,1],"extensions":{{"KHR_materials_emissive_strength":{{"emissiveStrength":{RADIANCE}}}}}}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":{},"type":"VEC3","min":{},"max":{}}}],
        "bufferViews":[{{"buffer":0,"byteLength":{length}}}],
        "buffers":[{{"byteLength":{length},"uri":"data:application/octet-stream;base64,{data}"}}]}}"#,
        nodes.join(","),
        corners.len(),
        bound(Vec3::min),
        bound(Vec3::max),
        length = bytes.len(),
    );
    let folder = tempfile::tempdir().expect("a temporary folder");
    let path = folder.path().join("a.gltf");
    std::fs::write(&path, json).expect("a writable folder");
    let scene = from_file(&path);
    assert_eq!(scene.assembly.is_some(), shared);
    scene
}

/// The square from −0.5 to 0.5 facing +z, of two triangles (one light) or four (four lights).
fn square(triangles: usize) -> Vec<Vec3> {
    let [a, b, c, d] =
        [(-0.5, -0.5), (0.5, -0.5), (0.5, 0.5), (-0.5, 0.5)].map(|(x, y)| Vec3::new(x, y, 0.0));
    match triangles {
        2 => vec![a, b, c, a, c, d],
        _ => [[a, b], [b, c], [c, d], [d, a]]
            .into_iter()
            .flat_map(|[p, q]| [p, q, Vec3::ZERO])
            .collect(),
    }
}

/// Mean radiance with its standard error, in the middle of a camera's view.
fn looked(
    gpu: &Gpu,
    scene: &SceneData,
    [eye, target]: [Vec3; 2],
    what: &Variant,
    accel: &str,
) -> Estimate {
    let mut scene = scene.clone();
    let up = (target - eye).any_orthonormal_vector();
    scene.camera = Some(Camera {
        eye,
        target,
        up,
        vertical_fov_degrees: 0.01,
    });
    let stage = Stage::new(gpu, scene);
    let traced = stage.traced(gpu, structure(accel));
    let sampler = sampler("pixel-hash", "none");
    let renderer = stage.renderer(gpu, &traced, &sampler, what, SIZE, false);
    Estimate::of(&replicate_means(&renderer, 16, 8))
}

fn tracers(shared: bool) -> &'static [&'static str] {
    if shared {
        &["bvh", "meta-bvh"]
    } else {
        &["bvh"]
    }
}

/// Adds a white Lambertian square of edge 4 in the plane z.
fn with_wall(mut scene: SceneData, z: f32) -> SceneData {
    let material = scene.materials.len() as u32;
    scene.materials.push(Material::diffuse("wall", Vec3::ONE));
    let [a, b, c, d] =
        [(-2.0, -2.0), (2.0, -2.0), (2.0, 2.0), (-2.0, 2.0)].map(|(x, y)| Vec3::new(x, y, z));
    for corners in [[a, b, c], [a, c, d]] {
        scene.triangles.push(corners.into());
        scene.material_ids.push(material);
    }
    scene.mirrored.resize(scene.triangles.len(), false);
    scene.assembly = None;
    scene
}

/// Irradiance below the middle of a square lamp of edge 1 at this distance, parallel to it.
fn irradiance(distance: f64) -> f64 {
    let x = 0.5 / distance;
    let root = (1.0 + x * x).sqrt();
    4.0 * RADIANCE * (x / root) * (x / root).atan()
}

#[test]
fn one_sided_lamps_in_mirrored_nodes_shine_where_they_should() {
    let alone = path(0);
    let direct = |strategy: &str| {
        let strategy = ParamValue::Name(strategy.to_owned());
        integrator_variant(
            "path",
            &[
                ("max_depth", ParamValue::Integer(1)),
                ("strategy", strategy),
            ],
        )
    };
    for (place, shared, triangles) in PLACES.iter().flat_map(|p| [(p, false, 2), (p, true, 4)]) {
        let what = format!(
            "{:?}, shared: {shared}, {triangles} triangles",
            place.scales
        );
        let lamp = model(&square(triangles), place.scales, shared);
        // The bright side.
        for (side, accel) in [1.0, -1.0]
            .into_iter()
            .flat_map(|s| tracers(shared).iter().map(move |a| (s, a)))
        {
            let at = [Vec3::new(0.1, 0.2, 3.0 * side), Vec3::new(0.1, 0.2, 0.0)];
            let seen = looked(gpu(), &lamp, at, &alone, accel);
            let right = if side == place.front { RADIANCE } else { 0.0 };
            assert!(
                (seen.mean - right).abs() < 1e-5,
                "{what}, from {side}: {seen:?}"
            );
        }
        // Surfaces on that side are lit, by either strategy, and those on the other are not.
        for side in [1.0, -1.0] {
            let scene = with_wall(lamp.clone(), 1.5 * side);
            let right = if side == place.front {
                irradiance(1.5) / std::f64::consts::PI
            } else {
                0.0
            };
            for strategy in ["light", "bsdf"] {
                let at = [
                    Vec3::new(1.2, 0.4, 0.7 * side),
                    Vec3::new(0.0, 0.0, 1.5 * side),
                ];
                let seen = looked(gpu(), &scene, at, &direct(strategy), "bvh");
                assert!(
                    seen.agrees_with(right),
                    "{what}, wall {side}, {strategy}: {seen:?}, not {right}"
                );
                assert!(seen.error < 0.02 * RADIANCE, "{seen:?}");
            }
        }
    }
}

/// A box of 24 × 24 × 0.2 around the origin, counter-clockwise from outside.
fn slab() -> Vec<Vec3> {
    let half = Vec3::new(12.0, 12.0, 0.1);
    let mut corners = Vec::new();
    for axis in 0..3 {
        for side in [1.0, -1.0] {
            let at = |u: f32, v: f32| {
                let mut p = Vec3::ZERO;
                p[axis] = side;
                p[(axis + 1) % 3] = side * u;
                p[(axis + 2) % 3] = v;
                p * half
            };
            let [a, b, c, d] = [at(-1.0, -1.0), at(1.0, -1.0), at(1.0, 1.0), at(-1.0, 1.0)];
            corners.extend([a, b, c, a, c, d]);
        }
    }
    corners
}

#[test]
fn glass_in_mirrored_nodes_has_its_inside_inside() {
    // Seen at 60 degrees: R = 0.0892 at each surface. Swapped sides would reflect everything.
    let (index, cos) = (1.5_f64, 0.5_f64);
    let beyond = (1.0 - (1.0 - cos * cos) / (index * index)).sqrt();
    let [along, across] = [
        (index * cos - beyond) / (index * cos + beyond),
        (cos - index * beyond) / (cos + index * beyond),
    ];
    let r = 0.5 * (along * along + across * across);
    let right = RADIANCE * (1.0 - r) / (1.0 + r);
    let eye = 3.0 * Vec3::new(0.75_f32.sqrt(), 0.0, 0.5);
    for (place, shared) in PLACES.iter().flat_map(|p| [(p, false), (p, true)]) {
        let mut scene = model(&slab(), place.scales, shared);
        scene.materials[0] = Material::dielectric("glass", Vec3::ONE, index as f32);
        let mut scene = with_wall(scene, -1.0);
        let lamp = scene.materials.last_mut().expect("the wall");
        *lamp = Material::diffuse("lamp", Vec3::ZERO).emitting(Vec3::splat(RADIANCE as f32));
        for corner in scene
            .triangles
            .iter_mut()
            .rev()
            .take(2)
            .flat_map(|t| &mut t.vertices)
        {
            *corner *= Vec3::new(10.0, 10.0, 1.0);
        }
        let seen = looked(gpu(), &scene, [eye, Vec3::ZERO], &path(20), "bvh");
        assert!(
            seen.agrees_with(right) && seen.error < 0.01 * right,
            "{:?}, shared: {shared}: {seen:?}, not {right}",
            place.scales
        );
    }
}

#[test]
fn bumps_in_mirrored_nodes_are_mirrored_and_not_turned_inside_out() {
    // A map that tilts the normal towards +u: along +x in the mesh, along −x if it is mirrored.
    let tilt = DVec3::new(0.6, 0.0, 0.8);
    let texel = tilt.to_array().map(|x| ((x + 1.0) * 127.5).round() as u8);
    let mapped = DVec3::from_array(texel.map(|b| f64::from(b) / 127.5 - 1.0)).normalize();
    let towards = DVec3::new(0.48, 0.0, 0.8).normalize();
    for (place, shared) in PLACES.iter().flat_map(|p| [(p, false), (p, true)]) {
        let mut scene = model(&square(2), place.scales, shared);
        let [x, _, z] = (place.scales.iter()).fold([1.0, 1.0, 1.0], |[x, y, z], [a, b, c]| {
            [x * a, y * b, z * c]
        });
        scene.environment = Vec3::ZERO;
        scene.materials[0] = Material {
            normal_texture: Some(TextureUse::plain(0)),
            ..Material::diffuse("bumps", Vec3::ONE)
        };
        scene.textures = vec![Texture {
            name: "tilt".to_owned(),
            width: 1,
            height: 1,
            texels: vec![[texel[0], texel[1], texel[2], 255]],
        }];
        let own = square(2);
        let uv = |c: &Vec3| Vec2::new(c.x + 0.5, 0.5 - c.y);
        let uvs: Vec<[Vec2; 3]> = own
            .chunks(3)
            .map(|t| [uv(&t[0]), uv(&t[1]), uv(&t[2])])
            .collect();
        scene.uvs = uvs.repeat(scene.triangles.len() / 2);
        let side = f64::from(z.signum());
        let light = DVec3::new(towards.x, 0.0, side * towards.z);
        scene.lights = vec![Light::Directional {
            direction: (-light).as_vec3(),
            irradiance: Vec3::ONE,
        }];
        let normal = DVec3::new(f64::from(x.signum()) * mapped.x, mapped.y, side * mapped.z);
        let right = normal.dot(light) / std::f64::consts::PI;
        let eye = Vec3::new(0.1, 0.2, 3.0 * side as f32);
        let seen = looked(
            gpu(),
            &scene,
            [eye, Vec3::new(0.1, 0.2, 0.0)],
            &path(1),
            "bvh",
        );
        assert!(
            (seen.mean / right - 1.0).abs() < 1e-3,
            "{:?}, shared: {shared}: {seen:?}, not {right}",
            place.scales
        );
    }
}

fn front(scene: &SceneData, id: usize) -> Vec3 {
    let [a, b, c] = scene.outward(id);
    (b - a).cross(c - a).normalize()
}

#[test]
fn copies_and_moved_instances_keep_their_fronts() {
    let mut scene = model(&square(2), &[[-1.0, 1.0, 1.0]], true);
    let before = scene.hash.clone();
    // Unlike its hits, its appearance depends on the sides.
    assert_eq!(scene.mirrored, [true, true, false, false]);
    let turned = Transform::from_matrix(DMat4::from_scale(DVec3::new(1.0, 1.0, -1.0)).as_mat4());
    scene.move_instance(1, turned).expect("an instance");
    assert_eq!((front(&scene, 0), front(&scene, 2)), (Vec3::Z, Vec3::NEG_Z));
    assert_ne!(scene.hash, before);
    scene
        .move_instance(0, Transform::IDENTITY)
        .expect("an instance");
    scene
        .move_instance(1, Transform::IDENTITY)
        .expect("an instance");
    assert_eq!(scene.mirrored, [false; 4]);

    let folder = tempfile::tempdir().expect("a temporary folder");
    let obj = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";
    std::fs::write(folder.path().join("a.obj"), obj).expect("a writable folder");
    for (mesh, camera, right) in [
        ("1,1,1", "1,1,1", Vec3::Z),
        ("-1,1,1", "1,1,1", Vec3::Z),
        ("1,1,-1", "1,1,1", Vec3::NEG_Z),
        ("1,1,1", "-1,1,1", Vec3::Z),
        ("1,1,-1", "-1,1,1", Vec3::NEG_Z),
    ] {
        let scale =
            |by: &str| format!("<transform name=\"toWorld\"><scale value=\"{by}\"/></transform>");
        let text = format!(
            "<scene><camera type=\"perspective\">{}</camera><mesh type=\"obj\"><string name=\"filename\" value=\"a.obj\"/>{}</mesh></scene>",
            scale(camera),
            scale(mesh)
        );
        let path = folder.path().join("a.xml");
        std::fs::write(&path, text).expect("a writable folder");
        assert_eq!(
            front(&from_file(&path), 0),
            right,
            "mesh {mesh}, camera {camera}"
        );
    }
}

/// Face corners of a PLY file without normals and texture coordinates.
fn ply(path: &Path) -> Vec<[Vec3; 3]> {
    let bytes = std::fs::read(path).expect("a mesh");
    let head = b"end_header\n";
    let start = bytes
        .windows(head.len())
        .position(|w| w == head)
        .expect("a header")
        + head.len();
    let text = String::from_utf8_lossy(&bytes[..start]).into_owned();
    let count: usize = text
        .split("element vertex ")
        .nth(1)
        .and_then(|t| t.split_whitespace().next())
        .and_then(|t| t.parse().ok())
        .expect("a count");
    let number = |at: usize| {
        f32::from_le_bytes(bytes[start + 4 * at..][..4].try_into().expect("four bytes"))
    };
    let corner = |at: usize| Vec3::new(number(3 * at), number(3 * at + 1), number(3 * at + 2));
    (0..count / 3)
        .map(|t| [0, 1, 2].map(|k| corner(3 * t + k)))
        .collect()
}

#[test]
fn copies_on_a_plane_and_exports_have_the_fronts_of_mirrored_nodes() {
    let scene = model(&square(2), &[[1.0, 1.0, -1.0]], false);
    let folder = tempfile::tempdir().expect("a temporary folder");
    let settings = MitsubaSettings {
        camera: scene.view(1.0),
        size: SIZE,
        spp: 1,
        bounces: 1,
        fronts_only: true,
    };
    export_mitsuba(&scene, &settings, folder.path()).expect("a writable folder");
    assert!(folder.path().join(MITSUBA_FILE).is_file());
    for [a, b, c] in ply(&folder.path().join("meshes/0.ply")) {
        assert_eq!((b - a).cross(c - a).normalize(), Vec3::NEG_Z);
    }
}

#[test]
fn kernels_that_take_no_notice_of_mirrors_have_lamps_dark_in_front_and_bright_behind() {
    let gpu = open(kernels_with(
        "shading/sides",
        &[("& 1u) != 0u", "& 1u) == 2u")],
    ));
    let lamp = model(&square(2), &[[-1.0, 1.0, 1.0]], false);
    for (side, wrong) in [(1.0, 0.0), (-1.0, RADIANCE)] {
        let at = [Vec3::new(0.1, 0.2, 3.0 * side), Vec3::new(0.1, 0.2, 0.0)];
        let seen = looked(&gpu, &lamp, at, &path(0), "bvh");
        assert!((seen.mean - wrong).abs() < 1e-5, "{seen:?}");
    }
}
