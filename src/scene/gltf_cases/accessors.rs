//! Where numbers come from and how they are written.

use super::*;

#[test]
fn sparse_values_lie_over_a_view_or_over_zeros() {
    let sparse = |count: usize| {
        json!({"count": count, "indices": {"bufferView": 2, "componentType": 5123},
            "values": {"bufferView": 3}})
    };
    let replaced = |name, places: [u16; 3]| {
        let values = floats(CORNERS[1..].iter().flatten().copied());
        case(name)
            .accessor(shorts(places), 5123, "SCALAR", 3)
            .accessor(values, 5126, "VEC3", 3)
            .set("/accessors/0/sparse", sparse(3))
    };
    let no_view = |case: Case| case.set("/accessors/0/bufferView", Value::Null);
    no_view(replaced("sparse without a view", [1, 2, 3]))
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    replaced("sparse over a view", [1, 2, 3]).load().whole(2);
    no_view(replaced("the last is first", [3, 2, 1]))
        .load()
        .whole(2);
    replaced("null instead of a view", [1, 2, 3])
        .set("/accessors/0/byteOffset", json!(null))
        .load()
        .whole(2);
    replaced("too large an index", [1, 2, 4])
        .load()
        .fails(&["mesh 0 `square`", "index 4"]);
    replaced("no sparse values", [1, 2, 9])
        .set("/accessors/0/sparse", json!({"count": 0}))
        .load()
        .whole(2);
    let zeros = no_view(case("zeros")).load();
    assert_eq!(zeros.scene().report.zero_area, 2);
    no_view(case("too many zeros"))
        .set("/accessors/0/count", json!(1_000_000_000_000_u64))
        .load()
        .fails(&["mesh 0", "too many"]);
}

#[test]
fn positions_are_read_in_every_type() {
    let scaled = |most: f32| CORNERS.as_flattened().iter().map(move |x| x * most);
    let bytes = |most: f32| scaled(most).map(|x| x as u8).collect::<Vec<_>>();
    let words = |most: f32| shorts(scaled(most).map(|x| x as u16));
    let required = json!(["KHR_mesh_quantization"]);
    for (name, component, data, is_normalised, far) in [
        ("i8", 5120, bytes(127.0), true, 1.0),
        ("u8", 5121, bytes(255.0), true, 1.0),
        ("i16", 5122, words(32_767.0), true, 1.0),
        ("u16", 5123, words(65_535.0), true, 1.0),
        ("i8 as they are", 5120, bytes(100.0), false, 100.0),
        ("u8 as they are", 5121, bytes(200.0), false, 200.0),
        ("i16 as they are", 5122, words(300.0), false, 300.0),
        ("u16 as they are", 5123, words(40_000.0), false, 40_000.0),
        (
            "f64",
            5130,
            scaled(2.0)
                .flat_map(|x| f64::from(x).to_le_bytes())
                .collect(),
            false,
            2.0,
        ),
    ] {
        let quantised = case(name)
            .accessor(data, component, "VEC3", 4)
            .set("/accessors/2/normalized", json!(is_normalised))
            .set("/meshes/0/primitives/0/attributes/POSITION", json!(2))
            .set("/extensionsRequired", required.clone());
        quantised.load().whole(2).corner([far, far, 0.0]);
    }
}

#[test]
fn elements_may_be_apart_together_or_anywhere() {
    let padded = CORNERS
        .iter()
        .flat_map(|[x, y, z]| floats([*x, *y, *z, 9.0]));
    let padded: Vec<u8> = padded.collect();
    let at_2 = |case: Case| case.set("/meshes/0/primitives/0/attributes/POSITION", json!(2));
    at_2(case("a stride").accessor(padded.clone(), 5126, "VEC3", 4))
        .set("/bufferViews/2/byteStride", json!(16))
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    // The last element need not be padded.
    at_2(case("a stride to the end").accessor(padded[..60].to_vec(), 5126, "VEC3", 4))
        .set("/bufferViews/2/byteStride", json!(16))
        .load()
        .whole(2);
    let shifted = [vec![7], floats(CORNERS.into_iter().flatten())].concat();
    at_2(case("an offset of 1").accessor(shifted, 5126, "VEC3", 4))
        .set("/accessors/2/byteOffset", json!(1))
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    for stride in [0, 4] {
        case("a stride that is none")
            .set("/bufferViews/0/byteStride", json!(stride))
            .load()
            .whole(2)
            .corner([1.0, 1.0, 0.0]);
    }
    case("a view without its length")
        .set("/bufferViews/0/byteLength", Value::Null)
        .load()
        .whole(2);
    case("a view beyond its buffer")
        .set("/bufferViews/1/byteLength", json!(99))
        .load()
        .whole(2);
    case("a buffer longer than it says")
        .set("/buffers/0/byteLength", json!(1))
        .load()
        .whole(2);
    case("whole numbers with a point")
        .set("/accessors/0/count", json!(4.0))
        .set("/bufferViews/1/byteOffset", json!(48.0))
        .load()
        .whole(2);
    case("wrong bounds")
        .set("/accessors/0/min", json!([5, "x"]))
        .load()
        .whole(2);
}

#[test]
fn a_value_that_is_used_and_wrong_is_named() {
    for (path, value, words) in [
        (
            "/accessors/0/count",
            json!(5),
            &["positions are outside", "buffer view 0"][..],
        ),
        (
            "/accessors/1/count",
            json!(7),
            &["indices are outside", "buffer view 1"],
        ),
        (
            "/accessors/0/type",
            json!("VEC2"),
            &["positions have 2 components"],
        ),
        ("/accessors/0/type", json!("VEC9"), &["unknown type"]),
        ("/accessors/0/componentType", json!(1), &["unknown type"]),
        ("/accessors/0/bufferView", json!(9), &["no buffer view 9"]),
        ("/bufferViews/0/buffer", json!(9), &["no buffer 9"]),
        (
            "/bufferViews/0/byteOffset",
            json!(u64::MAX),
            &["positions are outside"],
        ),
        (
            "/meshes/0/primitives/0/attributes/POSITION",
            json!(9),
            &["no accessor 9"],
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(9),
            &["no accessor 9"],
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!("x"),
            &["name no accessor"],
        ),
        (
            "/meshes/0/primitives/0/indices",
            json!(0),
            &["indices are not whole numbers"],
        ),
    ] {
        let all = [words, &["mesh 0 `square`, primitive 0"]].concat();
        case(path).set(path, value).load().fails(&all);
    }
}

#[test]
fn faces_are_listed_in_any_way() {
    let listed = |name, component: u32, data: Vec<u8>, count: usize, mode: u32| {
        case(name)
            .accessor(data, component, "SCALAR", count)
            .set("/meshes/0/primitives/0/indices", json!(2))
            .set("/meshes/0/primitives/0/mode", json!(mode))
    };
    let words = |list: &[u32]| {
        list.iter()
            .flat_map(|x| x.to_le_bytes())
            .collect::<Vec<_>>()
    };
    listed("bytes", 5121, vec![0, 1, 2, 0, 2, 3], 6, 4)
        .load()
        .whole(2);
    listed("words", 5125, words(&[0, 1, 2, 0, 2, 3]), 6, 4)
        .load()
        .whole(2);
    listed("signed", 5124, words(&[0, 1, 2, 0, 2, 3]), 6, 4)
        .load()
        .whole(2);
    listed("a strip", 5121, vec![0, 1, 3, 2], 4, 5)
        .load()
        .whole(2);
    listed("a fan", 5121, vec![0, 1, 2, 3], 4, 6)
        .load()
        .whole(2);
    listed(
        "a restart of bytes",
        5121,
        vec![0, 1, 3, 255, 1, 2, 3],
        7,
        5,
    )
    .load()
    .whole(2);
    listed("a restart", 5123, shorts([0, 1, 3, 65_535, 1, 2, 3]), 7, 5)
        .load()
        .whole(2);
    listed(
        "a restart of words",
        5125,
        words(&[0, 1, 3, u32::MAX, 1, 2, 3]),
        7,
        5,
    )
    .load()
    .whole(2);
    listed(
        "restarts in a list",
        5121,
        vec![0, 1, 2, 255, 0, 2, 3, 255],
        8,
        4,
    )
    .load()
    .whole(2);
    listed("a face cut short", 5121, vec![0, 1, 2, 0, 2], 5, 4)
        .load()
        .but(
            1,
            &["end within a triangle", "mesh 0 `square`, primitive 0"],
        );
    listed("a vertex too many", 5121, vec![0, 1, 4], 3, 4)
        .load()
        .fails(&["vertex 4", "there are 4"]);
}

#[test]
fn vertices_that_lack_something_are_named() {
    for (name, components, word) in [("NORMAL", 3, "normal"), ("COLOR_0", 3, "colour")] {
        case("two of four")
            .accessor(floats(vec![1.0; 2 * components]), 5126, "VEC3", 2)
            .set(
                &format!("/meshes/0/primitives/0/attributes/{name}"),
                json!(2),
            )
            .load()
            .but(
                2,
                &[
                    &format!("vertices beyond the last {word}"),
                    "mesh 0 `square`, primitive 0",
                ],
            );
    }
    let mut broken = case("a vertex that is not finite");
    broken.bytes[36..40].copy_from_slice(&f32::NAN.to_le_bytes());
    let loaded = broken.load();
    assert_eq!(loaded.scene().report.dropped_non_finite, 1);
    loaded.but(
        1,
        &["vertices are not finite", "mesh 0 `square`, primitive 0"],
    );
}

#[test]
fn what_is_no_face_is_left_out() {
    case("-1 for none")
        .set("/meshes/0/primitives/0/indices", json!(-1))
        .set("/meshes/0/primitives/0/material", json!(-1))
        .set("/meshes/0/primitives/0/attributes/NORMAL", json!(-1))
        .set("/nodes/0/skin", json!(-1))
        .set("/nodes/0/camera", json!(-1))
        .load()
        .but(1, &["end within a triangle"]);
    case("no indices")
        .set("/meshes/0/primitives/0/indices", Value::Null)
        .load()
        .but(1, &["end within a triangle"]);
    case("a strip without indices")
        .set("/meshes/0/primitives/0/indices", Value::Null)
        .set("/meshes/0/primitives/0/mode", json!(6))
        .load()
        .whole(2);
    for mode in [0, 1, 3, 7] {
        let lines = json!({"mode": mode, "attributes": {"POSITION": 0}});
        case("lines")
            .primitive(lines)
            .load()
            .but(2, &["lines or points", "`square`, primitive 1"]);
    }
    let line = json!({"mode": 1, "attributes": {"POSITION": 0}});
    let two = case("lines, counted")
        .primitive(line.clone())
        .primitive(line)
        .load();
    two.but(2, &["(2, the first: mesh 0 `square`, primitive 1)"]);
    for (of, component, kind, [positions, indices]) in
        [(0, 5126, "VEC3", [2, 1]), (1, 5125, "SCALAR", [0, 2])]
    {
        let alone = case("nothing").set(&format!("/accessors/{of}/count"), json!(0));
        let told = ["no triangles", "without vertices left out", "primitive 0"];
        alone.load().fails(&told);
        let empty = json!({"componentType": component, "count": 0, "type": kind});
        case("an empty part")
            .set("/accessors/-", empty)
            .primitive(json!({"attributes": {"POSITION": positions}, "indices": indices}))
            .load()
            .but(2, &["without vertices left out", "primitive 1"]);
    }
    case("no positions")
        .primitive(json!({"attributes": {"NORMAL": 0}}))
        .load()
        .but(2, &["without positions", "primitive 1"]);
}

#[test]
fn other_attributes_are_read_in_every_type_or_named() {
    let with = |name, attribute: &str| {
        let path = format!("/meshes/0/primitives/0/attributes/{attribute}");
        case(name).set(&path, json!(2))
    };
    let red = [1.0, 0.0, 0.0];
    let white = json!({"pbrMetallicRoughness": {"metallicFactor": 0}});
    let half = json!({"pbrMetallicRoughness": {"baseColorFactor": [0.5, 0.5, 0.5, 1]}});
    let reds = floats(red.repeat(4));
    let colored = || with("colours", "COLOR_0").accessor(reds.clone(), 5126, "VEC3", 4);
    colored().load().whole(2).color(red);
    colored().material(white).load().whole(2).color(red);
    colored()
        .material(half)
        .load()
        .whole(2)
        .color([0.5, 0.0, 0.0]);
    let bytes = [255, 0, 0, 255].repeat(4);
    with("colours in bytes, not said to be normalised", "COLOR_0")
        .accessor(bytes.clone(), 5121, "VEC4", 4)
        .load()
        .whole(2)
        .color(red);
    with("colours in bytes of quantised data", "COLOR_0")
        .accessor(bytes, 5121, "VEC4", 4)
        .set("/accessors/2/normalized", json!(true))
        .set("/extensionsUsed", json!(["KHR_mesh_quantization"]))
        .load()
        .whole(2)
        .color(red);
    with("colours of some", "COLOR_0")
        .accessor(reds[..24].to_vec(), 5126, "VEC3", 2)
        .load()
        .but(2, &["vertices beyond the last colour"]);
    with("colours outside", "COLOR_0")
        .accessor(reds[..24].to_vec(), 5126, "VEC3", 4)
        .load()
        .but(2, &["`COLOR_0`, whose values are outside", "primitive 0"]);
    with("colours of two numbers", "COLOR_0")
        .accessor(reds, 5126, "VEC2", 4)
        .load()
        .but(2, &["`COLOR_0`, whose values have 2 components"]);
    let halves = floats([1.0, 0.0, 0.0, 0.5].repeat(4));
    let faded = || with("alpha", "COLOR_0").accessor(halves.clone(), 5126, "VEC4", 4);
    faded().load().whole(2).color(red);
    faded()
        .material(json!({"alphaMode": "BLEND"}))
        .load()
        .but(2, &["alpha of `COLOR_0`"]);
    let slanted = [90, 0, 90, 0].repeat(4);
    let normals = with("normals in bytes", "NORMAL")
        .accessor(slanted, 5120, "VEC3", 4)
        .set("/bufferViews/2/byteStride", json!(4))
        .load()
        .whole(2);
    let normal = crate::decode_normal(normals.scene().normals[0][0]).expect("a normal");
    let half = std::f64::consts::FRAC_1_SQRT_2;
    assert!(
        normal.distance(glam::DVec3::new(half, 0.0, half)) < 1e-3,
        "{normal}"
    );
    with("normals that are not there", "NORMAL")
        .load()
        .but(2, &["`NORMAL`, whose values", "accessor 2"]);
    with("tangents that nothing uses", "TANGENT")
        .load()
        .whole(2);
    with("joints", "JOINTS_0").load().but(2, &["`JOINTS_0`"]);
}

#[test]
fn compressed_views_are_decoded() {
    // Written by gltfpack 1.3 and by glTF Transform 4.5 from a square with red corners.
    let packed = "oAESAAAAATMAAAB+fQEEAAAAAQwAAAB+AAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAoAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAAA/wAA/wAAAOHwAAB2h1ZneKmGZYlomAFpAAAA";
    let extension = |offset: u32, length: u32, stride: u32, mode: &str, count: u32| {
        json!({"buffer": 0, "byteOffset": offset, "byteLength": length, "byteStride": stride,
            "mode": mode, "count": count})
    };
    let model = |name: &'static str, extension_name: &str| {
        let view = |stride: Value, packed: Value| {
            json!({"buffer": 1, "byteLength": 9999, "byteStride": stride,
                "extensions": {extension_name: packed}})
        };
        let mut packed_case = case(name)
            .set("/extensionsRequired", json!([extension_name, "KHR_mesh_quantization"]))
            .set("/buffers/-", json!({"byteLength": 60, "extensions": {extension_name: {"fallback": true}}}))
            .set("/bufferViews", json!([
                view(json!(8), extension(0, 60, 8, "ATTRIBUTES", 4)),
                view(json!(4), extension(60, 37, 4, "ATTRIBUTES", 4)),
                view(json!(null), extension(100, 19, 2, "TRIANGLES", 6))]))
            .set("/accessors", json!([
                {"bufferView": 0, "componentType": 5123, "count": 4, "type": "VEC3"},
                {"bufferView": 2, "componentType": 5123, "count": 6, "type": "SCALAR"},
                {"bufferView": 1, "componentType": 5121, "count": 4, "type": "VEC4", "normalized": true}]))
            .set("/meshes/0/primitives/0/attributes/COLOR_0", json!(2))
            .set("/nodes/0/scale", json!([6.10388815e-05, 6.10388815e-05, 6.10388815e-05]));
        packed_case.bytes = STANDARD.decode(packed).expect("base64");
        packed_case
    };
    for name in ["EXT_meshopt_compression", "KHR_meshopt_compression"] {
        model("compressed", name)
            .load()
            .whole(2)
            .color([1.0, 0.0, 0.0]);
    }
    let model = |name| model(name, "EXT_meshopt_compression");
    let extension = "/bufferViews/0/extensions/EXT_meshopt_compression";
    model("a stride of the extension alone")
        .set("/bufferViews/0/byteStride", Value::Null)
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    model("damaged")
        .set(&format!("{extension}/byteLength"), json!(50))
        .load()
        .fails(&["mesh 0", "buffer view 0", "is damaged", "ATTRIBUTES"]);
    model("too many")
        .set(&format!("{extension}/count"), json!(1_u64 << 40))
        .load()
        .fails(&["buffer view 0", "is damaged"]);
    let glb = model("compressed in a container").glb(b' ');
    model("compressed in a container")
        .load_as("model.glb", &glb)
        .whole(2);
}

#[test]
fn draco_is_refused_with_what_to_do_unless_the_data_is_there_too() {
    let name = "KHR_draco_mesh_compression";
    let both = |title| {
        let extension = json!({name: {"bufferView": 0, "attributes": {"POSITION": 0}}});
        case(title)
            .set("/extensionsUsed", json!([name]))
            .set("/meshes/0/primitives/0/extensions", extension)
    };
    both("data besides").load().whole(2);
    both("no other data")
        .set("/accessors/0/bufferView", Value::Null)
        .load()
        .fails(&[
            "mesh 0 `square`, primitive 0",
            name,
            "npx @gltf-transform/cli copy IN OUT",
        ]);
    case("required and not used")
        .set("/extensionsRequired", json!([name]))
        .load()
        .whole(2);
}
