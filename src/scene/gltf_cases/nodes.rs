//! Scenes, nodes and what hangs on them.

use super::*;

#[test]
fn a_scene_begins_somewhere() {
    let two = |name| {
        case(name).set(
            "/nodes/-",
            json!({"mesh": 0, "translation": [3, 0, 0], "name": "b"}),
        )
    };
    let no_scenes = |case: Case| case.set("/scenes", Value::Null).set("/scene", Value::Null);
    no_scenes(two("no scenes")).load().whole(4);
    no_scenes(two("no scenes, but children"))
        .set("/nodes/1/children", json!([0]))
        .load()
        .whole(4)
        .corner([4.0, 1.0, 0.0]);
    two("no default scene")
        .set("/scene", Value::Null)
        .load()
        .whole(2);
    two("an empty list of scenes")
        .set("/scenes", json!([]))
        .load()
        .but(4, &["scene 0"]);
    two("a scene that is not there")
        .set("/scene", json!(7))
        .load()
        .but(2, &["the scene to show is not there", "scene 7"]);
    two("another scene")
        .set("/scenes/-", json!({"name": "night", "nodes": [1]}))
        .load()
        .but(
            2,
            &["scenes that are not the one to show are left out (scene 1 `night`)"],
        );
    two("the second scene")
        .set("/scenes/-", json!({"nodes": [0, 1]}))
        .set("/scene", json!(1))
        .set("/scenes/0/nodes", json!([]))
        .load()
        .whole(4);
    case("no nodes")
        .set("/nodes", Value::Null)
        .load()
        .fails(&["no triangles"]);
    case("an empty scene")
        .set("/scenes/0/nodes", json!([]))
        .load()
        .fails(&["no triangles", "the scene to show has no nodes (scene 0)"]);
    two("a root that is not there")
        .set("/scenes/0/nodes", json!([0, 9]))
        .load()
        .but(2, &["named but not there", "node 9"]);
}

#[test]
fn nodes_are_drawn_wherever_they_stand() {
    let of = |name, nodes: Value| case(name).set("/nodes", nodes);
    let moved = |by: u32| json!({"translation": [by, 0, 0], "children": [2]});
    of(
        "two parents",
        json!([{"children": [1, 3]}, moved(3), {"mesh": 0, "name": "leg"}, moved(6)]),
    )
    .load()
    .but(4, &["children of several nodes", "node 2 `leg`"])
    .corner([4.0, 1.0, 0.0]);
    of(
        "a child listed as a root",
        json!([{"children": [1]}, {"mesh": 0}]),
    )
    .set("/scenes/0/nodes", json!([0, 1]))
    .load()
    .but(2, &["listed as roots", "node 1"]);
    of("a root listed twice", json!([{"mesh": 0}]))
        .set("/scenes/0/nodes", json!([0, 0]))
        .load()
        .but(2, &["drawn once", "node 0"]);
    of(
        "its own child",
        json!([{"mesh": 0, "children": [0], "name": "snake"}]),
    )
    .load()
    .but(2, &["children of themselves", "node 0 `snake`"]);
    of(
        "a circle",
        json!([{"mesh": 0, "children": [1]}, {"children": [0]}]),
    )
    .load()
    .but(2, &["children of themselves"]);
    of(
        "a circle without scenes",
        json!([{"mesh": 0, "children": [1]}, {"children": [0]}]),
    )
    .set("/scenes", Value::Null)
    .load()
    .but(2, &["children of themselves"]);
    of(
        "a child that is not there",
        json!([{"mesh": 0, "children": [7, "x", null]}]),
    )
    .load()
    .but(2, &["named but not there", "node 7"]);
    of(
        "a mesh that is not there",
        json!([{"mesh": 0, "children": [1]}, {"mesh": 5, "name": "gone"}]),
    )
    .load()
    .but(2, &["a mesh that is not there", "node 1 `gone`"]);
    // Each level shows the next twice: a small file with more places than can be walked.
    let levels = (1..40)
        .map(|k| json!({"children": [k, k]}))
        .chain([json!({"mesh": 0})]);
    let twice = of("doubled", levels.collect()).load();
    twice.fails(&["node ", "more than"]);
}

#[test]
fn transforms_may_be_rounded_flat_or_broken() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    let with = |name, key: &str, value: Value| case(name).set(&format!("/nodes/0/{key}"), value);
    with("a turn", "rotation", json!([0, 0, half, half]))
        .load()
        .whole(2)
        .corner([-1.0, 1.0, 0.0]);
    with("a long quaternion", "rotation", json!([0, 0, 3, 3]))
        .load()
        .whole(2)
        .corner([-1.0, 1.0, 0.0]);
    with("no rotation", "rotation", json!([0, 0, 0, 0]))
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    with("a mirror", "scale", json!([-1, 1, 1]))
        .load()
        .whole(2)
        .corner([-1.0, 1.0, 0.0]);
    with("a flat scale", "scale", json!([2, 2, 0]))
        .load()
        .whole(2)
        .corner([2.0, 2.0, 0.0]);
    let identity = [1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1, 0, 5, 0, 0, 1];
    with("a matrix", "matrix", json!(identity))
        .load()
        .whole(2)
        .corner([6.0, 1.0, 0.0]);
    let transposed = [1, 0, 0, 5, 0, 1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1];
    with("a matrix row by row", "matrix", json!(transposed))
        .load()
        .but(2, &["last row is not 0, 0, 0, 1", "node 0"])
        .corner([1.0, 1.0, 0.0]);
    let mut broken: Vec<Value> = identity.iter().map(|x| json!(x)).collect();
    broken[12] = Value::Null;
    with("a matrix of NaN", "matrix", json!(broken))
        .load()
        .fails(&[
            "no triangles",
            "all 2 have a NaN",
            "numbers missing",
            "node 0",
        ]);
    with("a short translation", "translation", json!([1, 2]))
        .load()
        .fails(&["all 2 have a NaN", "numbers missing", "node 0"]);
    with("a scale of one number", "scale", json!(2))
        .load()
        .but(2, &["no list of numbers", "node 0"])
        .corner([1.0, 1.0, 0.0]);
    with("a mesh by its name", "mesh", json!("square"))
        .load()
        .fails(&["a mesh that is not there", "node 0"]);
    with("far away", "translation", json!([0, 4_649_776, 0]))
        .load()
        .but(2, &["rounded to steps of 0.5, and the model is 1"]);
    with("a matrix and a scale", "matrix", json!(identity))
        .set("/nodes/0/scale", json!([9, 9, 9]))
        .load()
        .but(2, &["the matrix counts", "node 0"])
        .corner([6.0, 1.0, 0.0]);
    let beside = case("a broken node beside others")
        .set("/nodes/-", json!({"mesh": 0, "matrix": broken}))
        .set("/scenes/0/nodes", json!([0, 1]))
        .load();
    assert_eq!(beside.scene().triangles.len(), 2);
    assert_eq!(beside.scene().report.dropped_non_finite, 2);
}

#[test]
fn what_hangs_on_nodes_is_drawn_or_named() {
    let on = |name, key: &str, value: Value| case(name).set(&format!("/nodes/0/{key}"), value);
    let beside = json!([{"mesh": 0}, {"mesh": 0, "extensions": {"KHR_node_visibility": {"visible": false}}}]);
    case("a hidden node")
        .set("/nodes", beside)
        .set("/scenes/0/nodes", json!([0, 1]))
        .set("/extensionsRequired", json!(["KHR_node_visibility"]))
        .load()
        .whole(2);
    on("a camera", "camera", json!(0))
        .set(
            "/cameras",
            json!([{"type": "perspective", "perspective": {"yfov": 0.5, "znear": 0.1}}]),
        )
        .load()
        .whole(2);
    for camera in [
        json!({"name": "plan", "type": "orthographic", "orthographic": {"xmag": 1}}),
        json!({"name": "plan"}),
        json!({"name": "plan", "type": "perspective", "perspective": null}),
    ] {
        on("another camera", "camera", json!(0))
            .set("/cameras", json!([camera]))
            .load()
            .but(2, &["without a perspective", "camera 0 `plan`"]);
    }
    on("no camera", "camera", json!(3))
        .load()
        .but(2, &["camera 3"]);
    on("a camera that sees nothing", "camera", json!(0))
        .set("/cameras", json!([{"perspective": {"yfov": 9}}]))
        .load()
        .but(2, &["a camera of the file was ignored", "camera 0"]);
    on("two cameras", "camera", json!(0))
        .set(
            "/cameras",
            json!([{"perspective": {"yfov": 0.5}}, {"name": "top"}]),
        )
        .set("/nodes/-", json!({"camera": 1}))
        .set("/scenes/0/nodes", json!([0, 1]))
        .load()
        .but(2, &["behind the first", "camera 1 `top`"]);
    let reaching = json!({"KHR_lights_punctual": {"lights": [{"type": "point", "range": 5}]}});
    on(
        "a light with a range",
        "extensions",
        json!({"KHR_lights_punctual": {"light": 0}}),
    )
    .set("/extensions", reaching)
    .load()
    .but(2, &["`range` of lights (node 0)"]);
    // By the node, whatever its number among the lights that are left.
    let odd = json!({"KHR_lights_punctual": {"lights": [
        {"type": "ambient"}, {"type": "point", "intensity": -1}, {"type": "point", "intensity": 0},
        {"type": "spot", "spot": {"innerConeAngle": 20, "outerConeAngle": 45}}, {"type": "point"}
    ]}});
    let mut lit = case("lights that cannot shine").set("/extensions", odd);
    for index in 0..5 {
        let node = json!({"extensions": {"KHR_lights_punctual": {"light": index}}});
        lit = lit.set("/nodes/-", node);
        lit = lit.set("/scenes/0/nodes/-", json!(index + 1));
    }
    let lit = lit.load();
    assert_eq!(lit.scene().lights.len(), 1);
    lit.but(
        2,
        &[
            "unknown type are left out (node 1)",
            "a light is left out: its intensity is negative (node 2)",
            "a light is left out: its power is 0 (node 3)",
            "a light is left out: its cone is none: 0 ≤ inner ≤ outer ≤ π does not hold (node 4)",
        ],
    );
    let light = |index: u32| json!({"KHR_lights_punctual": {"light": index}});
    let lights = json!({"KHR_lights_punctual": {"lights": [{"type": "spot"}, {"type": "area"}]}});
    let lit = on("a light", "extensions", light(0))
        .set("/extensions", lights.clone())
        .load()
        .whole(2);
    assert_eq!(lit.scene().lights.len(), 1);
    for index in [1, 2] {
        on("no light", "extensions", light(index))
            .set("/extensions", lights.clone())
            .load()
            .but(
                2,
                &["lights that are missing or of an unknown type", "node 0"],
            );
    }
    on("a skin", "skin", json!(0))
        .set("/skins", json!([{"joints": "broken"}]))
        .load()
        .but(
            2,
            &["a skin or morph targets", "rest shape", "mesh 0 `square`"],
        );
    let animation = json!([{"channels": [{"target": {"path": "pointer"}}]}, {"name": "walk"}]);
    case("animations")
        .set("/animations", animation)
        .load()
        .but(2, &["animations (2, the first: animation 0)"]);
}

#[test]
fn instances_are_drawn_in_every_type() {
    let name = "EXT_mesh_gpu_instancing";
    let with = |title, attributes: Value| {
        let extension = json!({name: {"attributes": attributes}});
        case(title)
            .accessor(vec![0, 0, 0, 0, 5, 0, 0, 0], 5120, "VEC3", 2)
            .set("/bufferViews/2/byteStride", json!(4))
            .accessor(floats([1.0, 1.0, 1.0, 2.0, 2.0, 2.0]), 5126, "VEC3", 2)
            .set("/nodes/0/extensions", extension)
            .set("/extensionsRequired", json!([name]))
    };
    let scene = with("two", json!({"TRANSLATION": 2, "SCALE": 3}))
        .load()
        .whole(4);
    assert_eq!(
        scene.scene().triangles[2].vertices[2],
        Vec3::new(7.0, 2.0, 0.0)
    );
    let still = with(
        "turned by nothing",
        json!({"TRANSLATION": 2, "ROTATION": 4}),
    )
    .accessor(floats([0.0; 8]), 5126, "VEC4", 2)
    .load()
    .whole(4);
    assert_eq!(
        still.scene().triangles[2].vertices[2],
        Vec3::new(6.0, 1.0, 0.0)
    );
    with("nothing to tell them apart", json!({"_ID": 3}))
        .load()
        .but(2, &["`_ID` of instances", "node 0"]);
    with("of several numbers", json!({"TRANSLATION": 2, "SCALE": 0}))
        .load()
        .fails(&["node 0", "of 2 and of 4 instances"]);
    with("listed below zeros", json!({"TRANSLATION": 2}))
        .set("/accessors/2/bufferView", Value::Null)
        .load()
        .whole(4);
}

#[test]
fn extensions_that_are_not_read_refuse_nothing_and_are_named() {
    for key in ["extensionsUsed", "extensionsRequired"] {
        case("required")
            .set(
                &format!("/{key}"),
                json!(["X_own", "KHR_texture_transform", "KHR_texture_basisu"]),
            )
            .load()
            .but(
                2,
                &[
                    "the extension `X_own`",
                    "the extension `KHR_texture_basisu`",
                ],
            );
    }
    case("where it is")
        .set("/extensionsUsed", json!(["MSFT_lod"]))
        .set("/nodes/0/extensions", json!({"MSFT_lod": {"ids": [1]}}))
        .set(
            "/nodes/-",
            json!({"name": "far", "extensions": {"MSFT_lod": null}}),
        )
        .load()
        .but(2, &["the extension `MSFT_lod` (2, the first: node 0)"]);
    case("not declared")
        .set(
            "/accessors/0/extensions",
            json!({"X_deep": {"extensions": {"X_deeper": {}}}}),
        )
        .load()
        .but(2, &["`X_deep` (accessor 0)", "`X_deeper` (accessor 0)"]);
    for (key, value) in [
        ("samplers", json!([{"magFilter": "soft", "wrapS": 1}])),
        (
            "images",
            json!([{}, {"uri": "none.png"}, {"bufferView": 77}]),
        ),
        ("textures", json!([{"source": 99}])),
        ("skins", json!([{}])),
        ("cameras", json!([{"type": 3}])),
        ("extras", json!({"extensions": {"X_own": {}}})),
        (
            "materials",
            json!([{"alphaMode": 7, "pbrMetallicRoughness": {"baseColorTexture": null}}]),
        ),
    ] {
        case("broken, but not used")
            .set(&format!("/{key}"), value)
            .load()
            .whole(2);
    }
    case("an accessor that nothing uses")
        .set("/accessors/-", json!({"componentType": 5, "type": "MAT9"}))
        .load()
        .whole(2);
    case("what applications keep")
        .set("/nodes/0/extras", json!({"extensions": {"X_own": {}}}))
        .load()
        .whole(2);
    case("the nearest texel")
        .set(
            "/samplers",
            json!([{"magFilter": 9729}, {"magFilter": 9728}]),
        )
        .load()
        .but(2, &["nearest texel", "sampler 1"]);
    case("of the document")
        .set(
            "/extensions",
            json!({"X_own": {}, "KHR_lights_punctual": {}}),
        )
        .load()
        .but(2, &["the extension `X_own`"]);
    case("a later reader")
        .set("/asset/minVersion", json!("2.1"))
        .load()
        .but(2, &["readers of glTF 2.1"]);
    case("values of other types")
        .set("/nodes/0/name", json!(5))
        .set("/nodes/0/children", json!(null))
        .set("/meshes/0/name", json!(null))
        .load()
        .whole(2);
}

#[test]
fn meshes_that_no_node_shows_are_named() {
    case("meshes without nodes")
        .set("/nodes/0", json!({}))
        .load()
        .fails(&["no triangles", "no node shows one (mesh 0 `square`)"]);
}

/// The view matrix has the scaling ignored (glTF 2.0, 3.10.2).
#[test]
fn no_scale_turns_a_camera_around() {
    let half = std::f64::consts::FRAC_1_SQRT_2;
    for (above, own) in [
        (json!({}), json!({"scale": [1, 1, -1]})),
        (json!({}), json!({"scale": [-1, -1, -1]})),
        (json!({}), json!({"scale": [0, 0, 0]})),
        (json!({"scale": [1, -1, -1]}), json!({})),
        (
            json!({}),
            json!({"matrix": [-2, 0, 0, 0, 0, 1, 0, 0, 0, 0, 3, 0, 0, 0, 0, 1]}),
        ),
        // About z, and stretched along y after that.
        (
            json!({"scale": [1, 9, 1]}),
            json!({"rotation": [0, 0, half, half]}),
        ),
        (
            json!({"matrix": [0, 2, 0, 0, -2, 0, 0, 0, 0, 0, 2, 0, 0, 0, 0, 1]}),
            json!({}),
        ),
    ] {
        let is_turned = [&above, &own]
            .iter()
            .any(|node| !node["rotation"].is_null() || node["matrix"][0] == 0);
        let mut camera = own.clone();
        camera["camera"] = json!(0);
        let mut top = above.clone();
        top["children"] = json!([2]);
        top["translation"] = json!([0, 0, 5]);
        if !top["matrix"].is_null() {
            top["matrix"][14] = json!(5);
        }
        let found = case("a scaled camera")
            .set("/cameras", json!([{"perspective": {"yfov": 0.5}}]))
            .set("/nodes/-", top)
            .set("/nodes/-", camera)
            .set("/scenes/0/nodes", json!([0, 1]))
            .load();
        let camera = found.scene().camera.expect("a camera");
        let forward = (camera.target - camera.eye).normalize();
        let up = if is_turned { Vec3::NEG_X } else { Vec3::Y };
        assert_eq!(camera.eye, Vec3::new(0.0, 0.0, 5.0), "{above} {own}");
        assert!(forward.distance(Vec3::NEG_Z) < 1e-6, "{above} {own}");
        assert!(
            camera.up.distance(up) < 1e-6,
            "{above} {own}: {}",
            camera.up
        );
    }
}
