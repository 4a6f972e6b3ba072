//! Parser for the statements of OBJ files.

use super::mtl::Library;
use glam::{Vec2, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::str::SplitWhitespace;

/// Marks a missing index of a corner.
const NONE: u32 = u32::MAX;

/// A corner of a face: zero-based indices of vertex, texture coordinates and normal.
#[derive(Clone, Copy)]
pub(super) struct Corner([u32; 3]);

impl Corner {
    pub(crate) fn vertex(self) -> usize {
        self.0[0] as usize
    }

    pub(crate) fn uv(self) -> Option<usize> {
        (self.0[1] != NONE).then_some(self.0[1] as usize)
    }

    pub(crate) fn normal(self) -> Option<usize> {
        (self.0[2] != NONE).then_some(self.0[2] as usize)
    }
}

/// A face of three or more corners, which follow those of the previous face.
pub(super) struct Face {
    pub corners: u32,
    /// Line in the file, from 1.
    pub line: u32,
    /// Index into [`Statements::materials`].
    pub material: u32,
    /// Index into [`Statements::objects`].
    pub object: u32,
}

/// The content of a file, with warnings.
pub(super) struct Statements {
    pub positions: Vec<Vec3>,
    /// Empty, or as long as `positions` up to the last vertex with a colour.
    pub colors: Vec<Option<Vec3>>,
    /// With v pointing up.
    pub uvs: Vec<Vec2>,
    pub normals: Vec<Vec3>,
    pub corners: Vec<Corner>,
    pub faces: Vec<Face>,
    /// The material before any `usemtl`, then of each `usemtl`; `None` if undefined.
    pub materials: Vec<Option<u32>>,
    /// Names of objects and groups.
    pub objects: Vec<String>,
    pub warnings: Vec<String>,
}

#[derive(Default)]
struct Reader {
    numbers: HashMap<String, u32>,
    /// Names of `usemtl` that no library has defined so far.
    pending: Vec<(usize, String)>,
    /// Number of faces with fewer than three corners, and the line of the first.
    short: (usize, u32),
    /// True while a smoothing group is on.
    is_smooth: bool,
    /// Unread statements, with the line of the first of each.
    unread: BTreeMap<String, u32>,
}

impl Statements {
    /// Parses a text and loads libraries as they are named.
    ///
    /// # Errors
    /// The line of the first malformed statement, and the problem.
    pub(crate) fn read(text: &str, library: &Library) -> Result<Self, (u32, String)> {
        let mut found = Self {
            positions: Vec::new(),
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            corners: Vec::new(),
            faces: Vec::new(),
            materials: vec![None],
            objects: vec!["unnamed_object".to_owned()],
            warnings: Vec::new(),
        };
        let mut reader = Reader::default();
        for (line, content) in (1..).zip(text.lines()) {
            let statement = content.trim();
            // Names may contain `#`; their readers use `rest`.
            let mut words = without_comment(statement).split_whitespace();
            let Some(keyword) = words.next() else {
                continue;
            };
            let rest = statement[keyword.len()..].trim();
            found
                .statement(&mut reader, library, line, keyword, rest, words)
                .map_err(|problem| (line, problem))?;
        }
        found.finish(reader, text);
        Ok(found)
    }

    fn statement(
        &mut self,
        reader: &mut Reader,
        library: &Library,
        line: u32,
        keyword: &str,
        rest: &str,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        match keyword {
            "v" => self.vertex(reader, line, words)?,
            "vt" => {
                let uv: [f32; 2] = numbers(keyword, words, 1)?;
                self.uvs.push(Vec2::from(uv));
            }
            "vn" => {
                let normal: [f32; 3] = numbers(keyword, words, 3)?;
                self.normals.push(Vec3::from(normal));
            }
            "f" => self.face(reader, line, words)?,
            "o" | "g" => {
                let name = if rest.is_empty() {
                    "unnamed_object"
                } else {
                    rest
                };
                self.objects.push(name.to_owned());
            }
            "usemtl" => {
                let known = reader.material(rest);
                if known.is_none() {
                    reader.pending.push((self.materials.len(), rest.to_owned()));
                }
                self.materials.push(known);
            }
            "mtllib" => reader.numbers.extend(library.load(rest)),
            "s" => {
                let group = words.clone().next().unwrap_or("off");
                reader.is_smooth = !matches!(group, "off" | "0");
            }
            // Points and lines have no surface.
            "l" | "p" => {}
            _ if reader.unread.len() < MOST_UNREAD => {
                reader.unread.entry(keyword.to_owned()).or_insert(line);
            }
            _ => {}
        }
        Ok(())
    }

    /// Reads three coordinates, with optional weight (a divisor) or colour and alpha.
    fn vertex(
        &mut self,
        reader: &mut Reader,
        line: u32,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        let count = words.clone().count();
        if ![3, 4, 6, 7].contains(&count) {
            return Err(format!("`v` with {count} numbers"));
        }
        let [x, y, z, w, g, b, alpha] = numbers("v", words, 3)?;
        let position = Vec3::new(x, y, z);
        if count == 4 {
            if w == 0.0 {
                return Err("a vertex of weight 0".to_owned());
            }
            self.positions.push(position / w);
            return Ok(());
        }
        if count > 4 {
            self.colors.resize(self.positions.len(), None);
            self.colors.push(Some(Vec3::new(w, g, b)));
        }
        if count == 7 && alpha != 1.0 {
            let what = "the alpha of a vertex".to_owned();
            reader.unread.entry(what).or_insert(line);
        }
        self.positions.push(position);
        Ok(())
    }

    fn face(
        &mut self,
        reader: &mut Reader,
        line: u32,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let first = self.corners.len();
        for word in words {
            self.corners.push(corner(word, counts)?);
        }
        let corners = self.corners.len() - first;
        if corners == 0 {
            return Err("`f` with no corners".to_owned());
        }
        if corners < 3 {
            self.corners.truncate(first);
            let (count, before) = reader.short;
            reader.short = (count + 1, if count == 0 { line } else { before });
            return Ok(());
        }
        if reader.is_smooth && self.corners[first..].iter().any(|c| c.normal().is_none()) {
            let what = "smoothing groups (`s`) of faces without normals".to_owned();
            reader.unread.entry(what).or_insert(line);
        }
        self.faces.push(Face {
            corners: corners as u32,
            line,
            material: self.materials.len() as u32 - 1,
            object: self.objects.len() as u32 - 1,
        });
        Ok(())
    }

    /// Checks that everything these corners refer to exists.
    ///
    /// # Errors
    /// The missing item.
    pub(crate) fn check(&self, corners: Range<usize>) -> Result<(), String> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for Corner(indices) in &self.corners[corners] {
            for ((index, count), what) in indices.iter().zip(counts).zip(WHAT) {
                if *index != NONE && *index as usize >= count {
                    let number = u64::from(*index) + 1;
                    return Err(format!(
                        "the face refers to {what} {number}, but there are {count}"
                    ));
                }
            }
        }
        Ok(())
    }

    fn finish(&mut self, reader: Reader, text: &str) {
        for (place, name) in &reader.pending {
            self.materials[*place] = reader.material(name);
        }
        let (count, line) = reader.short;
        self.warnings.extend(match count {
            0 => None,
            1 => Some(format!(
                "line {line}: a face with fewer than three corners, left out"
            )),
            _ => Some(format!(
                "{count} faces with fewer than three corners, left out; the first in line {line}"
            )),
        });
        let unread = reader.unread.iter();
        self.warnings
            .extend(unread_warning(unread.map(|(what, line)| {
                let what = if what.contains(' ') {
                    what.clone()
                } else {
                    format!("`{what}`")
                };
                format!("{what} (line {line})")
            })));
        self.warnings.extend(cut_off(text));
    }
}

impl Reader {
    /// The material of this name; a comment may follow.
    fn material(&self, name: &str) -> Option<u32> {
        let known = |name: &str| self.numbers.get(name).copied();
        known(name).or_else(|| known(without_comment(name).trim()))
    }
}

/// Limit on the kinds of unread statements recorded: a file in another format has any number.
const MOST_UNREAD: usize = 64;

const WHAT: [&str; 3] = ["vertex", "texture coordinate", "normal"];

/// One warning for everything in a file that is not read; `None` if there is nothing.
pub(super) fn unread_warning(what: impl Iterator<Item = String>) -> Option<String> {
    const SHOWN: usize = 12;
    let what: Vec<String> = what.collect();
    let shown = what[..what.len().min(SHOWN)].join(", ");
    let more = if what.len() > SHOWN { ", …" } else { "" };
    (!what.is_empty())
        .then(|| format!("not read, and drawn as if it were not there: {shown}{more}"))
}

pub(super) fn without_comment(line: &str) -> &str {
    line.split('#').next().unwrap_or_default()
}

/// Parses at least `least` numbers; missing ones are 0, and those beyond `N` ignored.
fn numbers<const N: usize>(
    keyword: &str,
    words: SplitWhitespace<'_>,
    least: usize,
) -> Result<[f32; N], String> {
    let mut found = [0.0; N];
    let mut count = 0;
    for (place, word) in found.iter_mut().zip(words) {
        *place = number(word).ok_or_else(|| format!("`{word}` is not a number"))?;
        count += 1;
    }
    if count >= least {
        Ok(found)
    } else {
        Err(format!("`{keyword}` with {count} numbers"))
    }
}

/// Parses numbers of C, C++ and Fortran: NaN as `-1.#IND` or `nan(ind)`, exponents as `1.0D+00`.
pub(super) fn number(word: &str) -> Option<f32> {
    word.parse().ok().or_else(|| {
        let word = word.to_ascii_lowercase();
        let begins_as_none = ["nan", "+nan", "-nan"].iter().any(|w| word.starts_with(w));
        if begins_as_none || word.contains(".#ind") || word.contains(".#qnan") {
            Some(f32::NAN)
        } else {
            word.replace('d', "e").parse().ok()
        }
    })
}

/// Parses a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, given the number of each so far.
fn corner(word: &str, counts: [usize; 3]) -> Result<Corner, String> {
    let none = || format!("`{word}` is not a face corner");
    let mut corner = [NONE; 3];
    let mut parts = word.split('/');
    for (k, place) in corner.iter_mut().enumerate() {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() && k > 0 {
            continue;
        }
        let value: i64 = part.parse().map_err(|_| none())?;
        let index = match value {
            1.. => value - 1,
            _ => value + counts[k] as i64,
        };
        let found = u32::try_from(index)
            .ok()
            .filter(|i| *i != NONE && value != 0);
        *place = found.ok_or_else(|| {
            let (what, count) = (WHAT[k], counts[k]);
            format!("the face refers to {what} {value}, but there are {count} before it")
        })?;
    }
    match parts.next() {
        None => Ok(Corner(corner)),
        Some(_) => Err(none()),
    }
}

/// Detects a file that ends within a statement by its missing final line break. A number without
/// its last digits is still a number, so there is no other sign.
fn cut_off(text: &str) -> Option<String> {
    let last = text.lines().next_back().filter(|_| !text.ends_with('\n'))?;
    let keyword = last.split_ascii_whitespace().next()?;
    ["v", "vt", "vn", "f"].contains(&keyword).then(|| {
        let number = text.lines().count();
        format!("line {number}, the last, has no line end: the file may be cut off there")
    })
}
