//! Heat maps: what the rays of pixels cost, in colours.

use raystone_image::{Picture, viridis};

/// The picture of these costs, row by row, from 0 to `scale`.
pub(crate) fn heat_map(costs: &[f32], scale: f32, [width, height]: [u32; 2]) -> Picture {
    Picture {
        width,
        height,
        pixels: costs.iter().map(|cost| viridis(cost / scale)).collect(),
    }
}
