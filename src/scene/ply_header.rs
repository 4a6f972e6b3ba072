//! Headers of PLY files.

use super::tally::Unread;
use raystone_core::text::plain_text_or_latin1;
use std::io::BufRead;

/// How the values after the header are written.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Encoding {
    Text,
    Little,
    Big,
}

/// Type of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Kind {
    Char,
    UChar,
    Short,
    UShort,
    Int,
    UInt,
    Long,
    ULong,
    Float,
    Double,
    /// Not a type of PLY: a word in text, unreadable in binary files.
    Unknown,
}

impl Kind {
    fn named(name: &str) -> Self {
        match name.to_ascii_lowercase().as_str() {
            "char" | "int8" => Self::Char,
            "uchar" | "uint8" => Self::UChar,
            "short" | "int16" => Self::Short,
            "ushort" | "uint16" => Self::UShort,
            "int" | "int32" => Self::Int,
            "uint" | "uint32" => Self::UInt,
            "long" | "int64" => Self::Long,
            "ulong" | "uint64" => Self::ULong,
            "float" | "float32" => Self::Float,
            "double" | "float64" => Self::Double,
            _ => Self::Unknown,
        }
    }

    /// Bytes of a binary value.
    pub(crate) fn bytes(self) -> u64 {
        match self {
            Self::Char | Self::UChar => 1,
            Self::Short | Self::UShort => 2,
            Self::Int | Self::UInt | Self::Float => 4,
            Self::Long | Self::ULong | Self::Double => 8,
            Self::Unknown => 0,
        }
    }
}

/// A value, or a list of values, of each element of a kind.
pub(super) struct Property {
    pub name: String,
    pub kind: Kind,
    /// Type of the length, if it is a list.
    pub length: Option<Kind>,
    /// Line in the file, from 1.
    pub line: usize,
}

/// A kind of element.
pub(super) struct Element {
    pub name: String,
    pub count: u64,
    /// Line in the file, from 1.
    pub line: usize,
    pub properties: Vec<Property>,
}

impl Element {
    /// Smallest size of all elements in bytes: a digit and a separator per property in text, empty
    /// lists.
    pub(crate) fn least_bytes(&self, encoding: Encoding) -> u64 {
        let least = |property: &Property| match encoding {
            Encoding::Text => 2,
            _ => property.length.unwrap_or(property.kind).bytes(),
        };
        let each: u64 = self.properties.iter().map(least).sum();
        each.saturating_mul(self.count)
    }

    /// The first property whose values cannot be told apart.
    pub(crate) fn unknown(&self, encoding: Encoding) -> Option<&Property> {
        let is_unknown = |p: &&Property| [Some(p.kind), p.length].contains(&Some(Kind::Unknown));
        let mut properties = self.properties.iter();
        properties
            .find(is_unknown)
            .filter(|_| encoding != Encoding::Text)
    }
}

/// A header.
pub(super) struct Header {
    pub encoding: Encoding,
    /// In the order of the file.
    pub elements: Vec<Element>,
    /// Statements that are not read.
    pub unread: Unread,
    /// Number of lines.
    pub lines: usize,
}

/// The name of an element that is read, which may be written in any case.
fn known(name: &str) -> &str {
    let read = ["vertex", "face", "tristrips"];
    let same = |known: &&str| known.eq_ignore_ascii_case(name);
    read.into_iter().find(same).unwrap_or(name)
}

impl Header {
    /// Reads the header with any kind of line ends; the rest stays in the source.
    ///
    /// # Errors
    /// The line of the first malformed statement, and the problem.
    pub(crate) fn read(source: &mut impl BufRead) -> Result<Self, (usize, String)> {
        let mut encoding = None;
        let mut header = Self {
            encoding: Encoding::Text,
            elements: Vec::new(),
            unread: Unread::default(),
            lines: 0,
        };
        let mut pairs = true;
        loop {
            let mut line = Vec::new();
            let end = read_line(source, &mut line, pairs);
            let end = end.map_err(|error| (header.lines + 1, error.to_string()))?;
            header.lines += 1;
            let number = header.lines;
            if number == 1 {
                check_magic(&line).map_err(|problem| (1, problem))?;
                // After a header with \r line ends, \n is the first byte of the data.
                pairs = end != LineEnd::Return;
                continue;
            }
            let text = plain_text_or_latin1(line);
            match text.split_whitespace().next() {
                Some("end_header") => break,
                Some("format") => {
                    let found = encoding_of(&text).map_err(|problem| (number, problem))?;
                    encoding.get_or_insert(found);
                }
                Some(_) => header
                    .statement(&text)
                    .map_err(|problem| (number, problem))?,
                None => {}
            }
            if end == LineEnd::None {
                return Err((number, "the file ends before `end_header`".to_owned()));
            }
        }
        let none = || (1, "the header has no line `format`".to_owned());
        header.encoding = encoding.ok_or_else(none)?;
        Ok(header)
    }

    fn statement(&mut self, text: &str) -> Result<(), String> {
        let line = self.lines;
        let words: Vec<&str> = text.split_whitespace().collect();
        match words[..] {
            ["comment", "TextureFile", ..] => {
                self.unread.see("the texture of a `TextureFile`", line);
            }
            ["comment" | "obj_info", ..] => {}
            ["element", name, count] => {
                let problem = || format!("`{count}` is not a number of elements");
                self.elements.push(Element {
                    name: known(name).to_owned(),
                    count: count.parse().map_err(|_| problem())?,
                    line,
                    properties: Vec::new(),
                });
            }
            ["property", ..] => {
                let (length, kind, name) = match words[1..] {
                    ["list", length, kind, ref name @ ..] => (Some(length), kind, name),
                    ["list", ..] | [] => return Err(format!("`{}` names no type", text.trim())),
                    [kind, ref name @ ..] => (None, kind, name),
                };
                let element = self.elements.last_mut();
                let element = element.ok_or("a property stands before the first element")?;
                element.properties.push(Property {
                    name: name.join(" "),
                    kind: Kind::named(kind),
                    length: length.map(Kind::named),
                    line,
                });
            }
            ["element", ..] => {
                return Err(format!("`{}` is not `element NAME COUNT`", text.trim()));
            }
            _ => self.unread.see(words[0], line),
        }
        Ok(())
    }
}

fn check_magic(line: &[u8]) -> Result<(), String> {
    if line.starts_with(b"\xff\xfe") || line.starts_with(b"\xfe\xff") {
        return Err("it is UTF-16 text; save it as UTF-8".to_owned());
    }
    let begins = plain_text_or_latin1(line.to_vec()).trim() == "ply";
    begins
        .then_some(())
        .ok_or_else(|| "the first line is not `ply`".to_owned())
}

fn encoding_of(text: &str) -> Result<Encoding, String> {
    match text.split_whitespace().nth(1) {
        Some("ascii") => Ok(Encoding::Text),
        Some("binary_little_endian") => Ok(Encoding::Little),
        Some("binary_big_endian") => Ok(Encoding::Big),
        _ => Err(format!(
            "`{}` is neither ascii, binary_little_endian nor binary_big_endian",
            text.trim()
        )),
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

/// Longest line of a header, bytes: what is longer is no PLY file.
const LONGEST_LINE: usize = 1 << 16;

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
            if line.len() + all > LONGEST_LINE {
                return Err(std::io::Error::other("a line of the header does not end"));
            }
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
