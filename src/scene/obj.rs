//! Wavefront OBJ by `tobj`; materials are in [`super::mtl`].

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::error::{guarded, open};
use super::texture::decode_all;
use super::{LoadOptions, Material, SceneData, SceneError, mtl};
use glam::{Vec2, Vec3};
use std::fs::File;
use std::io::{BufReader, Cursor};
use std::path::Path;
use tobj::LoadError;

/// Separate indices: no vertex is duplicated, and `tobj` keeps no map over index triples.
const OPTIONS: tobj::LoadOptions = tobj::LoadOptions {
    single_index: false,
    triangulate: true,
    ignore_points: true,
    ignore_lines: true,
};

/// Loads an OBJ model: relative indices, polygons as fans, `v` of texture coordinates turned down.
///
/// # Errors
/// [`SceneError`] with the line of the first broken statement.
pub(super) fn load(
    path: &Path,
    name: &str,
    options: &LoadOptions,
) -> Result<SceneData, SceneError> {
    let file = open(path)?;
    guarded(path, || {
        let library = mtl::Library::new(path, options.textures);
        let models = parse(path, file, &library)?;
        build(name, options, models, library)
    })
}

fn parse(path: &Path, file: File, library: &mtl::Library) -> Result<Vec<tobj::Model>, SceneError> {
    let load_mtl = |file: &Path| library.load(file);
    let mut reader = BufReader::with_capacity(1 << 20, file);
    let mut result = tobj::load_obj_buf(&mut reader, &OPTIONS, load_mtl);
    if matches!(result, Err(LoadError::ReadError)) {
        // Old exporters write names in Latin-1; the geometry is ASCII all the same.
        let text = lossy_text(path)?;
        library.forget();
        result = tobj::load_obj_buf(&mut Cursor::new(text), &OPTIONS, load_mtl);
    }
    match result {
        Ok((models, _)) => Ok(models),
        Err(error) => {
            let (place, problem) = match first_broken_line(&lossy_text(path)?) {
                Some((line, problem)) => (format!("line {line}"), problem),
                None => (String::new(), error.to_string()),
            };
            Err(SceneError::malformed(path, place, problem))
        }
    }
}

fn build(
    name: &str,
    options: &LoadOptions,
    models: Vec<tobj::Model>,
    library: mtl::Library,
) -> Result<SceneData, SceneError> {
    let mtl::Contents {
        mut materials,
        textures,
        warnings,
    } = library.into_contents();
    let count = models.iter().map(|m| m.mesh.indices.len() / 3).sum();
    let mut builder = SceneBuilder::new(!textures.is_empty(), count);
    builder.report.warnings = warnings;
    let default_id = materials.len() as u32;
    let mut without_material = (0, None);
    // By value: each model's arrays are freed as soon as they are copied.
    for tobj::Model { mesh, name } in models {
        let id = mesh.material_id.map_or(default_id, |id| id as u32);
        if id == default_id && !mesh.indices.is_empty() {
            without_material.0 += mesh.indices.len() / 3;
            without_material.1.get_or_insert(name);
        }
        push_mesh(&mut builder, &mesh, id);
    }
    if let (triangles, Some(object)) = without_material {
        materials.push(Material::diffuse("default", Vec3::splat(DEFAULT_ALBEDO)));
        if default_id > 0 {
            builder.report.warnings.push(format!(
                "{triangles} triangles (first object: `{object}`) use no material that a .mtl \
                 file defines; drawn grey"
            ));
        }
    }
    let textures = decode_all(
        &textures,
        options.max_texture_size,
        &mut materials,
        &mut builder.report,
    );
    let look = Look {
        materials,
        textures,
        camera: None,
        environment: Vec3::ZERO,
    };
    builder.finish(name, look)
}

fn push_mesh(builder: &mut SceneBuilder, mesh: &tobj::Mesh, material: u32) {
    let position = |i: u32| Vec3::from_slice(&mesh.positions[3 * i as usize..]);
    let uv = |i: u32| {
        let [u, v] = [0, 1].map(|k| mesh.texcoords[2 * i as usize + k]);
        Vec2::new(u, 1.0 - v)
    };
    let corners = mesh.indices.as_chunks::<3>().0;
    let uv_corners = mesh.texcoord_indices.as_chunks::<3>().0;
    for (k, corner) in corners.iter().enumerate() {
        let uvs = uv_corners.get(k).map_or([Vec2::ZERO; 3], |c| c.map(uv));
        builder.push_textured(corner.map(position), uvs, material);
    }
}

fn lossy_text(path: &Path) -> Result<String, SceneError> {
    let bytes = std::fs::read(path).map_err(|source| SceneError::Read {
        path: path.to_owned(),
        source,
    })?;
    Ok(String::from_utf8(bytes)
        .unwrap_or_else(|error| String::from_utf8_lossy(error.as_bytes()).into_owned()))
}

/// `tobj` tells what is wrong, not where: reads the statements again, only after a failure, and
/// returns the number (from 1) of the first line that no reader can accept.
fn first_broken_line(text: &str) -> Option<(usize, String)> {
    // Numbers of `v`, `vt`, `vn` so far.
    let mut counts = [0_i64; 3];
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or("");
        let problem = match keyword {
            "v" | "vt" | "vn" => {
                let kind = ["v", "vt", "vn"].iter().position(|k| *k == keyword)?;
                counts[kind] += 1;
                vector_problem(keyword, words)
            }
            "f" => words.find_map(|corner| corner_problem(corner, &counts)),
            _ => None,
        };
        if let Some(problem) = problem {
            return Some((number, problem));
        }
    }
    None
}

fn vector_problem<'a>(keyword: &str, words: impl Iterator<Item = &'a str>) -> Option<String> {
    let words: Vec<_> = words.collect();
    let (least, allowed): (usize, &[usize]) = match keyword {
        "v" => (3, &[3, 4, 6]),
        "vt" => (2, &[]),
        _ => (3, &[]),
    };
    if words.len() < least || !(allowed.is_empty() || allowed.contains(&words.len())) {
        return Some(format!("`{keyword}` with {} numbers", words.len()));
    }
    let broken = words[..least].iter().find(|w| w.parse::<f32>().is_err())?;
    Some(format!("`{broken}` is not a number"))
}

fn corner_problem(corner: &str, counts: &[i64; 3]) -> Option<String> {
    const WHAT: [&str; 3] = ["vertex", "texture coordinate", "normal"];
    for (k, index) in corner.split('/').enumerate().filter(|(_, i)| !i.is_empty()) {
        let (Ok(value), Some(count)) = (index.parse::<i64>(), counts.get(k)) else {
            return Some(format!("`{corner}` is not a face corner"));
        };
        if value == 0 || value > *count || value < -count {
            return Some(format!(
                "the face refers to {} {value}, but there are {count} before it",
                WHAT[k]
            ));
        }
    }
    None
}
