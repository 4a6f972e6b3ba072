//! Content is drawn or reported: vertex colours, instances, visibility, polygons, unread parts.

use super::*;
use base64::Engine;
use raystone::scene::decode_color;

/// A glTF of a square without a material. `attributes` are additional ones, with their accessors in
/// `more`: component type, type, normalised flag and bytes. `nodes` begin with the root.
fn gltf(attributes: &str, nodes: &str, head: &str, more: &[(u32, &str, usize, Vec<u8>)]) -> String {
    let corners = [[0.0_f32, 0.0], [1.0, 0.0], [1.0, 1.0], [0.0, 1.0]];
    let positions = corners.iter().flat_map(|[x, y]| [*x, *y, 0.0]);
    let mut bytes: Vec<u8> = positions.flat_map(f32::to_le_bytes).collect();
    bytes.extend(
        [0_u16, 1, 2, 0, 2, 3]
            .into_iter()
            .flat_map(u16::to_le_bytes),
    );
    let mut accessors = String::new();
    let mut views = String::new();
    for (view, (component, kind, count, data)) in (2..).zip(more) {
        let (at, length) = (bytes.len(), data.len());
        views += &format!(r#",{{"buffer":0,"byteOffset":{at},"byteLength":{length}}}"#);
        let is_normal = if *component == 5126 {
            ""
        } else {
            r#""normalized":true,"#
        };
        accessors += &format!(
            r#",{{"bufferView":{view},"componentType":{component},{is_normal}"count":{count},"type":"{kind}"}}"#
        );
        bytes.extend(data);
        bytes.resize(bytes.len().next_multiple_of(4), 0);
    }
    let total = bytes.len();
    let encoded = base64::engine::general_purpose::STANDARD.encode(&bytes);
    format!(
        r#"{{"asset":{{"version":"2.0"}},{head}"scene":0,"scenes":[{{"nodes":[0]}}],"nodes":[{nodes}],
        "meshes":[{{"primitives":[{{"attributes":{{"POSITION":0{attributes}}},"indices":1}}]}}],
        "accessors":[{{"bufferView":0,"componentType":5126,"count":4,"type":"VEC3","min":[0,0,0],"max":[1,1,0]}},
        {{"bufferView":1,"componentType":5123,"count":6,"type":"SCALAR"}}{accessors}],
        "bufferViews":[{{"buffer":0,"byteLength":48}},{{"buffer":0,"byteOffset":48,"byteLength":12}}{views}],
        "buffers":[{{"byteLength":{total},"uri":"data:application/octet-stream;base64,{encoded}"}}]}}"#
    )
}

fn load_gltf(text: &str) -> SceneData {
    load_files("a.gltf", &[("a.gltf", text.as_bytes())]).unwrap_or_else(|e| panic!("{e}: {text}"))
}

fn floats(values: &[f32]) -> Vec<u8> {
    values.iter().flat_map(|x| x.to_le_bytes()).collect()
}

fn told(scene: &SceneData) -> String {
    scene.report.warnings.join("\n")
}

const PLAIN: &str = r#"{"mesh":0}"#;

#[test]
fn first_colours_of_gltf_are_linear_and_the_same_in_every_type() {
    // 51, 102, 255 of 255 in every corner but the last, which is black.
    let unit: [f64; 3] = [0.2, 0.4, 1.0];
    let all = |alpha: bool, scale: f64| -> Vec<f64> {
        let corner = |k: usize| {
            let color = unit.map(|x| if k == 3 { 0.0 } else { x * scale });
            let alpha = if alpha { vec![scale] } else { vec![] };
            [color.to_vec(), alpha].concat()
        };
        (0..4).flat_map(corner).collect()
    };
    let mut found = Vec::new();
    for alpha in [false, true] {
        let kind = if alpha { "VEC4" } else { "VEC3" };
        let bytes: Vec<u8> = all(alpha, 255.0).iter().map(|x| *x as u8).collect();
        // Three bytes per vertex at a stride of four.
        let bytes = alpha.then_some(bytes);
        let words: Vec<u16> = all(true, 65_535.0).iter().map(|x| *x as u16).collect();
        let words: Vec<u8> = words.iter().flat_map(|x| x.to_le_bytes()).collect();
        let singles: Vec<f32> = all(alpha, 1.0).iter().map(|x| *x as f32).collect();
        let mut variants = vec![(5126, kind, floats(&singles)), (5123, "VEC4", words)];
        variants.extend(bytes.map(|bytes| (5121, "VEC4", bytes)));
        for (component, kind, data) in variants {
            let text = gltf(r#","COLOR_0":2"#, PLAIN, "", &[(component, kind, 4, data)]);
            let scene = load_gltf(&text);
            let id = scene.material_ids[0] as usize;
            assert_eq!(scene.materials[id].base_color, Vec3::ONE, "no grey beneath");
            let [first, last] = [scene.colors[1][1], scene.colors[1][2]];
            let error = (decode_color(first) - DVec3::from(unit))
                .abs()
                .max_element();
            assert!(
                error < 1e-5,
                "{component} {kind}: {:?}",
                decode_color(first)
            );
            assert_eq!(decode_color(last), DVec3::ZERO);
            assert!(!told(&scene).contains("COLOR"), "{}", told(&scene));
            found.push(scene.colors);
        }
    }
    assert!(found.len() == 5 && found.iter().all(|colors| *colors == found[0]));
}

#[test]
fn colours_of_ply_and_obj_are_those_of_a_screen() {
    let ply = |names: &str, kind: &str, values: &str| {
        let [r, g, b] = <[&str; 3]>::try_from(names.split(' ').collect::<Vec<_>>()).unwrap();
        let text = format!(
            "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
             property {kind} {r}\nproperty {kind} {g}\nproperty {kind} {b}\nelement face 1\n\
             property list uchar int vertex_indices\nend_header\n\
             0 0 0 {values}\n1 0 0 {values}\n0 1 0 {values}\n3 0 1 2\n"
        );
        load_files("a.ply", &[("a.ply", text.as_bytes())]).unwrap()
    };
    // IEC 61966-2-1 at 1, 188/255 and 0.
    let expected = DVec3::new(1.0, 0.502_886_5, 0.0);
    let obj = "v 0 0 0 1 0.7372549 0\nv 1 0 0 1 0.7372549 0\nv 0 1 0 1 0.7372549 0\nf 1 2 3\n";
    for scene in [
        ply("red green blue", "uchar", "255 188 0"),
        ply(
            "diffuse_red diffuse_green diffuse_blue",
            "uchar",
            "255 188 0",
        ),
        ply("r g b", "float", "1 0.7372549 0"),
        ply("red green blue", "double", "1 0.7372549 0"),
        ply("red green blue", "ushort", "65535 48316 0"),
        load_obj(obj).unwrap(),
    ] {
        let color = decode_color(scene.colors[0][1]);
        assert!((color - expected).abs().max_element() < 2e-5, "{color}");
        assert_eq!(scene.materials[0].base_color, Vec3::ONE);
        assert!(!told(&scene).contains("`red`"), "{}", told(&scene));
    }
    let whole = ply("red green blue", "int", "255 188 0");
    assert!(whole.colors.is_empty() && told(&whole).contains("`red` of `vertex`"));
    let beyond = ply("red green blue", "float", "255 188 0");
    assert!(told(&beyond).contains("3 vertices have a colour beyond 0 to 1"));
}

#[test]
fn some_vertices_may_lack_a_colour() {
    let text = "v 0 0 0 1 0 0\nv 1 0 0\nv 1 1 0 1 0 0\nv 0 1 0\nv 2 2 0\nf 1 2 3 4\nf 2 4 5\n";
    let scene = load_obj(text).unwrap();
    assert_eq!(decode_color(scene.colors[0][0]), DVec3::X);
    assert_eq!(decode_color(scene.colors[0][1]), DVec3::ONE);
    let albedo = |t: usize| scene.materials[scene.material_ids[t] as usize].base_color;
    assert_eq!(
        (albedo(0), albedo(2)),
        (Vec3::ONE, Vec3::splat(DEFAULT_ALBEDO))
    );
}

#[test]
fn listed_instances_stand_where_they_are_put() {
    let half = 0.5_f32.sqrt();
    let turned = [0.0, 0.0, half, half];
    let lists = |rotation: (u32, Vec<u8>)| {
        vec![
            (5126, "VEC3", 2, floats(&[0.0, 0.0, 0.0, 5.0, 0.0, 1.0])),
            (rotation.0, "VEC4", 2, rotation.1),
            (5126, "VEC3", 2, floats(&[1.0, 1.0, 1.0, 2.0, 3.0, 1.0])),
        ]
    };
    let node = r#"{"mesh":0,"translation":[0,10,0],"extensions":{"EXT_mesh_gpu_instancing":
        {"attributes":{"TRANSLATION":2,"ROTATION":3,"SCALE":4,"_COLOR_0":2}}}}"#;
    let head = r#""extensionsUsed":["EXT_mesh_gpu_instancing"],"extensionsRequired":["EXT_mesh_gpu_instancing"],"#;
    let float = floats(&[[0.0, 0.0, 0.0, 1.0], turned].concat());
    let short = |x: f32| ((x * 32_767.0).round() as i16).to_le_bytes();
    let shorts: Vec<u8> = [[0.0, 0.0, 0.0, 1.0], turned]
        .as_flattened()
        .iter()
        .flat_map(|x| short(*x))
        .collect();
    for rotation in [(5126, float), (5122, shorts)] {
        let scene = load_gltf(&gltf("", node, head, &lists(rotation)));
        assert_eq!(scene.triangles.len(), 4);
        assert_eq!(scene.triangles[0].vertices[2], Vec3::new(1.0, 11.0, 0.0));
        // (1, 1) is scaled to (2, 3), rotated to (−3, 2), and translated.
        let far = scene.triangles[2].vertices[2];
        assert!(far.distance(Vec3::new(2.0, 12.0, 1.0)) < 1e-3, "{far}");
        let assembly = scene.assembly.as_ref().expect("instances");
        assert_eq!(
            (assembly.objects().len(), assembly.instances().len()),
            (1, 2)
        );
        let told = told(&scene);
        assert!(told.contains("`_COLOR_0` of instances"), "{told}");
        assert!(!told.contains("EXT_mesh"), "{told}");
    }
    let float = floats(&[[0.0, 0.0, 0.0, 1.0], turned].concat());
    let lists = lists((5126, float));
    for (from, to, expected) in [
        ("\"TRANSLATION\":2", "\"TRANSLATION\":99", "no accessor 99"),
        ("\"TRANSLATION\":2", "\"TRANSLATION\":0", "of 4 and of 2"),
        (
            "\"TRANSLATION\":2",
            "\"TRANSLATION\":3",
            "4 components, not 3",
        ),
        (
            "\"attributes\":{\"TR",
            "\"attributs\":{\"TR",
            "no attributes",
        ),
        ("\"ROTATION\":3", "\"ROTATION\":2", "ROTATION"),
        ("\"ROTATION\":3", "\"ROTATION\":\"x\"", "no accessor"),
    ] {
        assert!(node.contains(from), "{from}");
        let text = gltf("", &node.replace(from, to), head, &lists);
        let message = failure(load_files("a.gltf", &[("a.gltf", text.as_bytes())]));
        assert!(
            message.contains(expected) && message.contains("node 0"),
            "{message}"
        );
    }
}

#[test]
fn what_is_not_visible_is_not_there_nor_what_is_below_it() {
    let hidden = r#""extensions":{"KHR_node_visibility":{"visible":false}}"#;
    let nodes = format!(
        r#"{{"mesh":0,"children":[1,3]}},{{"children":[2],{hidden}}},{{"mesh":0,"translation":[5,0,0]}},
        {{"mesh":0,"translation":[9,0,0],"extensions":{{"KHR_node_visibility":{{"visible":true}}}}}}"#
    );
    let head =
        r#""extensionsUsed":["KHR_node_visibility"],"extensionsRequired":["KHR_node_visibility"],"#;
    let scene = load_gltf(&gltf("", &nodes, head, &[]));
    assert_eq!(scene.triangles.len(), 4);
    assert_eq!(scene.triangles[2].vertices[0].x, 9.0);
    assert!(!told(&scene).contains("visibility"), "{}", told(&scene));
}

#[test]
fn everything_that_is_not_read_is_named_once() {
    let nodes = r#"{"children":[1,2]},{"mesh":0},{"mesh":0,"translation":[2,0,0]}"#;
    let four = |n: usize| {
        (
            5126,
            ["VEC2", "VEC3", "VEC4"][n - 2],
            4,
            floats(&vec![1.0; 4 * n]),
        )
    };
    let attributes = r#","COLOR_1":2,"TEXCOORD_0":3,"TEXCOORD_2":3,"_WEAR":3"#;
    let head = r#""extensionsUsed":["KHR_materials_variants","X_own","KHR_texture_transform"],"#;
    let scene = load_gltf(&gltf(attributes, nodes, head, &[four(4), four(2)]));
    let told = told(&scene);
    for once in [
        "COLOR_1",
        "TEXCOORD_2",
        "_WEAR",
        "KHR_materials_variants",
        "X_own",
    ] {
        assert_eq!(told.matches(once).count(), 1, "{once}: {told}");
    }
    for read in ["TEXCOORD_0", "KHR_texture_transform"] {
        assert!(!told.contains(read), "{read}: {told}");
    }

    let ply = "ply\nformat ascii 1.0\nelement vertex 3\nproperty float x\nproperty float y\nproperty float z\n\
        property float nx\nproperty uchar alpha\nelement face 1\nproperty list uchar int vertex_indices\n\
        property int part\nelement edge 1\nproperty int a\nend_header\n\
        0 0 0 1 2\n1 0 0 1 2\n0 1 0 1 2\n3 0 1 2 7\n4\n";
    let scene = load_files("a.ply", &[("a.ply", ply.as_bytes())]).unwrap();
    let told = self::told(&scene);
    for once in [
        "`nx` of `vertex`",
        "`alpha` of `vertex`",
        "`part` of `face`",
        "element `edge`",
    ] {
        assert_eq!(told.matches(once).count(), 1, "{once}: {told}");
    }
    assert!(
        !told.contains("`x`") && !told.contains("vertex_indices"),
        "{told}"
    );

    let obj = format!(
        "mtllib m.mtl\n{SQUARE}vp 0 0\nvp 1 1\ns 1\nusemtl a\nf 1 2 3\ns off\nf 1 3 4\ncurv 1 2\n"
    );
    let mtl = b"newmtl a\nKa 1 1 1\nKd 1 0 0\nsharpness 60\nmap_Ka a.png\nrefl a.png\nnewmtl b\nsharpness 3\n";
    let files: [(&str, &[u8]); 2] = [("a.obj", obj.as_bytes()), ("m.mtl", mtl)];
    let scene = load_files("a.obj", &files).unwrap();
    let told = self::told(&scene);
    for once in [
        "`vp` (2 times, first: line 6)",
        "smoothing groups",
        "`curv`",
        "`sharpness` (2 times, first: line 4)",
        "`map_Ka`",
        "`refl`",
    ] {
        assert_eq!(told.matches(once).count(), 1, "{once}: {told}");
    }
    assert!(
        !told.contains("`Ka`") && !told.contains("`s` (line"),
        "{told}"
    );
}

#[test]
fn a_corner_without_normal_or_coordinates_never_takes_those_of_the_face_before() {
    let mtl = b"newmtl a\nKd 1 1 1\nmap_Kd tex.png\n";
    let obj = format!(
        "mtllib m.mtl\n{SQUARE}vt 0.25 0.75\nvn 1 0 1\nusemtl a\nf 1/1/1 2/1/1 3/1/1\nf 1 3 4\nf 1/1 3 4//1\n"
    );
    let image = png();
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", obj.as_bytes()),
        ("m.mtl", mtl),
        ("tex.png", &image),
    ];
    let scene = load_files("a.obj", &files).unwrap();
    let given = Vec2::new(0.25, 0.25);
    assert_eq!(
        scene.uvs,
        [[given; 3], [Vec2::ZERO; 3], [given, Vec2::ZERO, Vec2::ZERO]]
    );
    let normal = |t: usize| scene.normals[t].map(|word| word != GEOMETRIC);
    assert_eq!(
        [normal(0), normal(1), normal(2)],
        [[true; 3], [false; 3], [false, false, true]]
    );
}

#[test]
fn concave_polygons_are_what_they_are_and_crossing_ones_are_named() {
    // A dart, whose fan from the first corner would cover the outside.
    let area = |scene: &SceneData| -> f32 {
        let of = |t: &raystone::geometry::Triangle| {
            let [a, b, c] = t.vertices;
            0.5 * (b - a).cross(c - a).length()
        };
        scene.triangles.iter().map(of).sum()
    };
    let dart = "v 0 0 0\nv 2 1 0\nv 0 2 0\nv 0.5 1 0\n";
    for turned in ["1 2 3 4", "2 3 4 1", "3 4 1 2", "4 1 2 3", "4 3 2 1"] {
        let scene = load_obj(&format!("{dart}f {turned}\n")).unwrap();
        assert_eq!(area(&scene), 1.5, "{turned}");
        assert!(
            !told(&scene).contains("cross themselves"),
            "{}",
            told(&scene)
        );
    }
    let ply = "ply\nformat ascii 1.0\nelement vertex 4\nproperty float x\nproperty float y\nproperty float z\n\
        element face 2\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n2 1 0\n0 2 0\n0.5 1 0\n4 0 1 2 3\n";
    let scene = load_files(
        "a.ply",
        &[("a.ply", format!("{ply}4 1 2 3 0\n").as_bytes())],
    )
    .unwrap();
    assert_eq!((area(&scene), scene.triangles.len()), (3.0, 4));
    // Between the corners of a square, the second face uses both diagonals.
    let square = ply.replace(
        "0 0 0\n2 1 0\n0 2 0\n0.5 1 0\n",
        "0 0 0\n2 0 0\n2 2 0\n0 2 0\n",
    );
    let crossing = load_files(
        "a.ply",
        &[("a.ply", format!("{square}4 0 2 1 3\n").as_bytes())],
    );
    let told_of = told(&crossing.unwrap());
    assert!(
        told_of.contains("1 polygon crosses itself (face 1)"),
        "{told_of}"
    );
    let bow = load_obj(&format!("{SQUARE}f 1 2 3 4\nf 1 3 2 4\n")).unwrap();
    let told_of = told(&bow);
    assert!(
        told_of.contains("1 polygon crosses itself (line 6)"),
        "{told_of}"
    );
}

#[test]
fn headers_of_ply_end_their_lines_in_any_way() {
    let text = "ply\nformat ascii 1.0\ncomment x\nelement vertex 3\nproperty float x\nproperty float y\n\
        property float z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n\
        0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n";
    let load_bytes = |bytes: &[u8]| load_files("a.ply", &[("a.ply", bytes)]).map(|s| s.hash);
    let plain = load_bytes(text.as_bytes()).unwrap();
    for end in ["\r", "\r\n"] {
        assert_eq!(
            load_bytes(text.replace('\n', end).as_bytes()).unwrap(),
            plain,
            "{end:?}"
        );
        let (header, _) = text.split_once("0 0 0").unwrap();
        let header = header
            .replace("ascii", "binary_little_endian")
            .replace('\n', end);
        // The first byte of the data is that of a line end.
        let first = f32::from_le_bytes([b'\n', 0, 0, 0]);
        let mut bytes = header.into_bytes();
        bytes.extend(floats(&[first, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0, 0.0]));
        bytes.push(3);
        bytes.extend([0_i32, 1, 2].into_iter().flat_map(i32::to_le_bytes));
        let scene = load_files("b.ply", &[("b.ply", &bytes)]).unwrap();
        assert_eq!(scene.triangles[0].vertices[0].x, first, "{end:?}");
    }
    let marked = format!("\u{feff}{text}").replace("comment x", "comment \u{fc}");
    assert_eq!(load_bytes(marked.as_bytes()).unwrap(), plain);
    let latin1 = text.replace("comment x", "comment \u{fc}");
    let latin1: Vec<u8> = latin1.chars().map(|c| c as u8).collect();
    assert_eq!(load_bytes(&latin1).unwrap(), plain);
    let message = load_bytes(b"\xff\xfep\0l\0y\0\n\0")
        .unwrap_err()
        .to_string();
    assert!(message.contains("UTF-16"), "{message}");
}
