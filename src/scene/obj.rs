//! Wavefront OBJ; materials are in [`super::mtl`], statements in [`super::obj_statements`].

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::colors::{is_color, shown};
use super::error::{self, guarded};
use super::obj_statements::{Corner, Face, Statements};
use super::polygon::triangulate;
use super::tally::Tally;
use super::text::normalised;
use super::texture::{decode_all, forget_unused};
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
        let broken = |(line, problem): (usize, String)| {
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
        model.builder.note_far();
        model.tell();
        materials.append(&mut model.without);
        let mut builder = model.builder;
        forget_unused(&mut materials, builder.material_ids());
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
    /// Faces without a material, and the object and the undefined material of the first.
    drawn_grey: (Tally, Option<[String; 2]>),
    /// Self-intersecting polygons.
    crossing: Tally,
    /// Faces with a colour that is not within 0 to 1.
    odd_colors: Tally,
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
            drawn_grey: (Tally::default(), None),
            crossing: Tally::default(),
            odd_colors: Tally::default(),
        }
    }

    fn push_faces(&mut self) -> Result<(), (usize, String)> {
        let faces = std::mem::take(&mut self.read.faces);
        let mut first = 0;
        for face in &faces {
            let end = first + face.corners as usize;
            let line = face.line as usize;
            self.read.check(first..end, line)?;
            self.push_face(face, first..end);
            first = end;
        }
        Ok(())
    }

    fn push_face(&mut self, face: &Face, corners: std::ops::Range<usize>) {
        let line = face.line as usize;
        let corners = &self.read.corners[corners];
        let positions = &self.read.positions;
        let places: Vec<Vec3> = corners.iter().map(|c| positions[c.vertex()]).collect();
        let mut colors = Vec::new();
        if !self.read.colors.is_empty() {
            let colors_of = |c: &Corner| self.read.colors.get(c.vertex()).copied().flatten();
            let given: Vec<Option<Vec3>> = corners.iter().map(colors_of).collect();
            let is_odd = given.iter().flatten().any(|color| !is_color(*color));
            self.odd_colors.see_if(is_odd, line);
            if given.iter().any(Option::is_some) {
                let light = |color: &Option<Vec3>| shown(color.unwrap_or(Vec3::ONE));
                colors = given.iter().map(light).collect();
            }
        }
        let material = match &self.read.materials[face.material as usize] {
            Ok(id) => *id,
            Err(name) => {
                let next = self.known + self.without.len() as u32;
                let (id, albedo) = if colors.is_empty() {
                    let (tally, first) = &mut self.drawn_grey;
                    tally.see(line);
                    let object = &self.read.objects[face.object as usize];
                    first.get_or_insert_with(|| [object.clone(), name.clone()]);
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
        self.crossing.see_if(crosses, line);
    }

    /// Warns about everything drawn differently from the file.
    fn tell(&mut self) {
        let [uvs, normals] = self.read.lost;
        let notes = [
            self.read.unused().note(
                [
                    "vertex is not three numbers",
                    "vertices are not three numbers",
                ],
                "line",
                "used by no face",
            ),
            uvs.note(
                [
                    "corner names a texture coordinate that does not exist",
                    "corners name a texture coordinate that does not exist",
                ],
                "line",
                "as if none were named",
            ),
            normals.note(
                [
                    "corner names a normal that does not exist",
                    "corners name a normal that does not exist",
                ],
                "line",
                "as if none were named",
            ),
            self.crossing.note(
                ["polygon crosses itself", "polygons cross themselves"],
                "line",
                "drawn as a fan around the first corner",
            ),
            self.odd_colors.note(
                [
                    "face has vertex colours beyond 0 to 1",
                    "faces have vertex colours beyond 0 to 1",
                ],
                "line",
                "each component is taken as 0 or 1",
            ),
        ];
        let warnings = &mut self.builder.report.warnings;
        warnings.extend(notes.into_iter().flatten());
        if let (faces, Some([object, material])) = &self.drawn_grey
            && (self.known > 0 || !material.is_empty())
        {
            let first = match material.as_str() {
                "" => format!("drawn grey; the first belongs to object `{object}`"),
                name => format!("drawn grey; the first is of material `{name}`, object `{object}`"),
            };
            warnings.extend(faces.note(
                [
                    "face has no material that a .mtl file defines",
                    "faces have no material that a .mtl file defines",
                ],
                "line",
                &first,
            ));
        }
    }
}
