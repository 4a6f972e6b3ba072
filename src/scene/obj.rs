//! Wavefront OBJ by `tobj`; materials are in [`super::mtl`].

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::error::{self, guarded, panic_text};
use super::text::normalised;
use super::texture::decode_all;
use super::{LoadOptions, Material, SceneData, SceneError, mtl};
use glam::{Vec2, Vec3};
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::Path;

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
    let bytes = error::read(path)?;
    guarded(path, || {
        let text = normalised(bytes);
        let library = mtl::Library::new(path, options);
        let models = read(&text, &library).map_err(|failure| {
            let (place, problem) = match first_broken_line(&text) {
                Some((line, problem)) => (format!("line {line}"), problem),
                None => (String::new(), failure),
            };
            SceneError::malformed(path, place, problem)
        })?;
        let mut warnings = Vec::new();
        warnings.extend(too_few_corners(&text));
        warnings.extend(cut_off(&text));
        drop(text);
        build(name, options, models, library, warnings)
    })
}

/// The models, or what `tobj` says or panics with: it multiplies indices before it compares them with
/// what there is.
fn read(text: &str, library: &mtl::Library) -> Result<Vec<tobj::Model>, String> {
    let load = || tobj::load_obj_buf(&mut text.as_bytes(), &OPTIONS, |file| library.load(file));
    match catch_unwind(AssertUnwindSafe(load)) {
        Ok(Ok((models, _))) => Ok(models),
        Ok(Err(error)) => Err(error.to_string()),
        Err(payload) => Err(panic_text(payload.as_ref())),
    }
}

fn build(
    name: &str,
    options: &LoadOptions,
    models: Vec<tobj::Model>,
    library: mtl::Library,
    mut warnings: Vec<String>,
) -> Result<SceneData, SceneError> {
    let mtl::Contents {
        mut materials,
        textures,
        warnings: of_materials,
        ..
    } = library.into_contents();
    warnings.extend(of_materials);
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
        options.texture_limits(builder.len()),
        &mut materials,
        &mut builder.report,
    );
    let look = Look {
        materials,
        textures,
        ..Look::default()
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
    let normal = |i: u32| Vec3::from_slice(&mesh.normals[3 * i as usize..]);
    let normal_corners = mesh.normal_indices.as_chunks::<3>().0;
    for (k, corner) in corners.iter().enumerate() {
        let uvs = uv_corners.get(k).map_or([Vec2::ZERO; 3], |c| c.map(uv));
        let normals = normal_corners.get(k).map(|c| c.map(normal));
        builder.push_corners(corner.map(position), uvs, normals, material);
    }
}

/// Faces that `tobj` takes for lines or points and leaves out.
fn too_few_corners(text: &str) -> Option<String> {
    let is_short = |(_, line): &(usize, &str)| {
        let mut words = line.split_ascii_whitespace();
        words.next() == Some("f") && words.take_while(|word| !word.starts_with('#')).count() < 3
    };
    let mut short = (1..).zip(text.lines()).filter(is_short);
    let (first, _) = short.next()?;
    let count = 1 + short.count();
    Some(match count {
        1 => format!("line {first}: a face with fewer than three corners, left out"),
        _ => format!(
            "{count} faces with fewer than three corners, left out; the first in line {first}"
        ),
    })
}

/// A file that ends within a statement lacks the end of its last line. A number that lacks its last
/// digits is a number, so that is all there is to see.
fn cut_off(text: &str) -> Option<String> {
    let last = text.lines().next_back().filter(|_| !text.ends_with('\n'))?;
    let keyword = last.split_ascii_whitespace().next()?;
    ["v", "vt", "vn", "f"].contains(&keyword).then(|| {
        let number = text.lines().count();
        format!("line {number}, the last, has no line end: the file may be cut off there")
    })
}

/// `tobj` tells what is wrong, not where: reads the statements again, only after a failure, and
/// returns the number (from 1) of the first line that no reader can accept.
fn first_broken_line(text: &str) -> Option<(usize, String)> {
    // Numbers of `v`, `vt`, `vn` so far, and whether vertices have colours.
    let mut counts = [0_i64; 3];
    let mut colored = None;
    for (number, line) in (1..).zip(text.lines()) {
        let mut words = line.split_whitespace();
        let keyword = words.next().unwrap_or("");
        let problem = match keyword {
            "v" | "vt" | "vn" => {
                let kind = ["v", "vt", "vn"].iter().position(|k| *k == keyword)?;
                counts[kind] += 1;
                let has_color = words.clone().count() == 6;
                let problem = vector_problem(keyword, words);
                let mixed = keyword == "v" && *colored.get_or_insert(has_color) != has_color;
                let mixed = mixed.then(|| "some vertices have a colour, others none".to_owned());
                problem.or(mixed)
            }
            "f" | "l" => {
                let problem = words
                    .clone()
                    .find_map(|corner| corner_problem(corner, &counts));
                let bare = words
                    .next()
                    .is_none()
                    .then(|| format!("`{keyword}` with no corners"));
                problem.or(bare)
            }
            "usemtl" if words.next().is_none() => Some("`usemtl` with no name".to_owned()),
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
    let read = if keyword == "v" { words.len() } else { least };
    if let Some(broken) = words[..read].iter().find(|w| w.parse::<f32>().is_err()) {
        return Some(format!("`{broken}` is not a number"));
    }
    // The fourth number of a vertex divides the others.
    let weight = words
        .get(3)
        .filter(|_| keyword == "v" && words.len() == 4)?;
    (weight.parse() == Ok(0.0_f32)).then(|| "a vertex of weight 0".to_owned())
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
