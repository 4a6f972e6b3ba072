//! Large files in which every byte needs as much memory as the format allows.

/// Bytes of a file, about.
const SIZE: usize = 200_000;

fn filled(before: &str, part: &str, after: &str) -> Vec<u8> {
    let parts = part.repeat(SIZE / part.len());
    [before, parts.trim_end_matches(','), after]
        .concat()
        .into_bytes()
}

/// As [`filled`], with the number of each part in the place of `#`.
fn numbered(before: &str, part: &str, after: &str) -> Vec<u8> {
    let count = SIZE / (part.len() + 4);
    let parts: Vec<String> = (0..count)
        .map(|k| part.replace('#', &k.to_string()))
        .collect();
    let parts = parts.concat();
    [before, parts.trim_end_matches(','), after]
        .concat()
        .into_bytes()
}

/// The dense files of a target, each with a name.
pub fn files(target: &str) -> Vec<(&'static str, Vec<u8>)> {
    match target {
        "experiment" => experiments(),
        "obj" => objs(),
        "gltf" => gltfs(),
        "ply" => plys(),
        "ies" => luminaires(),
        "points" => vec![
            ("zeros", filled("", "0\n", "")),
            ("one point", filled("", "0 ", "")),
            ("comments", filled("0\n", "#\n", "")),
        ],
        "records" => records(),
        _ => Vec::new(),
    }
}

const AXES: &str = "sequence = [\"halton\"]\ndecorrelation = [\"none\"]\nintegrator = [\"ao\"]\n";

fn experiments() -> Vec<(&'static str, Vec<u8>)> {
    let axes =
        |scene: &str, accel: &str| format!("[axes]\nscene = [{scene}]\naccel = [{accel}]\n{AXES}");
    let tail = format!("]\naccel = [\"bvh\"]\n{AXES}");
    let grid = axes("\"cornell-box\"", "\"uniform-grid\"");
    vec![
        ("scenes", numbered("[axes]\nscene = [", "\"#.ply\",", &tail)),
        (
            "one long name",
            filled("[axes]\nscene = [\"", "x", &format!("\"{tail}")),
        ),
        ("tables", numbered("", "[a#]\n", "")),
        ("keys", numbered("", "a#=0\n", "")),
        ("zeros", filled("a = [", "0,", "]")),
        (
            "blank lines",
            filled(&axes("\"cornell-box\"", "\"bvh\""), "\n", ""),
        ),
        (
            "lambdas",
            numbered(
                &format!("{grid}[accel.uniform-grid]\nlambda = ["),
                "1.#,",
                "]",
            ),
        ),
        ("excludes", filled(&grid, "[[exclude]]\naccel='bvh'\n", "")),
    ]
}

fn objs() -> Vec<(&'static str, Vec<u8>)> {
    let vertex = "v 0 0 0\nvt 0 0\nvn 0 0 1\n";
    let library = |mtl: Vec<u8>| [b"mtllib m.mtl\nv 0 0 0\nf 1 1 1\n\0".as_slice(), &mtl].concat();
    vec![
        ("vertices", filled("", "v 0 0 0\n", "f 1 1 1\n")),
        ("one fan", filled(&format!("{vertex}f "), "1 ", "\n")),
        (
            "one fan with all indices",
            filled(&format!("{vertex}f "), "1/1/1 ", "\n"),
        ),
        ("faces", filled(vertex, "f 1 1 1\n", "")),
        ("objects", filled(vertex, "g\nf 1 1 1\n", "")),
        (
            "libraries",
            filled(vertex, "mtllib m.mtl\n", "f 1 1 1\n\0newmtl a\n"),
        ),
        ("materials", library(numbered("", "newmtl #\n", ""))),
        (
            "textures",
            library(numbered("", "newmtl #\nmap_Kd #\n", "")),
        ),
        (
            "unknown statements",
            library(numbered("newmtl a\n", "x# 1\n", "")),
        ),
        (
            "broken statements",
            library(filled("newmtl a\n", "Kd\n", "")),
        ),
    ]
}

/// A document with one node, which shows one triangle.
const TRIANGLE: &str = r#"{"asset":{"version":"2.0"},"scenes":[{"nodes":[0]}],
"nodes":[{"mesh":0}],
"meshes":[{"primitives":[{"attributes":{"POSITION":0}}]}],
"accessors":[{"bufferView":0,"componentType":5126,"count":3,"type":"VEC3","min":[0,0,0],
"max":[1,1,0]}],
"bufferViews":[{"buffer":0,"byteLength":36,"byteStride":12}],
"buffers":[{"byteLength":36,"uri":"data:;base64,AAAAAAAAAAAAAAAAAACAPwAAAAAAAAAAAACAPwAAgD8AAAAA"}]}"#;

fn gltfs() -> Vec<(&'static str, Vec<u8>)> {
    let triangle = TRIANGLE;
    let with = |part: Vec<u8>| {
        let part = String::from_utf8(part).expect("dense files are text");
        triangle
            .replacen('{', &format!("{{{part},"), 1)
            .into_bytes()
    };
    let nodes = |count: usize| {
        let list: Vec<String> = (1..count).map(|k| k.to_string()).collect();
        let before = format!("\"nodes\":[{{\"children\":[{}]}}", list.join(","));
        let parts = ",{\"mesh\":0}".repeat(count - 1);
        triangle
            .replace("\"nodes\":[{\"mesh\":0}]", &format!("{before}{parts}]"))
            .into_bytes()
    };
    let chain = |count: usize| {
        let parts: Vec<String> = (1..count)
            .map(|k| format!("{{\"children\":[{k}]}}"))
            .collect();
        let list = format!("\"nodes\":[{},{{\"mesh\":0}}]", parts.join(","));
        triangle
            .replace("\"nodes\":[{\"mesh\":0}]", &list)
            .into_bytes()
    };
    vec![
        ("materials", with(filled("\"materials\":[", "{},", "]"))),
        (
            "unused nodes",
            triangle
                .replace(
                    "{\"mesh\":0}]",
                    &format!("{{\"mesh\":0}}{}]", ",{}".repeat(SIZE / 3)),
                )
                .into_bytes(),
        ),
        ("nodes of one mesh", nodes(SIZE / 16)),
        ("a chain of nodes", chain(SIZE / 20)),
        ("samplers", with(filled("\"samplers\":[", "{},", "]"))),
        ("zeros", with(filled("\"extras\":[", "0,", "]"))),
        ("spaces", with(filled("\"extras\":0", " ", ""))),
    ]
}

fn plys() -> Vec<(&'static str, Vec<u8>)> {
    let header = |encoding: &str, vertices: usize, faces: usize, list: &str| {
        format!(
            "ply\nformat {encoding} 1.0\nelement vertex {vertices}\nproperty uchar x\nproperty uchar y\n\
             property uchar z\nelement face {faces}\nproperty list {list} vertex_indices\nend_header\n"
        )
    };
    let binary = |header: String, body: Vec<u8>| [header.as_bytes(), &body].concat();
    let fan = |length: usize| [&(length as u32).to_le_bytes()[..], &vec![0; length]].concat();
    let little = "binary_little_endian";
    let count = SIZE / 3;
    vec![
        (
            "vertices",
            binary(
                header(little, count, 1, "uchar uchar"),
                [vec![0; 3 * count], vec![3, 0, 0, 0]].concat(),
            ),
        ),
        (
            "empty faces",
            binary(header(little, 1, SIZE, "uchar uchar"), vec![0; 3 + SIZE]),
        ),
        (
            "triangles",
            binary(
                header(little, 1, SIZE / 4, "uchar uchar"),
                [vec![0; 3], [3, 0, 0, 0].repeat(SIZE / 4)].concat(),
            ),
        ),
        (
            "one fan",
            binary(
                header(little, 1, 1, "uint uchar"),
                [vec![0; 3], fan(SIZE)].concat(),
            ),
        ),
        (
            "announced faces",
            binary(header(little, 1, SIZE, "uchar uchar"), vec![0; 100]),
        ),
        (
            "one fan in text",
            filled(
                &format!("{}0 0 0\n{} ", header("ascii", 1, 1, "uint uint"), SIZE / 2),
                "0 ",
                "\n",
            ),
        ),
        (
            "properties",
            numbered(
                "ply\nformat ascii 1.0\nelement face 1\n",
                "property int #\n",
                "end_header\n",
            ),
        ),
        (
            "comments",
            filled("ply\nformat ascii 1.0\n", "comment\n", "end_header\n"),
        ),
    ]
}

fn luminaires() -> Vec<(&'static str, Vec<u8>)> {
    let angles = |count: usize, last: usize| {
        let parts = (0..count).map(|k| format!("{} ", (k * last) as f64 / (count - 1) as f64));
        parts.collect::<String>()
    };
    let before = "TILT=NONE\n1 1 1";
    let table = |vertical: usize, horizontal: usize, last: usize| {
        let numbers = format!("{before} {vertical} {horizontal} 1 2 0 0 0 1 1 1\n");
        let angles = angles(vertical, 90) + &angles(horizontal, last);
        let candela = "1 ".repeat(vertical * horizontal);
        [numbers, angles, candela].concat().into_bytes()
    };
    vec![
        ("labels", filled("", "\n", "TILT=NONE\n")),
        ("lines", filled("TILT=NONE\n", "\n", "")),
        ("words", filled("TILT=NONE\n", "1 ", "\n")),
        ("a quadrant", table(10_000, 5, 90)),
        ("horizontal angles", table(2, 9999, 90)),
        ("a circle", table(181, 361, 360)),
        ("announced candela", {
            let numbers = format!("{before} 10000 10000 1 2 0 0 0 1 1 1\n");
            let angles = angles(10_000, 90) + &angles(10_000, 90);
            (numbers + &angles).into_bytes()
        }),
    ]
}

fn records() -> Vec<(&'static str, Vec<u8>)> {
    let line = |body: &str| format!("{{\"schema\":\"raystone/3\",\"body\":{body}}}\n");
    let skipped = line("{\"kind\":\"skipped\",\"cell\":\"\",\"reason\":\"\"}");
    let open =
        "{\"schema\":\"raystone/3\",\"body\":{\"kind\":\"skipped\",\"cell\":\"\",\"reason\":\"\",";
    vec![
        ("lines", filled("", &skipped, "")),
        ("zeros", filled(&format!("{open}\"x\":["), "0,", "]}}\n")),
        ("lists", filled(&format!("{open}\"x\":["), "[],", "]}}\n")),
        (
            "maps",
            numbered(&format!("{open}\"x\":{{"), "\"#\":0,", "}}}\n"),
        ),
        ("empty lines", filled(&skipped, "\n", "")),
        ("one line of nothing", filled("", " ", "")),
    ]
}
