//! Writes OpenEXR files ("OpenEXR File Layout" of the Academy Software Foundation) with one part of
//! uncompressed scan lines. The `exr` crate, used for reading, writes attributes in hash map order,
//! so equal images would give different files.

use super::Image;

/// Name and value of metadata; formats that cannot store it omit it.
pub type Attribute<'a> = (&'a str, String);

/// Encodes an image, with attributes of type `string`.
pub(super) fn encode_exr(image: &Image, own: &[Attribute]) -> Vec<u8> {
    const MAGIC_AND_VERSION: [u8; 8] = [0x76, 0x2f, 0x31, 0x01, 2, 0, 0, 0];
    const FLOAT: u8 = 2;
    // Channels in alphabetical order, with their index in a pixel.
    const CHANNELS: [(u8, usize); 3] = [(b'B', 2), (b'G', 1), (b'R', 0)];
    let [right, bottom] = [image.width - 1, image.height - 1];
    let window: Vec<u8> = [0, 0, right, bottom]
        .iter()
        .flat_map(|v| v.to_le_bytes())
        .collect();
    let mut channels = Vec::new();
    for (name, _) in CHANNELS {
        // Name, type, "perceptually linear" and three reserved bytes, sampling in x and y.
        channels.extend([name, 0, FLOAT, 0, 0, 0, 0, 0, 0, 0, 1, 0, 0, 0, 1, 0, 0, 0]);
    }
    channels.push(0);
    let one = 1f32.to_le_bytes();
    let required: [(&str, &str, &[u8]); 8] = [
        ("channels", "chlist", &channels),
        ("compression", "compression", &[0]),
        ("dataWindow", "box2i", &window),
        ("displayWindow", "box2i", &window),
        ("lineOrder", "lineOrder", &[0]),
        ("pixelAspectRatio", "float", &one),
        ("screenWindowCenter", "v2f", &[0; 8]),
        ("screenWindowWidth", "float", &one),
    ];
    let own = own
        .iter()
        .map(|(name, value)| (*name, "string", value.as_bytes()));
    let mut bytes = MAGIC_AND_VERSION.to_vec();
    for (name, kind, value) in required.into_iter().chain(own) {
        bytes.extend_from_slice(format!("{name}\0{kind}\0").as_bytes());
        bytes.extend_from_slice(&(value.len() as u32).to_le_bytes());
        bytes.extend_from_slice(value);
    }
    bytes.push(0);
    // Offset of each row, then the rows: number, size, one channel after the other.
    let row_bytes = 12 * image.width;
    let first_row = bytes.len() as u64 + 8 * u64::from(image.height);
    for row in 0..u64::from(image.height) {
        bytes.extend((first_row + row * (8 + u64::from(row_bytes))).to_le_bytes());
    }
    for (y, row) in (0u32..).zip(image.pixels.chunks(image.width as usize)) {
        bytes.extend(y.to_le_bytes());
        bytes.extend(row_bytes.to_le_bytes());
        for (_, channel) in CHANNELS {
            bytes.extend(row.iter().flat_map(|pixel| pixel[channel].to_le_bytes()));
        }
    }
    bytes
}
