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

/// The top of the scale that several pictures share: the greatest of what 99 % of the pixels of each do not exceed, at least 1.
pub(crate) fn scale_of<'a>(all: impl Iterator<Item = &'a [f32]>) -> f32 {
    let of_most = |costs: &[f32]| {
        let mut sorted = costs.to_vec();
        sorted.sort_unstable_by(f32::total_cmp);
        sorted.get(sorted.len() * 99 / 100).copied().unwrap_or(0.0)
    };
    all.map(of_most).fold(1.0, f32::max)
}
