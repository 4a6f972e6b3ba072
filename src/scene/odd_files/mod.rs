//! Files as programs write them, with what is read of each and what is said about the rest.

mod disguise;
mod ies;
mod masks;
mod nori;
mod obj;
mod ply;
mod textures;

use super::{LoadOptions, Params, SceneData, Variant, decode_color, load_alone};
use std::path::Path;

/// What becomes of a file: a letter per triangle for its colour (`.` grey, `r` red, `g` green, `b`
/// blue) and parts of the notes, one for each; or parts of the error.
enum Outcome {
    Reads(&'static str, &'static [&'static str]),
    Fails(&'static [&'static str]),
}

use Outcome::{Fails, Reads};

fn load(file: &Path) -> Result<SceneData, String> {
    let variant = Variant {
        name: file.to_string_lossy().into_owned(),
        params: Params::default(),
        label: String::new(),
    };
    load_alone(&variant, &LoadOptions::default()).map_err(|error| error.to_string())
}

/// The colours of a scene's triangles, by their first corners.
fn colors(scene: &SceneData) -> String {
    let letter = |k: usize| {
        let corner = scene
            .colors
            .get(k)
            .map_or(glam::DVec3::ONE, |c| decode_color(c[0]));
        let base = scene.materials[scene.material_ids[k] as usize].base_color;
        let [r, g, b] = (corner * base.as_dvec3()).to_array();
        match (r, g, b) {
            _ if r > g.max(b) => 'r',
            _ if g > r.max(b) => 'g',
            _ if b > r.max(g) => 'b',
            _ => '.',
        }
    };
    (0..scene.triangles.len()).map(letter).collect()
}

fn check(case: &str, result: Result<SceneData, String>, expected: &Outcome) {
    match (result, expected) {
        (Ok(scene), Reads(looks, notes)) => {
            assert_eq!(colors(&scene), *looks, "{case}: {:?}", scene.report);
            let sky = scene.daylight.map(|sky| sky.note());
            let mut lines = scene.report.lines();
            lines.retain(|line| Some(line) != sky.as_ref());
            check_parts(case, &lines.join("\n"), notes);
            assert!(
                lines.len() == notes.len(),
                "{case}: {lines:?} beyond {notes:?}"
            );
        }
        (Err(error), Fails(parts)) => {
            check_parts(case, &error, parts);
            assert!(!error.contains(['\n', '\t']), "{case}: {error:?}");
        }
        (Ok(scene), Fails(parts)) => panic!("{case}: {} is no {parts:?}", colors(&scene)),
        (Err(error), Reads(..)) => panic!("{case}: {error}"),
    }
}

fn check_parts(case: &str, text: &str, parts: &[&str]) {
    for part in parts {
        assert!(text.contains(part), "{case}: {text:?} lacks {part:?}");
    }
}

/// A DDS file of one block of BC1: two colours, and the choices of each row's texels, two bits each.
fn bc1(colors: [u16; 2], choices: [u8; 4], has_late_header: bool) -> Vec<u8> {
    let mut dds = [&b"DDS "[..], &[0; 124]].concat();
    let words = [
        (4, 124),
        (8, 0x1007),
        (12, 4),
        (16, 4),
        (76, 32),
        (80, 4),
        (108, 0x1000),
    ];
    for (at, word) in words {
        dds[at..at + 4].copy_from_slice(&u32::to_le_bytes(word));
    }
    dds[84..88].copy_from_slice(if has_late_header { b"DX10" } else { b"DXT1" });
    if has_late_header {
        let format_and_plane = [71_u32, 3, 0, 1, 0];
        dds.extend(format_and_plane.into_iter().flat_map(u32::to_le_bytes));
    }
    dds.extend(colors.into_iter().flat_map(u16::to_le_bytes));
    dds.extend(choices);
    dds
}

/// Writes files into a folder of their own and loads the first.
fn load_files(files: &[(&str, &[u8])]) -> Result<SceneData, String> {
    let folder = tempfile::tempdir().expect("a folder");
    for (name, bytes) in files {
        let path = folder.path().join(name);
        std::fs::create_dir_all(path.parent().expect("a parent")).expect("a folder");
        std::fs::write(path, bytes).expect("a file");
    }
    load(&folder.path().join(files[0].0))
}
