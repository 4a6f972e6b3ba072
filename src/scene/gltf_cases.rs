//! A table of documents as exporters write them, also against the standard: what of each is drawn,
//! and what the user is told.

use super::{LoadOptions, SceneData, decode_color};
use base64::Engine;
use base64::engine::general_purpose::STANDARD;
use glam::Vec3;
use serde_json::{Value, json};

/// A square of two triangles, changed by what each case says.
struct Case {
    name: &'static str,
    document: Value,
    /// The buffer: positions, indices, then what cases add, each in a view of its own.
    bytes: Vec<u8>,
    /// Files beside the model.
    files: Vec<(&'static str, Vec<u8>)>,
}

fn floats(values: impl IntoIterator<Item = f32>) -> Vec<u8> {
    values.into_iter().flat_map(f32::to_le_bytes).collect()
}

fn shorts(values: impl IntoIterator<Item = u16>) -> Vec<u8> {
    values.into_iter().flat_map(u16::to_le_bytes).collect()
}

const CORNERS: [[f32; 3]; 4] = [
    [0.0, 0.0, 0.0],
    [1.0, 0.0, 0.0],
    [1.0, 1.0, 0.0],
    [0.0, 1.0, 0.0],
];

fn case(name: &'static str) -> Case {
    let mut bytes = floats(CORNERS.into_iter().flatten());
    bytes.extend(shorts([0, 1, 2, 0, 2, 3]));
    let document = json!({
        "asset": {"version": "2.0"}, "scene": 0, "scenes": [{"nodes": [0]}], "nodes": [{"mesh": 0}],
        "meshes": [{"name": "square", "primitives": [{"attributes": {"POSITION": 0}, "indices": 1}]}],
        "accessors": [
            {"bufferView": 0, "componentType": 5126, "count": 4, "type": "VEC3"},
            {"bufferView": 1, "componentType": 5123, "count": 6, "type": "SCALAR"}],
        "bufferViews": [{"buffer": 0, "byteLength": 48}, {"buffer": 0, "byteOffset": 48, "byteLength": 12}],
        "buffers": [{}],
    });
    Case {
        name,
        document,
        bytes,
        files: Vec::new(),
    }
}

impl Case {
    /// Sets the value at a path of keys and indices, or removes it if it is null.
    fn set(mut self, path: &str, value: Value) -> Self {
        let (parent, key) = path.rsplit_once('/').expect("a path");
        let parent = self.document.pointer_mut(parent);
        let parent = parent.unwrap_or_else(|| panic!("{}: {path}", self.name));
        match parent {
            Value::Object(map) if value.is_null() => drop(map.remove(key)),
            Value::Object(map) => drop(map.insert(key.to_owned(), value)),
            Value::Array(list) if key == "-" => list.push(value),
            _ => parent[key.parse::<usize>().expect("an index")] = value,
        }
        self
    }

    /// Adds bytes and an accessor of them.
    fn accessor(mut self, bytes: Vec<u8>, component: u32, kind: &str, count: usize) -> Self {
        self.bytes.resize(self.bytes.len().next_multiple_of(4), 0);
        let (view, offset, length) = (
            self.document["bufferViews"]
                .as_array()
                .expect("views")
                .len(),
            self.bytes.len(),
            bytes.len(),
        );
        self.bytes.extend(bytes);
        let buffer_view = json!({"buffer": 0, "byteOffset": offset, "byteLength": length});
        let accessor =
            json!({"bufferView": view, "componentType": component, "count": count, "type": kind});
        self.set("/bufferViews/-", buffer_view)
            .set("/accessors/-", accessor)
    }

    /// A second primitive besides the square, which stays.
    fn primitive(self, primitive: Value) -> Self {
        self.set("/meshes/0/primitives/-", primitive)
    }

    fn material(self, material: Value) -> Self {
        self.set("/materials", json!([material]))
            .set("/meshes/0/primitives/0/material", json!(0))
    }

    fn file(mut self, name: &'static str, bytes: Vec<u8>) -> Self {
        self.files.push((name, bytes));
        self
    }

    /// The bytes in a file of this name, which the document calls by this URI.
    fn beside(self, name: &'static str, uri: &str) -> Self {
        let bytes = self.bytes.clone();
        self.file(name, bytes).set("/buffers/0/uri", json!(uri))
    }

    /// The text, with the bytes in a data URI unless the document already says where they are.
    fn text(&self) -> String {
        let mut document = self.document.clone();
        let length = self.bytes.len();
        if let Some(buffer) = document
            .pointer_mut("/buffers/0")
            .and_then(Value::as_object_mut)
        {
            let encoded = STANDARD.encode(&self.bytes);
            let data = format!("data:application/octet-stream;base64,{encoded}");
            buffer.entry("uri").or_insert(json!(data));
            buffer.entry("byteLength").or_insert(json!(length));
        }
        document.to_string()
    }

    fn glb(&self, padding: u8) -> Vec<u8> {
        let mut document = self.document.clone();
        document["buffers"][0]["byteLength"] = json!(self.bytes.len());
        let mut json = document.to_string().into_bytes();
        json.resize(json.len().next_multiple_of(4), padding);
        let length = 28 + json.len() + self.bytes.len();
        let word = |number: usize| (number as u32).to_le_bytes();
        let head = [
            b"glTF",
            &word(2)[..],
            &word(length),
            &word(json.len()),
            b"JSON",
        ];
        let tail = [&word(self.bytes.len())[..], b"BIN\0", &self.bytes];
        [head.concat(), json, tail.concat()].concat()
    }

    fn load(&self) -> Loaded {
        self.load_as("model.gltf", self.text().as_bytes())
    }

    fn load_as(&self, file: &str, bytes: &[u8]) -> Loaded {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join(file);
        for (name, bytes) in self
            .files
            .iter()
            .map(|(n, b)| (*n, &b[..]))
            .chain([(file, bytes)])
        {
            let file = folder.path().join(name);
            std::fs::create_dir_all(file.parent().expect("a folder")).expect("a folder");
            std::fs::write(file, bytes).expect("a file");
        }
        let loaded = super::gltf::load(&path, "model", &LoadOptions::default());
        Loaded {
            name: self.name,
            result: loaded.map_err(|error| error.to_string()),
        }
    }
}

struct Loaded {
    name: &'static str,
    result: Result<SceneData, String>,
}

impl Loaded {
    fn scene(&self) -> &SceneData {
        let result = self.result.as_ref();
        result.unwrap_or_else(|error| panic!("{}: {error}", self.name))
    }

    /// The warnings, without that on the missing light.
    fn told(&self) -> String {
        let warnings = self.scene().report.warnings.iter();
        let told = warnings.filter(|line| !line.contains("has no light"));
        told.cloned().collect::<Vec<_>>().join("\n")
    }

    /// So many triangles, and nothing left out.
    #[track_caller]
    fn whole(self, triangles: usize) -> Self {
        self.drawn(triangles);
        assert_eq!(self.told(), "", "{}", self.name);
        self
    }

    /// So many triangles with area, all finite.
    #[track_caller]
    fn drawn(&self, triangles: usize) {
        let scene = self.scene();
        assert_eq!(scene.triangles.len(), triangles, "{}", self.name);
        assert_eq!(scene.report.zero_area, 0, "{}", self.name);
    }

    /// So many triangles, and a note of all these words, once.
    #[track_caller]
    fn but(self, triangles: usize, note: &[&str]) -> Self {
        self.drawn(triangles);
        let told = self.told();
        for word in note {
            assert_eq!(
                told.matches(word).count(),
                1,
                "{}: `{word}` in: {told}",
                self.name
            );
        }
        self
    }

    #[track_caller]
    fn fails(self, words: &[&str]) {
        let message = self.result.map(|_| ()).expect_err(self.name);
        for word in words {
            assert!(
                message.contains(word),
                "{}: `{word}` in: {message}",
                self.name
            );
        }
    }

    /// The far corner of the square, and the colour there.
    #[track_caller]
    fn corner(self, expected: [f32; 3]) -> Self {
        let found = self.scene().triangles[0].vertices[2];
        assert!(
            found.distance(expected.into()) < 1e-4,
            "{}: {found}",
            self.name
        );
        self
    }

    #[track_caller]
    fn color(self, expected: [f32; 3]) -> Self {
        let scene = self.scene();
        let base = scene.materials[scene.material_ids[0] as usize].base_color;
        let vertex = scene.colors.first().map(|c| decode_color(c[2]).as_vec3());
        let found = base * vertex.unwrap_or(Vec3::ONE);
        assert!(
            found.distance(expected.into()) < 1e-4,
            "{}: {found}",
            self.name
        );
        self
    }
}

mod accessors;
mod files;
mod materials;
mod nodes;
mod poses;
