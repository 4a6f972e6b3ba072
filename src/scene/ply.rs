//! Stanford PLY, ASCII and binary: faces go straight into the scene's arrays.

use super::builder::{DEFAULT_ALBEDO, Look, SceneBuilder};
use super::colors::{is_color, shown};
use super::error::open;
use super::ply_body::Body;
use super::ply_header::{Element, Encoding, Header, Kind, Property};
use super::polygon::triangulate;
use super::tally::{Tally, unread_warning};
use super::{Material, SceneData, SceneError};
use glam::{Vec2, Vec3};
use std::io::{BufRead, BufReader};
use std::path::Path;

/// Loads a PLY model: polygons and triangle strips become triangles. There are no materials:
/// surfaces are grey or have the colours of vertices, or else of faces, which are sRGB whatever their type, as in
/// MeshLab, Blender and three.js. Vertex normals are shading normals.
///
/// # Errors
/// [`SceneError`] naming the unreadable element.
pub(super) fn load(path: &Path, name: &str) -> Result<SceneData, SceneError> {
    let (file, bytes) = open(path)?;
    let mut source = BufReader::with_capacity(1 << 16, file);
    let broken = |(place, problem): Problem| SceneError::malformed(path, place, problem);
    let header = Header::read(&mut source)
        .map_err(|(line, problem)| broken((format!("header, line {line}"), problem)))?;
    let mut body = Body::new(source, header.encoding, header.lines);
    let mut model = Model::default();
    model.read(&header, &mut body, bytes).map_err(broken)?;
    model.builder.note_far();
    model.tell(&header);
    let is_colored = model.has_colors;
    let builder = std::mem::take(&mut model.builder);
    // Their memory serves what follows.
    drop(model);
    let albedo = if is_colored { 1.0 } else { DEFAULT_ALBEDO };
    let look = Look {
        materials: vec![Material::diffuse("default", Vec3::splat(albedo))],
        ..Look::default()
    };
    builder.finish(name, look)
}

/// A place in the file, and what is wrong there.
type Problem = (String, String);

#[derive(Default)]
struct Model {
    builder: SceneBuilder,
    positions: Vec<Vec3>,
    /// Linear. Empty if vertices have none.
    colors: Vec<Vec3>,
    /// Empty if vertices have none.
    normals: Vec<Vec3>,
    /// Faces before the vertices: index, number of corners, corners.
    early: Vec<u32>,
    /// Their colours, linear, where they have some that are shown.
    early_colors: Vec<Option<Vec3>>,
    /// True if vertices or faces have colours.
    has_colors: bool,
    odd: Odd,
    /// What is not read, for a warning.
    unread: Vec<String>,
    /// Positions of the current face's corners.
    places: Vec<Vec3>,
}

/// Odd vertices and faces, for warnings.
#[derive(Default)]
struct Odd {
    positions: Tally,
    normals: Tally,
    colors: Tally,
    face_colors: Tally,
    /// Faces with fewer than three corners.
    flat: Tally,
    /// Self-intersecting polygons.
    crossing: Tally,
}

impl Model {
    /// Reads all elements up to the last with vertices or faces: what is behind them cannot spoil
    /// the model.
    fn read<S: BufRead>(
        &mut self,
        header: &Header,
        body: &mut Body<S>,
        bytes: u64,
    ) -> Result<(), Problem> {
        let elements = &header.elements;
        let first = |name: &str| elements.iter().position(|e| e.name == name && e.count > 0);
        let vertices = first("vertex");
        let plain = vertices.is_none_or(|k| Colors::of(&elements[k]).is_none());
        let read = [vertices, first("face"), first(STRIPS)];
        let last = read.into_iter().flatten().max();
        if last.is_some() && elements.iter().all(|e| e.name != "vertex") {
            let problem = "there is no element `vertex`".to_owned();
            return Err(("header".to_owned(), problem));
        }
        for (k, element) in elements.iter().enumerate() {
            let is_read = read.contains(&Some(k));
            if Some(k) <= last && element.count > 0 {
                check_types(element, header.encoding)?;
            }
            if is_read {
                check_size(element, header.encoding, bytes)?;
            }
            if Some(k) == vertices {
                self.read_vertices(element, body)?;
            } else if is_read {
                let colors = Colors::of(element).filter(|_| plain && element.name == "face");
                self.read_faces(element, body, vertices > Some(k), colors)?;
            } else if element.count > 0 {
                let Element { name, line, .. } = element;
                self.unread
                    .push(format!("the element `{name}` (line {line})"));
                if Some(k) < last {
                    each(element, body, |_, body| {
                        element.properties.iter().try_for_each(|p| body.skip(p))
                    })?;
                }
            }
        }
        self.push_early_faces()?;
        if last.is_some_and(|last| last + 1 == elements.len()) && body.goes_on() {
            let line = body
                .line()
                .map_or(String::new(), |n| format!(" (line {n})"));
            let what = format!("the rest behind the last element{line}");
            self.unread.push(what);
        }
        Ok(())
    }

    fn read_vertices<S: BufRead>(
        &mut self,
        element: &Element,
        body: &mut Body<S>,
    ) -> Result<(), Problem> {
        let place = || format!("element `{}`", element.name);
        let needed = || (place(), "the properties x, y and z are needed".to_owned());
        let position = find(element, ["x", "y", "z"], |_| true).ok_or_else(needed)?;
        let normal = find(element, ["nx", "ny", "nz"], |_| true);
        let colors = Colors::of(element);
        let color = colors.as_ref().map(|colors| colors.properties);
        self.has_colors |= color.is_some();
        let mut slots = vec![None; element.properties.len()];
        let sets = [Some(position), normal, color];
        for (k, property) in sets.iter().flatten().flatten().enumerate() {
            slots[*property] = Some(k);
        }
        self.name_unread(element, |k| slots[k].is_some());
        let count = element.count as usize;
        self.positions.reserve_exact(count);
        self.normals.reserve_exact(normal.map_or(0, |_| count));
        self.colors.reserve_exact(color.map_or(0, |_| count));
        let mut values = [0.0; 9];
        each(element, body, |index, body| {
            for (property, slot) in element.properties.iter().zip(&slots) {
                match slot {
                    Some(k) => values[*k] = body.value(property.kind)? as f32,
                    None => body.skip(property)?,
                }
            }
            let mut sets = values.as_chunks::<3>().0.iter().map(|v| Vec3::from(*v));
            let mut next = || sets.next().unwrap_or_default();
            self.push_vertex(
                index,
                next(),
                normal.map(|_| next()),
                colors.as_ref().map(|colors| next() / colors.white),
            );
            Ok(())
        })
    }

    fn push_vertex(
        &mut self,
        index: usize,
        position: Vec3,
        normal: Option<Vec3>,
        color: Option<Vec3>,
    ) {
        self.odd.positions.see_if(!position.is_finite(), index);
        self.positions.push(position);
        if let Some(normal) = normal {
            self.odd.normals.see_if(!normal.is_finite(), index);
            self.normals.push(normal);
        }
        if let Some(color) = color {
            self.odd.colors.see_if(!is_color(color), index);
            self.colors.push(shown(color));
        }
    }

    fn read_faces<S: BufRead>(
        &mut self,
        element: &Element,
        body: &mut Body<S>,
        is_early: bool,
        colors: Option<Colors>,
    ) -> Result<(), Problem> {
        let list = corner_list(element).ok_or_else(|| {
            let place = format!("element `{}`", element.name);
            (place, "the property vertex_indices is needed".to_owned())
        })?;
        let part =
            |k: usize| (colors.as_ref()).and_then(|c| c.properties.iter().position(|p| *p == k));
        self.name_unread(element, |k| k == list || part(k).is_some());
        self.has_colors |= colors.is_some();
        self.builder.reserve(element.count as usize);
        let mut corners = Vec::new();
        let mut values = Vec3::ZERO;
        each(element, body, |index, body| {
            corners.clear();
            for (k, property) in element.properties.iter().enumerate() {
                match property.length {
                    Some(length) if k == list => body.list(length, property.kind, |x| {
                        corners.push(corner(x)?);
                        Ok(())
                    })?,
                    _ => match part(k) {
                        Some(part) => values[part] = body.value(property.kind)? as f32,
                        None => body.skip(property)?,
                    },
                }
            }
            let color = colors.as_ref().map(|colors| values / colors.white);
            self.odd
                .face_colors
                .see_if(color.is_some_and(|color| !is_color(color)), index);
            let color = color.map(shown);
            let mut face = |corners: &[u32]| {
                if is_early {
                    self.early.extend([index as u32, corners.len() as u32]);
                    self.early.extend(corners);
                    self.early_colors.push(color);
                    Ok(())
                } else {
                    self.push_face(index, corners, color)
                }
            };
            if element.name == STRIPS {
                strip(&corners).try_for_each(|triangle| face(&triangle))
            } else {
                face(&corners)
            }
        })
    }

    fn push_early_faces(&mut self) -> Result<(), Problem> {
        let early = std::mem::take(&mut self.early);
        let mut colors = std::mem::take(&mut self.early_colors).into_iter();
        let mut rest = &early[..];
        while let [index, count, after @ ..] = rest {
            let (corners, after) = after.split_at(*count as usize);
            let broken = |problem| (format!("face {index}"), problem);
            self.push_face(*index as usize, corners, colors.next().flatten())
                .map_err(broken)?;
            rest = after;
        }
        Ok(())
    }

    /// Adds a polygon. Vertices have colours, or `color` is that of all its corners.
    fn push_face(
        &mut self,
        index: usize,
        corners: &[u32],
        color: Option<Vec3>,
    ) -> Result<(), String> {
        let Self {
            builder,
            positions,
            normals,
            colors,
            places,
            ..
        } = self;
        places.clear();
        places.reserve_exact(corners.len());
        for corner in corners {
            let position = positions.get(*corner as usize).ok_or_else(|| {
                let (vertex, count) = (i64::from(*corner), positions.len());
                let vertex = if *corner == NONE { -1 } else { vertex };
                format!("it refers to vertex {vertex}, but there are {count}, the first of them 0")
            })?;
            places.push(*position);
        }
        if corners.len() < 3 {
            self.odd.flat.see(index);
            return Ok(());
        }
        builder.reserve(corners.len() - 2);
        let crosses = triangulate(places, |triangle| {
            let of = triangle.map(|k| corners[k] as usize);
            let normals = (!normals.is_empty()).then(|| of.map(|v| normals[v]));
            let colors = match color {
                Some(color) => Some([color; 3]),
                None => (!colors.is_empty()).then(|| of.map(|v| colors[v])),
            };
            let vertices = triangle.map(|k| places[k]);
            builder.push_colored(vertices, [Vec2::ZERO; 3], normals, colors, 0);
        });
        self.odd.crossing.see_if(crosses, index);
        Ok(())
    }

    /// Notes the properties that are not read.
    fn name_unread(&mut self, element: &Element, is_read: impl Fn(usize) -> bool) {
        let others = element.properties.iter().enumerate();
        let others = others.filter(|(k, _)| !is_read(*k));
        let named = others.map(|(_, p)| {
            let Property { name, line, .. } = p;
            format!("`{name}` of `{}` (line {line})", element.name)
        });
        self.unread.extend(named);
    }

    /// Warns about everything drawn differently from the file.
    fn tell(&mut self, header: &Header) {
        let odd = &self.odd;
        let notes = [
            odd.flat.note(
                [
                    "face has fewer than three corners",
                    "faces have fewer than three corners",
                ],
                "face",
                "left out",
            ),
            odd.positions.note(
                ["vertex is not finite", "vertices are not finite"],
                "vertex",
                "triangles with such a corner are dropped",
            ),
            odd.normals.note(
                ["normal is not finite", "normals are not finite"],
                "vertex",
                "the triangle's is used",
            ),
            odd.crossing.note(
                ["polygon crosses itself", "polygons cross themselves"],
                "face",
                "drawn as a fan around the first corner",
            ),
            odd.colors.note(
                [
                    "vertex has a colour beyond 0 to 1",
                    "vertices have a colour beyond 0 to 1",
                ],
                "vertex",
                "each component is taken as 0 or 1",
            ),
            odd.face_colors.note(
                [
                    "face has a colour beyond 0 to 1",
                    "faces have a colour beyond 0 to 1",
                ],
                "face",
                "each component is taken as 0 or 1",
            ),
            unread_warning(self.unread.drain(..)),
            header.unread.note(),
        ];
        self.builder
            .report
            .warnings
            .extend(notes.into_iter().flatten());
    }
}

/// Reads all elements of a kind; problems get their place.
fn each<S: BufRead>(
    element: &Element,
    body: &mut Body<S>,
    mut one: impl FnMut(usize, &mut Body<S>) -> Result<(), String>,
) -> Result<(), Problem> {
    let Element { name, count, .. } = element;
    let all = if element.properties.is_empty() {
        0
    } else {
        *count
    };
    for index in 0..all {
        one(index as usize, body).map_err(|problem| {
            let line = body.line().map_or(String::new(), |n| format!(", line {n}"));
            let place = match name.as_str() {
                "vertex" | "face" => format!("{name} {index} of {count}{line}"),
                _ => format!("element `{name}`, {index} of {count}{line}"),
            };
            (place, problem)
        })?;
    }
    Ok(())
}

/// Refuses elements with values of a type that is none of PLY's, behind which nothing can be found.
fn check_types(element: &Element, encoding: Encoding) -> Result<(), Problem> {
    let Some(Property { name, line, .. }) = element.unknown(encoding) else {
        return Ok(());
    };
    let problem = format!("the type of `{name}` is none of PLY");
    Err((format!("header, line {line}"), problem))
}

/// Refuses elements that cannot fit into a file of `bytes` bytes, before memory is reserved.
fn check_size(element: &Element, encoding: Encoding, bytes: u64) -> Result<(), Problem> {
    // The last line of a text may lack its end.
    if element.least_bytes(encoding) <= bytes + 1 {
        return Ok(());
    }
    let Element { name, count, .. } = element;
    Err((
        format!("element `{name}`"),
        format!("{count} elements are announced, more than the file can hold"),
    ))
}

/// The element of triangle strips, in files of the Stanford repository.
const STRIPS: &str = "tristrips";

const COLORS: [[&str; 3]; 3] = [
    ["red", "green", "blue"],
    ["r", "g", "b"],
    ["diffuse_red", "diffuse_green", "diffuse_blue"],
];

/// Where an element has its colour.
struct Colors {
    /// Indices of red, green and blue among its properties.
    properties: [usize; 3],
    /// What white has there.
    white: Vec3,
}

impl Colors {
    fn of(element: &Element) -> Option<Self> {
        let known = |names: &[&str; 3]| find(element, *names, |kind| white(kind).is_some());
        let properties = COLORS.iter().find_map(known)?;
        let white = properties.map(|k| white(element.properties[k].kind).unwrap_or(1.0));
        Some(Self {
            properties,
            white: white.into(),
        })
    }
}

/// The largest colour component of a type; `None` if its range is unknown.
fn white(kind: Kind) -> Option<f32> {
    match kind {
        Kind::UChar => Some(255.0),
        Kind::UShort => Some(65_535.0),
        Kind::Float | Kind::Double => Some(1.0),
        _ => None,
    }
}

/// Indices of the first properties of these names that are no lists; `None` unless all are there.
fn find(element: &Element, names: [&str; 3], is_fit: impl Fn(Kind) -> bool) -> Option<[usize; 3]> {
    let is = |p: &Property, name| {
        p.name.eq_ignore_ascii_case(name) && p.length.is_none() && is_fit(p.kind)
    };
    let at = |name| element.properties.iter().position(|p| is(p, name));
    match names.map(at) {
        [Some(a), Some(b), Some(c)] => Some([a, b, c]),
        _ => None,
    }
}

/// Index of the list of corners, which has two names, or is the only list of whole numbers.
fn corner_list(element: &Element) -> Option<usize> {
    let is_whole = |p: &Property| !matches!(p.kind, Kind::Float | Kind::Double);
    let lists = element.properties.iter().enumerate();
    let lists = lists.filter(|(_, p)| p.length.is_some());
    let named = ["vertex_indices", "vertex_index", "vertices"];
    let is_named = |p: &Property| named.iter().any(|name| p.name.eq_ignore_ascii_case(name));
    let mut of_name = lists.clone().filter(|(_, p)| is_named(p));
    let mut whole = lists.filter(|(_, p)| is_whole(p));
    let only = whole.next().filter(|_| whole.next().is_none());
    of_name.next().or(only).map(|(k, _)| k)
}

/// The −1 that ends a strip.
const NONE: u32 = u32::MAX;

/// The number of a vertex, or [`NONE`].
fn corner(value: f64) -> Result<u32, String> {
    match value {
        -1.0 => Ok(NONE),
        0.0..=4_294_967_295.0 if value.fract() == 0.0 => Ok(value as u32),
        _ => Err(format!("`{value}` is not the number of a vertex")),
    }
}

/// The triangles of strips, all turning the same way. Triangles with equal corners, which join
/// strips, are left out.
fn strip(corners: &[u32]) -> impl Iterator<Item = [u32; 3]> + '_ {
    let strips = corners.split(|corner| *corner == NONE);
    let triangles = strips.flat_map(|strip| strip.array_windows().enumerate());
    let turned = triangles.map(|(k, &[a, b, c]): (usize, &[u32; 3])| match k % 2 {
        0 => [a, b, c],
        _ => [b, a, c],
    });
    turned.filter(|[a, b, c]| a != b && b != c && a != c)
}
