//! Parser for the statements of OBJ files.

use super::mtl::Library;
use super::tally::{Tally, Unread};
use glam::{Vec2, Vec3};
use std::collections::{BTreeMap, HashMap};
use std::ops::Range;
use std::str::{FromStr, SplitWhitespace};

/// Marks a missing index of a corner.
const NONE: u32 = u32::MAX;

/// Limit on the broken vertices that wait for a face: a file with more is no model.
const MOST_BROKEN: usize = 4096;

/// Keywords of the statements that are read.
const KEYWORDS: [&str; 10] = [
    "v", "vt", "vn", "f", "fo", "o", "g", "usemtl", "mtllib", "s",
];

/// Marks an index of a texture coordinate or normal that cannot exist.
const LOST: u32 = NONE - 1;

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
    /// The material before any `usemtl`, then of each `usemtl`, or its name if it is not defined.
    pub materials: Vec<Result<u32, String>>,
    /// Names of objects and groups.
    pub objects: Vec<String>,
    pub warnings: Vec<String>,
    /// Corners whose texture coordinates do not exist, and corners whose normal does not.
    pub lost: [Tally; 2],
    /// Lines and problems of vertices that are not three numbers, by index; those that no face used yet.
    pub broken: BTreeMap<u32, (usize, String)>,
}

#[derive(Default)]
struct Reader {
    numbers: HashMap<String, u32>,
    /// Faces with fewer than three corners.
    short: Tally,
    /// Vertices, texture coordinates and normals that are not finite.
    infinite: [Tally; 3],
    /// Libraries that define a material of an earlier one.
    again: Tally,
    /// True while a smoothing group is on.
    is_smooth: bool,
    unread: Unread,
}

impl Statements {
    /// Parses a text and loads libraries as they are named.
    ///
    /// # Errors
    /// The line of the first malformed statement, and the problem.
    pub(crate) fn read(text: &str, library: &Library) -> Result<Self, (usize, String)> {
        let mut found = Self {
            positions: Vec::new(),
            colors: Vec::new(),
            uvs: Vec::new(),
            normals: Vec::new(),
            corners: Vec::new(),
            faces: Vec::new(),
            materials: vec![Err(String::new())],
            objects: vec!["unnamed_object".to_owned()],
            warnings: Vec::new(),
            lost: [Tally::default(); 2],
            broken: BTreeMap::new(),
        };
        let mut reader = Reader::default();
        for (line, content) in (1..).zip(text.lines()) {
            let statement = content.trim();
            // Names may contain `#`; their readers use `rest`.
            let mut words = without_comment(statement).split_whitespace();
            let Some(keyword) = words.next() else {
                if statement.starts_with("#MRGB") {
                    let what = "vertex colours of ZBrush (`#MRGB`)";
                    reader.unread.see(what, line);
                }
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
        line: usize,
        keyword: &str,
        rest: &str,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        match keyword {
            "v" => self.vertex(reader, line, words)?,
            "vt" => {
                let ([u, v], count) = numbers(words);
                let u = if count == 0 { f32::NAN } else { u };
                let uv = Vec2::new(u, v);
                reader.infinite[1].see_if(!uv.is_finite(), line);
                self.uvs.push(uv);
            }
            "vn" => {
                let (normal, count) = numbers(words);
                let normal = Vec3::from(normal);
                let normal = if count < 3 { Vec3::NAN } else { normal };
                reader.infinite[2].see_if(!normal.is_finite(), line);
                self.normals.push(normal);
            }
            // `fo` is an older name.
            "f" | "fo" => self.face(reader, line, words)?,
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
                self.materials.push(known.ok_or_else(|| rest.to_owned()));
            }
            "mtllib" => reader.define(library.load(rest), line),
            "s" => {
                let group = words.clone().next().unwrap_or("off");
                reader.is_smooth = !matches!(group, "off" | "0");
            }
            // Keywords are in small letters, but for those of a few programs.
            _ => match keyword.to_ascii_lowercase() {
                small if KEYWORDS.contains(&&*small) => {
                    self.statement(reader, library, line, &small, rest, words)?;
                }
                _ => reader.unread.see(keyword, line),
            },
        }
        Ok(())
    }

    /// Reads three coordinates, with optional weight (a divisor) or colour and alpha. One that is broken is an error
    /// once a face uses it.
    fn vertex(
        &mut self,
        reader: &mut Reader,
        line: usize,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        let all = words.clone().count();
        let ([x, y, z, w, g, b, alpha, _], count) = numbers(words.clone());
        if count < 3 {
            let odd = words.clone().nth(count);
            let problem = odd.map_or_else(|| format!("`v` with {count} numbers"), no_number);
            if self.broken.len() == MOST_BROKEN {
                return Err(problem);
            }
            let index = self.positions.len() as u32;
            self.broken.insert(index, (line, problem));
            self.positions.push(Vec3::NAN);
            return Ok(());
        }
        let mut position = Vec3::new(x, y, z);
        match count {
            // Weights are for rational surfaces, whose control points may have none.
            4 if w == 0.0 => reader.unread.see("a weight of 0 of a vertex", line),
            4 => position /= w,
            6 | 7 => {
                self.colors.resize(self.positions.len(), None);
                self.colors.push(Some(Vec3::new(w, g, b)));
            }
            _ => {}
        }
        if all > count || ![3, 4, 6, 7].contains(&count) {
            reader.unread.see("further words of `v`", line);
        }
        if count == 7 && alpha != 1.0 {
            reader.unread.see("the alpha of a vertex", line);
        }
        reader.infinite[0].see_if(!position.is_finite(), line);
        self.positions.push(position);
        Ok(())
    }

    fn face(
        &mut self,
        reader: &mut Reader,
        line: usize,
        words: SplitWhitespace<'_>,
    ) -> Result<(), String> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        let first = self.corners.len();
        for word in words {
            let (corner, is_all) = corner(word, counts)?;
            self.corners.push(corner);
            reader
                .unread
                .see_if(!is_all, "further numbers of a corner", line);
        }
        let corners = self.corners.len() - first;
        if corners < 3 {
            self.corners.truncate(first);
            reader.short.see(line);
            return Ok(());
        }
        if reader.is_smooth && self.corners[first..].iter().any(|c| c.normal().is_none()) {
            let what = "smoothing groups (`s`) of faces without normals";
            reader.unread.see(what, line);
        }
        self.faces.push(Face {
            corners: corners as u32,
            line: line as u32,
            material: self.materials.len() as u32 - 1,
            object: self.objects.len() as u32 - 1,
        });
        Ok(())
    }

    /// Checks that the vertices of these corners exist; a texture coordinate or normal that does
    /// not is as one that is not given.
    ///
    /// # Errors
    /// The missing vertex, or one that is broken, with the line.
    pub(crate) fn check(
        &mut self,
        corners: Range<usize>,
        line: usize,
    ) -> Result<(), (usize, String)> {
        let counts = [self.positions.len(), self.uvs.len(), self.normals.len()];
        for Corner(indices) in &mut self.corners[corners] {
            for (k, index) in indices.iter_mut().enumerate() {
                let (number, count) = (u64::from(*index) + 1, counts[k]);
                if k == 0
                    && let Some(broken) = self.broken.remove(index)
                {
                    return Err(broken);
                }
                if *index == NONE || number <= count as u64 {
                    continue;
                }
                if k == 0 {
                    return Err((line, beyond(number as i64, count, "")));
                }
                *index = NONE;
                self.lost[k - 1].see(line);
            }
        }
        Ok(())
    }

    /// The broken vertices that no checked face uses.
    pub(crate) fn unused(&self) -> Tally {
        let mut unused = Tally::default();
        let lines = self.broken.values().map(|(line, _)| *line);
        lines.for_each(|line| unused.see(line));
        unused
    }

    fn finish(&mut self, reader: Reader, text: &str) {
        for material in &mut self.materials {
            let known = material
                .as_ref()
                .err()
                .and_then(|name| reader.material(name));
            if let Some(id) = known {
                *material = Ok(id);
            }
        }
        let [positions, uvs, normals] = reader.infinite;
        let notes = [
            reader.short.note(
                [
                    "face has fewer than three corners",
                    "faces have fewer than three corners",
                ],
                "line",
                "left out",
            ),
            positions.note(
                ["vertex is not finite", "vertices are not finite"],
                "line",
                "triangles with such a corner are dropped",
            ),
            uvs.note(
                [
                    "texture coordinate is not finite",
                    "texture coordinates are not finite",
                ],
                "line",
                "taken as 0",
            ),
            normals.note(
                ["normal is not finite", "normals are not finite"],
                "line",
                "the triangle's is used",
            ),
            reader.again.note(
                [
                    "library defines a material of an earlier one again",
                    "libraries define a material of an earlier one again",
                ],
                "line",
                "the last definition counts from there on",
            ),
            reader.unread.note(),
            cut_off(text),
        ];
        self.warnings.extend(notes.into_iter().flatten());
    }
}

impl Reader {
    fn define(&mut self, materials: HashMap<String, u32>, line: usize) {
        let is_again = materials.keys().any(|name| self.numbers.contains_key(name));
        self.again.see_if(is_again, line);
        self.numbers.extend(materials);
    }

    /// The material of this name; a comment may follow, and quotation marks may be around it, in the library as well.
    fn material(&self, name: &str) -> Option<u32> {
        let known = |name: &str| self.numbers.get(name).copied();
        let bare = without_comment(name).trim();
        let quoted = || known(bare.trim_matches('"')).or_else(|| known(&format!("\"{bare}\"")));
        known(name).or_else(|| known(bare)).or_else(quoted)
    }
}

/// The part of a line before `#`, which does not begin a comment in the number `1.#IND`.
pub(super) fn without_comment(line: &str) -> &str {
    let mut signs = line.match_indices('#').map(|(at, _)| line.split_at(at));
    let is_number = |(before, after): &(&str, &str)| {
        before.ends_with('.') && after[1..].starts_with(|c: char| c.is_ascii_uppercase())
    };
    let comment = signs.find(|parts| !is_number(parts));
    comment.map_or(line, |(before, _)| before)
}

/// Parses the numbers before the first other word, at most `N`, and counts them; missing ones are 0.
fn numbers<const N: usize>(words: SplitWhitespace<'_>) -> ([f32; N], usize) {
    let mut found = [0.0; N];
    let mut count = 0;
    for (place, number) in found.iter_mut().zip(words.map_while(number)) {
        *place = number;
        count += 1;
    }
    (found, count)
}

/// Parses numbers of C, C++ and Fortran: NaN as `-1.#IND` or `nan(ind)`, exponents as `1.0D+00`,
/// floats as `1.0f`.
pub(super) fn number<T: FromStr + From<f32>>(word: &str) -> Option<T> {
    word.parse().ok().or_else(|| {
        let word = word.to_ascii_lowercase();
        let begins_as_none = ["nan", "+nan", "-nan"].iter().any(|w| word.starts_with(w));
        if begins_as_none || word.contains(".#") {
            Some(f32::NAN.into())
        } else {
            // `1.0f`, as source text of C has it.
            let word = word.strip_suffix('f').unwrap_or(&word);
            word.replace('d', "e").parse().ok()
        }
    })
}

/// Says what is wrong with a word in place of a number.
pub(super) fn no_number(word: &str) -> String {
    let with_point = number::<f64>(&word.replace(',', "."));
    let hint = match with_point {
        Some(_) if word.contains(',') => "; decimals are written with a point",
        _ => "",
    };
    format!("`{word}` is not a number{hint}")
}

/// Parses a corner `v`, `v/vt`, `v//vn` or `v/vt/vn`, given the number of each so far; false if the word goes on.
fn corner(word: &str, counts: [usize; 3]) -> Result<(Corner, bool), String> {
    let none = || format!("`{word}` is not a face corner");
    let mut corner = [NONE; 3];
    let mut parts = word.split('/');
    for (k, place) in corner.iter_mut().enumerate() {
        let part = parts.next().unwrap_or_default();
        if part.is_empty() && k > 0 {
            continue;
        }
        let value = whole(part).ok_or_else(none)?;
        let index = match value {
            1.. => value - 1,
            _ => value.saturating_add(counts[k] as i64),
        };
        let found = u32::try_from(index)
            .ok()
            .filter(|i| *i < LOST && value != 0);
        *place = match found {
            None if k == 0 => return Err(beyond(value, counts[k], " before it")),
            found => found.unwrap_or(LOST),
        };
    }
    Ok((Corner(corner), parts.all(str::is_empty)))
}

/// Parses an index; some write it as a number with a point (`1.0`), or set corners apart by commas (`1,`).
fn whole(part: &str) -> Option<i64> {
    part.parse().ok().or_else(|| {
        let part = part.strip_suffix(',').unwrap_or(part);
        let zeros = |after: &str| after.bytes().all(|digit| digit == b'0');
        let (whole, after) = part.split_once('.').unwrap_or((part, ""));
        zeros(after).then(|| whole.parse().ok())?
    })
}

fn beyond(vertex: i64, count: usize, place: &str) -> String {
    if vertex == 0 {
        return "the face refers to vertex 0, but the first is 1".to_owned();
    }
    format!("the face refers to vertex {vertex}, but there are {count}{place}")
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
