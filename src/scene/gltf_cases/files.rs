//! The text, its container, and the files that it names.

use super::*;

#[test]
fn bytes_of_data_uris_are_read_however_they_are_written() {
    // Indices whose encoding has both letters that URLs write otherwise.
    let model = |name| {
        let mut model = case(name);
        model.bytes.extend([0xfb, 0xff, 0xbf, 0x3e]);
        model
    };
    let encoded = STANDARD.encode(model("").bytes);
    assert!(encoded.contains('+') && encoded.contains('/') && encoded.ends_with('='));
    let escaped = encoded
        .replace('+', "%2B")
        .replace('/', "%2f")
        .replace('=', "%3D");
    let plain: String = model("")
        .bytes
        .iter()
        .map(|byte| format!("%{byte:02x}"))
        .collect();
    let lines: Vec<&str> = encoded
        .as_bytes()
        .chunks(20)
        .map(|l| std::str::from_utf8(l).unwrap())
        .collect();
    for uri in [
        format!("data:application/gltf-buffer;base64,{encoded}"),
        format!("data:;base64,{encoded}"),
        format!("data:application/octet-stream;charset=utf-8;base64,{encoded}"),
        format!("DATA:text/plain;BASE64,{encoded}"),
        format!(
            "data:application/octet-stream;base64,{}",
            encoded.trim_end_matches('=')
        ),
        format!("data:application/octet-stream;base64,{escaped}"),
        format!(
            "data:application/octet-stream;base64,{}",
            encoded.replace('+', "-").replace('/', "_")
        ),
        format!(
            "data:application/octet-stream;base64,{}",
            lines.join("\r\n")
        ),
        format!("data:application/octet-stream,{plain}"),
        format!("data:,{plain}"),
    ] {
        model("a data URI")
            .set("/buffers/0/uri", json!(uri))
            .load()
            .whole(2);
    }
    for uri in ["data:application/octet-stream;base64", "data:;base64,*AAA"] {
        let broken = model("no data").set("/buffers/0/uri", json!(uri)).load();
        broken.fails(&["mesh 0", "buffer 0: the data URI cannot be decoded"]);
    }
}

#[test]
fn files_are_found_as_exporters_name_them() {
    for (name, uri) in [
        ("quad.bin", "quad.bin"),
        ("data/quad.bin", "data/quad.bin"),
        ("data/quad.bin", "data\\quad.bin"),
        ("data/quad.bin", ".\\data\\quad.bin"),
        ("a b.bin", "a%20b.bin"),
        ("a b.bin", "a b.bin"),
        ("a%20b.bin", "a%20b.bin"),
        ("100%.bin", "100%.bin"),
        ("käse.bin", "k%C3%A4se.bin"),
        ("käse.bin", "käse.bin"),
        ("data/a b.bin", "data%5Ca%20b.bin"),
        ("a#1.bin", "a#1.bin"),
        ("a+b.bin", "a+b.bin"),
        ("quad.bin", "quad.bin?version=3"),
        ("quad.bin", "./quad.bin"),
    ] {
        case("a file").beside(name, uri).load().whole(2);
    }
    case("a file in another case")
        .beside("Data.BIN", "data.bin")
        .load()
        .but(2, &["`data.bin` is not there: ", "Data.BIN is read"]);
    // As archives of macOS hold it: a letter and its accent.
    case("a file in decomposed letters")
        .beside("ka\u{308}se.bin", "k\u{e4}se.bin")
        .load()
        .but(
            2,
            &["`k\u{e4}se.bin` is not there: ", "ka\u{308}se.bin is read"],
        );
    case("a file in capital letters beyond ASCII")
        .beside("K\u{c4}SE.bin", "k\u{e4}se.bin")
        .load()
        .but(2, &["K\u{c4}SE.bin is read"]);
    let pointer = b"version https://git-lfs.github.com/spec/v1\n".to_vec();
    case("a pointer to a file")
        .file("quad.bin", pointer)
        .set("/buffers/0/uri", json!("quad.bin"))
        .load()
        .fails(&[
            "mesh 0",
            "quad.bin: it is a pointer of Git LFS",
            "git lfs pull",
        ]);
    let of = |uri: &str| case("no file").set("/buffers/0/uri", json!(uri)).load();
    of("data\\quad.bin").fails(&["buffer 0", "data/quad.bin"]);
    of("..\\quad.bin").fails(&["buffer 0", "outside the model's folder"]);
    of("https://example.org/quad.bin").fails(&["on the network", "beside the model"]);
    case("a missing file that is not used")
        .set("/buffers/-", json!({"uri": "none.bin", "byteLength": 4}))
        .load()
        .whole(2);
}

#[test]
fn texts_may_be_marked_padded_and_nearly_json() {
    let model = case("a text");
    let text = model.text();
    let utf_16: Vec<u8> = format!("\u{feff}{text}")
        .encode_utf16()
        .flat_map(u16::to_le_bytes)
        .collect();
    for bytes in [
        format!("\u{feff}{text}").into_bytes(),
        format!("{text}\0\0\0").into_bytes(),
        format!("\r\n {text}  \n\0").into_bytes(),
        format!("\0\u{feff}{text}\u{1a}").into_bytes(),
        utf_16,
        text.replace("square", "squ\u{e4}re")
            .chars()
            .map(|c| c as u8)
            .collect(),
    ] {
        model.load_as("model.gltf", &bytes).whole(2);
    }
    let mended = |from: &str, to: &str| {
        assert!(text.contains(from), "{from}");
        model.load_as("model.gltf", text.replace(from, to).as_bytes())
    };
    let told = &["the text is not JSON", "line 1"][..];
    mended("\"mesh\":0", "\"mesh\":0,").but(2, told);
    mended("\"count\":4", "\"count\":4,\"min\":[NaN,-Infinity,1.#IND]").but(2, told);
    mended("\"count\":4", "\"count\":4,\"max\":[-nan(ind),nan, inf ]").but(2, told);
    mended("square", "a\tb\\d").but(2, told);
    mended(
        "\"buffers\":[{",
        "\"images\":[{\"uri\":\"textures\\wood.png\"},],\"buffers\":[{",
    )
    .but(2, told);
    mended("\"mesh\":0", "\"mesh\":}").fails(&["model.gltf", "line 1 column"]);
    mended("\"mesh\":0", "\"mesh\":0,\"name\":\"NaN ,] \\\"\"").whole(2);
    for other in [&b"glXF\x02\0\0\0"[..], b"<html>"] {
        let expected = "neither binary glTF, which begins with `glTF`, nor JSON text";
        model.load_as("model.glb", other).fails(&[expected]);
    }
}

#[test]
fn containers_may_be_padded_and_counted_wrongly() {
    let model = case("a container");
    let load = |bytes: &[u8]| model.load_as("model.glb", bytes);
    for padding in [b' ', 0] {
        load(&model.glb(padding)).whole(2);
    }
    let glb = model.glb(b' ');
    let with_word = |at: usize, word: u32| {
        let mut bytes = glb.clone();
        bytes[at..at + 4].copy_from_slice(&word.to_le_bytes());
        bytes
    };
    for length in [0, 20, glb.len() as u32 - 1, glb.len() as u32 + 9, u32::MAX] {
        load(&with_word(8, length)).whole(2);
    }
    load(&[&glb[..], b"\0\0\0"].concat()).whole(2);
    load(&[&glb[..], b"padding of 3D Tiles"].concat()).whole(2);
    // The length of the text without its padding.
    let json = u32::from_le_bytes(*glb[12..].first_chunk().unwrap());
    let text = std::str::from_utf8(&glb[20..20 + json as usize]).unwrap();
    let padding = (text.len() - text.trim_end().len()) as u32;
    load(&with_word(12, json - padding)).whole(2);
    let chunk = [&4_u32.to_le_bytes()[..], b"XTRAmore"].concat();
    let at = 20 + json as usize;
    load(&[&glb[..at], &chunk, &glb[at..]].concat()).whole(2);
    load(&glb[..glb.len() - 1]).fails(&["mesh 0", "indices are outside"]);
    load(&glb[..at]).fails(&["buffer 0", "no binary chunk"]);
    load(&glb[..at - 9]).fails(&["byte 12", "a chunk of"]);
    load(&with_word(4, 1)).fails(&["byte 4", "version 1"]);
    let mut named = case("a container that also names no file");
    named.document["buffers"][0]["uri"] = json!("");
    named.load_as("model.glb", &named.glb(b' ')).whole(2);
    let alone = model.text();
    model.load_as("model.glb", alone.as_bytes()).whole(2);
}

#[test]
fn other_versions_say_what_to_do() {
    let of = |version: Value| case("a version").set("/asset/version", version).load();
    of(json!("1.0")).fails(&["glTF of version 1.0", "export it as glTF 2.0"]);
    of(json!(1)).fails(&["glTF of version 1", "export it as glTF 2.0"]);
    of(json!("2.1")).whole(2);
    of(json!(2)).whole(2);
    // collada2gltf wrote some without a version.
    case("parts with names")
        .set("/asset", Value::Null)
        .set("/meshes", json!({"mesh_1": {"primitives": []}}))
        .load()
        .fails(&["glTF of version 1.0"]);
    case("no version")
        .set("/asset", Value::Null)
        .load()
        .whole(2);
}

#[test]
fn what_is_no_list_is_named() {
    case("primitives in no list")
        .set(
            "/meshes/0/primitives",
            json!({"attributes": {"POSITION": 0}}),
        )
        .load()
        .fails(&["no triangles", "`primitives` is not a list", "mesh 0"]);
    case("animations in no list")
        .set("/animations", json!("none"))
        .load()
        .but(2, &["`animations` is not a list"]);
}
