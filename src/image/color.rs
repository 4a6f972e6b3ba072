//! Colour maps: one for quantities, one palette for categories.

/// Nine equidistant colours of matplotlib's `viridis` (van der Walt and Smith 2015, CC0).
const VIRIDIS: [[u8; 3]; 9] = [
    [0x44, 0x01, 0x54],
    [0x47, 0x2d, 0x7b],
    [0x3b, 0x52, 0x8b],
    [0x2c, 0x72, 0x8e],
    [0x21, 0x91, 0x8c],
    [0x28, 0xae, 0x80],
    [0x5e, 0xc9, 0x62],
    [0xad, 0xdc, 0x30],
    [0xfd, 0xe7, 0x25],
];

/// The colour-blind safe palette of Okabe and Ito (2008), dark colours first; faint yellow last.
const OKABE_ITO: [[u8; 3]; 8] = [
    [0x00, 0x72, 0xb2],
    [0xd5, 0x5e, 0x00],
    [0x00, 0x9e, 0x73],
    [0xcc, 0x79, 0xa7],
    [0x00, 0x00, 0x00],
    [0x56, 0xb4, 0xe9],
    [0xe6, 0x9f, 0x00],
    [0xf0, 0xe4, 0x42],
];

/// Perceptually uniform colour (sRGB) for `t` in [0, 1], dark violet to yellow: `viridis`,
/// piecewise linear between nine of its colours. `t` is clamped; NaN counts as 0.
pub fn viridis(t: f32) -> [u8; 3] {
    let last = VIRIDIS.len() - 1;
    let t = if t.is_nan() { 0.0 } else { t.clamp(0.0, 1.0) };
    let position = t * last as f32;
    let index = (position as usize).min(last - 1);
    let fraction = position - index as f32;
    std::array::from_fn(|channel| {
        let low = f32::from(VIRIDIS[index][channel]);
        let high = f32::from(VIRIDIS[index + 1][channel]);
        (low + (high - low) * fraction).round() as u8
    })
}

/// Colour (sRGB) of a category index; repeats after eight, so markers must also distinguish them.
pub fn categorical(index: usize) -> [u8; 3] {
    OKABE_ITO[index % OKABE_ITO.len()]
}

pub(crate) fn hex([r, g, b]: [u8; 3]) -> String {
    format!("#{r:02x}{g:02x}{b:02x}")
}

/// The colour map as a CSS gradient from left to right.
pub fn viridis_css() -> String {
    let stops: Vec<String> = VIRIDIS.iter().map(|&color| hex(color)).collect();
    format!("linear-gradient(to right, {})", stops.join(", "))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn viridis_has_the_published_ends_and_middle() {
        assert_eq!(viridis(0.0), [68, 1, 84]);
        assert_eq!(viridis(0.5), [33, 145, 140]);
        assert_eq!(viridis(1.0), [253, 231, 37]);
    }

    #[test]
    fn viridis_clamps_and_survives_nan() {
        assert_eq!(viridis(-3.0), viridis(0.0));
        assert_eq!(viridis(f32::INFINITY), viridis(1.0));
        assert_eq!(viridis(f32::NAN), viridis(0.0));
    }

    #[test]
    fn viridis_grows_brighter_all_the_way() {
        let luma = |[r, g, b]: [u8; 3]| {
            0.2126 * f64::from(r) + 0.7152 * f64::from(g) + 0.0722 * f64::from(b)
        };
        let steps: Vec<f64> = (0..=64).map(|i| luma(viridis(i as f32 / 64.0))).collect();
        assert!(steps.windows(2).all(|pair| pair[1] > pair[0]));
    }

    #[test]
    fn the_first_eight_categories_differ() {
        let distinct: std::collections::BTreeSet<_> = (0..8).map(categorical).collect();
        assert_eq!(distinct.len(), 8);
        assert_eq!(categorical(8), categorical(0));
    }
}
