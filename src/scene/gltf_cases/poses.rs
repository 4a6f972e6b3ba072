//! Morph targets and skins.

use super::*;

/// The corner of the square at rest is (1, 1, 0); its target moves it by (0, 0, 4).
#[test]
fn morph_targets_are_drawn_by_the_weights_of_the_file() {
    let moved = |name| {
        case(name)
            .accessor(floats([0.0, 0.0, 4.0].repeat(4)), 5126, "VEC3", 4)
            .set("/meshes/0/primitives/0/targets", json!([{"POSITION": 2}]))
    };
    moved("without weights")
        .load()
        .whole(2)
        .corner([1.0, 1.0, 0.0]);
    let by_mesh = moved("of the mesh").set("/meshes/0/weights", json!([0.5]));
    by_mesh.load().whole(2).corner([1.0, 1.0, 2.0]);
    let by_node = moved("of the node")
        .set("/meshes/0/weights", json!([0.5]))
        .set("/nodes/0/weights", json!([0.25]))
        .set("/nodes/-", json!({"mesh": 0, "translation": [3, 0, 0]}))
        .set("/scenes/0/nodes", json!([0, 1]));
    let loaded = by_node.load().whole(4).corner([1.0, 1.0, 1.0]);
    let scene = loaded.scene();
    assert_eq!(scene.triangles[2].vertices[2], Vec3::new(4.0, 1.0, 2.0));
    let assembly = scene.assembly.as_ref().expect("instances");
    assert_eq!(assembly.instances().len(), 2);
    moved("that are not there")
        .set("/meshes/0/primitives/0/targets", json!([{"POSITION": 99}]))
        .set("/meshes/0/weights", json!([1]))
        .load()
        .but(
            2,
            &["`POSITION` of morph targets", "accessor 99", "primitive 0"],
        );
    moved("shorter than the square")
        .set("/accessors/2/count", json!(3))
        .set("/meshes/0/weights", json!([0.5]))
        .load()
        .but(
            2,
            &["`POSITION` of vertices beyond the last", "primitive 0"],
        )
        .corner([1.0, 1.0, 2.0]);
}

/// White becomes (0.5, 0.25, 1) by half of (−1, −1.5, 2): what is above 1 is 1.
#[test]
fn morph_targets_change_colours_and_coordinates() {
    for (kind, target) in [
        ("VEC3", &[-1.0, -1.5, 2.0][..]),
        ("VEC4", &[-1.0, -1.5, 2.0, 0.0]),
    ] {
        case("a colour")
            .accessor(floats([1.0; 12]), 5126, "VEC3", 4)
            .accessor(floats(target.repeat(4)), 5126, kind, 4)
            .set("/meshes/0/primitives/0/attributes/COLOR_0", json!(2))
            .set("/meshes/0/primitives/0/targets", json!([{"COLOR_0": 3}]))
            .set("/meshes/0/weights", json!([0.5]))
            .load()
            .whole(2)
            .color([0.5, 0.25, 1.0]);
    }
    let uvs = CORNERS.iter().flat_map(|[x, y, _]| [*x, *y]);
    let loaded = case("coordinates")
        .accessor(floats(uvs), 5126, "VEC2", 4)
        .accessor(floats([2.0, -1.0].repeat(4)), 5126, "VEC2", 4)
        .set("/meshes/0/primitives/0/attributes/TEXCOORD_0", json!(2))
        .set("/meshes/0/primitives/0/targets", json!([{"TEXCOORD_0": 3}]))
        .set("/meshes/0/weights", json!([0.5]))
        .material(json!({"pbrMetallicRoughness": {"baseColorTexture": {"index": 0}}}))
        .set("/textures", json!([{"source": 0}]))
        .set("/images", json!([{"uri": "wood.ppm"}]))
        .file("wood.ppm", b"P6 1 1 255\n\x01\x02\x03".to_vec())
        .load()
        .whole(2);
    // The far corner has (1, 1).
    assert_eq!(loaded.scene().uvs[0][2], glam::Vec2::new(2.0, 0.5));
}

/// The corner (1, 1, 0) belongs to the second joint alone, the others to the first. The node's own
/// scale means nothing.
#[test]
fn skins_are_drawn_as_their_joints_stand() {
    let skinned = |name| {
        let mut weights = [1.0, 0.0, 0.0, 0.0].repeat(4);
        weights[8..12].copy_from_slice(&[0.0, 0.5, 0.0, 0.0]);
        let identity = |x: f32| {
            let mut matrix = [0.0; 16];
            [0, 5, 10, 15].into_iter().for_each(|k| matrix[k] = 1.0);
            matrix[12] = x;
            matrix
        };
        let inverse = [identity(0.0), identity(-0.5)].concat();
        case(name)
            .accessor([0, 1, 0, 0].repeat(4), 5121, "VEC4", 4)
            .accessor(floats(weights), 5126, "VEC4", 4)
            .accessor(floats(inverse), 5126, "MAT4", 2)
            .set("/meshes/0/primitives/0/attributes/JOINTS_0", json!(2))
            .set("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(3))
            .set(
                "/nodes",
                json!([
                {"mesh": 0, "skin": 0, "scale": [100, 100, 100]},
                {"children": [2], "translation": [0, 0, 3]}, {"scale": [2, 2, 2]}]),
            )
            .set("/scenes/0/nodes", json!([0, 1]))
            .set(
                "/skins",
                json!([{"joints": [1, 2], "inverseBindMatrices": 4}]),
            )
    };
    let loaded = skinned("two joints").load().whole(2);
    let corners = loaded.scene().triangles[0].vertices;
    assert_eq!(corners[1], Vec3::new(1.0, 0.0, 3.0));
    loaded.corner([1.0, 2.0, 3.0]);
    let mut weights = [1.0, 0.0, 0.0, 0.0].repeat(4);
    weights[4..12].copy_from_slice(&[0.0, 0.0, 0.0, 0.0, 0.0, 0.5, 0.0, 0.0]);
    let loaded = skinned("a vertex without weights")
        .accessor(floats(weights), 5126, "VEC4", 4)
        .set("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(5))
        .load();
    let corners = loaded.scene().triangles[0].vertices;
    assert_eq!(corners[1], Vec3::new(1.0, 0.0, 3.0));
    loaded
        .but(2, &["have no weights", "primitive 0"])
        .corner([1.0, 2.0, 3.0]);
    for (key, value) in [
        ("/skins/0/inverseBindMatrices", json!(1)),
        ("/skins/0/joints", json!([1])),
        ("/skins/0/joints", json!([1, 7])),
        ("/meshes/0/primitives/0/attributes/WEIGHTS_0", json!(99)),
        ("/accessors/3/count", json!(3)),
    ] {
        skinned("broken")
            .set(key, value)
            .load()
            .but(2, &["rest shape"]);
    }
    skinned("joints that are children of each other")
        .set("/nodes/2/children", json!([1]))
        .load()
        .but(2, &["children of themselves"]);
}
