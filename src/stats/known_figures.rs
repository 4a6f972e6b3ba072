//! Figures of fixed samples, computed anew and compared with what other programs say, at the start of
//! whatever shows figures: a build that divides by n where it should by n − 1 ends before it misleads.
//!
//! The constants are those of NumPy 2 and SciPy 1.17 (`scipy.stats`, and for jackknives, slopes, trimmed
//! means and images the formulas in NumPy), printed with all digits; the calls stand beside them.

use super::{known_metrics, known_tests};
use crate::bias::{BiasOptions, check_bias};
use crate::comparison::Pairs;
use crate::hypothesis::{
    benjamini_hochberg, capped_t_test, holm, student_t_quantile, student_t_two_sided, t_test_power,
};
use crate::interval::{Interval, Spread};
use crate::log_figure::LogFigure;
use crate::metrics::{Reference, measure};
use crate::rates::{millions_per_second, without_overhead};
use crate::signed_rank::SignedRank;
use crate::statistics::{
    kendall_tau, log_log_slope, mean, mean_interval, median, median_interval, root_mean_interval,
    variance,
};
use raystone_image::{Image, tone_map};

/// A figure's name, what was computed, and what it should be.
pub(super) type Known = (&'static str, Option<f64>, f64);

/// Relative error that is rounding.
const ROUNDING: f64 = 1e-12;
/// Relative error of special functions, and of the integral behind the power of a test.
const OF_FUNCTIONS: f64 = 1e-10;
const OF_POWER: f64 = 1e-3;
/// That of pixels in single precision, and of programs that compute with it.
const OF_PIXELS: f64 = 1e-6;
const OF_SINGLE: f64 = 3e-4;

const X: [f64; 8] = [2.5, 0.7, 4.1, 3.3, 9.2, 1.9, 5.8, 2.2];
const Y: [f64; 7] = [1.1, 0.4, 2.0, 1.6, 2.9, 0.8, 2.6];
const Z: [f64; 10] = [3.1, 0.2, 5.5, 4.4, 1.3, 9.9, 7.2, 2.6, 6.1, 8.8];

/// Computes all figures anew.
///
/// # Errors
/// One is not what it should be: which, and both values.
pub fn check() -> Result<(), String> {
    let groups = [
        (ROUNDING, samples()),
        (ROUNDING, rates()),
        (ROUNDING, ranks()),
        (ROUNDING, winners()),
        (OF_FUNCTIONS, student()),
        (OF_FUNCTIONS, intervals()),
        (OF_POWER, vec![power()]),
        (ROUNDING, images()?),
        (OF_FUNCTIONS, bias()?),
        (OF_FUNCTIONS, known_tests::ratio()),
        (ROUNDING, known_tests::front()),
        (OF_FUNCTIONS, known_tests::laws()),
        (OF_FUNCTIONS, known_tests::many()),
        (OF_PIXELS, known_tests::biases()?),
        (OF_POWER, known_tests::verdicts()?),
        (ROUNDING, known_metrics::metrics()?),
        (OF_PIXELS, known_metrics::pictures()?),
        (OF_SINGLE, known_metrics::flip()),
        (OF_FUNCTIONS, known_metrics::tails()?),
        (ROUNDING, known_metrics::tiles()),
    ];
    groups
        .into_iter()
        .try_for_each(|(tolerance, known)| agree(&known, tolerance))
}

/// The first figure that differs by more than a relative tolerance.
fn agree(known: &[Known], tolerance: f64) -> Result<(), String> {
    for (name, found, expected) in known {
        let found = found.unwrap_or(f64::NAN);
        let differs = (found - expected).abs() > tolerance * expected.abs();
        if differs || found.is_nan() {
            return Err(format!(
                "the {name} of a known sample is {found}, and should be {expected}: this program computes \
                 wrong figures; build it anew, and report what stays wrong"
            ));
        }
    }
    Ok(())
}

/// numpy.polyfit(log(N), log(C.mean(axis=0)), 1)[0], and its jackknife over curves.
fn slope() -> Option<Interval> {
    let curves = [
        [1.0, 0.45, 0.27, 0.11],
        [0.8, 0.5, 0.2, 0.13],
        [1.2, 0.55, 0.26, 0.1],
    ];
    log_log_slope(&curves.map(|y| [1.0, 4.0, 16.0, 64.0].into_iter().zip(y).collect()))
}

fn samples() -> Vec<Known> {
    let slope = slope().map(|slope| slope.value);
    vec![
        ("mean", mean(&X), 3.7125),
        ("median", median(&X), 2.9),
        ("median of an odd number", median(&Y), 1.6),
        // X.var(ddof=1)
        ("variance", variance(&X), 7.272_678_571_428_57),
        ("slope on logarithms", slope, -0.523_153_083_967_624_5),
    ]
}

/// By hand: 60,000 rays in 2, 1 and 4 ms, and 2 ms of which half a one is an empty dispatch.
fn rates() -> Vec<Known> {
    let rate = millions_per_second(&[2.0, 1.0, 4.0], 6e4).map(|rate| rate.value);
    let rest = without_overhead(&[2.0], 0.5).first().copied();
    vec![("rate", rate, 30.0), ("time above an empty one", rest, 1.5)]
}

/// The same rounds of three, of which the first two have Yuen's t = −1.004 with five degrees of freedom, p = 0.36; and the last
/// is a fifth slower.
fn winners() -> Vec<Known> {
    let rounds = [
        [5.1, 4.9, 5.3, 5.0, 7.7, 5.2, 4.8, 5.05, 5.15, 4.95],
        [5.2, 4.85, 5.5, 5.1, 7.6, 5.15, 4.95, 5.0, 5.3, 5.0],
        [6.1, 5.9, 6.5, 6.2, 6.05, 9.3, 5.8, 6.15, 6.3, 5.95],
    ];
    let figures = rounds.map(|times| LogFigure::of_rounds("rounds", &times));
    let figures: Vec<&LogFigure> = figures.iter().flatten().collect();
    let pairs = Pairs::of(&figures);
    let is = |is: bool| Some(f64::from(u8::from(is)));
    vec![
        (
            "number of the least",
            pairs.least().map(|i| i as f64 + 1.0),
            1.0,
        ),
        (
            "difference of two that are alike",
            is(!pairs.differ(0, 1)),
            1.0,
        ),
        (
            "difference of two that are not",
            is(pairs.differ(0, 2)),
            1.0,
        ),
    ]
}

fn ranks() -> Vec<Known> {
    let pairs = [
        [1.0, 2.0],
        [2.0, 1.0],
        [3.0, 4.0],
        [4.0, 3.0],
        [4.0, 6.0],
        [6.0, 6.0],
    ];
    // max over ranks of min(1, (m − rank) p)
    let holm = holm(&[0.01, 0.04, 0.03, 0.005, 0.2]);
    // false_discovery_control(p) <= 0.05
    let chosen = |p: &[f64]| {
        let rejected = benjamini_hochberg(p, 0.05).into_iter().enumerate();
        Some(rejected.map(|(i, is)| f64::from(u8::from(is) << i)).sum())
    };
    let rejected = chosen(&[0.01, 0.04, 0.03, 0.005, 0.2]);
    // The second is above its own bound, 0.02, and the fourth below 0.04.
    let stepped = chosen(&[0.035, 0.9, 0.001, 0.028, 0.025]);
    let differences = [0.1, 0.4, -0.2, 0.5, 0.3, 0.6, 0.25, -0.05, 0.31, 0.44];
    let wilcoxon = SignedRank::new(&differences);
    let end = |k: usize| wilcoxon.as_ref().map(|test| test.interval(0.05)[k]);
    vec![
        // kendalltau(x, y).statistic
        (
            "rank correlation",
            kendall_tau(&pairs),
            0.642_857_142_857_142_8,
        ),
        ("p after Holm's correction", holm.first().copied(), 0.04),
        (
            "second p after Holm's correction",
            holm.get(1).copied(),
            0.09,
        ),
        (
            "least p after Holm's correction",
            holm.get(3).copied(),
            0.025,
        ),
        ("choice by Benjamini and Hochberg", rejected, 15.0),
        ("choice from the greatest p down", stepped, 29.0),
        // wilcoxon(d, method="exact").pvalue; median and order statistics of Walsh averages
        (
            "p by Wilcoxon's test",
            wilcoxon.as_ref().map(SignedRank::p),
            0.013_671_875,
        ),
        (
            "estimate by Wilcoxon's test",
            wilcoxon.as_ref().map(SignedRank::estimate),
            0.28,
        ),
        ("lower end by Wilcoxon's test", end(0), 0.1),
        ("upper end by Wilcoxon's test", end(1), 0.45),
    ]
}

fn student() -> Vec<Known> {
    // ttest_ind(X, Y, equal_var=False); p with the 7 degrees of freedom of X in place of 8.84
    let welch = capped_t_test(&X, &Y, 0.0);
    let shifted = capped_t_test(&X, &Y, 3.0);
    let times = [5.1, 4.9, 5.3, 5.0, 7.7, 5.2, 4.8, 5.05, 5.15, 4.95];
    let others = [6.1, 5.9, 6.5, 6.2, 6.05, 9.3, 5.8, 6.15, 6.3, 5.95];
    let [times, others] = [&times, &others].map(|times| LogFigure::of_rounds("rounds", times));
    let seven = LogFigure::of_rounds("rounds", &Y);
    let of_seven = seven.as_ref().map(LogFigure::interval);
    let spread = |variance, freedom| Spread { variance, freedom };
    let compared = times
        .as_ref()
        .zip(others.as_ref())
        .map(|(a, b)| a.compared_with(b));
    vec![
        // 2 t.sf(|t|, n) and t.isf(p / 2, n)
        (
            "p of Student's t",
            Some(student_t_two_sided(2.5, 7.0)),
            0.040_992_218_585_752_89,
        ),
        (
            "p of a small t",
            Some(student_t_two_sided(0.3, 4.5)),
            0.777_533_547_039_431_3,
        ),
        (
            "p of a large t",
            Some(student_t_two_sided(-6.0, 30.0)),
            1.394_276_876_720_476_4e-6,
        ),
        (
            "quantile of Student's t",
            Some(student_t_quantile(0.05, 7.0)),
            2.364_624_251_592_784_4,
        ),
        (
            "far quantile of Student's t",
            Some(student_t_quantile(0.001, 3.0)),
            12.923_978_636_687_481,
        ),
        (
            "quantile of Cauchy's distribution",
            Some(student_t_quantile(0.05, 1.0)),
            12.706_204_736_174_7,
        ),
        (
            "t of Welch's test",
            welch.map(|w| w.t),
            2.051_084_868_224_813,
        ),
        (
            "standard error of Welch's test",
            welch.map(|w| w.standard_error),
            1.016_012_844_574_386_1,
        ),
        (
            "degrees of freedom of Welch's test",
            welch.map(|w| w.degrees_of_freedom),
            7.0,
        ),
        ("p of Welch's test", welch.map(|w| w.p), 0.07940314706529426),
        (
            "p of Welch's test within a margin",
            shifted.map(|w| w.p),
            1.0,
        ),
        // exp(trim_mean(log(t), 0.2)), and Yuen's test of the differences of logarithms
        (
            "trimmed mean of times",
            times.map(|t| t.log.exp()),
            5.074_281_483_925_959,
        ),
        (
            "p of Yuen's test",
            compared.map(|c| c.p),
            2.257_597_732_265_080_7e-7,
        ),
        // Of seven a fifth is one, not two.
        (
            "trimmed mean of seven times",
            of_seven.map(|i| i.value),
            1.489_090_865_963_998_3,
        ),
        (
            "lower end of a trimmed mean",
            of_seven.map(|i| i.low),
            0.682_921_446_909_095_1,
        ),
        (
            "upper end of a trimmed mean",
            of_seven.map(|i| i.high),
            3.246_920_443_241_800_4,
        ),
        (
            "upper end at 1 % of a trimmed mean",
            seven.map(|seven| seven.upper(0.01)),
            5.424_118_376_660_227,
        ),
        (
            "freedom of a difference",
            Some(Spread::of_difference(spread(2.0, 4.0), spread(3.0, 9.0)).freedom),
            4.0,
        ),
    ]
}

/// nct.sf(t.isf(0.025, 7), 7, 3)
fn power() -> Known {
    let power = t_test_power(3.0, 0.05, 7.0);
    ("power of a t-test", Some(power), 0.730_628_288_626_270_8)
}

fn intervals() -> Vec<Known> {
    let of_mean = mean_interval(&X);
    let of_root = root_mean_interval(&X);
    let of_median = median_interval(&Z);
    let of_slope = slope();
    vec![
        // mean ± t.isf(0.025, 7) s / √8
        (
            "lower end of a mean",
            of_mean.map(|i| i.low),
            1.457_926_787_315_575_5,
        ),
        (
            "upper end of a mean",
            of_mean.map(|i| i.high),
            5.967_073_212_684_426,
        ),
        // √ mean · exp(± t.isf(0.025, 7) √((n − 1)/n Σ (log rᵢ − mean)²)), rᵢ without value i
        (
            "root mean",
            of_root.map(|i| i.value),
            1.926_784_886_799_769_4,
        ),
        (
            "lower end of a root mean",
            of_root.map(|i| i.low),
            1.394_694_198_515_876_5,
        ),
        (
            "upper end of a root mean",
            of_root.map(|i| i.high),
            2.661_873_838_684_737_4,
        ),
        // Hettmansperger and Sheather with binom.cdf
        (
            "lower end of a median",
            of_median.map(|i| i.low),
            2.154_954_954_954_955_6,
        ),
        (
            "upper end of a median",
            of_median.map(|i| i.high),
            7.747_747_747_747_748,
        ),
        (
            "lower end of a slope",
            of_slope.map(|i| i.low),
            -0.691_711_184_448_427,
        ),
        (
            "upper end of a slope",
            of_slope.map(|i| i.high),
            -0.354_594_983_486_821_95,
        ),
    ]
}

/// ttest_ind(A + 4, B, equal_var=False) of two tiles, A and A + 8, against B in both; p with 7 degrees of freedom. A and B are
/// X and Y in eighths, so that pixels hold them.
fn bias() -> Result<Vec<Known>, String> {
    let eighths = |values: &[f64]| -> Vec<f32> {
        let round = |x: &f64| ((x * 8.0).round() / 8.0) as f32;
        values.iter().map(round).collect()
    };
    let image = |left: f32, right: f32| Image {
        width: 4,
        height: 2,
        pixels: [[left; 3], [left; 3], [right; 3], [right; 3]].repeat(2),
    };
    let ours: Vec<Image> = (eighths(&X).into_iter())
        .map(|value| image(value, value + 8.0))
        .collect();
    let theirs: Vec<Image> = (eighths(&Y).into_iter())
        .map(|value| image(value, value))
        .collect();
    let options = BiasOptions {
        tile: 2,
        rounding: 0.0,
        ..BiasOptions::default()
    };
    let found = check_bias(&ours, &theirs, options).map_err(|e| e.to_string())?;
    let whole = found.whole;
    let place = (found.rejected.first()).map(|[x, y]| f64::from(10 * x + y));
    Ok(vec![
        ("t of a bias", whole.map(|w| w.t), 5.987_629_235_071_879),
        (
            "standard error of a bias",
            whole.map(|w| w.standard_error),
            1.017_723_336_025_305_3,
        ),
        ("p of a bias", whole.map(|w| w.p), 5.489_943_013_088_752e-4),
        (
            "least p of a tile",
            Some(found.min_p),
            2.258_743_895_435_726e-5,
        ),
        ("number of tiles", Some(found.tiles as f64), 2.0),
        ("place of a biased tile", place, 20.0),
    ])
}

/// Metrics of an image of four pixels whose values are short binary fractions.
fn images() -> Result<Vec<Known>, String> {
    let image = |pixels: [[f32; 3]; 4]| Image {
        width: 2,
        height: 2,
        pixels: pixels.to_vec(),
    };
    let shown = image([
        [0.5, 0.25, 0.125],
        [2.0, 1.0, 0.5],
        [0.0, 0.75, 0.25],
        [1.5, 3.0, 0.0625],
    ]);
    let halves = [
        image([
            [0.4375, 0.25, 0.25],
            [1.75, 1.25, 0.5],
            [0.125, 0.5, 0.25],
            [1.5, 2.5, 0.125],
        ]),
        image([
            [0.5625, 0.375, 0.125],
            [2.25, 1.0, 0.75],
            [0.125, 0.75, 0.5],
            [1.25, 3.0, 0.25],
        ]),
    ];
    let reference = Reference::from_parts(halves.to_vec()).map_err(|e| e.to_string())?;
    let report = measure(&shown, &reference).map_err(|e| e.to_string())?;
    let metric = |id: &str| report.metrics.get(id).copied();
    // The curve of `displayed`, in Python.
    let seen = tone_map(&shown, 1.0);
    let seen = |channel: usize| seen.pixels.get(1).map(|pixel| f64::from(pixel[channel]));
    Ok(vec![
        ("red of a picture", seen(0), 253.0),
        ("green of a picture", seen(1), 186.0),
        ("blue of a picture", seen(2), 136.0),
        (
            "mean squared error",
            metric("mse/v1"),
            0.014_973_958_333_333_334,
        ),
        (
            "root mean squared error",
            metric("rmse/v1"),
            0.122_368_126_296_570_11,
        ),
        (
            "mean absolute error",
            metric("mae/v1"),
            0.104_166_666_666_666_67,
        ),
        (
            "relMSE",
            metric("relmse/eps=1e-2/v1"),
            0.107_418_958_824_144_94,
        ),
        (
            "unbiased MSE",
            metric("mse-unbiased/v1"),
            -0.003_255_208_333_333_333_5,
        ),
        (
            "unbiased relMSE",
            metric("relmse-unbiased/eps=1e-2/v1"),
            0.069_888_466_260_081_24,
        ),
        ("MSE of red", metric("mse-red/v1"), 0.007_812_5),
        (
            "MSE of luminance",
            metric("mse-luminance/v1"),
            0.013_388_733_401_895_492,
        ),
        (
            "SMAPE",
            metric("smape/eps=1e-2/v1"),
            0.187_681_459_610_668_43,
        ),
        (
            "PSNR",
            metric("psnr/tone-mapped/v1"),
            21.747_975_722_407_944,
        ),
        // mean (A − B)² / 4
        (
            "MSE of a reference",
            reference.own_mse(),
            0.018_229_166_666_666_668,
        ),
        (
            "relMSE of a reference",
            reference.own_relmse(),
            0.037_530_492_564_063_71,
        ),
    ])
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn all_figures_are_those_of_other_programs() {
        assert_eq!(check(), Ok(()));
    }

    #[test]
    fn a_figure_that_is_off_is_named() {
        let groups = [
            samples(),
            rates(),
            ranks(),
            winners(),
            student(),
            intervals(),
            images().unwrap(),
            known_tests::ratio(),
            known_tests::laws(),
            known_tests::biases().unwrap(),
            known_metrics::metrics().unwrap(),
            known_metrics::tails().unwrap(),
        ];
        assert!(groups.iter().flatten().count() > 40);
        for (name, found, expected) in groups.into_iter().flatten() {
            for wrong in [found.map(|x| x * (1.0 + 1e-8)), Some(f64::NAN), None] {
                let fault = agree(&[(name, wrong, expected)], OF_FUNCTIONS).unwrap_err();
                assert!(fault.contains(name), "{fault}");
            }
        }
    }
}
