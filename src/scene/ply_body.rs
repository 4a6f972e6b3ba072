//! Values of PLY files, read one after the other from text or bytes.

use super::obj_statements::{no_number, number};
use super::ply_header::{Encoding, Kind, Property};
use std::io::{BufRead, ErrorKind};

/// The values after a header.
pub(super) struct Body<S> {
    source: S,
    encoding: Encoding,
    /// Line of the last word; in binary files that of the header's end.
    line: usize,
    word: Vec<u8>,
    /// The last byte of a text.
    last: u8,
}

const ENDS: &str = "the file ends here";

impl<S: BufRead> Body<S> {
    /// The values behind a header of `lines` lines.
    pub(crate) fn new(source: S, encoding: Encoding, lines: usize) -> Self {
        Self {
            source,
            encoding,
            line: lines + 1,
            word: Vec::new(),
            last: b'\n',
        }
    }

    /// The line of the last word, if this is text.
    pub(crate) fn line(&self) -> Option<usize> {
        (self.encoding == Encoding::Text).then_some(self.line)
    }

    /// Reads a value.
    ///
    /// # Errors
    /// The file ends or cannot be read, or the word is not a number.
    pub(crate) fn value(&mut self, kind: Kind) -> Result<f64, String> {
        if self.encoding == Encoding::Text {
            return self.number(kind);
        }
        Ok(match kind {
            Kind::Char => i8::from_le_bytes(self.bytes()?).into(),
            Kind::UChar => u8::from_le_bytes(self.bytes()?).into(),
            Kind::Short => i16::from_le_bytes(self.bytes()?).into(),
            Kind::UShort => u16::from_le_bytes(self.bytes()?).into(),
            Kind::Int => i32::from_le_bytes(self.bytes()?).into(),
            Kind::UInt => u32::from_le_bytes(self.bytes()?).into(),
            Kind::Long => i64::from_le_bytes(self.bytes()?) as f64,
            Kind::ULong => u64::from_le_bytes(self.bytes()?) as f64,
            Kind::Float => f32::from_le_bytes(self.bytes()?).into(),
            Kind::Double => f64::from_le_bytes(self.bytes()?),
            Kind::Unknown => return Err("a value of unknown type".to_owned()),
        })
    }

    /// Reads the items of a list and passes each on.
    ///
    /// # Errors
    /// As [`Self::value`], and a length that is not a count.
    pub(crate) fn list(
        &mut self,
        length: Kind,
        kind: Kind,
        mut item: impl FnMut(f64) -> Result<(), String>,
    ) -> Result<(), String> {
        for _ in 0..self.length(length)? {
            item(self.value(kind)?)?;
        }
        Ok(())
    }

    /// Passes over a property.
    ///
    /// # Errors
    /// As [`Self::list`].
    pub(crate) fn skip(&mut self, property: &Property) -> Result<(), String> {
        let count = property.length.map_or(Ok(1), |kind| self.length(kind))?;
        if self.encoding == Encoding::Text {
            return (0..count).try_for_each(|_| self.next_word());
        }
        let mut left = count.saturating_mul(property.kind.bytes());
        while left > 0 {
            let bytes = self.source.fill_buf().map_err(|e| e.to_string())?.len();
            if bytes == 0 {
                return Err(ENDS.to_owned());
            }
            let part = left.min(bytes as u64);
            self.source.consume(part as usize);
            left -= part;
        }
        Ok(())
    }

    /// True if values are left; reads on to the first.
    pub(crate) fn goes_on(&mut self) -> bool {
        match self.encoding {
            Encoding::Text => self.next_word().is_ok() && self.word != [DOS_END],
            _ => self.source.fill_buf().is_ok_and(|bytes| !bytes.is_empty()),
        }
    }

    fn length(&mut self, kind: Kind) -> Result<u64, String> {
        let length = self.value(kind)?;
        if length >= 0.0 && length.fract() == 0.0 {
            Ok(length as u64)
        } else {
            Err(format!("a list cannot have {length} items"))
        }
    }

    fn bytes<const N: usize>(&mut self) -> Result<[u8; N], String> {
        let mut bytes = [0; N];
        match self.source.read_exact(&mut bytes) {
            Err(error) if error.kind() == ErrorKind::UnexpectedEof => return Err(ENDS.to_owned()),
            Err(error) => return Err(error.to_string()),
            Ok(()) => {}
        }
        if self.encoding == Encoding::Big {
            bytes.reverse();
        }
        Ok(bytes)
    }

    fn number(&mut self, kind: Kind) -> Result<f64, String> {
        self.next_word()?;
        // Writers of text put a byte order mark where their text begins: behind the header.
        let word = self
            .word
            .strip_prefix(b"\xef\xbb\xbf")
            .unwrap_or(&self.word);
        let word = std::str::from_utf8(word).unwrap_or_default();
        // Rounded once: a float's text through f64 may be another float.
        let found = match kind {
            Kind::Float => number::<f32>(word).map(f64::from),
            _ => number(word),
        };
        found.ok_or_else(|| no_number(&self.word.escape_ascii().to_string()))
    }

    /// Reads a word. Line ends are blanks: writers break lines within elements, too.
    fn next_word(&mut self) -> Result<(), String> {
        self.word.clear();
        loop {
            let bytes = self.source.fill_buf().map_err(|e| e.to_string())?;
            if bytes.is_empty() {
                let found = !self.word.is_empty();
                return found.then_some(()).ok_or_else(|| ENDS.to_owned());
            }
            let mut start = 0;
            if self.word.is_empty() {
                for byte in bytes.iter().take_while(|b| b.is_ascii_whitespace()) {
                    let is_end = *byte == b'\r' || (*byte == b'\n' && self.last != b'\r');
                    self.line += usize::from(is_end);
                    self.last = *byte;
                    start += 1;
                }
            }
            let rest = &bytes[start..];
            let end = rest.iter().position(u8::is_ascii_whitespace);
            let part = &rest[..end.unwrap_or(rest.len())];
            if self.word.len() + part.len() > LONGEST_WORD {
                return Err("a word does not end".to_owned());
            }
            self.word.extend_from_slice(part);
            self.last = part.last().copied().unwrap_or(self.last);
            let read = start + part.len();
            self.source.consume(read);
            if end.is_some() && !self.word.is_empty() {
                return Ok(());
            }
        }
    }
}

/// Ctrl-Z, the end-of-text mark of CP/M and DOS.
const DOS_END: u8 = 0x1a;

/// Longest word of a text, bytes: what is longer is no number.
const LONGEST_WORD: usize = 1 << 16;
