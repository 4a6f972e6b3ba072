//! Files that are no models, whatever their names say.

use super::load_files;
use crate::{EnvironmentMap, check_model};

const POINTER: &[u8] = b"version https://git-lfs.github.com/spec/v1\noid sha256:4d7a\nsize 12345\n";
const PAGE: &[u8] = b"\n<!DOCTYPE HTML>\n<html><head><title>404</title></head></html>\n";
const GZIP: &[u8] = b"\x1f\x8b\x08\0\0\0\0\0\0\x03\x03\0\0\0\0\0\0\0\0\0";
const ZIP: &[u8] = b"PK\x03\x04\x14\0\0\0\x08\0";
const WIDE: &[u8] = b"v\0 \x000\0 \x000\0\n\0";

#[test]
fn what_is_no_model_is_named_with_a_way_to_one() {
    let names = ["a.obj", "a.gltf", "a.glb", "a.ply", "a.xml", "a.obj.gz"];
    for (bytes, parts) in [
        (POINTER, ["pointer of Git LFS", "git lfs pull"]),
        (PAGE, ["a web page", "download the file itself"]),
        (GZIP, ["compressed by gzip", "gzip -dc IN > OUT"]),
        (ZIP, ["a ZIP archive", "unzip FILE"]),
        (WIDE, ["UTF-16 text without a mark", "iconv -f UTF-16LE"]),
    ] {
        let is_of_text = bytes == WIDE;
        for name in &names[..if is_of_text { 1 } else { names.len() }] {
            let error = load_files(&[(name, bytes)]).map(|_| ()).unwrap_err();
            let folder = tempfile::tempdir().expect("a folder");
            let path = folder.path().join(name);
            std::fs::write(&path, bytes).expect("a file");
            let checked = check_model(&path).unwrap_err().to_string();
            for text in [error, checked] {
                assert!(parts.iter().all(|part| text.contains(part)), "{text}");
            }
        }
    }
}

#[test]
fn textures_libraries_and_skies_may_be_none_either() {
    let model = b"mtllib m.mtl\nv 0 0 0\nv 1 0 0\nv 0 1 0\nusemtl a\nf 1 2 3\n";
    for (texture, says) in [
        (POINTER, "it is a pointer of Git LFS to the file (fetch"),
        (&[][..], "the file is empty"),
    ] {
        let files: [(&str, &[u8]); 3] = [
            ("a.obj", model),
            ("m.mtl", b"newmtl a\nmap_Kd t.png\n"),
            ("t.png", texture),
        ];
        let told = load_files(&files).expect("a scene").report.warnings;
        assert!(told.iter().any(|line| line.contains(says)), "{told:?}");
    }
    let told = load_files(&[("a.obj", model), ("m.mtl", GZIP)]);
    let told = told.expect("a scene").report.warnings;
    let says = "m.mtl: it is compressed by gzip (unpack it first: `gzip -dc IN > OUT`); its materials are drawn grey";
    assert!(told.iter().any(|line| line.contains(says)), "{told:?}");
    let folder = tempfile::tempdir().expect("a folder");
    let path = folder.path().join("a.hdr");
    std::fs::write(&path, POINTER).expect("a file");
    let error = EnvironmentMap::read(&path, &mut Vec::new()).unwrap_err();
    assert!(error.to_string().contains("git lfs pull"), "{error}");
}
