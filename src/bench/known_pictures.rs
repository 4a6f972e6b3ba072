//! Known pictures, made anew before any is shown: a heat map with its colours reversed, or the spectrum of an image with its
//! sides exchanged, looks like another result.

use crate::heat_map::{heat_map, scale_of};
use crate::spectrum::{ErrorSpectrum, SIGMAS, error_spectrum, mean_power, spectrum_of};
use raystone_image::{Image, automatic_exposure, viridis};
use std::f64::consts::TAU;

/// The ends of the colour map viridis, as Matplotlib 3.9 prints them: violet for nothing, yellow for the most.
const ENDS: [[u8; 3]; 2] = [[68, 1, 84], [253, 231, 37]];
/// And at a quarter, a half and three quarters.
const BETWEEN: [[u8; 3]; 3] = [[59, 82, 139], [33, 145, 140], [94, 201, 98]];
/// Width and height.
const SIZE: [u32; 2] = [8, 4];
/// Relative error of sums over pixels of f32.
const ROUNDING: f64 = 1e-6;

/// Makes them.
///
/// # Errors
/// One is not what it should be: what of which, and both values.
pub fn check() -> Result<(), String> {
    let [cheap, dear] = ENDS;
    let [quarter, half, most] = BETWEEN;
    let map = heat_map(&[0.0, 4.0, 2.0, 1.0, 3.0, 9.0], 4.0, [3, 2]);
    let pixels = vec![cheap, dear, half, quarter, most, dear];
    if (map.width, map.height, &map.pixels) != (3, 2, &pixels) {
        return Err(wrong("heat map", format!("{map:?}"), format!("{pixels:?}")));
    }
    // Of 1 to 200 the one behind 99 hundredths of them is 199; of 1 to 100 it is 100, and of nothing the least.
    let costs = |most: u16| -> Vec<f32> { (1..=most).rev().map(f32::from).collect() };
    let all = [costs(100), costs(200), Vec::new()];
    let top = scale_of(all.iter().map(Vec::as_slice));
    if top != 199.0 {
        let top = top.to_string();
        return Err(wrong("top of a heat map", top, "199".to_owned()));
    }
    // Of 1, 2 and 6 the mean is 3, and the variance (4 + 1 + 9) / 2.
    let spread = Image::variance_of(&[1.0, 2.0, 6.0].map(flat)).map_err(|e| e.to_string())?;
    if spread != flat(7.0) {
        return Err(wrong(
            "variance",
            format!("{:?}", spread.pixels),
            "7".to_owned(),
        ));
    }
    let found = spectrum_of(&wave(1.0), &wave(0.0)).map_err(|e| e.to_string())?;
    for (what, found, expected) in [
        // The wave has all power in two of 31 frequencies, an eighth of a cycle per pixel each way.
        ("greatest power", found.loudest, 15.5),
        ("power of low frequencies", found.low_frequency, 15.5),
        // Along x cos(2π/8) of all cosines but one of eight, which is lost with its neighbour; along y 1.
        ("autocorrelation", found.autocorrelation, along_both()),
        ("variance", Some(found.variance), 0.5),
    ] {
        let agrees = found.is_some_and(|x| (x - expected).abs() <= ROUNDING * expected);
        if !agrees {
            return Err(wrong(what, format!("{found:?}"), expected.to_string()));
        }
    }
    rings(found.power.first().copied())?;
    between_colours()?;
    filtered()?;
    exposed()
}

/// Below a quarter of a cycle per pixel the wave's two frequencies are alone in their ring. And of three images with powers of 1, 3 and 5 and
/// variances of 1, 2 and 3 the quantiles of the power over the mean variance, 1/2, 3 and 15/2, as `numpy.quantile` has them.
fn rings(first: Option<(f64, f64)>) -> Result<(), String> {
    let of = |power: f64, variance: f64| ErrorSpectrum {
        power: vec![(0.25, power)],
        variance,
        low_frequency: None,
        loudest: None,
        autocorrelation: None,
        filtered: Vec::new(),
    };
    let all = mean_power(&[of(5.0, 3.0), of(1.0, 1.0), of(3.0, 2.0)]);
    let at = all.first();
    let quantiles = at.and_then(|at| at.quantiles).unwrap_or_default();
    let known = [
        ("frequency of a ring", first.map(|at| at.0), 0.125),
        ("power of a ring", first.map(|at| at.1), 15.5),
        ("mean power", at.map(|at| at.power.value), 3.0),
        ("median power", Some(quantiles[0]), 3.0),
        ("third quarter of a power", Some(quantiles[1]), 5.25),
        ("95th hundredth of a power", Some(quantiles[2]), 7.05),
        ("greatest power of an image", Some(quantiles[3]), 7.5),
    ];
    let is_other = |(_, found, expected): &(&str, Option<f64>, f64)| {
        !found.is_some_and(|x| (x - expected).abs() <= ROUNDING * expected)
    };
    match known.into_iter().find(is_other) {
        None => Ok(()),
        Some((what, found, expected)) => {
            Err(wrong(what, format!("{found:?}"), expected.to_string()))
        }
    }
}

/// Eighths of viridis between those that a heat map has to the bit: `viridis(9)` of R's viridisLite, which rounds otherwise.
fn between_colours() -> Result<(), String> {
    const ODD: [[u8; 3]; 4] = [
        [0x47, 0x2d, 0x7b],
        [0x2c, 0x72, 0x8e],
        [0x27, 0xad, 0x81],
        [0xaa, 0xdc, 0x32],
    ];
    for (place, expected) in ODD.into_iter().enumerate() {
        let found = viridis((2.0 * place as f32 + 1.0) / 8.0);
        if found.iter().zip(expected).any(|(a, b)| a.abs_diff(b) > 4) {
            return Err(wrong(
                "colour",
                format!("{found:?}"),
                format!("{expected:?}"),
            ));
        }
    }
    Ok(())
}

/// An impulse after a Gaussian: along each axis the squares of its weights sum to 0.282 (σ = 1) and 0.141 (σ = 2), as
/// `scipy.ndimage.gaussian_filter` has them.
fn filtered() -> Result<(), String> {
    const SIDE: usize = 41;
    let mut error = [0.0; SIDE * SIDE];
    error[SIDE * SIDE / 2] = 1.0;
    let found = error_spectrum(&error, [SIDE; 2]).filtered;
    for (sigma, of_axis) in [
        (0.0, 1.0),
        (1.0, 0.282_125_655_064_598_14),
        (2.0, 0.141_052_356_387_740_7),
    ] {
        let place = SIGMAS.iter().position(|s| *s == sigma);
        let found = place.and_then(|k| found.get(k)).copied();
        let expected = of_axis / SIDE as f64;
        let agrees = found.is_some_and(|x| (x - expected).abs() <= ROUNDING * expected);
        if !agrees {
            let what = format!("filtered impulse (σ = {sigma})");
            return Err(wrong(&what, format!("{found:?}"), expected.to_string()));
        }
    }
    Ok(())
}

/// A picture of 2, 8, black and no number: the exposure makes 4, the middle of the logarithms of what is lit, 0.36.
fn exposed() -> Result<(), String> {
    let pixels = vec![[2.0; 3], [8.0; 3], [0.0; 3], [f32::NAN; 3]];
    let image = Image {
        width: 4,
        height: 1,
        pixels,
    };
    let exposure = automatic_exposure(&image);
    if (exposure - 0.09).abs() > 1e-6 {
        return Err(wrong("exposure", exposure.to_string(), "0.09".to_owned()));
    }
    Ok(())
}

fn wrong(what: &str, found: String, expected: String) -> String {
    format!(
        "the {what} of a known picture is {found}, and should be {expected}: this program shows wrong figures; build it \
         anew, and report what stays wrong"
    )
}

fn flat(value: f32) -> Image {
    Image {
        width: 2,
        height: 1,
        pixels: vec![[value; 3]; 2],
    }
}

fn cosine(column: u32) -> f64 {
    (TAU * f64::from(column) / f64::from(SIZE[0])).cos()
}

/// A wave of one cycle along the width, as bright as `size`, over grey.
fn wave(size: f64) -> Image {
    let [width, height] = SIZE;
    let pixel = |at: u32| [(2.0 + size * cosine(at % width)) as f32; 3];
    Image {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

/// Means of products with the neighbour to the right and below, over the variance.
fn along_both() -> f64 {
    let [width, height] = SIZE;
    let right: f64 = (1..width).map(|x| cosine(x - 1) * cosine(x)).sum();
    let below: f64 = (0..width).map(|x| cosine(x).powi(2)).sum();
    let products = f64::from(height) * right + f64::from(height - 1) * below;
    let count = height * (width - 1) + (height - 1) * width;
    products / f64::from(count) / 0.5
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn they_are_as_by_hand() {
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn an_image_of_other_sides_has_another_spectrum() {
        let turned = |image: Image| Image {
            width: image.height,
            height: image.width,
            ..image
        };
        let found = spectrum_of(&turned(wave(1.0)), &turned(wave(0.0))).expect("a spectrum");
        assert!(
            found.low_frequency.is_none_or(|power| power < 10.0),
            "{found:?}"
        );
    }
}
