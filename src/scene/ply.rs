//! Stanford PLY with `ply-rs-bw`, ASCII and binary: faces go straight into the scene's arrays.

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::colors::linear;
use super::error::{guarded, open};
use super::obj_statements::unread_warning;
use super::polygon::triangulate;
use super::{Material, SceneData, SceneError};
use glam::{Vec2, Vec3};
use ply_rs_bw::parser::{ParseError, Parser, Reader};
use ply_rs_bw::ply::{
    ElementDef, Encoding, Property, PropertyAccess, PropertyAccessResult, PropertyDef,
    PropertyType, ScalarType,
};
use raystone_core::text::plain_text_or_latin1;
use std::io::{BufRead, BufReader, Cursor};
use std::path::Path;

/// Loads a PLY model. Polygons become triangles. There are no materials: surfaces are grey or have
/// vertex colours, which are sRGB whatever their type, as in MeshLab, Blender and three.js.
///
/// # Errors
/// [`SceneError`] naming the unreadable element.
pub(super) fn load(path: &Path, name: &str) -> Result<SceneData, SceneError> {
    let (file, bytes) = open(path)?;
    guarded(path, || {
        let source = BufReader::with_capacity(1 << 16, file);
        let (builder, is_colored) = read(path, bytes, source)?;
        let albedo = if is_colored { 1.0 } else { DEFAULT_ALBEDO };
        let look = Look {
            materials: vec![Material::diffuse("default", Vec3::splat(albedo))],
            ..Look::default()
        };
        builder.finish(name, look)
    })
}

/// Reads the triangles; the flag is true if vertices have colours.
fn read(
    path: &Path,
    bytes: u64,
    mut source: impl BufRead,
) -> Result<(SceneBuilder, bool), SceneError> {
    let text = header_text(&mut source).map_err(|p| SceneError::malformed(path, "header", p))?;
    let header = Parser::<Skipped>::new()
        .read_header(&mut Reader::new(Cursor::new(text)))
        .map_err(|error| header_error(path, &error))?;
    let mut body = Body {
        path,
        encoding: header.encoding,
        source,
        line: Vec::new(),
    };
    let mut vertices: Vec<Vertex> = Vec::new();
    let mut is_colored = false;
    let mut builder = SceneBuilder::default();
    let mut odd = Odd::default();
    for definition in header.elements.values() {
        check_element(path, definition, header.encoding, bytes)?;
    }
    for (name, definition) in &header.elements {
        match name.as_str() {
            "vertex" => {
                is_colored = has_colors(definition);
                vertices.reserve_exact(definition.count);
                body.each(definition, |_, vertex| {
                    vertices.push(vertex);
                    Ok(())
                })?;
            }
            "face" => {
                builder = SceneBuilder::new(false, definition.count);
                body.each(definition, |index, face: Face| {
                    let corners = face.corners(&vertices).map_err(|problem| {
                        SceneError::malformed(path, format!("face {index}"), problem)
                    })?;
                    odd.flat += usize::from(corners.len() < 3);
                    builder.reserve(corners.len().saturating_sub(2));
                    odd.see(index, push_face(&mut builder, &corners, is_colored));
                    Ok(())
                })?;
            }
            _ => body.each(definition, |_, Skipped| Ok(()))?,
        }
    }
    let is_odd = |v: &Vertex| !(v.color.min_element() >= 0.0 && v.color.max_element() <= 1.0);
    odd.colors = vertices.iter().filter(|v| is_colored && is_odd(v)).count();
    let warnings = &mut builder.report.warnings;
    odd.tell(warnings);
    let unread = header.elements.values().flat_map(|e| unread(e, is_colored));
    warnings.extend(unread_warning(unread));
    Ok((builder, is_colored))
}

/// Counts of odd faces and vertices, for warnings.
#[derive(Default)]
struct Odd {
    /// Faces with fewer than three corners.
    flat: usize,
    /// Self-intersecting polygons, and the first of them.
    crossing: (usize, usize),
    /// Vertices with a colour outside 0 to 1.
    colors: usize,
}

impl Odd {
    fn see(&mut self, face: usize, crosses: bool) {
        if crosses {
            let (count, first) = self.crossing;
            self.crossing = (count + 1, if count == 0 { face } else { first });
        }
    }

    fn tell(&self, warnings: &mut Vec<String>) {
        if self.flat > 0 {
            warnings.push(format!(
                "{} faces with fewer than three corners left out",
                self.flat
            ));
        }
        let (count, first) = self.crossing;
        if count > 0 {
            warnings.push(format!(
                "{count} polygons cross themselves, the first is face {first}: drawn as fans around their first corner"
            ));
        }
        if self.colors > 0 {
            warnings.push(format!(
                "{} vertices have a colour beyond 0 to 1, which is taken as 0 or 1",
                self.colors
            ));
        }
    }
}

/// Adds a polygon's triangles. Returns true if it intersects itself.
fn push_face(builder: &mut SceneBuilder, corners: &[&Vertex], is_colored: bool) -> bool {
    let places: Vec<Vec3> = corners.iter().map(|c| c.position).collect();
    let light = |k: usize| {
        let shown = corners[k].color.clamp(Vec3::ZERO, Vec3::ONE);
        Vec3::from(shown.to_array().map(linear))
    };
    triangulate(&places, |triangle| {
        let colors = is_colored.then(|| triangle.map(light));
        builder.push_colored(
            triangle.map(|k| places[k]),
            [Vec2::ZERO; 3],
            None,
            colors,
            0,
        );
    })
}

const COLORS: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["r", "g", "b"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
];

/// True if vertices have a colour that can be read.
fn has_colors(vertex: &ElementDef) -> bool {
    let is_read = |name: &&str| {
        let property = vertex.properties.get(*name);
        let kind = property.map(|p| &p.data_type);
        kind.is_some_and(|kind| {
            use ScalarType::{Double, Float, UChar, UShort};
            matches!(kind, PropertyType::Scalar(UChar | UShort | Float | Double))
        })
    };
    COLORS.iter().any(|names| names.iter().all(&is_read))
}

/// The properties of an element that are not read.
fn unread(element: &ElementDef, is_colored: bool) -> Vec<String> {
    let name = element.name.as_str();
    if element.count == 0 {
        return Vec::new();
    }
    let is_read = |property: &&String| match name {
        "vertex" => {
            let is_color = COLORS.as_flattened().contains(&property.as_str());
            ["x", "y", "z"].contains(&property.as_str()) || (is_colored && is_color)
        }
        _ => FACE_LISTS.contains(&property.as_str()),
    };
    match name {
        "vertex" | "face" => {
            let others = element.properties.keys().filter(|p| !is_read(p));
            others.map(|p| format!("`{p}` of `{name}`")).collect()
        }
        _ => vec![format!("the element `{name}`")],
    }
}

/// Reads the header with any kind of line ends; the rest stays in the source.
fn header_text(source: &mut impl BufRead) -> Result<Vec<u8>, String> {
    let mut text = Vec::new();
    let mut line = Vec::new();
    let mut pairs = true;
    loop {
        let end = read_line(source, &mut line, pairs).map_err(|e| e.to_string())?;
        if text.is_empty() {
            if line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff") {
                return Err("it is UTF-16 text; save it as UTF-8".to_owned());
            }
            // After a header with \r line ends, \n is the first byte of the data.
            pairs = end != LineEnd::Return;
        }
        let plain = plain_text_or_latin1(std::mem::take(&mut line));
        text.extend(plain.as_bytes());
        if end == LineEnd::None {
            return Ok(text);
        }
        text.push(b'\n');
        if plain.trim() == "end_header" {
            return Ok(text);
        }
    }
}

#[derive(Clone, Copy, PartialEq, Eq)]
enum LineEnd {
    None,
    /// `\r`.
    Return,
    /// `\n` or `\r\n`.
    Other,
}

/// Appends a line without its end: `\n`, `\r`, or with `pairs` also both.
fn read_line(
    source: &mut impl BufRead,
    line: &mut Vec<u8>,
    pairs: bool,
) -> std::io::Result<LineEnd> {
    loop {
        let bytes = source.fill_buf()?;
        if bytes.is_empty() {
            return Ok(LineEnd::None);
        }
        let Some(end) = bytes.iter().position(|b| matches!(b, b'\n' | b'\r')) else {
            let all = bytes.len();
            line.extend_from_slice(bytes);
            source.consume(all);
            continue;
        };
        line.extend_from_slice(&bytes[..end]);
        let is_return = bytes[end] == b'\r';
        source.consume(end + 1);
        let is_pair = is_return && pairs && source.fill_buf()?.first() == Some(&b'\n');
        if is_pair {
            source.consume(1);
        }
        return Ok(if is_return && !is_pair {
            LineEnd::Return
        } else {
            LineEnd::Other
        });
    }
}

fn header_error(path: &Path, error: &ParseError) -> SceneError {
    let place = error.line().map_or("header".to_owned(), |line| {
        format!("header, line {}", line.max(1))
    });
    SceneError::malformed(path, place, error.to_string().trim().to_owned())
}

/// Minimum bytes of an element: a digit and a separator per property in text, empty lists.
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

/// Refuses elements that cannot fit into a file of `bytes` bytes, before memory is reserved, and
/// elements that lack required properties.
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

struct Body<'a, S> {
    path: &'a Path,
    encoding: Encoding,
    source: S,
    line: Vec<u8>,
}

impl<S: BufRead> Body<'_, S> {
    /// Reads all elements of one kind and passes each on with its index.
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
                match read_line(source, &mut self.line, true) {
                    Ok(LineEnd::None) if self.line.is_empty() => {
                        return Err("the file ends here".to_owned());
                    }
                    Ok(_) => {
                        let line = String::from_utf8_lossy(&self.line);
                        parser.read_ascii_element(&line, definition)
                    }
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

#[derive(Clone, Copy)]
struct Vertex {
    position: Vec3,
    /// sRGB, 0 to 1.
    color: Vec3,
}

impl PropertyAccess for Vertex {
    fn new() -> Self {
        Self {
            position: Vec3::NAN,
            color: Vec3::ONE,
        }
    }

    fn set_property(&mut self, name: &str, value: Property) -> PropertyAccessResult {
        let component = match name {
            "x" => &mut self.position.x,
            "y" => &mut self.position.y,
            "z" => &mut self.position.z,
            _ => {
                let mut of_color = COLORS
                    .iter()
                    .filter_map(|n| n.iter().position(|n| *n == name));
                let Some((k, shade)) = of_color.next().zip(shade(&value)) else {
                    return PropertyAccessResult::Ignored;
                };
                self.color[k] = shade;
                return PropertyAccessResult::Set;
            }
        };
        match value.to_f32_lossy() {
            Some(value) => *component = value,
            None => return PropertyAccessResult::UnsupportedType,
        }
        PropertyAccessResult::Set
    }
}

/// A colour component, 0 to 1.
fn shade(value: &Property) -> Option<f32> {
    Some(match value {
        Property::UChar(x) => f32::from(*x) / f32::from(u8::MAX),
        Property::UShort(x) => f32::from(*x) / f32::from(u16::MAX),
        Property::Float(x) => *x,
        Property::Double(x) => *x as f32,
        _ => return None,
    })
}

/// Both names of the corner list are in use.
const FACE_LISTS: [&str; 2] = ["vertex_indices", "vertex_index"];

/// The corner list, in the file's type.
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
    fn corners<'a>(&self, vertices: &'a [Vertex]) -> Result<Vec<&'a Vertex>, String> {
        let position = |index: i64| {
            let vertex = usize::try_from(index).ok().and_then(|i| vertices.get(i));
            vertex.ok_or_else(|| {
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

/// An ignored element.
struct Skipped;

impl PropertyAccess for Skipped {
    fn new() -> Self {
        Self
    }
}
