//! Line continuation (`\`) of the Wavefront formats.

use raystone_core::text::plain_text_or_latin1;

/// The plain text of a file. A line that ends in `\`, also with blanks behind it, but not in a comment, continues on the next; empty lines replace the joined ones, to preserve line numbers.
pub(super) fn normalised(bytes: Vec<u8>) -> String {
    let mut bytes = plain_text_or_latin1(bytes).into_bytes();
    // Exporters pad files with zeros at the end.
    bytes.truncate(
        bytes
            .iter()
            .rposition(|byte| *byte != 0)
            .map_or(0, |last| last + 1),
    );
    // Writing never overtakes reading, as the output is at most as long as the input.
    let (mut from, mut to, mut line, mut joined) = (0, 0, 0, 0);
    let mut is_comment = false;
    while from < bytes.len() {
        let continued = continuation(&bytes[from..]).filter(|_| !is_comment);
        match (bytes[from], continued) {
            (_, Some(length)) => {
                bytes[to] = b' ';
                to += 1;
                joined += 1;
                from += length;
            }
            (b'\n', None) => {
                let end = to + 1 + joined;
                bytes[to..end].fill(b'\n');
                (to, line, joined, is_comment) = (end, end, 0, false);
                from += 1;
            }
            (byte, None) => {
                // Names may contain `#`, but do not begin with it.
                let before = bytes[line..to].last();
                is_comment |= byte == b'#' && before.is_none_or(u8::is_ascii_whitespace);
                bytes[to] = byte;
                to += 1;
                from += 1;
            }
        }
    }
    bytes.truncate(to);
    // Only whole characters were copied, and only blanks and line ends added.
    String::from_utf8(bytes).unwrap_or_default()
}

/// Length of a `\` that ends a line, with blanks behind it and the line end. Before the end of the
/// text there is none to continue on.
fn continuation(bytes: &[u8]) -> Option<usize> {
    let rest = bytes.strip_prefix(b"\\")?;
    let is_blank = |byte: &&u8| matches!(byte, b' ' | b'\t');
    let blanks = rest.iter().take_while(is_blank).count();
    match rest.get(blanks) {
        Some(b'\n') => Some(blanks + 2),
        None => Some(blanks + 1),
        Some(_) => None,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn marks_line_ends_and_continuations_become_plain_lines() {
        for (given, expected) in [
            (&b"\xef\xbb\xbfmtllib a.mtl\n"[..], "mtllib a.mtl\n"),
            (b"v 1\rv 2\r\nv 3\n\rv 4", "v 1\nv 2\nv 3\n\nv 4"),
            (b"f 1 \\\n2 \\\r\n3\nf 4\n", "f 1  2  3\n\n\nf 4\n"),
            (b"f 1 \\\r2\rf 3\r", "f 1  2\n\nf 3\n"),
            (b"map_Kd a\\b.png\n", "map_Kd a\\b.png\n"),
            (b" # c:\\models\\\nv 1\n", " # c:\\models\\\nv 1\n"),
            (b"v 1 2 3 # c:\\a\\\nv 1\n", "v 1 2 3 # c:\\a\\\nv 1\n"),
            (b"usemtl a#1 \\\n\nf 1\n", "usemtl a#1  \n\nf 1\n"),
            (b"f 1 2 \\", "f 1 2  "),
            (b"f 1 2 \\ \t\n3\nf 4\n", "f 1 2  3\n\nf 4\n"),
            (b"f 1 2 \\  ", "f 1 2  "),
            (b"map_Kd a\\ b.png\n", "map_Kd a\\ b.png\n"),
            (b"f 1 2 \\\n", "f 1 2  "),
            (b"\\\n\\\n\\\n", "   "),
            (b"usemtl M\xfcll\n", "usemtl M\u{fc}ll\n"),
            (b"f 1 2 3\n\0\0\0", "f 1 2 3\n"),
            (b"", ""),
        ] {
            assert_eq!(normalised(given.to_vec()), expected);
        }
    }

    #[test]
    fn numbers_of_lines_are_kept() {
        let text = normalised(b"# one\r\nf 1 \\\n 2\\\n 3\nbroken\n".to_vec());
        assert_eq!(text.lines().position(|line| line == "broken"), Some(4));
    }
}
