//! Text utilities: decoding, escaping, file names, content hashes, and nearest known names.

pub mod escape;

/// Bytes that are not UTF-8.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct NotUtf8 {
    /// First line with such bytes, from 1.
    pub line: usize,
}

/// Decodes a text file from any editor to UTF-8 without a byte order mark and with `\n` line ends.
/// UTF-16 is detected by its byte order mark; lines may end in `\r\n` or `\r`, and DOS's
/// end-of-file mark (Ctrl-Z) may follow the last one.
///
/// # Errors
/// Invalid UTF-8, with its line.
pub fn plain_text(bytes: Vec<u8>) -> Result<String, NotUtf8> {
    String::from_utf8(plain_bytes(bytes)).map_err(|error| {
        let before = &error.as_bytes()[..error.utf8_error().valid_up_to()];
        let ends = before.iter().filter(|byte| **byte == b'\n');
        NotUtf8 {
            line: 1 + ends.count(),
        }
    })
}

/// [`plain_text`] for formats older than UTF-8: invalid UTF-8 is read as Windows-1252, byte by byte, so different names stay
/// different. It is Latin-1 with letters in the place of control characters, which names do not have (WHATWG Encoding).
pub fn plain_text_or_latin1(bytes: Vec<u8>) -> String {
    String::from_utf8(plain_bytes(bytes)).unwrap_or_else(|error| {
        let mut text = String::with_capacity(error.as_bytes().len());
        for chunk in error.as_bytes().utf8_chunks() {
            text.push_str(chunk.valid());
            text.extend(chunk.invalid().iter().map(|byte| match byte {
                0x80..=0x9f => WINDOWS[usize::from(byte - 0x80)],
                _ => char::from(*byte),
            }));
        }
        text
    })
}

/// Windows-1252 from 0x80 to 0x9f; the five bytes that it leaves open are control characters, as in Latin-1.
const WINDOWS: [char; 32] = [
    '€', '\u{81}', '‚', 'ƒ', '„', '…', '†', '‡', 'ˆ', '‰', 'Š', '‹', 'Œ', '\u{8d}', 'Ž',
    '\u{8f}', //
    '\u{90}', '‘', '’', '“', '”', '•', '–', '—', '˜', '™', 'š', '›', 'œ', '\u{9d}', 'ž', 'Ÿ',
];

/// [`plain_text`] for bytes that may not be UTF-8.
fn plain_bytes(mut bytes: Vec<u8>) -> Vec<u8> {
    let utf_16 = |from: fn([u8; 2]) -> u16| {
        let units = bytes[2..].as_chunks::<2>().0.iter().map(|pair| from(*pair));
        let letters = char::decode_utf16(units);
        let letters = letters.map(|letter| letter.unwrap_or(char::REPLACEMENT_CHARACTER));
        letters.collect::<String>().into_bytes()
    };
    match bytes[..] {
        [0xff, 0xfe, ..] => bytes = utf_16(u16::from_le_bytes),
        [0xfe, 0xff, ..] => bytes = utf_16(u16::from_be_bytes),
        [0xef, 0xbb, 0xbf, ..] => drop(bytes.drain(..3)),
        _ => {}
    }
    if bytes.last() == Some(&DOS_END) {
        bytes.pop();
    }
    if bytes.contains(&b'\r') {
        let mut before = 0;
        // The result is no longer than the input.
        bytes.retain_mut(|byte| {
            let is_second = before == b'\r' && *byte == b'\n';
            before = *byte;
            if *byte == b'\r' {
                *byte = b'\n';
            }
            !is_second
        });
    }
    bytes
}

/// Ctrl-Z, the end-of-text mark of CP/M and DOS.
const DOS_END: u8 = 0x1a;

/// BLAKE3 hash of named parts as 64 hexadecimal digits.
///
/// Every name and text is preceded by its length, so parts cannot run together: moving a character
/// from one part to the next changes the hash. The order of the parts matters.
pub fn cell_hash(parts: &[(&str, &str)]) -> String {
    let mut hasher = blake3::Hasher::new();
    hasher.update(&(parts.len() as u64).to_le_bytes());
    for (name, text) in parts {
        for field in [name, text] {
            hasher.update(&(field.len() as u64).to_le_bytes());
            hasher.update(field.as_bytes());
        }
    }
    hasher.finalize().to_hex().to_string()
}

/// Quotes a text as one word of a POSIX shell.
pub fn shell_word(text: &str) -> String {
    let is_plain = |c: char| c.is_ascii_alphanumeric() || "-_./=,:+@%".contains(c);
    if !text.is_empty() && text.chars().all(is_plain) {
        text.to_owned()
    } else {
        format!("'{}'", text.replace('\'', "'\\''"))
    }
}

/// Maximum length of the readable part of a file name, characters.
const SLUG_CHARACTERS: usize = 80;

/// A file name for `parts`: readable, and made unique by a hash, even if case is ignored or the
/// readable part is truncated.
pub fn slug(parts: &[&str]) -> String {
    let plain = |c: char| match c {
        '.' => '.',
        c if c.is_ascii_alphanumeric() => c.to_ascii_lowercase(),
        _ => '-',
    };
    let text = parts.join("-");
    let readable: String = text.chars().take(SLUG_CHARACTERS).map(plain).collect();
    let hash = blake3::hash(parts.join("\0").as_bytes()).to_hex();
    format!("{readable}-{}", &hash[..10])
}

/// Compared characters of a name; time and memory grow with the product of both.
const COMPARED: usize = 64;

/// Names that are less alike are none that was meant.
const LEAST_ALIKE: f64 = 0.4;
/// What likeness to a part of a name counts.
const OF_PARTS: f64 = 0.8;

/// A question for a message about an unknown name, such as "; did you mean `bvh`?"; empty if no known name is near.
pub fn did_you_mean<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let near = nearest(name, known);
    near.map_or(String::new(), |near| format!("; did you mean `{near}`?"))
}

/// The same with all known names behind it.
pub fn did_you_mean_or_known(name: &str, known: &[&str]) -> String {
    let all = known.join(", ");
    match did_you_mean(name, known.iter().copied()) {
        near if near.is_empty() => format!("; known: {all}"),
        near => format!("{near} Known: {all}"),
    }
}

/// The known name nearest to `name`; `None` if none is like it.
///
/// Uses the normalised Damerau–Levenshtein similarity to the name, or to a part between hyphens; a
/// name that contains the other is also near. So `grid` and `gird` find `uniform-grid`.
pub fn nearest<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> Option<&'a str> {
    let beginning = |text: &str| text.chars().take(COMPARED).collect::<String>();
    let name = beginning(name).to_lowercase();
    let score = |candidate: &str| {
        let candidate = beginning(candidate);
        let contained = name.len() >= 3 && (candidate.contains(&name) || name.contains(&candidate));
        let alike = |part: &str| strsim::normalized_damerau_levenshtein(&name, part);
        let of_parts = candidate.split('-').map(alike).fold(0.0, f64::max);
        alike(&candidate).max(OF_PARTS * of_parts) + if contained { 0.5 } else { 0.0 }
    };
    let known = known
        .into_iter()
        .map(|candidate| (score(candidate), candidate));
    let nearest = known.max_by(|a, b| a.0.total_cmp(&b.0));
    nearest
        .filter(|(score, _)| *score >= LEAST_ALIKE)
        .map(|(_, candidate)| candidate)
}

/// Formats an integer with thin groups of three: `262,267`.
pub fn count(value: u64) -> String {
    let digits = value.to_string();
    let mut text = String::with_capacity(digits.len() + digits.len() / 3);
    for (i, digit) in digits.chars().enumerate() {
        if i > 0 && (digits.len() - i).is_multiple_of(3) {
            text.push(',');
        }
        text.push(digit);
    }
    text
}

/// Formats `1 sampler`, `3 samplers`.
pub fn plural(n: usize, noun: &str) -> String {
    if n == 1 {
        format!("1 {noun}")
    } else {
        format!("{} {noun}s", count(n as u64))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_line_ends_and_codings_are_all_one_text() {
        let utf_16 = |text: &str, bytes: fn(u16) -> [u8; 2]| {
            let units = std::iter::once(0xfeff).chain(text.encode_utf16());
            units.flat_map(bytes).collect::<Vec<u8>>()
        };
        let expected = "a 1\n\u{e9}\u{1f600} 2\n\n3";
        let crlf = expected.replace('\n', "\r\n");
        for given in [
            expected.as_bytes().to_vec(),
            format!("\u{feff}{crlf}\u{1a}").into_bytes(),
            expected.replace('\n', "\r").into_bytes(),
            "a 1\r\n\u{e9}\u{1f600} 2\n\r3".as_bytes().to_vec(),
            utf_16(expected, u16::to_le_bytes),
            utf_16(&crlf, u16::to_be_bytes),
        ] {
            assert_eq!(plain_text(given.clone()).as_deref(), Ok(expected));
            assert_eq!(plain_text_or_latin1(given), expected);
        }
        assert_eq!(plain_text(Vec::new()).as_deref(), Ok(""));
        let latin1 = b"a\rb \xfc\xe9\r\n".to_vec();
        assert_eq!(plain_text(latin1.clone()), Err(NotUtf8 { line: 2 }));
        assert_eq!(plain_text_or_latin1(latin1), "a\nb \u{fc}\u{e9}\n");
        let windows = b"wood \x96 \x93dark\x94 \x80\x81\x8c\x9f\xa0".to_vec();
        let expected = "wood \u{2013} \u{201c}dark\u{201d} \u{20ac}\u{81}\u{152}\u{178}\u{a0}";
        assert_eq!(plain_text_or_latin1(windows), expected);
    }

    #[test]
    fn nearest_prefers_a_transposition_and_finds_a_part_of_a_name() {
        let known = ["brute-force", "bvh", "roped-bvh", "uniform-grid"];
        assert_eq!(nearest("bhv", known), Some("bvh"));
        assert_eq!(nearest("grid", known), Some("uniform-grid"));
        assert_eq!(nearest("Roped_BVH", known), Some("roped-bvh"));
        assert_eq!(nearest("bvh", []), None);
        assert_eq!(nearest("x.stl", ["caustics", "fog"]), None);
        assert_eq!(nearest("gird", known), Some("uniform-grid"));
        assert_eq!(
            did_you_mean_or_known("bhv", &["bvh", "grid"]),
            "; did you mean `bvh`? Known: bvh, grid"
        );
        assert_eq!(did_you_mean_or_known("x", &["bvh"]), "; known: bvh");
        assert_eq!(did_you_mean("bhv", known), "; did you mean `bvh`?");
        assert_eq!(did_you_mean("quite another", ["bvh"]), "");
    }

    #[test]
    fn shell_words_come_back_from_a_shell() {
        for text in [
            "a b",
            "it's",
            "$(x)`y`",
            "",
            "plain-1.2/x",
            "\"",
            "a\nb",
            "*",
            "~",
            "!x",
        ] {
            let echo = format!("printf %s {}", shell_word(text));
            let output = std::process::Command::new("sh")
                .args(["-c", &echo])
                .output();
            assert_eq!(output.unwrap().stdout, text.as_bytes(), "{text:?}");
        }
        assert_eq!(shell_word("plain-1.2/x"), "plain-1.2/x");
    }

    #[test]
    fn equal_parts_hash_equal_and_every_change_shows() {
        let base = cell_hash(&[("scene", "ab"), ("accel", "c")]);
        assert_eq!(base, cell_hash(&[("scene", "ab"), ("accel", "c")]));
        assert_eq!(base.len(), 64);
        for other in [
            cell_hash(&[("scene", "a"), ("accel", "bc")]),
            cell_hash(&[("scene", "abaccel"), ("", "c")]),
            cell_hash(&[("accel", "c"), ("scene", "ab")]),
            cell_hash(&[("scene", "ab"), ("accel", "c"), ("", "")]),
            cell_hash(&[("scene", "ab"), ("accel", "d")]),
        ] {
            assert_ne!(base, other);
        }
    }
}
