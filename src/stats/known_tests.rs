//! Tests of fixed samples beyond those of [`super::known_figures`]: figures whose intervals are not symmetric, fronts, laws of
//! growth, and biases that show in places of little noise, or in those that replicates seldom reach.
//!
//! Values are those of NumPy 2 and SciPy 1.17.

use super::known_figures::Known;
use crate::bias::{BiasCheck, BiasOptions, BiasVerdict, check_bias};
use crate::comparison::{LogFigure, Place, places};
use crate::growth::{Model, growth};
use crate::interval::Interval;
use crate::signed_rank::SignedRank;
use crate::statistics::pareto_front;
use raystone_image::Image;

/// 3 in [2, 4] of ten degrees of freedom against 5 in [4, 8] of twenty: the side of each that lies towards the other counts.
pub(super) fn ratio() -> Vec<Known> {
    let of = |[value, low, high]: [f64; 3], freedom| {
        LogFigure::of_interval(Interval { value, low, high }, freedom)
    };
    let pair = of([3.0, 2.0, 4.0], 10.0).zip(of([5.0, 4.0, 8.0], 20.0));
    let found = pair.map(|(a, b)| a.compared_with(&b));
    vec![
        (
            "p of a ratio",
            found.map(|d| d.p),
            0.005_723_532_296_298_968,
        ),
        (
            "lower end of a ratio",
            found.map(|d| d.ratio.low),
            0.331_960_044_439_946_5,
        ),
        (
            "upper end of a ratio",
            found.map(|d| d.ratio.high),
            0.848_753_498_115_967_3,
        ),
    ]
}

/// Of three known exactly, two that trade one figure for the other are in front, and one that is worse in both is beaten.
pub(super) fn front() -> Vec<Known> {
    let points = [[1.0, 4.0], [2.0, 3.0], [2.5, 5.0]];
    let found = places(&points.map(|point| point.map(LogFigure::exact)));
    let expected = [Place::Front, Place::Front, Place::Beaten];
    let right = found.iter().zip(&expected).filter(|(a, b)| a == b).count();
    // The first of two at 1, the next, and an equal one.
    let line = pareto_front(&[
        (3.0, 2.0),
        (1.0, 4.0),
        (2.0, 3.0),
        (2.5, 3.0),
        (1.0, 5.0),
        (3.0, 2.0),
    ]);
    let is_line = line == [1, 2, 0, 5];
    vec![
        ("number of places on a front", Some(right as f64), 3.0),
        ("line of a front", Some(f64::from(u8::from(is_line))), 1.0),
    ]
}

/// Residuals of relative least squares, `numpy.linalg.lstsq`, of times that follow the other law.
pub(super) fn laws() -> Vec<Known> {
    let points = |time: &dyn Fn(f64) -> f64| -> Vec<(f64, f64)> {
        let sizes = (3..9).map(|k| f64::from(1 << k));
        sizes.map(|n| (n, 0.3 + 0.01 * time(n))).collect()
    };
    let (linear, other) = (points(&|n| n), points(&|n| n * n.log2()));
    let named = |points: &Vec<(f64, f64)>| growth(&vec![points.clone(); 7])?.better;
    let right = u8::from(named(&linear) == Some(Model::Linear))
        + u8::from(named(&other) == Some(Model::Linearithmic));
    vec![
        (
            "residual of n log n",
            Model::Linearithmic.residual(&linear),
            0.054_124_264_176_569_38,
        ),
        (
            "residual of n",
            Model::Linear.residual(&other),
            0.104_226_897_131_981_85,
        ),
        ("number of laws", Some(f64::from(right)), 2.0),
    ]
}

/// Of 61 differences, more than are counted one by one, each third is negative: ranks of 1261 and 630. By the normal law with half a rank taken
/// off, mean 61 · 62 / 4 and variance 61 · 62 · 123 / 24, that is erfc(315 / √19382.75 / √2).
pub(super) fn many() -> Vec<Known> {
    let differences: Vec<f64> = (1..=61)
        .map(|k: i32| f64::from(if k % 3 == 0 { -k } else { k }))
        .collect();
    let p = SignedRank::new(&differences).map(|test| test.p());
    vec![("p of many pairs", p, 0.023_661_941_657_942_25)]
}

const X: [f32; 8] = [2.5, 0.75, 4.125, 3.25, 9.25, 1.875, 5.75, 2.25];
const Y: [f32; 7] = [1.125, 0.375, 2.0, 1.625, 2.875, 0.75, 2.625];

fn checked(ours: Vec<Image>, theirs: Vec<Image>, tile: u32) -> Result<BiasCheck, String> {
    let options = BiasOptions {
        tile,
        rounding: 0.0,
        ..BiasOptions::default()
    };
    check_bias(&ours, &theirs, options).map_err(|e| e.to_string())
}

/// An image of grey columns, each four wide.
fn columns(values: &[f32], height: u32) -> Image {
    let row: Vec<[f32; 3]> = values.iter().flat_map(|v| [[*v; 3]; 4]).collect();
    Image {
        width: row.len() as u32,
        height,
        pixels: row.repeat(height as usize),
    }
}

const FEW: [f32; 3] = [1.125, 0.375, 2.0];

/// Two tiles alike, of which the reference has three parts, too few for weights: p of the image and of both tiles is that of
/// ttest_ind with 7 degrees of freedom, the chance that any of three tests gives so little 3 p, and a bias of 6.17 standard errors
/// is found in 90 % of all cases at a third of 0.01: nct.sf(t.isf(0.01 / 6, 7), 7, 6.1695) = 0.9.
pub(super) fn verdicts() -> Result<Vec<Known>, String> {
    let images = |values: &[f32], off: f32| -> Vec<Image> {
        let each = values.iter().map(|value| columns(&[value + off; 2], 4));
        each.collect()
    };
    let found = checked(images(&X, -1.25), images(&FEW, 0.0), 4)?;
    let tiles = found.p_histogram[2] as f64;
    // Tiles of much noise the other way round, which the whole image has not.
    let opposite = |values: &[f32], off: f32| -> Vec<Image> {
        let each = values.iter().enumerate().map(|(place, value)| {
            let noise = if place % 3 == 0 { 24.0 } else { -12.0 } * (1.0 + value / 16.0);
            columns(&[64.0 + off + value / 64.0 + noise, 64.0 + off - noise], 4)
        });
        each.collect()
    };
    let biased = checked(opposite(&X, 1.0 / 16.0), opposite(&FEW, 0.0), 4)?;
    let is_biased = biased.rejected.is_empty() && biased.verdict == BiasVerdict::Biased;
    Ok(vec![
        (
            "p of all tests of a bias",
            Some(found.p),
            3.0 * 0.260_325_340_418_422_26,
        ),
        ("tiles with a p from 0.2 to 0.3", Some(tiles), 2.0),
        ("bias that would be found", found.detectable, DETECTABLE),
        (
            "verdict on an image without biased tiles",
            Some(f64::from(u8::from(is_biased))),
            1.0,
        ),
    ])
}

/// 6.169536 times the standard error, over the mean of the reference.
const DETECTABLE: f64 = 6.169_535_487_668_701 * 1.063_251_076_737_070_4 / (3.5 / 3.0);

/// Two blocks, one with a twelfth of the other's noise, and weights of each half of the reference from the other; and a
/// tile where replicates show less noise than a quarter of what the reference and the other tiles foretell.
pub(super) fn biases() -> Result<Vec<Known>, String> {
    let blocks = |values: &[f32]| -> Vec<Image> {
        let pairs = values.iter().zip(values.iter().rev());
        pairs
            .map(|(quiet, noisy)| columns(&[4.0 + quiet / 4.0, 3.0 * noisy], 4))
            .collect()
    };
    let weighted = checked(blocks(&X), blocks(&Y), 4)?.weighted;
    let seldom = [0.0, 1.0, 0.0, 2.0, 1.0, 0.0, 1.0, 0.0].map(|k| 20.0 + k / 1024.0);
    let ours = X.iter().zip(seldom).map(|(x, s)| columns(&[*x, *x, s], 4));
    let theirs = Y.iter().map(|y| columns(&[*y; 3], 4)).collect();
    let least = checked(ours.collect(), theirs, 4)?.min_p;
    Ok(vec![
        (
            "t of a weighted bias",
            weighted.map(|test| test.t),
            3.014_681_940_562_911,
        ),
        (
            "p of a weighted bias",
            weighted.map(|test| test.p),
            0.019_532_484_288_195_425,
        ),
        (
            "p of a bias where replicates hardly differ",
            Some(least),
            1.857_083_668_541_279e-6,
        ),
    ])
}
