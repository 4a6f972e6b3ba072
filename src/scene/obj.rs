//! Wavefront OBJ; materials are in [`super::mtl`], statements in [`super::obj_statements`].

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::colors::linear;
use super::error::{self, guarded};
use super::obj_statements::{Corner, Face, Statements};
use super::polygon::triangulate;
use super::text::normalised;
use super::texture::decode_all;
use super::{LoadOptions, Material, SceneData, SceneError, mtl};
use glam::{Vec2, Vec3};
use std::path::Path;

/// Loads an OBJ model: relative indices, polygons as triangles, `v` of texture coordinates flipped
/// to point down. Vertex colours are sRGB, as in Blender and three.js.
///
/// # Errors
/// [`SceneError`] with the line of the first malformed statement.
pub(super) fn load(
    path: &Path,
    name: &str,
    options: &LoadOptions,
) -> Result<SceneData, SceneError> {
    let bytes = error::read(path)?;
    guarded(path, || {
        let text = normalised(bytes);
        let library = mtl::Library::new(path, options);
        let broken = |(line, problem): (u32, String)| {
            SceneError::malformed(path, format!("line {line}"), problem)
        };
        let mut read = Statements::read(&text, &library).map_err(broken)?;
        drop(text);
        let mtl::Contents {
            mut materials,
            textures,
            warnings,
            ..
        } = library.into_contents();
        let mut builder = SceneBuilder::new(!textures.is_empty(), read.faces.len());
        builder.report.warnings = std::mem::take(&mut read.warnings);
        builder.report.warnings.extend(warnings);
        let mut model = Model::new(read, builder, materials.len() as u32);
        model.push_faces().map_err(broken)?;
        model.tell();
        materials.append(&mut model.without);
        let mut builder = model.builder;
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
    })
}

struct Model {
    read: Statements,
    builder: SceneBuilder,
    /// Number of library materials.
    known: u32,
    /// Materials of faces without one, numbered after those of the libraries.
    without: Vec<Material>,
    grey: Option<u32>,
    white: Option<u32>,
    /// Number of triangles without a material, and the object of the first.
    drawn_grey: (usize, Option<String>),
    /// Number of self-intersecting polygons, and the line of the first.
    crossing: (usize, u32),
    /// Number of colours outside 0 to 1 or not numeric.
    odd_colors: usize,
}

impl Model {
    fn new(read: Statements, builder: SceneBuilder, known: u32) -> Self {
        Self {
            read,
            builder,
            known,
            without: Vec::new(),
            grey: None,
            white: None,
            drawn_grey: (0, None),
            crossing: (0, 0),
            odd_colors: 0,
        }
    }

    fn push_faces(&mut self) -> Result<(), (u32, String)> {
        let faces = std::mem::take(&mut self.read.faces);
        let mut first = 0;
        for face in &faces {
            let end = first + face.corners as usize;
            self.read
                .check(first..end)
                .map_err(|problem| (face.line, problem))?;
            self.push_face(face, first..end);
            first = end;
        }
        Ok(())
    }

    fn push_face(&mut self, face: &Face, corners: std::ops::Range<usize>) {
        let corners = &self.read.corners[corners];
        let positions = &self.read.positions;
        let places: Vec<Vec3> = corners.iter().map(|c| positions[c.vertex()]).collect();
        let mut colors = Vec::new();
        if !self.read.colors.is_empty() {
            let colors_of = |c: &Corner| self.read.colors.get(c.vertex()).copied().flatten();
            let given: Vec<Option<Vec3>> = corners.iter().map(colors_of).collect();
            let is_odd = |c: &Vec3| !(c.min_element() >= 0.0 && c.max_element() <= 1.0);
            self.odd_colors += usize::from(given.iter().flatten().any(is_odd));
            if given.iter().any(Option::is_some) {
                let light = |c: &Option<Vec3>| {
                    let shown = c.unwrap_or(Vec3::ONE).clamp(Vec3::ZERO, Vec3::ONE);
                    Vec3::from(shown.to_array().map(linear))
                };
                colors = given.iter().map(light).collect();
            }
        }
        let material = match self.read.materials[face.material as usize] {
            Some(id) => id,
            None => {
                let next = self.known + self.without.len() as u32;
                let (id, albedo) = if colors.is_empty() {
                    (&mut self.grey, DEFAULT_ALBEDO)
                } else {
                    (&mut self.white, 1.0)
                };
                *id.get_or_insert_with(|| {
                    let default = Material::diffuse("default", Vec3::splat(albedo));
                    self.without.push(default);
                    next
                })
            }
        };
        if Some(material) == self.grey {
            self.drawn_grey.0 += corners.len() - 2;
            let object = || self.read.objects[face.object as usize].clone();
            self.drawn_grey.1.get_or_insert_with(object);
        }
        let uv = |c: &Corner| {
            let uv = c.uv().map(|i| self.read.uvs[i]);
            uv.map_or(Vec2::ZERO, |uv| Vec2::new(uv.x, 1.0 - uv.y))
        };
        // A corner without a normal uses the triangle's.
        let normal = |c: &Corner| c.normal().map_or(Vec3::ZERO, |i| self.read.normals[i]);
        let has_normals = corners.iter().any(|c| c.normal().is_some());
        let builder = &mut self.builder;
        let crosses = triangulate(&places, |triangle| {
            let of = triangle.map(|k| &corners[k]);
            let normals = has_normals.then(|| of.map(normal));
            let colors = (!colors.is_empty()).then(|| triangle.map(|k| colors[k]));
            let vertices = triangle.map(|k| places[k]);
            builder.push_colored(vertices, of.map(uv), normals, colors, material);
        });
        if crosses {
            let (count, line) = self.crossing;
            self.crossing = (count + 1, if count == 0 { face.line } else { line });
        }
    }

    /// Warns about everything drawn differently from the file.
    fn tell(&mut self) {
        let warnings = &mut self.builder.report.warnings;
        let (count, line) = self.crossing;
        if count > 0 {
            warnings.push(format!(
                "{count} polygons cross themselves, the first in line {line}: drawn as fans around their first corner"
            ));
        }
        if self.odd_colors > 0 {
            warnings.push(format!(
                "{} faces have colours of vertices beyond 0 to 1, which are taken as 0 or 1",
                self.odd_colors
            ));
        }
        if let (triangles, Some(object)) = &self.drawn_grey
            && self.known > 0
        {
            warnings.push(format!(
                "{triangles} triangles (first object: `{object}`) use no material that a .mtl \
                 file defines; drawn grey"
            ));
        }
    }
}
