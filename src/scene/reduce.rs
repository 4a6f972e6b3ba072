//! Downscales images by area averages of what texels represent: linear light, numbers or
//! directions, never encoded colours.

use glam::Vec4;

/// Meaning of an image's texels.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Texels {
    /// sRGB colours (IEC 61966-2-1) weighted by alpha.
    Colours,
    /// sRGB colours whose alpha nothing reads.
    Opaque,
    /// Directions 2c − 1 of length 1.
    Normals,
    Numbers,
}

/// The old rows or columns that overlap each new one: indices and weights, which add up to 1.
fn shares(from: u32, to: u32) -> Vec<Vec<(usize, f32)>> {
    let scale = f64::from(from) / f64::from(to);
    let of = |at: u32| {
        let (begin, end) = (f64::from(at) * scale, f64::from(at + 1) * scale);
        let last = (end.ceil() as u32).min(from);
        let covered = |k: u32| (end.min(f64::from(k) + 1.0) - begin.max(f64::from(k))) / scale;
        (begin as u32..last)
            .map(|k| (k as usize, covered(k) as f32))
            .filter(|(_, share)| *share > 0.0)
            .collect()
    };
    (0..to).map(of).collect()
}

/// Area averages for the texels of a smaller image, row by row; old rows are scaled by `weight`.
pub(super) fn area_means(
    [width, height]: [u32; 2],
    [columns, rows]: [u32; 2],
    texel: impl Fn(usize) -> Vec4,
    weight: impl Fn(u32) -> f32,
) -> Vec<Vec4> {
    let (across, down) = (shares(width, columns), shares(height, rows));
    let mut means = Vec::with_capacity(columns as usize * rows as usize);
    for row in &down {
        let weights: Vec<(usize, f32)> = (row.iter())
            .map(|(y, share)| (*y, share * weight(*y as u32)))
            .collect();
        let all: f32 = weights.iter().map(|(_, weight)| weight).sum();
        means.extend(across.iter().map(|column| {
            let along = |y: usize| {
                let texels = column.iter();
                let sum: Vec4 = texels
                    .map(|(x, s)| *s * texel(y * width as usize + x))
                    .sum();
                sum
            };
            let sum: Vec4 = weights.iter().map(|(y, weight)| *weight * along(*y)).sum();
            sum / all
        }));
    }
    means
}

pub(super) fn reduced(
    texels: &[[u8; 4]],
    from: [u32; 2],
    to: [u32; 2],
    kind: Texels,
) -> Vec<[u8; 4]> {
    let unit = |texel: [u8; 4]| Vec4::from(texel.map(f32::from)) / 255.0;
    let bytes = |v: Vec4| (255.0 * v).round().to_array().map(|x| x as u8);
    let even = |_| 1.0;
    match kind {
        Texels::Numbers => {
            let means = area_means(from, to, |at| unit(texels[at]), even);
            means.into_iter().map(bytes).collect()
        }
        Texels::Normals => {
            let vector = |at: usize| {
                let v = unit(texels[at]);
                (2.0 * v.truncate() - 1.0).normalize_or_zero().extend(v.w)
            };
            let encoded = |mean: Vec4| {
                let v = mean.truncate().try_normalize().unwrap_or(glam::Vec3::Z);
                bytes((0.5 * v + 0.5).extend(mean.w))
            };
            let means = area_means(from, to, vector, even);
            means.into_iter().map(encoded).collect()
        }
        Texels::Colours | Texels::Opaque => {
            let linear: [f32; 256] = std::array::from_fn(|k| decoded(k as f32 / 255.0));
            let light = |at: usize| {
                let [r, g, b, a] = texels[at];
                let [r, g, b] = [r, g, b].map(|c| linear[usize::from(c)]);
                let alpha = match kind {
                    Texels::Opaque => 1.0,
                    _ => f32::from(a) / 255.0,
                };
                Vec4::new(r * alpha, g * alpha, b * alpha, alpha)
            };
            let plain = |at: usize| {
                let [r, g, b, _] = texels[at].map(|c| linear[usize::from(c)]);
                Vec4::new(r, g, b, 0.0)
            };
            let means = area_means(from, to, light, even);
            // Where alpha is 0, colours have equal weight.
            let nothing = means.iter().any(|mean| mean.w == 0.0);
            let others = nothing.then(|| area_means(from, to, plain, even));
            let encoded = |(at, mean): (usize, Vec4)| {
                let colour = match (&others, mean.w > 0.0) {
                    (Some(others), false) => others[at].truncate(),
                    _ => mean.truncate() / mean.w,
                };
                let [r, g, b] = colour.to_array().map(encode);
                bytes(Vec4::new(r, g, b, mean.w))
            };
            means.into_iter().enumerate().map(encoded).collect()
        }
    }
}

fn decoded(c: f32) -> f32 {
    if c <= 0.04045 {
        c / 12.92
    } else {
        ((c + 0.055) / 1.055).powf(2.4)
    }
}

/// Encodes a linear component as sRGB (IEC 61966-2-1).
pub(super) fn encode(c: f32) -> f32 {
    if c <= 0.003_130_8 {
        c * 12.92
    } else {
        1.055 * c.powf(1.0 / 2.4) - 0.055
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const WHITE: [u8; 4] = [255; 4];
    const BLACK: [u8; 4] = [0, 0, 0, 255];
    const NOTHING: [u8; 4] = [0; 4];

    fn checker(size: u32, [a, b]: [[u8; 4]; 2]) -> Vec<[u8; 4]> {
        let texel = |k: u32| {
            if (k % size + k / size).is_multiple_of(2) {
                a
            } else {
                b
            }
        };
        (0..size * size).map(texel).collect()
    }

    #[test]
    fn a_checker_of_white_and_black_keeps_half_the_light() {
        let light = |c: u8| decoded(f32::from(c) / 255.0);
        for (size, to) in [(8, 4), (8, 2), (6, 1)] {
            let small = reduced(
                &checker(size, [WHITE, BLACK]),
                [size; 2],
                [to; 2],
                Texels::Colours,
            );
            for [r, g, b, a] in small {
                assert_eq!((r, g, a), (b, b, 255));
                assert!((light(r) - 0.5).abs() < 0.004, "{r}");
            }
        }
        // Five texels to two: each takes 2½, of which 1½ are white along each axis.
        let stripes: Vec<[u8; 4]> = (0..5).map(|k| [WHITE, BLACK][k % 2]).collect();
        let small = reduced(&stripes, [5, 1], [2, 1], Texels::Colours);
        assert!(small.iter().all(|t| (light(t[0]) - 0.6).abs() < 0.004));
    }

    #[test]
    fn what_is_cut_out_has_no_colour_and_numbers_are_not_decoded() {
        let red = [255, 0, 0, 255];
        let masked = checker(4, [red, NOTHING]);
        let small = reduced(&masked, [4, 4], [2, 2], Texels::Colours);
        assert_eq!(small, [[255, 0, 0, 128]; 4]);
        // Without a mask the alpha of white and of clear black is none: half the light is byte 188 (IEC 61966-2-1).
        let clear = checker(4, [[255, 255, 255, 10], [0, 0, 0, 255]]);
        let small = reduced(&clear, [4, 4], [2, 2], Texels::Opaque);
        assert_eq!(small, [[188, 188, 188, 255]; 4]);
        let gone = reduced(&[[200, 100, 0, 0]; 4], [2, 2], [1, 1], Texels::Colours);
        assert_eq!(gone, [[200, 100, 0, 0]]);
        let numbers = reduced(&checker(4, [WHITE, BLACK]), [4, 4], [1, 1], Texels::Numbers);
        assert_eq!(numbers, [[128, 128, 128, 255]]);
    }

    #[test]
    fn normals_keep_their_length() {
        let tilted = [[218, 128, 218, 255], [38, 128, 218, 255]];
        let small = reduced(&tilted, [2, 1], [1, 1], Texels::Normals);
        assert!(small[0][2] >= 254, "{small:?}");
        assert_eq!(small[0][1], 128);
    }
}
