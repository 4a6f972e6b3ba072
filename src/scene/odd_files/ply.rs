//! PLY.

use super::{Fails, Outcome, Reads, check, load_files};
use crate::decode_normal;

const CORNERS: &str = "0 0 0\n1 0 0\n1 1 0\n0 1 0\n";

/// Header and body between `format` and the end; `V` stands for four vertices of floats, `F` for
/// faces with a list of ints, `E` for the end of the header, `C` for the corners of a square.
const PLY: &[(&str, Outcome)] = &[
    ("V4F1E C4 0 1 2 3\n", Reads("..", &[])),
    (
        "element verteX 4\nproperty float x\nproperty float y\nproperty float z\nelement fAce 1\nproperty list uchar int vertex_Indices\nproperty list uchar int other\nE C4 0 1 2 3 1 7\n",
        Reads("..", &["`other` of `face` (line 9)"]),
    ),
    (
        "V5F1E C nan nan nan\n4 0 1 2 3\n",
        Reads("..", &["1 vertex is not finite (vertex 4)"]),
    ),
    (
        "V5F2E C -inf 1.#QNAN -nan(ind)\n4 0 1 2 3\n3 0 1 4\n",
        Reads(
            "..",
            &["1 triangle dropped", "1 vertex is not finite (vertex 4)"],
        ),
    ),
    (
        "V4F1E 0. 0. .0\n1. 0. 0\n+1 1.0D+00 -0.\n.0 1e0 0\n4 0 1 2 3\n",
        Reads("..", &[]),
    ),
    (
        "V4F1E 0 0\n0 1\n\n0 0 1 1 0 0 1 0 4 0\n1 2\n3",
        Reads("..", &[]),
    ),
    ("V4F1E C4 0 1\u{c}2\t3 ", Reads("..", &[])),
    (
        "V4F1E C4 0 1 2 3\n7 8 9\n",
        Reads("..", &["the rest behind the last element (line 15)"]),
    ),
    ("V4F1E C4 0 1 2 3\n\u{1a}", Reads("..", &[])),
    (
        "comment \u{fc}\nobj_info num_cols 4\ncomment TextureFile a.png\nV4F1E C4 0 1 2 3\n",
        Reads("..", &["`TextureFile`"]),
    ),
    (
        "V4property float scalar_C2M_distances[<0.5]_(2)\nproperty uchar a b\nF1E 0 0 0 1 2\n1 0 0 1 2\n1 1 0 1 2\n0 1 0 x -\n4 0 1 2 3\n",
        Reads(
            "..",
            &["`scalar_C2M_distances[<0.5]_(2)` of `vertex` (line 7), `a b` of `vertex` (line 8)"],
        ),
    ),
    (
        "V4property float x\nproperty list uchar float w\nF1E 0 0 0 9 0\n1 0 0 9 2 5 5\n1 1 0 9 0\n0 1 0 9 1 7\n4 0 1 2 3\n",
        Reads(
            "..",
            &["`x` of `vertex` (line 7), `w` of `vertex` (line 8)"],
        ),
    ),
    (
        "V4property string name\nF1E 0 0 0 a\n1 0 0 b\n1 1 0 c\n0 1 0 d\n4 0 1 2 3\n",
        Reads("..", &["`name` of `vertex`"]),
    ),
    (
        "V4property uchar red\nproperty uchar green\nproperty uchar blue\nF1E 0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n4 0 1 2 3\n",
        Reads("rr", &[]),
    ),
    (
        "V4property float diffuse_red\nproperty float diffuse_green\nproperty float diffuse_blue\nF1E 0 0 0 0 1 0\n1 0 0 0 1 0\n1 1 0 0 nan 0\n0 1 0 0 1 0\n4 0 1 2 3\n",
        Reads("gg", &["1 vertex has a colour beyond 0 to 1 (vertex 2)"]),
    ),
    (
        "V4element tristrips 1\nproperty list int int vertex_indices\nE C5 0 1 3 2 -1\n",
        Reads("..", &[]),
    ),
    (
        "V4element tristrips 1\nproperty list int uint vertex_indices\nF1E C9 0 1 3 4294967295 0 1 1 3 2\n3 0 1 2\n",
        Reads("...", &[]),
    ),
    ("F1V4E 4 0 1 2 3\nC", Reads("..", &[])),
    (
        "V4F2property uchar red\nproperty uchar green\nproperty uchar blue\nproperty uchar alpha\nE C4 0 1 2 3 255 0 0 9\n3 0 1 2 0 9 255 0\n",
        Reads("rrb", &["`alpha` of `face`"]),
    ),
    (
        "F2property float r\nproperty float g\nproperty float b\nV4E 3 0 1 2 0 1 0\n4 0 1 2 3 0 0 2\nC",
        Reads("gbb", &["1 face has a colour beyond 0 to 1 (face 1)"]),
    ),
    (
        "element tristrips 1\nproperty list int int vertex_indices\nF1property uchar red\nproperty uchar green\nproperty uchar blue\nV4E 5 0 1 3 2 -1\n3 0 1 2 255 0 0\nC",
        Reads("..r", &[]),
    ),
    (
        "V4property uchar red\nproperty uchar green\nproperty uchar blue\nF1property uchar red\nproperty uchar green\nproperty uchar blue\nE 0 0 0 255 0 0\n1 0 0 255 0 0\n1 1 0 255 0 0\n0 1 0 255 0 0\n4 0 1 2 3 0 0 255\n",
        Reads(
            "rr",
            &["`red` of `face` (line 12), `green` of `face` (line 13), `blue` of `face` (line 14)"],
        ),
    ),
    (
        "F1V4E 3 0 1 4\nC",
        Fails(&["face 0", "vertex 4, but there are 4, the first of them 0"]),
    ),
    (
        "element camera 1\nproperty float view\nproperty list uchar int ids\nV4F1E 0.5 2 1 2\nC4 0 1 2 3\n",
        Reads("..", &["the element `camera` (line 3)"]),
    ),
    (
        "V4F1element edge 3\nproperty int a\nE C4 0 1 2 3\n1\n",
        Reads("..", &["the element `edge`"]),
    ),
    (
        "V4element face 1\nproperty list uint8 int32 vertex_index\nproperty int part\nE C4 0 1 2 3 9\n",
        Reads("..", &["`part` of `face`"]),
    ),
    (
        "V4element face 1\nproperty list uchar int flags\nproperty list uchar int vertices\nE C2 7 7 4 0 1 2 3\n",
        Reads("..", &["`flags` of `face`"]),
    ),
    (
        "V4element face 1\nproperty list uchar float texcoord\nproperty list uchar int corners\nE C1 0.5 4 0 1 2 3\n",
        Reads("..", &["`texcoord` of `face`"]),
    ),
    (
        "V4F2E C2 0 1\n4 0. 1. 2. 3.\n",
        Reads("..", &["1 face has fewer than three corners (face 0)"]),
    ),
    (
        "V4F1E C2 0 1\n",
        Fails(&[
            "no triangles",
            "1 face has fewer than three corners (face 0)",
        ]),
    ),
    (
        "V4element range_grid 1\nproperty list uchar int vertex_indices\nE C1 0\n",
        Fails(&["no triangles", "the element `range_grid`"]),
    ),
    ("V4E C", Fails(&["no triangles (it lists no faces)"])),
    (
        "V4F2E C4 0 1 2 3\n3 0 1",
        Fails(&["face 1 of 2, line 15): the file ends here"]),
    ),
    (
        "V4F1E C4 0 1 2 9\n",
        Fails(&["face 0 of 1, line 14", "vertex 9, but there are 4"]),
    ),
    (
        "V4F1E C4 0 1 2 0.5\n",
        Fails(&[
            "face 0 of 1, line 14",
            "`0.5` is not the number of a vertex",
        ]),
    ),
    ("V4F1E C-1 0 1 2\n", Fails(&["face 0 of 1", "-1 items"])),
    (
        "V4F1E 0 0 0\n0 x\ty 0\n",
        Fails(&["vertex 1 of 4, line 11", "`x` is not a number"]),
    ),
    (
        "V4000F1E C4 0 1 2 3\n",
        Fails(&[
            "element `vertex`",
            "4000 elements are announced, more than the file can hold",
        ]),
    ),
    (
        "V4element face 1\nproperty int n\nE C3\n",
        Fails(&["element `face`", "vertex_indices"]),
    ),
    (
        "element vertices 1\nproperty float x\nF1E 0\n3 0 0 0\n",
        Fails(&["header", "no element `vertex`"]),
    ),
    (
        "V4F1E 0,5 0 0\n",
        Fails(&[
            "vertex 0 of 4, line 10",
            "`0,5` is not a number; decimals are written with a point",
        ]),
    ),
    (
        "element vertex 4\nproperty float X\nproperty float Y\nproperty float Z\nF1E C4 0 1 2 3\n",
        Reads("..", &[]),
    ),
    (
        "property float x\nV4F1E C",
        Fails(&["header, line 3", "before the first element"]),
    ),
    (
        "element vertex many\nE ",
        Fails(&["header, line 3", "`many`"]),
    ),
    (
        "element camera 9\nproperty int id\nV4F1E 1 2",
        Fails(&["element `camera`, 2 of 9, line 12"]),
    ),
    ("V4F1", Fails(&["header", "end_header"])),
];

/// Expands the abbreviations of [`PLY`].
fn ply(text: &str) -> String {
    let mut out = "ply\nformat ascii 1.0\n".to_owned();
    let (mut header, body) = match text.split_once("E ") {
        Some((header, body)) => (
            header.to_owned() + "end_header\n",
            body.replace('C', CORNERS),
        ),
        None => (text.to_owned(), String::new()),
    };
    let list = "property list uchar int vertex_indices\n";
    let axes = "property float x\nproperty float y\nproperty float z\n";
    for digits in ["4000", "1", "2", "4", "5"] {
        header = header.replace(
            &format!("V{digits}"),
            &format!("element vertex {digits}\n{axes}"),
        );
        header = header.replace(
            &format!("F{digits}"),
            &format!("element face {digits}\n{list}"),
        );
    }
    out += &header;
    out + &body
}

#[test]
fn ply_files_as_found_are_read() {
    for (text, expected) in PLY {
        let text = ply(text);
        let latin1: Vec<u8> = text.chars().map(|c| c as u8).collect();
        let variants = [
            text.as_bytes().to_vec(),
            latin1,
            [b"\xef\xbb\xbf", text.as_bytes()].concat(),
            text.replace('\n', "\r\n").into_bytes(),
            text.replace('\n', "\r").into_bytes(),
        ];
        for bytes in variants {
            check(&text, load_files(&[("a.ply", &bytes)]), expected);
        }
    }
}

#[test]
fn a_byte_order_mark_may_stand_behind_the_header() {
    let text = ply("V4F1E C4 0 1 2 3\n").replace("end_header\n", "end_header\n\u{feff}");
    check(
        "a mark",
        load_files(&[("a.ply", text.as_bytes())]),
        &Reads("..", &[]),
    );
}

#[test]
fn binary_ply_files_have_any_types_and_orders_and_line_ends() {
    let header = "ply\nformat ORDER 1.0\nelement face 1\nproperty list uint16 int8 vertex_index\n\
        property list uchar double t\nelement vertex 4\nproperty float64 x\nproperty uint8 y\n\
        property int64 name\nproperty int16 z\nproperty uint8 r\nproperty uint8 g\nproperty uint8 b\n\
        end_header\n";
    for (order, end, is_big) in [
        ("binary_little_endian", "\n", false),
        ("binary_big_endian", "\r\n", true),
        ("binary_big_endian", "\r", true),
    ] {
        let mut bytes = header
            .replace("ORDER", order)
            .replace('\n', end)
            .into_bytes();
        let mut put = |value: &[u8]| {
            if is_big {
                bytes.extend(value.iter().rev())
            } else {
                bytes.extend(value)
            }
        };
        put(&4_u16.to_le_bytes());
        (0..4_u8).for_each(|corner| put(&[corner]));
        put(&[2]);
        put(&1.5_f64.to_le_bytes());
        put(&2.5_f64.to_le_bytes());
        for (x, y) in [(0.0_f64, 0_u8), (1.0, 0), (1.0, 1), (0.0, 1)] {
            put(&x.to_le_bytes());
            put(&[y]);
            put(&7_i64.to_le_bytes());
            put(&(-2_i16).to_le_bytes());
            [255, 0, 0].into_iter().for_each(|part| put(&[part]));
        }
        let whole = load_files(&[("a.ply", &bytes)]);
        let last = whole.as_ref().map(|scene| scene.triangles[1].vertices[2]);
        assert_eq!(last, Ok(glam::Vec3::new(0.0, 1.0, -2.0)));
        check(
            order,
            whole,
            &Reads(
                "rr",
                &["`t` of `face` (line 5), `name` of `vertex` (line 9)"],
            ),
        );
        let short = load_files(&[("a.ply", &bytes[..bytes.len() - 1])]);
        check(
            order,
            short,
            &Fails(&["vertex 3 of 4): the file ends here"]),
        );
        bytes.push(0);
        let long = load_files(&[("a.ply", &bytes)]);
        check(
            order,
            long,
            &Reads("rr", &["the rest behind the last element"]),
        );
    }
    let square = [0.0_f32, 0.0, 0.0, 1.0, 0.0, 0.0, 1.0, 1.0, 0.0].map(f32::to_le_bytes);
    let axes = "property float x\nproperty float y\nproperty float z\n";
    let of = |before: &str, behind: &str| {
        let list = "property list uchar uchar vertex_indices\n";
        let header = format!(
            "ply\nformat binary_little_endian 1.0\n{before}element vertex 3\n{axes}element face 1\n{list}{behind}end_header\n"
        );
        let bytes = [
            header.as_bytes(),
            square.as_flattened(),
            &[3, 0, 1, 2],
            b"text",
        ]
        .concat();
        load_files(&[("a.ply", &bytes)])
    };
    let named = "element name COUNT\nproperty string s\n";
    let behind = Reads(".", &["the element `name` (line 9)"]);
    check("behind", of("", &named.replace("COUNT", "1")), &behind);
    let unused = of(&named.replace("COUNT", "0"), "");
    check(
        "none",
        unused,
        &Reads(".", &["the rest behind the last element"]),
    );
    let before = Fails(&["header, line 4", "the type of `s` is none of PLY"]);
    check("before", of(&named.replace("COUNT", "1"), ""), &before);
    let odd =
        b"ply\nformat binary_little_endian 1.0\nelement vertex 1\nproperty string s\nend_header\n";
    let fails = Fails(&["the type of `s` is none of PLY"]);
    check("types", load_files(&[("a.ply", odd)]), &fails);
}

#[test]
fn vertex_normals_of_ply_files_are_shading_normals() {
    let axes = "property float nx\nproperty float ny\nproperty float nz\n";
    let text = ply(&format!(
        "V4{axes}F1E 0 0 0 1 0 1\n1 0 0 0 0 1\n1 1 0 nan 0 0\n0 1 0 0 0 0\n4 0 1 2 3\n"
    ));
    let scene = load_files(&[("a.ply", text.as_bytes())]).expect("a scene");
    let given = scene.normals[0].map(|word| decode_normal(word).is_some());
    assert_eq!(given, [true, true, false]);
    let first = decode_normal(scene.normals[0][0]).expect("a normal");
    assert!(first.distance(glam::DVec3::new(0.5, 0.0, 0.5).normalize()) < 1e-4);
    let notes = Reads("..", &["1 normal is not finite (vertex 2)"]);
    check("normals", Ok(scene), &notes);
}
