//! Scenes of Nori: content, and errors of broken ones.

use glam::Vec3;
use raystone::params::{Params, Variant};
use raystone::scene::{
    COOK_TORRANCE, DIELECTRIC, LoadOptions, MIRROR, SceneData, SceneError, load,
};
use std::fs;
use tempfile::TempDir;

const OBJ: &str = "v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

fn loaded(xml: &str) -> Result<SceneData, SceneError> {
    let folder = TempDir::new().unwrap();
    fs::write(folder.path().join("mesh.obj"), OBJ).unwrap();
    let path = folder.path().join("scene.xml");
    fs::write(&path, xml).unwrap();
    let name = path.to_str().unwrap().to_owned();
    let variant = Variant {
        label: name.clone(),
        name,
        params: Params::default(),
    };
    load(&variant, &LoadOptions::default())
}

/// A scene with one mesh, whose element contains `inside`, and a camera transform that begins with
/// `first`.
fn scene(inside: &str, first: &str) -> String {
    format!(
        r#"<?xml version="1.0"?>
<scene>
    <integrator type="path_mis"/>
    <camera type="perspective">
        <float name="fov" value="90"/>
        <integer name="width" value="200"/><integer name="height" value="100"/>
        <transform name="toWorld">{first}<lookat origin="0, 0, 5" target="0, 0, 0" up="0 1 0"/></transform>
    </camera>
    <mesh type="obj"><string name="filename" value="mesh.obj"/>{inside}</mesh>
</scene>"#
    )
}

#[test]
fn transforms_act_in_their_order_and_the_field_of_view_is_that_of_the_width() {
    let moved = r#"<transform name="toWorld"><scale value="2,2,2"/><rotate axis="0,0,1" angle="90"/><translate value="1 0 0"/></transform>
        <emitter type="area"><color name="radiance" value="3 2 1"/></emitter>"#;
    let scene = loaded(&scene(moved, "")).unwrap();
    let close = |a: Vec3, b: Vec3| (a - b).abs().max_element() < 1e-6;
    let [a, b, c] = scene.triangles[0].vertices;
    assert!(
        close(a, Vec3::X)
            && close(b, Vec3::new(1.0, 2.0, 0.0))
            && close(c, Vec3::new(-1.0, 0.0, 0.0))
    );
    assert_eq!(scene.materials[0].emission, Vec3::new(3.0, 2.0, 1.0));
    assert_eq!(scene.materials[0].base_color, Vec3::splat(0.5));
    let camera = scene.camera.unwrap();
    assert_eq!((camera.eye, camera.up), (Vec3::new(0.0, 0.0, 5.0), Vec3::Y));
    // tan(45°) over the half width is ½ over the half height.
    let expected = 2.0 * 0.5_f32.atan().to_degrees();
    assert!((camera.vertical_fov_degrees - expected).abs() < 1e-4);
    assert!(
        scene.report.warnings.is_empty(),
        "{:?}",
        scene.report.warnings
    );
}

#[test]
fn a_mirrored_camera_mirrors_the_scene_and_keeps_fronts_in_front() {
    let front = |scene: &SceneData| {
        let [a, b, c] = scene.triangles[0].vertices;
        (b - a).cross(c - a).z
    };
    let light = r#"<emitter type="area"><color name="radiance" value="1 1 1"/></emitter>"#;
    let plain = loaded(&scene(light, "")).unwrap();
    let mirrored = loaded(&scene(light, r#"<scale value="-1 1 1"/>"#)).unwrap();
    assert!(front(&plain) > 0.0 && front(&mirrored) > 0.0);
    let least = |scene: &SceneData| scene.bounds().min.x;
    assert_eq!((least(&plain), least(&mirrored)), (0.0, -1.0));
    assert_eq!(plain.camera, mirrored.camera);
}

#[test]
fn materials_are_those_of_the_file() {
    let of = |bsdf: &str| {
        let light = r#"<emitter type="area"><color name="radiance" value="1 1 1"/></emitter>"#;
        loaded(&scene(&format!("{bsdf}{light}"), "")).unwrap()
    };
    let diffuse = of(r#"<bsdf type="diffuse"><color name="albedo" value="0.1 0.2 0.3"/></bsdf>"#);
    assert_eq!(diffuse.materials[0].base_color, Vec3::new(0.1, 0.2, 0.3));
    assert_eq!(of(r#"<bsdf type="mirror"/>"#).materials[0].kind, &MIRROR);
    let glass = of(r#"<bsdf type="dielectric"><float name="intIOR" value="1.6"/></bsdf>"#);
    assert_eq!(glass.materials[0].kind, &DIELECTRIC);
    assert!((glass.materials[0].parameters[0] - 1.6 / 1.000277).abs() < 1e-6);
    let rough = of(
        r#"<bsdf type="microfacet"><color name="kd" value="0.1 0.2 0.3"/><float name="alpha" value="0.05"/></bsdf>"#,
    );
    let rough = &rough.materials[0];
    assert_eq!(
        (rough.kind, rough.base_color),
        (&COOK_TORRANCE, Vec3::new(0.1, 0.2, 0.3))
    );
    let expected = [0.7, 0.7, 0.7, 0.05, 1.5046 / 1.000277, 1.0, 1.0];
    let close = |(a, b): (&f32, f32)| (a - b).abs() < 1e-6;
    assert!(
        rough.parameters.iter().zip(expected).all(close),
        "{:?}",
        rough.parameters
    );
    assert!(!rough.emits_both_sides);
    let unknown = of(r#"<bsdf type="velvet"/>"#);
    assert!(
        unknown.report.warnings[0].contains("line 9: the material `velvet`"),
        "{:?}",
        unknown.report
    );
}

#[test]
fn a_broken_scene_is_answered_with_its_line() {
    let answer = |xml: &str| loaded(xml).unwrap_err().to_string();
    for (xml, expected) in [
        ("<scene><mesh></scene>", "line 1"),
        ("<thing/>", "no `<scene>`"),
        (
            "<scene>\n<mesh type=\"obj\"/></scene>",
            "line 2): a mesh without",
        ),
        (
            "<scene><mesh><string name=\"filename\" value=\"/etc/x.obj\"/></mesh></scene>",
            "absolute path",
        ),
        ("<scene/>", "no triangles"),
    ] {
        let found = answer(xml);
        assert!(found.contains(expected), "{found}");
    }
    let number = scene(
        r#"<transform name="toWorld"><scale value="1 x 1"/></transform>"#,
        "",
    );
    assert!(answer(&number).contains("`value` is not three numbers"));
}
