//! Stanford PLY by `ply-rs-bw`, ASCII and binary, read element by element: faces go straight into
//! the scene's arrays.

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::error::{guarded, open};
use super::{Material, SceneData, SceneError};
use glam::Vec3;
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef,
    PropertyType, ScalarType,
};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Loads a PLY model. Polygons become fans; there are no materials, every surface is grey.
///
/// # Errors
/// [`SceneError`] naming the element that could not be read.
pub(super) fn load(path: &Path, name: &str) -> Result<SceneData, SceneError> {
    let file = open(path)?;
    let bytes = file.metadata().map_or(0, |meta| meta.len());
    guarded(path, || {
        let source = BufReader::with_capacity(1 << 16, file);
        let builder = read(path, bytes, source)?;
        let look = Look {
            materials: vec![Material::diffuse("default", Vec3::splat(DEFAULT_ALBEDO))],
            ..Look::default()
        };
        builder.finish(name, look)
    })
}

fn read(path: &Path, bytes: u64, source: impl BufRead) -> Result<SceneBuilder, SceneError> {
    let mut reader = Reader::new(source);
    let header = Parser::<Skipped>::new()
        .read_header(&mut reader)
        .map_err(|error| header_error(path, &error))?;
    let mut body = Body {
        path,
        encoding: header.encoding,
        source: reader.into_inner(),
        line: String::new(),
    };
    let mut vertices: Vec<Vec3> = Vec::new();
    let mut builder = SceneBuilder::default();
    let mut polygons_without_area = 0_usize;
    for definition in header.elements.values() {
        check_element(path, definition, header.encoding, bytes)?;
    }
    for (name, definition) in &header.elements {
        match name.as_str() {
            "vertex" => {
                vertices.reserve_exact(definition.count);
                body.each(definition, |_, Vertex(position)| {
                    vertices.push(position);
                    Ok(())
                })?;
            }
            "face" => {
                builder = SceneBuilder::new(false, definition.count);
                body.each(definition, |index, face: Face| {
                    let corners = face.corners(&vertices).map_err(|problem| {
                        SceneError::malformed(path, format!("face {index}"), problem)
                    })?;
                    polygons_without_area += usize::from(corners.len() < 3);
                    builder.reserve(corners.len().saturating_sub(2));
                    for k in 2..corners.len() {
                        builder.push([corners[0], corners[k - 1], corners[k]], 0);
                    }
                    Ok(())
                })?;
            }
            _ => body.each(definition, |_, Skipped| Ok(()))?,
        }
    }
    if polygons_without_area > 0 {
        builder.report.warnings.push(format!(
            "{polygons_without_area} faces with fewer than three corners left out"
        ));
    }
    Ok(builder)
}

fn header_error(path: &Path, error: &ParseError) -> SceneError {
    let place = error.line().map_or("header".to_owned(), |line| {
        format!("header, line {}", line.max(1))
    });
    SceneError::malformed(path, place, error.to_string().trim().to_owned())
}

/// Bytes that an element takes at least: a digit and a gap per property in text, and an empty list
/// for every list.
fn least_bytes(definition: &ElementDef, encoding: Encoding) -> u64 {
    let least = |property: &PropertyDef| match (encoding, &property.data_type) {
        (Encoding::Ascii, _) => 2,
        (_, PropertyType::Scalar(kind) | PropertyType::List(kind, _)) => match kind {
            ScalarType::Char | ScalarType::UChar => 1,
            ScalarType::Short | ScalarType::UShort => 2,
            ScalarType::Int | ScalarType::UInt | ScalarType::Float => 4,
            ScalarType::Double => 8,
        },
    };
    definition.properties.values().map(least).sum()
}

/// Refuses elements that cannot be in a file of `bytes` bytes, before memory is reserved for them,
/// and elements that lack what is needed.
fn check_element(
    path: &Path,
    definition: &ElementDef,
    encoding: Encoding,
    bytes: u64,
) -> Result<(), SceneError> {
    let ElementDef {
        name,
        count,
        properties,
    } = definition;
    // The last line of a text may lack its end.
    let least = least_bytes(definition, encoding).saturating_mul(*count as u64);
    let problem = if least > bytes + 1 || (properties.is_empty() && *count > 0) {
        format!("{count} elements are announced, more than the file can hold")
    } else if name == "vertex" && !["x", "y", "z"].iter().all(|k| properties.contains_key(*k)) {
        "the properties x, y and z are needed".to_owned()
    } else if name == "face" && !FACE_LISTS.iter().any(|k| properties.contains_key(*k)) {
        "the property vertex_indices is needed".to_owned()
    } else {
        return Ok(());
    };
    Err(SceneError::malformed(
        path,
        format!("element `{name}`"),
        problem,
    ))
}

/// The part after the header.
struct Body<'a, S> {
    path: &'a Path,
    encoding: Encoding,
    source: S,
    line: String,
}

impl<S: BufRead> Body<'_, S> {
    /// Reads all elements of one kind, handing each on with its index.
    fn each<E: PropertyAccess>(
        &mut self,
        definition: &ElementDef,
        mut consume: impl FnMut(usize, E) -> Result<(), SceneError>,
    ) -> Result<(), SceneError> {
        let parser = Parser::<E>::new();
        for index in 0..definition.count {
            let element = self.element(&parser, definition).map_err(|problem| {
                let place = format!("{} {index} of {}", definition.name, definition.count);
                SceneError::malformed(self.path, place, problem)
            })?;
            consume(index, element)?;
        }
        Ok(())
    }

    fn element<E: PropertyAccess>(
        &mut self,
        parser: &Parser<E>,
        definition: &ElementDef,
    ) -> Result<E, String> {
        let source = &mut self.source;
        let element = match self.encoding {
            Encoding::Ascii => {
                self.line.clear();
                match source.read_line(&mut self.line) {
                    Ok(0) => return Err("the file ends here".to_owned()),
                    Ok(_) => parser.read_ascii_element(&self.line, definition),
                    Err(error) => return Err(error.to_string()),
                }
            }
            Encoding::BinaryLittleEndian => parser.read_little_endian_element(source, definition),
            Encoding::BinaryBigEndian => parser.read_big_endian_element(source, definition),
        };
        element.map_err(|error| match error.kind() {
            std::io::ErrorKind::UnexpectedEof => "the file ends here".to_owned(),
            _ => error.to_string(),
        })
    }
}

struct Vertex(Vec3);

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self(Vec3::NAN)
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let component = match name {
            "x" => &mut self.0.x,
            "y" => &mut self.0.y,
            "z" => &mut self.0.z,
            _ => return PropertyAccessResult::Ignored,
        };
        match value.to_f32_lossy() {
            Some(value) => *component = value,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// Both names of the list of corners are in use.
const FACE_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The corner list, in the type of the file.
struct Face(Option<Property>);

impl PropertyAccess for Face {
    fn new() -> Self {
        Self(None)
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        if !FACE_LISTS.contains(&name) {
            return PropertyAccessResult::Ignored;
        }
        self.0 = Some(value);
        PropertyAccessResult::Set
    }
}

impl Face {
    fn corners(&self, vertices: &[Vec3]) -> Result<Vec<Vec3>, String> {
        let position = |index: i64| {
            let vertex = usize::try_from(index).ok().and_then(|i| vertices.get(i));
            vertex.copied().ok_or_else(|| {
                format!(
                    "the face refers to vertex {index}, but {} are defined before it",
                    vertices.len()
                )
            })
        };
        match &self.0 {
            Some(Property::ListInt(list)) => list.iter().map(|i| position((*i).into())).collect(),
            Some(list) => {
                let list = list.to_u32_list();
                let list = list.ok_or("the corners are not a list of vertex indices")?;
                list.into_iter().map(|i| position(i.into())).collect()
            }
            None => Err("no list of vertex indices".to_owned()),
        }
    }
}

/// An element nobody needs.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
