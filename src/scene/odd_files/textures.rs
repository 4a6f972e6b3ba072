//! Textures in the formats that models of others have. The bytes are Pillow's 12 and tifffile's, or written by hand.

use super::{SceneData, bc1, load_files};
use crate::texture::{Encoded, ImageSource, decode_all};
use crate::{LoadReport, Material, TextureUse};

/// Red and green above blue and white. The ending says what a file is only where its bytes do not.
const FOUR: [(&str, &str); 11] = [
    (
        "below.tga",
        "000002000000000000000000020002001800ff0000ffffff0000ff00ff0000000000000000005452554556\
         4953494f4e2d5846494c452e00",
    ),
    (
        "above.tga",
        "0000020000000000000000000200020018200000ff00ff00ff0000ffffff",
    ),
    (
        "runs.TGA",
        "00000a00000000000000000002000200180001ff0000ffffff010000ff00ff00000000000000000054525545\
         564953494f4e2d5846494c452e00",
    ),
    (
        "plain.bmp",
        "424d460000000000000036000000280000000200000002000000010018000000000010000000c40e0000c40e\
         00000000000000000000ff0000ffffff00000000ff00ff000000",
    ),
    (
        "bitmap.tga",
        "424d460000000000000036000000280000000200000002000000010018000000000010000000c40e0000c40e\
         00000000000000000000ff0000ffffff00000000ff00ff000000",
    ),
    (
        "first.gif",
        "47494638376102000200810000ffffff00ff00ff00000000ff2c000000000200020000080700050418002020\
         003b",
    ),
    (
        "plain.tif",
        "49492a00080000000a0000010400010000000200000001010400010000000200000002010300030000008600\
         000003010300010000000100000006010300010000000200000011010400010000008c000000150103000100\
         00000300000016010400010000000200000017010400010000000c0000001c01030001000000010000000000\
         0000080008000800ff000000ff000000ffffffff",
    ),
    (
        "lzw.tiff",
        "49492a0014000000803fc010381411ff078080000a0000010300010000000200000001010300010000000200\
         0000020103000300000092000000030103000100000005000000060103000100000002000000110104000100\
         0000080000001501030001000000030000001601030001000000020000001701040001000000\
         0b0000001c010300010000000100000000000000080008000800",
    ),
    (
        "sixteen.tif",
        "49492a00080000000d000001040001000000020000000101040001000000020000000201030003000000aa00\
         00000301030001000000010000000601030001000000020000001101040001000000c0000000150103000100\
         0000030000001601040001000000020000001701040001000000180000001a01050001000000b00000001b01\
         050001000000b80000001c010300010000000100000028010300010000000100000000000000100010001000\
         01000000010000000100000001000000ffff000000000000ffff000000000000ffffffffffffffff",
    ),
    (
        "plain.ppm",
        "50360a3220320a3235350aff000000ff000000ffffffff",
    ),
    (
        "text.ppm",
        // P3, a comment, 2 2, 255 and the numbers.
        "50330a23200a3220320a3235350a32353520302030203020323535203020302030203235350a323535203235\
         3520323535",
    ),
];

/// One row of linear light: 0.5, and 0.25, 4 and −1.
const LIGHT: [(&str, &str); 1] = [(
    "float.tif",
    "49492a00080000000e000001040001000000020000000101040001000000010000000201030003000000b6000000\
     0301030001000000010000000601030001000000020000001101040001000000e000000015010300010000000300\
     00001601040001000000010000001701040001000000180000001a01050001000000bc0000001b01050001000000\
     c40000001c01030001000000010000002801030001000000010000005301030003000000cc000000000000002000\
     200020000100000001000000010000000100000003000300030000000000000000000000000000000000003f0000\
     003f0000003f0000803e00008040000080bf",
)];

fn with_texture(name: &str, bytes: &[u8]) -> SceneData {
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    let library = format!("newmtl a\nmap_Kd {name}\n");
    let files: [(&str, &[u8]); 3] = [
        ("a.obj", model),
        ("m.mtl", library.as_bytes()),
        (name, bytes),
    ];
    load_files(&files).unwrap_or_else(|error| panic!("{name}: {error}"))
}

fn bytes(hex: &str) -> Vec<u8> {
    let byte = |pair: &[u8]| {
        let digits = std::str::from_utf8(pair).expect("digits");
        u8::from_str_radix(digits, 16).expect("a byte")
    };
    hex.as_bytes().chunks(2).map(byte).collect()
}

/// The texels of a scene's one texture, row by row, without alpha.
fn colors(name: &str, bytes: &[u8]) -> Vec<[u8; 3]> {
    let scene = with_texture(name, bytes);
    let [texture] = &scene.textures[..] else {
        panic!("{name}: {:?}", scene.report);
    };
    assert!(texture.texels.iter().all(|[.., a]| *a == 255), "{name}");
    texture
        .texels
        .iter()
        .map(|[r, g, b, _]| [*r, *g, *b])
        .collect()
}

#[test]
fn textures_of_old_formats_are_the_right_way_up_and_of_the_right_colours() {
    let expected = [[255, 0, 0], [0, 255, 0], [0, 0, 255], [255, 255, 255]];
    for (name, hex) in FOUR {
        assert_eq!(colors(name, &bytes(hex)), expected, "{name}");
    }
    // DXT1: the first of two colours in the first row of texels, then the second.
    let dds = bc1([0xf800, 0x001f], [0, 0x55, 0x55, 0x55], false);
    let [first, second] = [[[255, 0, 0]; 4], [[0, 0, 255]; 4]];
    assert_eq!(
        colors("block.dds", &dds),
        [first, second, second, second].concat()
    );
}

#[test]
fn linear_light_becomes_srgb_as_other_colours_are() {
    let expected = [[188, 188, 188], [137, 255, 0]];
    for (name, hex) in LIGHT {
        assert_eq!(colors(name, &bytes(hex)), expected, "{name}");
    }
    let says = |name: &str, file: &[u8]| with_texture(name, file).report.lines().join("\n");
    let bright = "1 of its 2 texels are brighter than 1, which becomes 1";
    let told = says("float.tif", &bytes(LIGHT[0].1));
    assert!(told.contains(bright), "{told}");
    let hdr = |exponent: u8| {
        let header = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n";
        [&header[..], &[128, 128, 128, 128, 128, 64, 32, exponent]].concat()
    };
    let told = says("light.hdr", &hdr(132));
    assert!(told.contains(bright), "{told}");
    let told = says("light.hdr", &hdr(129));
    assert!(!told.contains("brighter"), "{told}");
    // Mantissas of 128 are half of what the exponent of 128 says, 1.
    let hdr = b"#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n-Y 1 +X 2\n\x80\x80\x80\x80\x40\xff\x00\x80";
    let [grey, [red, green, blue]] = colors("light.hdr", hdr)[..] else {
        panic!("two texels");
    };
    assert_eq!((grey, red, green, blue), ([188; 3], 137, 255, 0));
    // Its exposure and the factors of its colours are divided by, and its pixels begin where it says.
    for (lines, order, expected) in [
        ("EXPOSURE=2\n", "-Y 1 +X 2", [[137; 3], [99; 3]]),
        (
            "COLORCORR=2 1 1\n",
            "-Y 1 +X 2",
            [[137, 188, 188], [99, 137, 137]],
        ),
        ("", "-Y 1 -X 2", [[137; 3], [188; 3]]),
    ] {
        let head = format!("#?RGBE\n{lines}FORMAT=32-bit_rle_rgbe\n\n{order}\n");
        let hdr = [head.as_bytes(), &[128; 4], &[128, 128, 128, 127]].concat();
        assert_eq!(colors("light.hdr", &hdr), expected, "{head}");
    }
}

#[test]
fn what_is_no_image_is_named_with_the_formats_that_are() {
    for (name, bytes) in [
        ("t.png", &b"KTX 20"[..]),
        ("t.tga", b"\x00"),
        ("t.dds", b"DDS "),
    ] {
        let scene = with_texture(name, bytes);
        assert!(scene.textures.is_empty(), "{name}");
        let lines = scene.report.lines().join("\n");
        assert!(lines.contains(name), "{lines}");
        assert_eq!(name == "t.png", lines.contains("TIFF, PNM"), "{lines}");
    }
}

#[test]
fn a_dds_of_another_kind_is_named_with_those_that_are_read() {
    let mut dds = [&b"DDS "[..], &[0; 124]].concat();
    for (at, word) in [
        (4, 124),
        (8, 0x1007),
        (12, 4),
        (16, 4),
        (76, 32),
        (80, 0x40),
    ] {
        dds[at..at + 4].copy_from_slice(&u32::to_le_bytes(word));
    }
    let lines = with_texture("t.dds", &dds).report.lines().join("\n");
    assert!(lines.contains("of DDS BC1 to BC3 are read"), "{lines}");
    assert!(!lines.contains("PNM, DDS"), "{lines}");
}

#[test]
fn damaged_textures_are_read_or_refused_and_never_panic() {
    let damage = |bytes: &[u8], k: usize| {
        let mut bytes = bytes.to_vec();
        let at = k.wrapping_mul(0x9e37_79b1) % bytes.len();
        match k % 4 {
            0 => bytes.truncate(at),
            1 => bytes[at] ^= 1 << (k / 4 % 8),
            2 => bytes[at] = 255,
            _ => bytes.insert(at, k as u8),
        }
        bytes
    };
    let mut read = 0;
    for (name, hex) in FOUR.iter().chain(&LIGHT) {
        let whole = bytes(hex);
        for k in 0..400 {
            let sources = [ImageSource {
                name: (*name).to_owned(),
                encoded: Encoded::Memory(damage(&whole, k).into()),
            }];
            let mut report = LoadReport::default();
            let mut materials = [Material {
                base_color_texture: Some(TextureUse::plain(0)),
                ..Material::diffuse("", glam::Vec3::ONE)
            }];
            let textures = decode_all(&sources, [64, 1 << 20], &mut materials, &mut report);
            let [width, height] = textures.first().map_or([0; 2], |t| [t.width, t.height]);
            assert!(width <= 64 && height <= 64, "{name}, {k}");
            assert!(
                !textures.is_empty() || !report.warnings.is_empty(),
                "{name}, {k}"
            );
            read += textures.len();
        }
    }
    assert!((400..4400).contains(&read), "{read} of 4800 read");
}
