//! Alpha that decoders pass over, and that files have without meaning it.

use image::{ImageFormat, RgbaImage};

/// Mends the alpha of the image of a file of this format.
pub(super) fn mend(bytes: &[u8], format: Option<ImageFormat>, image: &mut RgbaImage) {
    cut_holes(bytes, image);
    // Of 32 bits, whose last eight are nothing; those that say so in their header and those that mean them look alike.
    if format == Some(ImageFormat::Tga) && image.pixels().all(|pixel| pixel.0[3] == 0) {
        image.pixels_mut().for_each(|pixel| pixel.0[3] = 255);
    }
}

/// A block of 4 × 4 texels: two colours, then two bits a texel.
const BLOCK: usize = 8;

/// Takes the alpha from the texels of a DDS file of BC1 that are transparent: the last of four choices where the first colour of
/// a block is not above the second (Direct3D 11, "BC1").
fn cut_holes(bytes: &[u8], image: &mut RgbaImage) {
    let Some(blocks) = blocks(bytes) else {
        return;
    };
    let across = image.width().div_ceil(4);
    for (number, block) in (0..).zip(blocks) {
        let [first, second] = [0, 2].map(|at| u16::from_le_bytes([block[at], block[at + 1]]));
        if first > second {
            continue;
        }
        let choices = u32::from_le_bytes([block[4], block[5], block[6], block[7]]);
        for texel in (0..16).filter(|texel| choices >> (2 * texel) & 3 == 3) {
            let (x, y) = (
                number % across * 4 + texel % 4,
                number / across * 4 + texel / 4,
            );
            if let Some(found) = image.get_pixel_mut_checked(x, y) {
                found.0[3] = 0;
            }
        }
    }
}

/// The blocks behind the header of a file of BC1, that of Direct3D 10 or an earlier one.
fn blocks(bytes: &[u8]) -> Option<&[[u8; BLOCK]]> {
    const BC1: std::ops::RangeInclusive<u8> = 70..=72;
    let start = match bytes.get(84..88)? {
        b"DXT1" => 128,
        b"DX10" if BC1.contains(bytes.get(128)?) => 148,
        _ => return None,
    };
    let is_dds = bytes.starts_with(b"DDS ");
    Some(bytes.get(start..).filter(|_| is_dds)?.as_chunks().0)
}
