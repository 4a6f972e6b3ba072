//! Positions along a Z-order curve through a cube of cells around all box centres. CPU version of
//! `kernels/accel/tree/parallel/morton.wesl`.
//!
//! Source: G. M. Morton, "A computer oriented geodetic data base and a new technique in file
//! sequencing", 1966.
//!
//! The cell width is a power of two, so no division is needed and the product with it is exact: the
//! difference from the minimum corner is the only rounding, the same on all adapters. The longest
//! side of the scene then spans between half of the cells and all of them.

const AXIS_BITS: u32 = 20;
const WORD_BITS: u32 = 10;
const SCALE_EXPONENT: u32 = 253;
const LARGEST_EXPONENT: u32 = 254;

/// Cells per unit of length, for a longest side of this extent.
pub(crate) fn grid_scale(extent: f32) -> f32 {
    let exponent = extent.to_bits() >> 23 & 255;
    f32::from_bits((SCALE_EXPONENT + AXIS_BITS - exponent).min(LARGEST_EXPONENT) << 23)
}

pub(crate) fn cell_of(centre: f32, low: f32, scale: f32) -> u32 {
    (((centre - low) * scale) as u32).min((1 << AXIS_BITS) - 1)
}

/// Ten bits with two zeros before each.
fn spread(bits: u32) -> u32 {
    let mut x = bits;
    x = (x | x << 16) & 0x0300_00ff;
    x = (x | x << 8) & 0x0300_f00f;
    x = (x | x << 4) & 0x030c_30c3;
    (x | x << 2) & 0x0924_9249
}

fn interleave(bits: [u32; 3]) -> u32 {
    let [x, y, z] = bits.map(spread);
    x << 2 | y << 1 | z
}

/// The code of a cell: upper and lower thirty bits.
pub(crate) fn morton_code(cell: [u32; 3]) -> [u32; 2] {
    let lower = (1 << WORD_BITS) - 1;
    [
        interleave(cell.map(|c| c >> WORD_BITS)),
        interleave(cell.map(|c| c & lower)),
    ]
}
