//! Radiance files whose pixels do not begin at the top left: the eight orders of its resolution line.

use super::Image;

/// How the pixels of a Radiance file lie that does not begin at the top left.
pub(super) struct Turn {
    /// Scan lines are columns.
    is_column: bool,
    /// Scan lines go up, or to the left.
    lines: bool,
    /// What is in them does.
    within: bool,
}

/// The file as one of rows from the top left, and how its pixels lie; `None` if they do so anyway.
pub(super) fn upright(bytes: &[u8]) -> Option<(Vec<u8>, Turn)> {
    let end = bytes.array_windows().position(|pair| pair == b"\n\n")? + 2;
    let length = bytes[end..]
        .iter()
        .take(64)
        .position(|byte| *byte == b'\n')?;
    let line = std::str::from_utf8(&bytes[end..end + length]).ok()?;
    let [first, height, second, width] =
        <[&str; 4]>::try_from(line.split_whitespace().collect::<Vec<_>>()).ok()?;
    let turn = match (first, second) {
        ("-Y" | "+Y", "-X" | "+X") => Turn {
            is_column: false,
            lines: first == "+Y",
            within: second == "-X",
        },
        ("-X" | "+X", "-Y" | "+Y") => Turn {
            is_column: true,
            lines: first == "-X",
            within: second == "+Y",
        },
        _ => return None,
    };
    if !(turn.is_column || turn.lines || turn.within) {
        return None;
    }
    let line = format!("-Y {height} +X {width}");
    let file = [&bytes[..end], line.as_bytes(), &bytes[end + length..]].concat();
    Some((file, turn))
}

impl Turn {
    /// Width and height of the picture, of those of the file as one of rows.
    pub(super) fn size(&self, [width, height]: [u32; 2]) -> [u32; 2] {
        if self.is_column {
            [height, width]
        } else {
            [width, height]
        }
    }

    pub(super) fn undone(&self, image: &Image) -> Result<Image, String> {
        let [lines, within] = [image.height, image.width];
        let [width, height] = self.size([within, lines]);
        let turned =
            |k: u32, count: u32, is_turned: bool| if is_turned { count - 1 - k } else { k };
        let place = |y: u32, x: u32| {
            let [line, at] = if self.is_column { [x, y] } else { [y, x] };
            let line = turned(line, lines, self.lines);
            let at = turned(at, within, self.within);
            image.pixels[line as usize * within as usize + at as usize]
        };
        let pixels = (0..height).flat_map(|y| (0..width).map(move |x| (y, x)));
        let pixels = pixels.map(|(y, x)| place(y, x)).collect();
        Image::new(width, height, pixels).map_err(|e| e.to_string())
    }
}

#[cfg(test)]
mod tests {
    use crate::read_linear;

    /// A picture of three columns and two rows, in which each pixel is 2 to the power of its number in reading order.
    #[test]
    fn all_eight_orders_of_pixels_show_the_same_picture() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("a.hdr");
        for (line, order) in [
            ("-Y 2 +X 3", [0, 1, 2, 3, 4, 5]),
            ("+Y 2 +X 3", [3, 4, 5, 0, 1, 2]),
            ("-Y 2 -X 3", [2, 1, 0, 5, 4, 3]),
            ("+Y 2 -X 3", [5, 4, 3, 2, 1, 0]),
            ("+X 3 -Y 2", [0, 3, 1, 4, 2, 5]),
            ("+X 3 +Y 2", [3, 0, 4, 1, 5, 2]),
            ("-X 3 -Y 2", [2, 5, 1, 4, 0, 3]),
            ("-X 3 +Y 2", [5, 2, 4, 1, 3, 0]),
        ] {
            let head = format!("#?RADIANCE\nFORMAT=32-bit_rle_rgbe\n\n{line}\n");
            let pixels = order
                .iter()
                .flat_map(|number| [128, 128, 128, 129 + number]);
            let file: Vec<u8> = head.bytes().chain(pixels).collect();
            std::fs::write(&path, file).unwrap();
            let image = read_linear(&path).unwrap();
            assert_eq!([image.width, image.height], [3, 2], "{line}");
            let file = std::fs::read(&path).unwrap();
            assert_eq!(crate::hdr_size(&file), Ok([3, 2]), "{line}");
            let found: Vec<f32> = image.pixels.iter().map(|pixel| pixel[0]).collect();
            let expected = [1.0, 2.0, 4.0, 8.0, 16.0, 32.0];
            assert_eq!(found, expected, "{line}");
        }
    }
}
