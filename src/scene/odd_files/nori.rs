//! Nori's XML.

use super::{Fails, Outcome, Reads, check, load_files};

const MESH: &[u8] = b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n";

/// What stands in `<mesh>` after the file's name, what stands in `<camera>` with its type, and what becomes of it.
const NORI: &[(&str, &str, Outcome)] = &[
    (
        "<bsdf type=\"diffuse\"><color name=\"albedo\" value=\"1 0 0\"/></bsdf>",
        "<camera type=\"perspective\"><float name=\"fov\" value=\"30\"/><float name=\"nearClip\" value=\"1\"/></camera>",
        Reads("r", &[]),
    ),
    (
        "<bsdf type=\"diffuse\"><color name=\"albeddo\" value=\"1 0 0\"/></bsdf>",
        "",
        Reads(
            ".",
            &["line 4: `<color>` `albeddo` of `<bsdf>` is not read"],
        ),
    ),
    (
        "<bsdf type=\"diffuse\"><color name=\"albedo\" value=\"0 1 0\"/><color name=\"albedo\" value=\"1 0 0\"/></bsdf>",
        "",
        Reads(
            "r",
            &["line 4: a later `albedo` counts in place of this one"],
        ),
    ),
    (
        "<bsdf type=\"diffuse\"><color name=\"albedo\" value=\"1 0 0\"/></bsdf><bsdf type=\"mirror\"/>",
        "",
        Reads(
            "r",
            &["line 4: a mesh has one material, and this is another: left out"],
        ),
    ),
    (
        "<emitter type=\"area\"><color name=\"radiance\" value=\"1 1 1\"/></emitter><emitter type=\"area\"/>",
        "",
        Reads(
            ".",
            &["line 4: a mesh has one emitter, and this is another: left out"],
        ),
    ),
    (
        "<emitter type=\"area\"/>",
        "",
        Reads(".", &["line 4: an emitter without `radiance` is dark"]),
    ),
    (
        "<transform name=\"toLocal\"/>",
        "",
        Reads(
            ".",
            &["line 4: a `<transform>` that is not `toWorld` is not read"],
        ),
    ),
    (
        "<bsdf type=\"velvet\"><color name=\"albedo\" value=\"1 0 0\"/></bsdf>",
        "",
        Reads(
            "r",
            &["the material `velvet` is not known; drawn as diffuse"],
        ),
    ),
    (
        "",
        "<camera type=\"perspective\"/><camera type=\"perspective\"><float name=\"fov\" value=\"0\"/></camera>",
        Reads(
            ".",
            &["line 2: a scene has one camera, and this is another: left out"],
        ),
    ),
    (
        "<bsdf type=\"diffuse\"><texture type=\"checkerboard_color\" name=\"albedo\"/></bsdf>",
        "",
        Reads(".", &["`<texture>` `albedo` of `<bsdf>` is not read"]),
    ),
    (
        "<bsdf type=\"roughconductor\"><string name=\"intIOR\" value=\"bk7\"/><color name=\"albedo\" value=\"1 0 0\"/></bsdf>",
        "",
        Reads(
            "r",
            &["the material `roughconductor` is not known; drawn as diffuse"],
        ),
    ),
    (
        "<bsdf type=\"diffuse\"><color name=\"albedo\" value=\"1 0 0\"/><string name=\"extIOR\" value=\"air\"/></bsdf>",
        "",
        Reads(
            "r",
            &["line 4: `<string>` `extIOR` of `<bsdf>` is not read"],
        ),
    ),
    (
        "<bsdf type=\"dielectric\"><string name=\"intIOR\" value=\"bk7\"/></bsdf>",
        "",
        Fails(&["line 4", "`intIOR` is not a number"]),
    ),
    (
        "<bsdf type=\"dielectric\"><float name=\"intIOR\" value=\"-1.5\"/></bsdf>",
        "",
        Fails(&["line 4", "indices of refraction are above 0"]),
    ),
    (
        "<emitter type=\"area\"><color name=\"radiance\" value=\"-5,-5,-5\"/></emitter>",
        "",
        Reads(
            ".",
            &["`radiance` of [-5, -5, -5] is beyond what is rendered"],
        ),
    ),
    (
        "<transform name=\"toWorld\"><translate value=\"0,4649776,0\"/></transform>",
        "",
        Reads(".", &["rounded to steps of 0.5, and the model is 1"]),
    ),
    (
        "<transform name=\"toWorld\"><translate value=\"0,4649776,0\"/></transform><transform name=\"toWorld\"/>",
        "",
        Reads(
            ".",
            &["line 4: a later `<transform>` counts in place of this one"],
        ),
    ),
    (
        "</mesh><mesh type=\"sphere\"><float name=\"radius\" value=\"1\"/>",
        "",
        Reads(".", &["line 4: the mesh `sphere` is not known, left out"]),
    ),
    (
        "<medium type=\"homogeneous\"/>",
        "",
        Reads(".", &["`<medium>` of `<mesh>` is not read"]),
    ),
    (
        "",
        "<camera type=\"thinlens\"><float name=\"apertureRadius\" value=\"1\"/></camera>",
        Reads(
            ".",
            &[
                "the camera `thinlens` is not known; drawn as perspective",
                "`<float>` `apertureRadius` of `<camera>` is not read",
            ],
        ),
    ),
    (
        "",
        "<camera type=\"perspective\"><float name=\"fov\" value=\"0\"/></camera>",
        Fails(&["line 2", "field of view of 0°"]),
    ),
    (
        "",
        "<camera type=\"perspective\"><transform name=\"toWorld\"><lookat origin=\"0 0 1\" target=\"0 0 1\" up=\"0 1 0\"/></transform></camera>",
        Fails(&["line 2", "has no directions"]),
    ),
    (
        "",
        "<camera type=\"perspective\"><transform name=\"toWorld\"><lookat origin=\"0 0 1\" target=\"0 0 0\" up=\"0 0 1\"/></transform></camera>",
        Fails(&["line 2", "has no directions"]),
    ),
];

#[test]
fn nori_files_as_found_are_read() {
    for (mesh, camera, expected) in NORI {
        let text = format!(
            "<scene>\n{camera}\n<mesh type=\"obj\"><string name=\"filename\" value=\"m.obj\"/>\n{mesh}</mesh></scene>"
        );
        let files: [(&str, &[u8]); 2] = [("a.xml", text.as_bytes()), ("m.obj", MESH)];
        check(&text, load_files(&files), expected);
    }
}

#[test]
fn meshes_are_found_as_other_systems_write_them() {
    for (file, notes) in [
        ("parts\\m.obj", &[][..]),
        (" parts/m.obj", &[]),
        ("Parts\\M.OBJ", &["line 2: `Parts\\M.OBJ` is not there; "]),
        ("parts/M.obj", &["line 2: `parts/M.obj` is not there; "]),
    ] {
        let text = format!(
            "<!DOCTYPE scene>\n<scene><mesh type=\"obj\"><string name=\"filename\" value=\"{file}\"/></mesh></scene>\n<!-- M\u{fc}ller -->"
        );
        let latin1: Vec<u8> = text.chars().map(|c| c as u8).collect();
        for text in [text.as_bytes(), &latin1] {
            let result = load_files(&[("a.xml", text), ("parts/m.obj", MESH)]);
            check(file, result, &Reads(".", notes));
        }
    }
    let glb =
        "<scene>\n<mesh type=\"obj\"><string name=\"filename\" value=\"m.glb\"/></mesh></scene>";
    let files: [(&str, &[u8]); 2] = [("a.xml", glb.as_bytes()), ("m.glb", MESH)];
    let fails = Fails(&["line 2", "`m.glb` is no mesh of Nori"]);
    check("glb", load_files(&files), &fails);
}

#[test]
fn scenes_of_mitsuba_are_told_from_those_of_nori() {
    let text = b"<scene version=\"3.0.0\">\n<shape type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></shape></scene>";
    let fails = Fails(&[
        "a scene of Mitsuba, which is not read",
        "give its meshes as",
    ]);
    check("mitsuba", load_files(&[("a.xml", text)]), &fails);
}

#[test]
fn a_camera_looks_where_it_does_however_far_it_stands() {
    for scale in [1.0, 1e4, 1e7] {
        let [origin, target] = [[3.0, 1.0, 2.0], [0.0, 0.5, -1.0]].map(|at| at.map(|x| scale * x));
        let list = |at: [f64; 3]| at.map(|x| x.to_string()).join(", ");
        let text = format!(
            "<scene><camera type=\"perspective\"><transform name=\"toWorld\"><lookat origin=\"{}\" target=\"{}\" up=\"0, 1, 0\"/></transform></camera>\n\
             <mesh type=\"obj\"><string name=\"filename\" value=\"m.obj\"/></mesh></scene>",
            list(origin),
            list(target)
        );
        let scene = load_files(&[("a.xml", text.as_bytes()), ("m.obj", MESH)]).expect("a scene");
        let camera = scene.camera.expect("a camera");
        let found = (camera.target - camera.eye).normalize();
        let expected = glam::Vec3::new(-3.0, -0.5, -3.0).normalize();
        assert!(found.distance(expected) < 1e-5, "{scale}: {found}");
    }
}
