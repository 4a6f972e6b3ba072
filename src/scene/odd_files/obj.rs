//! OBJ and MTL.

use super::{Fails, Outcome, Reads, check, load_files};
use glam::{Mat2, Vec2};

const RED_AND_BLUE: &str = "newmtl red\nKd 0.8 0.1 0.1\nnewmtl blue\nKd 0.1 0.1 0.8\n";

/// Behind four vertices, with `m.mtl` beside it.
const OBJ: &[(&str, Outcome)] = &[
    ("mtllib m.mtl\nusemtl\tred\nf 1 2 3 4\n", Reads("rr", &[])),
    (
        "v 9 9 9 0\nmtllib m.mtl\nusemtl red\nf 1 2 5\n",
        Reads("r", &["a weight of 0 of a vertex (line 5)"]),
    ),
    (
        "mtllib\tm.mtl\nusemtl red\nf\t1\t2  3 4\n",
        Reads("rr", &[]),
    ),
    (
        "  mtllib m.mtl\ng part\n  usemtl red\n\t f 1 2 3 4\n",
        Reads("rr", &[]),
    ),
    (
        "usemtl red\nf 1 2 3\nmtllib m.mtl\nusemtl blue\nf 1 3 4\n",
        Reads("rb", &[]),
    ),
    (
        "mtllib m.mtl # colours\nusemtl red # a wall\nf 1 2 3 4 # the only face\n",
        Reads("rr", &[]),
    ),
    (
        "mtllib a.mtl m.mtl\nusemtl red\nf 1 2 3\n",
        Reads("r", &["a.mtl: "]),
    ),
    (
        "mtllib m.mtl\nusemtl red\nF 1///1 2 3//\n",
        Reads("r", &["further numbers of a corner (line 7)"]),
    ),
    (
        "V 1 1 1\nmtllib m.mtl\nusemtl red\nF -2 -3 -4\n",
        Reads("r", &[]),
    ),
    (
        "MTLLIB m.mtl\nG wall\nUseMtl red\nF 1 2 3\nUSEMTL blue\nF 1 3 4\nCALL x\n",
        Reads("rb", &["`CALL` (line 11)"]),
    ),
    (
        "mtllib m.mtl\nusemtl \"red\" # wall\nf 1 2 3\n",
        Reads("r", &[]),
    ),
    ("mtllib \"m.mtl\"\nusemtl red\nf 1 2 3\n", Reads("r", &[])),
    (
        "mtllib C:\\my work\\m.mtl\nusemtl red\nf 1 2 3\n",
        Reads("r", &["m.mtl is read in its place"]),
    ),
    (
        "mtllib C:\\work\\m.mtl\nusemtl red\nf 1 2 3\n",
        Reads("r", &["is read in its place"]),
    ),
    (
        "mtllib /home/me/m.mtl\nusemtl red\nf 1 2 3\n",
        Reads("r", &["is read in its place"]),
    ),
    (
        "mtllib M.MTL\nusemtl red\nf 1 2 3\n",
        Reads("r", &["is read in its place"]),
    ),
    (
        "usemtl red\nf 1 2 3\n",
        Reads(
            ".",
            &[
                "1 face has no material that a .mtl file defines (line 6): drawn grey; the first is of material `red`",
            ],
        ),
    ),
    (
        "mtllib m.mtl\nusemtl\nf 1 2 3\nf 1 3 4\n",
        Reads(
            "..",
            &["2 faces have no material that a .mtl file defines (first: line 7)"],
        ),
    ),
    (
        "mtllib m.mtl\nusemtl Red\nf 1 2 3\n",
        Reads(".", &["`Red`"]),
    ),
    ("v 0 0 1 # origin\nf 1 2 5 # x\n", Reads(".", &[])),
    ("f 1.0 2.000 3.\nf 1, 3, 4\n", Reads("..", &[])),
    ("f -4.0 -3, 3\n", Reads(".", &[])),
    ("v 0 0 1 1 0 0\nf 5 1 2\n", Reads("r", &[])),
    ("vt 0\nvt 0.5\nf 1/1 2/2 3/2\n", Reads(".", &[])),
    (
        "vt\nvt x 1\nvt nan 0\nf 1/1 2/2 3/3\n",
        Reads(
            ".",
            &["3 texture coordinates are not finite (first: line 5)"],
        ),
    ),
    (
        "vn 0 0 1\nvn -nan(ind) -nan(ind) -nan(ind)\nf 1//1 2//1 3//2\n",
        Reads(".", &["1 normal is not finite (line 6)"]),
    ),
    (
        "vn 1.#QNAN 1.#QNAN 1.#QNAN\nvn 1.#INF 0 0\nf 1//1 2//2 3//1\n",
        Reads(".", &["2 normals are not finite (first: line 5)"]),
    ),
    (
        "vn 0 1\nf 1//1 2//1 3//1\n",
        Reads(".", &["1 normal is not finite (line 5)"]),
    ),
    (
        "v 1.0D+00 0 .5\nv +1. 1d0 -.5E0\nf 1 5 6\n",
        Reads(".", &[]),
    ),
    (
        "v -1.#IND 0 0\nf 1 2 5\nf 1 2 3\n",
        Reads(
            ".",
            &["1 triangle dropped", "1 vertex is not finite (line 5)"],
        ),
    ),
    (
        "v 1 1 1 0\nf 1 2 5\nf 1 2 3\n",
        Reads("..", &["a weight of 0 of a vertex (line 5)"]),
    ),
    (
        "v 1 1 1 1 0\nv 1 1 1 x\nv 1 1 1 1 0 0 1 8 9\nf 5 6 7\nf 1 2 3\n",
        Reads("..", &["further words of `v` (3 times, first: line 5)"]),
    ),
    (
        "f 1/ 2// 3/1/1\n",
        Reads(
            ".",
            &[
                "1 corner names a texture coordinate that does not exist (line 5)",
                "1 corner names a normal",
            ],
        ),
    ),
    (
        "f 1/0/0 2/-1/-1 3\n",
        Reads(
            ".",
            &[
                "2 corners name a texture coordinate",
                "2 corners name a normal that does not exist (first: line 5)",
            ],
        ),
    ),
    ("f 1/1 2/1 3/1\nvt 0 0\n", Reads(".", &[])),
    ("f -4 -3 -2\nfo 1 3 4\n", Reads("..", &[])),
    (
        "f\nf 1 2\nf 1 2 3\n",
        Reads(
            ".",
            &["2 faces have fewer than three corners (first: line 5)"],
        ),
    ),
    (
        "f 1 2\n",
        Fails(&[
            "no triangles",
            "1 face has fewer than three corners (line 5)",
        ]),
    ),
    (
        "l 1 2\np 1\nl 2 3\ncall x.obj\nf 1 2 3\n",
        Reads(
            ".",
            &["`call` (line 8), `l` (2 times, first: line 5), `p` (line 6)"],
        ),
    ),
    (
        "surf 0 1 0 1 1 2 3\nend\n",
        Fails(&["no triangles", "`surf` (line 5)"]),
    ),
    ("f 1 2 \\\n3\\\n 4\n", Reads("..", &[])),
    (
        "# c:\\models\\\nf 1 2 3 # c:\\a\\\nf 1 3 4\n",
        Reads("..", &[]),
    ),
    ("f 1 2 \\ \t\n3 4\n", Reads("..", &[])),
    ("v 1.5f 0.F 1e0f\nf 1 2 5\n", Reads(".", &[])),
    (
        "#MRGB ffff0000ff00ff00\nf 1 2 3\n",
        Reads(".", &["vertex colours of ZBrush (`#MRGB`) (line 5)"]),
    ),
    (
        "v 500000.125 4649776.25 0\nv 500001.125 4649776.25 0\nv 500000.125 4649777.25 0\nf 5 6 7\n",
        Reads(".", &["rounded to steps of 0.5, and the model is 1"]),
    ),
    (
        "v 5000 0 0\nv 5001 0 0\nv 5000 1 0\nf 5 6 7\n",
        Reads(".", &["subtract an offset"]),
    ),
    (
        "v 500 0 0\nv 501 0 0\nv 500 1 0\nf 5 6 7\n",
        Reads(".", &[]),
    ),
    (
        "f 0 1 2\n",
        Fails(&["line 5", "vertex 0, but the first is 1"]),
    ),
    (
        "v nan 0 0\nf 1 2 5\n",
        Fails(&["all 1 have a NaN", "1 vertex is not finite (line 5)"]),
    ),
    (
        "v 1 2\nv 1 x 2\nf 1 2 3\n",
        Reads(
            ".",
            &["2 vertices are not three numbers (first: line 5): used by no face"],
        ),
    ),
    (
        "v 1 2\nv 1 x 2\nf 1 2 6\n",
        Fails(&["line 6", "`x` is not a number"]),
    ),
    ("f 1 2 9\n", Fails(&["line 5", "vertex 9, but there are 4"])),
    (
        "v 0,5 0 0\nf 1 2 5\n",
        Fails(&[
            "line 5",
            "`0,5` is not a number; decimals are written with a point",
        ]),
    ),
];

#[test]
fn obj_files_as_found_are_read() {
    for (text, expected) in OBJ {
        let model = format!("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\n{text}");
        let latin1 = [model.as_bytes(), b"# \xfc\n"].concat();
        let variants = [
            model.as_bytes().to_vec(),
            latin1,
            [b"\xef\xbb\xbf", model.as_bytes()].concat(),
            model.replace('\n', "\r\n").into_bytes(),
            model.replace('\n', "\r").into_bytes(),
        ];
        for bytes in variants {
            let files: [(&str, &[u8]); 2] = [("a.obj", &bytes), ("m.mtl", RED_AND_BLUE.as_bytes())];
            check(text, load_files(&files), expected);
        }
        let is_advice = |part: &&str| part.contains("with a point");
        if matches!(expected, Fails(parts) if parts.iter().any(is_advice)) {
            let advised = load_files(&[("a.obj", model.replace(',', ".").as_bytes())]);
            assert!(advised.is_ok(), "{text}: {advised:?}");
        }
    }
}

#[test]
fn zeros_at_the_end_are_padding() {
    let padded: &[u8] = b"v 0 0 0\nv 1 0 0\nv 1 1 0\nf 1 2 3\n\0\0\0";
    check("zeros", load_files(&[("a.obj", padded)]), &Reads(".", &[]));
}

/// A library, and the material `a` that it defines.
const MTL: &[(&str, Outcome)] = &[
    ("newmtl a\nKd 1 0 0", Reads("r", &[])),
    ("\u{feff}  newmtl\ta  \n\tkd\t1 0 0 # red", Reads("r", &[])),
    (
        "newmtl a\nKd 1.0D+00 0. .0\nd -halo 1\nTf 1 1 1\nillum 2.0",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 1 0 0\nKs\nNs none\nillum -1",
        Reads(
            "r",
            &[
                "the value of `Ks` (line 3), the value of `Ns` (line 4), the value of `illum` (line 5)",
            ],
        ),
    ),
    (
        "newmtl a\nKd 0 1 0\nnewmtl a\nKd 1 0 0",
        Reads("r", &["1 material is defined again (line 3)"]),
    ),
    (
        "Kd 0 1 0\nnewmtl a\nKd 1 0 0",
        Reads("r", &["statements before the first `newmtl` (line 1)"]),
    ),
    ("newmtl a\nKd 1 0 0\nnewmtl\nKd 0 1 0", Reads("r", &[])),
    (
        "newmtl a\nKd 1 0 0\nd 1\nTr 1",
        Reads("r", &["`Tr` that is not 1 − `d` (line 4)"]),
    ),
    ("newmtl a\nKd 1 0 0\nd 1\nTr 0", Reads("r", &[])),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd -mm 0.1 0.9 -blendu off T.PNG",
        Reads(
            "r",
            &[
                "`-blendu` of a texture (line 3), `-mm` of a texture (line 3)",
                "1 texture is not where it should be (line 3)",
            ],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd -bm 1 -s 1 1 1 -mm 0 1 sub\\t 1.png",
        Reads("r", &[]),
    ),
    ("newmtl a\nKd 1 0 0\nmap_Kd sub\\t\\ 1.png", Reads("r", &[])),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd -S 2 2 2 -Clamp ON sub/t%201.png",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd -clamp on t.png -s 2 2 -blendu off",
        Reads("r", &["`-blendu` of a texture (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd \"sub/t 1.png\" # bricks",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd SUB\\T 1.PNG",
        Reads("r", &["1 texture is not where it should be (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd D:\\maps\\t.png\nmap_d /maps/t.png",
        Reads(
            "r",
            &["2 textures are not where they should be (first: line 3)"],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd",
        Reads("r", &["the value of `map_Kd` (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nMAP_KD none.png",
        Reads("r", &["none.png"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Pr t.png\nPc 1\nmap_Pr t.png",
        Reads("r", &["`Pc` (line 4), `map_Pr` (2 times, first: line 3)"]),
    ),
    (
        "newmtl a\nKd nan -1 0\nd nan\nNs 1e999",
        Reads(
            ".",
            &["the value of `Kd` (line 2), the value of `Ns` (line 4), the value of `d` (line 3)"],
        ),
    ),
    (
        "newmtl a\nKd 0.5 0 0\nKs 0.2 0.2 0.2\nNs 9\nillum 3",
        Reads(
            "r",
            &["1 material is shaped by a specular colour (`Ks`), which is not rendered yet"],
        ),
    ),
    (
        "newmtl a\nKd 0.5 0 0\nKs 0.2 0.2 0.2\nNs 9\nillum 1",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 0 0 0\nmap_Kd t.png",
        Reads(".", &["`Kd` of 0 with a `map_Kd` (line 1)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nillum 11",
        Reads("r", &["the value of `illum` (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nTr 1",
        Reads("r", &["it is taken as opacity (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nTr 1\nnewmtl b\nTr 0",
        Reads(
            "r",
            &["1 material is wholly transparent, by `d` or `Tr` (line 1)"],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nd 0\nTr 1",
        Reads(
            "r",
            &["1 material is wholly transparent, by `d` or `Tr` (line 1)"],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nTr 1 illum 3",
        Reads("r", &["what stands behind the values of `Tr` (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0 1\nillum 2 # two",
        Reads("r", &["what stands behind the values of `Kd` (line 2)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nd -halo 0.5",
        Reads("r", &["`-halo` of `d` (line 3)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nillum 0",
        Reads("r", &["`illum` 0, a colour without light (line 1)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nillum 10",
        Reads("r", &["`illum` 10, shadows alone (line 1)"]),
    ),
    // Opaque surfaces by Maya and Blender, whose models are those of glass.
    (
        "newmtl a\nKd 1 0 0\nillum 4\nTf 1 1 1\nNi 1.86",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 1 0 0\nillum 9\nd 0.9\nNi 1.45",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nKd 1 0 0\nillum 6\nd 0.9\nPm 1\nPr 0.5",
        Reads("r", &[]),
    ),
    ("newmtl a\nKd 1 0 0\nillum 7", Reads("r", &[])),
    (
        "newmtl a\nKd 1 0 0\nillum 7\nNi 1.5",
        Reads(".", &["`Kd` of glass (line 1)"]),
    ),
    ("newmtl a\nKd 1 0 0\nillum 7\nPm 1\nPr 0.5", Reads("r", &[])),
    ("newmtl a\nKd 0 0 0\nillum 9\nNi 1.5", Reads(".", &[])),
    (
        "newmtl a\nKd 1 0 0\nillum 7\nNi 1.5\nd 0.5\nPm 0\nPr 0.8",
        Reads(
            ".",
            &["`Kd` of glass (line 1), `Pr` of glass (line 1), `d` of glass (line 1)"],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nd 0\nillum 4",
        Reads(".", &["`Kd` of glass (line 1)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nmap_Kd ..\\maps\\t.png",
        Reads("r", &["1 texture is not where it should be (line 3)"]),
    ),
    ("newmtl a\nKd 1 0 0\nKd 0.5f 0.f 0.0F", Reads("r", &[])),
    (
        "newmtl a\nKd 1 -0.5 0",
        Reads("r", &["what is below 0 in `Kd` (line 2)"]),
    ),
    (
        "newmtl a\nKd 1 0 0\nPr 0.5",
        Reads("r", &["`Pr` without `Pm` (line 1)"]),
    ),
    ("newmtl a\nKd 1 0 0\nPr 0.5\nPm 0", Reads("r", &[])),
    (
        "newmtl a\nKd 0 0 0\nillum 4\nTf 1 1 1\nNi 1.00",
        Reads(
            ".",
            &["`illum` of glass whose `Ni` is 1 and which filters nothing (line 1)"],
        ),
    ),
    (
        "newmtl a\nKd 1 0 0\nnewmtl b\nmap_Ke none.png",
        Reads("r", &[]),
    ),
    (
        "newmtl a\nillum 7\nNi 1.5\nnorm t.png\nmap_Kd t.png",
        Reads(".", &["`map_Kd` of glass or a mirror (line 5)"]),
    ),
    (
        "newmtl a\nKd 0.5 0 0\nKs 0.2 0.2 0.2\nillum 2\nPm 0",
        Reads(
            "r",
            &["1 material is shaped by a specular colour (`Ks`), which is not rendered yet"],
        ),
    ),
    (
        "newmtl a\nKd 0.5 0 0\nKs 0.2 0.2 0.2\nNs 1e7\nillum 2",
        Reads("r", &["what is beyond 0 to 100000 in `Ns` (line 1)"]),
    ),
    (
        "newmtl a\nKd 0.5 0 0\nKs 0.2 0.2 0.2\nNs 1e5\nillum 2",
        Reads("r", &[]),
    ),
    (
        "newmtl a # wall\nKd 1 0 0\nnewmtl a #2\nKd 0 1 0",
        Reads("r", &[]),
    ),
];

#[test]
fn mtl_files_as_found_are_read() {
    let mut png = std::io::Cursor::new(Vec::new());
    let image = image::RgbImage::from_pixel(1, 1, image::Rgb([255; 3]));
    image
        .write_to(&mut png, image::ImageFormat::Png)
        .expect("an image");
    let png = png.into_inner();
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    for (library, expected) in MTL {
        let files: [(&str, &[u8]); 4] = [
            ("a.obj", model),
            ("m.mtl", library.as_bytes()),
            ("t.png", &png),
            ("sub/t 1.png", &png),
        ];
        let result = load_files(&files);
        if let Ok(scene) = &result {
            let count = usize::from(library.contains("map_Kd ") && library.contains('.'));
            assert_eq!(scene.textures.len(), count, "{library}");
        }
        check(library, result, expected);
    }
}

/// Options take up to three numbers, and the file's name begins with one.
#[test]
fn a_texture_may_begin_with_a_number() {
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    for options in ["-s 4 2", "-bm 1 -s 4 2", "-s 4 2 1 -o 0"] {
        let library = format!("newmtl a\nmap_Kd {options} 01 old bricks.ppm\n");
        let files: [(&str, &[u8]); 3] = [
            ("a.obj", model),
            ("m.mtl", library.as_bytes()),
            ("01 old bricks.ppm", b"P6 1 1 255\n\x01\x02\x03"),
        ];
        let scene = load_files(&files).expect(options);
        assert_eq!(scene.textures.len(), 1, "{options}: {:?}", scene.report);
        let used = scene.materials[0].base_color_texture.expect("a texture");
        assert_eq!(used.linear, Mat2::from_diagonal(Vec2::new(4.0, 2.0)));
        assert_eq!(used.offset, Vec2::new(0.0, -1.0), "{options}");
    }
}

#[test]
fn several_libraries_stand_in_a_line_and_a_name_with_a_blank_goes_first() {
    let model = b"mtllib a.mtl b.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3\nusemtl blue\nf 1 3 4\n";
    let one: [&[u8]; 2] = [b"newmtl red\nKd 1 0 0\n", b"newmtl blue\nKd 0 0 1\n"];
    let mut files: Vec<(&str, &[u8])> =
        vec![("a.obj", model), ("a.mtl", one[0]), ("b.mtl", one[1])];
    check("two", load_files(&files), &Reads("rb", &[]));
    files.push((
        "a.mtl b.mtl",
        b"newmtl red\nKd 0 1 0\nnewmtl blue\nKd 0 1 0\n",
    ));
    check("one", load_files(&files), &Reads("gg", &[]));
    let model = String::from_utf8_lossy(model).replace("a.mtl b.mtl", "colours b.mtl");
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", model.as_bytes()),
        ("colours", one[0]),
        ("b.mtl", one[1]),
    ];
    check("no ending", load_files(&files), &Reads("rb", &[]));
}

#[test]
fn a_blank_in_the_name_of_a_library_may_be_written_in_three_ways() {
    for name in [
        "my m.mtl",
        "my\\ m.mtl",
        "my%20m.mtl",
        "./my m.mtl",
        ".\\my m.mtl",
    ] {
        let model = format!("mtllib {name}\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl red\nf 1 2 3\n");
        let files: [(&str, &[u8]); 2] = [
            ("a.obj", model.as_bytes()),
            ("my m.mtl", RED_AND_BLUE.as_bytes()),
        ];
        check(name, load_files(&files), &Reads("r", &[]));
    }
    let model = b"mtllib sub dir/my m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nusemtl red\nf 1 2 3\n";
    let files: [(&str, &[u8]); 2] = [("a.obj", model), ("my m.mtl", RED_AND_BLUE.as_bytes())];
    let note = &["my m.mtl is read in its place"];
    check("another folder", load_files(&files), &Reads("r", note));
}

#[test]
fn a_material_of_two_libraries_is_that_of_the_last() {
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nusemtl red\nf 1 2 3\nmtllib b.mtl\nusemtl red\nf 1 3 4\n";
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", model),
        ("m.mtl", RED_AND_BLUE.as_bytes()),
        ("b.mtl", b"newmtl red\nKd 0 1 0\n"),
    ];
    let note = &[
        "1 library defines a material of an earlier one again (line 8): the last definition counts from there on",
    ];
    check("two", load_files(&files), &Reads("rg", note));
}
