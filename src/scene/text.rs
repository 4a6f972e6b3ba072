//! Line continuation (`\`) of the Wavefront formats.

use raystone_core::text::plain_text_or_latin1;

/// The plain text of a file. A line that ends in `\`, unless it is a comment, continues on the
/// next; empty lines replace the joined ones, to preserve line numbers.
pub(super) fn normalised(bytes: Vec<u8>) -> String {
    let mut bytes = plain_text_or_latin1(bytes).into_bytes();
    // Writing never overtakes reading, as the output is at most as long as the input.
    let (mut from, mut to, mut line, mut joined) = (0, 0, 0, 0);
    while from < bytes.len() {
        match bytes[from] {
            b'\\' if bytes.get(from + 1) == Some(&b'\n') && !is_comment(&bytes[line..to]) => {
                bytes[to] = b' ';
                to += 1;
                joined += 1;
                from += 2;
            }
            b'\n' => {
                let end = to + 1 + joined;
                bytes[to..end].fill(b'\n');
                (to, line, joined) = (end, end, 0);
                from += 1;
            }
            byte => {
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

fn is_comment(line: &[u8]) -> bool {
    line.trim_ascii_start().starts_with(b"#")
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
            (b"f 1 2 \\", "f 1 2 \\"),
            (b"f 1 2 \\\n", "f 1 2  "),
            (b"\\\n\\\n\\\n", "   "),
            (b"usemtl M\xfcll\n", "usemtl M\u{fc}ll\n"),
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
