//! All metrics of fixed images that are large enough for each: windows of structural similarity, terms that are trimmed,
//! parts of a reference that are left out one at a time, pixels that replicates missed.
//!
//! Values are those of NumPy 2, from the formulas of `METRICS`; of ꟻLIP those of the authors' program.

use super::known_figures::Known;
use crate::adaptive::{Tiles, samples_needed};
use crate::flip::Seen;
use crate::heavy_tails::{PixelErrors, Tail, is_heavy};
use crate::interval::Interval;
use crate::log_figure::LogFigure;
use crate::metrics::{Reference, error_map, measure};
use raystone_image::Image;

const SIZE: [u32; 2] = [24, 16];
const PARTS: u32 = 4;

/// An image of values by place and channel.
fn image(value: impl Fn(u32, u32) -> f64) -> Image {
    let [width, height] = SIZE;
    let pixel = |i: u32| [0, 1, 2].map(|channel| value(i, channel) as f32);
    Image {
        width,
        height,
        pixels: (0..width * height).map(pixel).collect(),
    }
}

fn shown() -> Image {
    image(|i, c| f64::from((i * 37 + c * 11 + i * i % 13) % 64) / 32.0)
}

fn part(number: u32) -> Image {
    image(|i, c| {
        let whole = f64::from((i * 37 + c * 13) % 61) / 32.0 + 0.125;
        whole + (f64::from((i * 7 + number * 5 + c * 3) % 8) - 3.5) / 64.0
    })
}

/// Metrics, and their values without a part.
pub(super) fn metrics() -> Result<Vec<Known>, String> {
    let reference = Reference::from_parts((0..PARTS).map(part).collect());
    let reference = reference.map_err(|e| e.to_string())?;
    let report = measure(&shown(), &reference).map_err(|e| e.to_string())?;
    let metric = |id: &str| report.metrics.get(id).copied();
    let without = |id: &str, part: usize| report.without_part.get(id)?.get(part).copied();
    let (mse, relmse) = ("mse-unbiased/v1", "relmse-unbiased/eps=1e-2/v1");
    Ok(vec![
        (
            "relMSE of luminance",
            metric("relmse-luminance/eps=1e-2/v1"),
            0.483_737_525_056_405_1,
        ),
        (
            "trimmed relMSE",
            metric("relmse-trimmed/top=0.1%/eps=1e-2/v1"),
            2.729_475_444_916_342_3,
        ),
        (
            "MSE of green",
            metric("mse-green/v1"),
            0.637_458_801_269_531_2,
        ),
        (
            "MSE of blue",
            metric("mse-blue/v1"),
            0.643_773_396_809_895_9,
        ),
        (
            "unbiased MSE without a part",
            without(mse, 0),
            0.639_438_417_222_764_7,
        ),
        (
            "unbiased MSE without the last part",
            without(mse, 3),
            0.638_856_463_962_131,
        ),
        (
            "unbiased relMSE without a part",
            without(relmse, 1),
            2.896_004_252_655_185,
        ),
        (
            "unbiased relMSE without the third part",
            without(relmse, 2),
            2.924_284_607_264_125_3,
        ),
    ])
}

/// Metrics of pictures, whose exposure is a number of single precision.
pub(super) fn pictures() -> Result<Vec<Known>, String> {
    let reference = Reference::from_parts((0..PARTS).map(part).collect());
    let reference = reference.map_err(|e| e.to_string())?;
    let report = measure(&shown(), &reference).map_err(|e| e.to_string())?;
    let metric = |id: &str| report.metrics.get(id).copied();
    let [width, _] = SIZE;
    let ([x, y], share) = ([3_u32, 2], |level: f32| {
        [level; 3].map(|x| (255.0 * x) as u8)
    });
    let map = error_map(&shown(), &reference, 4.0, share).map_err(|e| e.to_string())?;
    let pixel = map.pixels.get((y * width + x) as usize);
    Ok(vec![
        (
            "PSNR of a picture",
            metric("psnr/tone-mapped/v1"),
            12.736_183_620_226_114,
        ),
        (
            "structural similarity",
            metric("ssim/tone-mapped/v1"),
            -0.067_094_154_828_574_75,
        ),
        (
            "place in a map of errors",
            pixel.map(|pixel| f64::from(pixel[0])),
            ERROR_AT_PLACE,
        ),
    ])
}

/// ⌊255 · √(mean over channels of (v − r)² / (r² + 0.01)) / 4⌋ at (3, 2).
const ERROR_AT_PLACE: f64 = 93.0;

/// Differences of ꟻLIP by the authors' program: white against black, green against blue, and an edge moved by a pixel.
pub(super) fn flip() -> Vec<Known> {
    const EDGE: usize = 32;
    let of = |value: &dyn Fn(usize) -> [f64; 3]| -> Seen {
        Seen::new(&(0..EDGE * EDGE).map(value).collect::<Vec<_>>(), EDGE)
    };
    let flat = |color: [f64; 3]| of(&|_| color);
    let step = |at: usize| of(&|i| [f64::from(u8::from(i % EDGE >= at)); 3]);
    let mean = |a: &Seen, b: &Seen| {
        let all = a.difference(b);
        Some(all.iter().sum::<f64>() / all.len() as f64)
    };
    vec![
        (
            "FLIP of black and white",
            mean(&flat([0.0; 3]), &flat([1.0; 3])),
            0.967_395_13,
        ),
        (
            "FLIP of green and blue",
            mean(&flat([0.0, 1.0, 0.0]), &flat([0.0, 0.0, 1.0])),
            1.0,
        ),
        (
            "FLIP of an edge",
            mean(&step(EDGE / 2), &step(EDGE / 2 + 1)),
            0.103_463_35,
        ),
    ]
}

/// What the parts of the reference foretell of two images at 4 spp, one of them a part itself, where a part has 16.
pub(super) fn tails() -> Result<Vec<Known>, String> {
    let reference = Reference::from_parts((0..PARTS).map(part).collect());
    let reference = reference.map_err(|e| e.to_string())?;
    let mut errors = PixelErrors::new(&reference);
    for image in [shown(), part(0)] {
        let added = errors.add(&image, &reference);
        added.map_err(|e| e.to_string())?;
    }
    let tail = errors.tail(4, 16);
    let heavy = |greatest_share: f64, missed: f64| {
        let tail = Tail {
            greatest_share,
            missed,
        };
        let relmse = Interval {
            value: 2.0,
            low: 1.0,
            high: 3.0,
        };
        f64::from(u8::from(is_heavy(tail, relmse)))
    };
    // By the share alone, by what was missed alone, by neither.
    let verdicts = 4.0 * heavy(0.04, 0.0) + 2.0 * heavy(0.01, 0.6) + heavy(0.03, 0.4);
    Ok(vec![
        (
            "greatest share of a pixel",
            tail.map(|tail| tail.greatest_share),
            0.015_473_651_247_938_496,
        ),
        (
            "share that replicates missed",
            tail.map(|tail| tail.missed),
            0.000_192_762_579_799_049_07,
        ),
        ("verdicts on tails", Some(verdicts), 6.0),
    ])
}

/// Tiles of 8² pixels of an image of 20 × 12, and the samples that one needs.
pub(super) fn tiles() -> Vec<Known> {
    let tiles = Tiles {
        size: [20, 12],
        edge: 8,
    };
    let last = tiles.pixels(5);
    let own = (0..tiles.len()).map(|tile| {
        let all = tiles.pixels(tile).into_iter();
        all.filter(|pixel| tiles.of_pixel(*pixel) == tile).count()
    });
    // A jackknife of ln 0.04 with an error of √(3/4 · 0.025): with 3 degrees of freedom the upper end of 95 % is 0.0552.
    let around = [-0.1, -0.05, 0.05, 0.1].map(|off| 0.04_f64.ln() + off);
    let error = LogFigure::new(0.04_f64.ln(), &[around.to_vec()], Vec::new());
    let needed = |target: f64, confidence: f64| {
        let counts = [4, 8, 16, 32];
        Some(f64::from(samples_needed(
            error.as_ref(),
            &counts,
            target,
            confidence,
        )))
    };
    vec![
        (
            "tile of a pixel",
            Some(tiles.of_pixel(9 * 20 + 17) as f64),
            5.0,
        ),
        ("pixels of the last tile", Some(last.len() as f64), 16.0),
        (
            "first pixel of the last tile",
            last.first().map(|p| *p as f64),
            176.0,
        ),
        (
            "pixels in their own tiles",
            Some(own.sum::<usize>() as f64),
            240.0,
        ),
        ("samples that a tile needs", needed(0.0145, 0.95), 16.0),
        ("samples with less certainty", needed(0.022, 0.5), 8.0),
        ("samples with more certainty", needed(0.022, 0.95), 16.0),
        ("samples beyond all", needed(0.001, 0.95), 32.0),
    ]
}
