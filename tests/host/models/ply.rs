//! PLY, as text and in both byte orders.

use super::*;

const HEADER: &str = "element vertex 4\nproperty float x\nproperty double y\n\
    property short z\nelement face 1\nproperty uchar flag\n\
    property list uchar int vertex_indices\nend_header\n";

fn load_bytes(bytes: &[u8]) -> Result<SceneData, SceneError> {
    load_files("test.ply", &[("test.ply", bytes)])
}

fn ascii(body: &str) -> Vec<u8> {
    format!("ply\nformat ascii 1.0\n{HEADER}{body}").into_bytes()
}

fn binary(big: bool) -> Vec<u8> {
    let order = if big { "big" } else { "little" };
    let mut bytes = format!("ply\nformat binary_{order}_endian 1.0\n{HEADER}").into_bytes();
    let mut put = |value: &[u8]| {
        let mut value = value.to_vec();
        if big {
            value.reverse();
        }
        bytes.extend(value);
    };
    for (x, y, z) in [
        (0.0_f32, 0.0_f64, 1_i16),
        (2.0, 0.0, 1),
        (2.0, 2.0, 1),
        (0.0, 2.0, 1),
    ] {
        put(&x.to_le_bytes());
        put(&y.to_le_bytes());
        put(&z.to_le_bytes());
    }
    put(&[7]);
    put(&[4]);
    for index in 0..4_i32 {
        put(&index.to_le_bytes());
    }
    bytes
}

#[test]
fn ascii_and_both_binary_orders_give_the_same_fan() {
    let text = load_bytes(&ascii("0 0 1\n2 0 1\n2 2 1\n0 2 1\n7 4 0 1 2 3\n")).unwrap();
    assert_eq!(text.triangles.len(), 2);
    let corner = |x, y| Vec3::new(x, y, 1.0);
    assert_eq!(
        text.triangles[1].vertices,
        [corner(0.0, 0.0), corner(2.0, 2.0), corner(0.0, 2.0)]
    );
    for big in [false, true] {
        assert_eq!(load_bytes(&binary(big)).unwrap().hash, text.hash);
    }
}

#[test]
fn broken_files_say_where() {
    let cases = [
        (ascii("0 0 1\n2 0 1\n"), "vertex 2 of 4"),
        (ascii("0 0 1\n2 0 1\n2 2 1\n0 2 1\n7 3 0 1 4\n"), "vertex 4"),
        (
            ascii("0 0 1\n2 0 1\n2 2 1\n0 2 1\n7 3 0 1 -1\n"),
            "vertex -1",
        ),
        (
            binary(false)[..binary(false).len() - 3].to_vec(),
            "face 0 of 1",
        ),
        (
            b"ply\nformat ascii 1.0\nelement vertex 3\n".to_vec(),
            "header",
        ),
        (
            b"ply\nformat ascii 1.0\nelement vertex 9000000000\nproperty float x\nend_header\n"
                .to_vec(),
            "more than the file can hold",
        ),
    ];
    for (bytes, expected) in cases {
        let error = load_bytes(&bytes).unwrap_err().to_string();
        assert!(error.contains(expected), "{error} lacks {expected}");
    }
}

#[test]
fn a_list_longer_than_the_file_is_an_error_and_takes_no_memory() {
    let header = "ply\nformat binary_little_endian 1.0\nelement vertex 0\n\
        property float x\nproperty float y\nproperty float z\nelement face 1\n\
        property list uint int vertex_indices\nend_header\n";
    let mut bytes = header.as_bytes().to_vec();
    bytes.extend([0xff; 8]);
    let error = load_bytes(&bytes).unwrap_err().to_string();
    assert!(error.contains("face 0 of 1"), "{error}");
}
