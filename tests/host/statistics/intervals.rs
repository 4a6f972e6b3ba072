//! Location, spread, intervals, slopes and Pareto fronts.

use raystone::measure::record::Interval;
use raystone::measure::statistics::*;
use raystone::random::Pcg32;

fn mean_of(samples: &[f64]) -> f64 {
    samples.iter().sum::<f64>() / samples.len() as f64
}

#[test]
fn median_mean_and_spread_of_known_samples() {
    assert_eq!(median(&[3.0, 1.0, 2.0]), Some(2.0));
    assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), Some(2.5));
    assert_eq!(mean(&[1.0, 2.0, 6.0]), Some(3.0));
    assert_eq!(variance(&[1.0, 2.0, 6.0]), Some(7.0));
}

#[test]
fn samples_that_are_empty_or_not_finite_have_no_statistics() {
    for bad in [&[][..], &[1.0, f64::NAN], &[f64::INFINITY, 2.0]] {
        assert_eq!(mean(bad), None);
        assert_eq!(median(bad), None);
        assert_eq!(variance(bad), None);
        assert_eq!(median_interval(bad), None);
        assert_eq!(mean_interval(bad), None);
    }
    assert_eq!(variance(&[1.0]), None);
}

/// Approximately normal, mean 0, variance 1.
fn normal(generator: &mut Pcg32) -> f64 {
    (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0
}

/// Share of 2,000 trials whose interval contains `truth`.
fn coverage(truth: f64, mut trial: impl FnMut(&mut Pcg32) -> Interval) -> f64 {
    let mut generator = Pcg32::new(11);
    let covers = |i: Interval| i.low <= truth && truth <= i.high;
    let covered = (0..2000).filter(|_| covers(trial(&mut generator))).count();
    covered as f64 / 2000.0
}

#[track_caller]
fn assert_95(share: f64) {
    assert!((0.93..=0.97).contains(&share), "{share} of the intervals");
}

#[test]
fn the_interval_of_a_mean_is_students() {
    let interval = mean_interval(&[1.0, 2.0, 6.0]).unwrap();
    // t of 2 degrees of freedom at 97.5 % is 4.302653; variance 7.
    let half = 4.302652729911275 * (7.0f64 / 3.0).sqrt();
    assert_eq!(interval.value, 3.0);
    assert!((interval.high - 3.0 - half).abs() < 1e-9, "{interval:?}");
    assert!((3.0 - interval.low - half).abs() < 1e-9, "{interval:?}");
    let single = mean_interval(&[4.0]).unwrap();
    assert_eq!((single.low, single.value, single.high), (4.0, 4.0, 4.0));
}

#[test]
fn intervals_of_means_cover_the_truth_as_often_as_promised() {
    for n in [2, 4, 8, 30] {
        assert_95(coverage(5.0, |g| {
            let samples: Vec<f64> = (0..n).map(|_| 5.0 + normal(g)).collect();
            mean_interval(&samples).unwrap()
        }));
    }
}

#[test]
fn intervals_of_medians_cover_the_truth_as_often_as_promised() {
    // Times have a one-sided tail: ln 2 is the median of −ln u.
    for n in [6, 7, 9, 12, 31] {
        assert_95(coverage(2.0f64.ln(), |g| {
            let samples: Vec<f64> = (0..n).map(|_| -(1.0 - g.uniform()).ln()).collect();
            median_interval(&samples).unwrap()
        }));
    }
    let few = median_interval(&[4.0, 1.0, 2.0]).unwrap();
    assert_eq!((few.low, few.value, few.high), (1.0, 2.0, 4.0));
    let same = median_interval(&[3.0; 9]).unwrap();
    assert_eq!((same.low, same.value, same.high), (3.0, 3.0, 3.0));
}

#[test]
fn intervals_of_slopes_cover_the_truth_as_often_as_promised() {
    assert_95(coverage(-1.0, |g| {
        let curve = |_| -> Vec<(f64, f64)> {
            let y = |x: f64, noise: f64| (x, (1.0 + 0.1 * noise) / x);
            (0..5).map(|k| y(2f64.powi(k), normal(g))).collect()
        };
        let curves: Vec<_> = (0..8).map(curve).collect();
        log_log_slope(&curves).unwrap()
    }));
}

#[test]
fn noise_of_two_sources_adds_up() {
    // A mean of eight, minus a noisier mean of four.
    assert_95(coverage(0.0, |g| {
        let a: Vec<f64> = (0..8).map(|_| normal(g)).collect();
        let b: Vec<f64> = (0..4).map(|_| 2.0 * normal(g)).collect();
        let value = mean_of(&a) - mean_of(&b);
        let without_a = leave_one_out(&a).map(|rest| mean_of(&rest) - mean_of(&b));
        let without_b = leave_one_out(&b).map(|rest| mean_of(&a) - mean_of(&rest));
        jackknife_interval(value, &[without_a.collect(), without_b.collect()]).unwrap()
    }));
    let exact = jackknife_interval(2.0, &[vec![], vec![2.0, 2.0]]).unwrap();
    assert_eq!((exact.low, exact.value, exact.high), (2.0, 2.0, 2.0));
    assert_eq!(jackknife_interval(2.0, &[vec![1.0, f64::NAN]]), None);
}

#[test]
fn a_root_of_a_mean_of_squares_has_an_interval_that_is_not_negative() {
    let interval = root_mean_interval(&[0.0, 0.0, 4.0, 0.0]).unwrap();
    assert_eq!((interval.low, interval.value), (0.0, 1.0));
    assert_95(coverage(1.0, |g| {
        let squares: Vec<f64> = (0..8).map(|_| normal(g).powi(2)).collect();
        root_mean_interval(&squares).unwrap()
    }));
}

/// Errors of replicates, each with mean 1.
#[derive(Debug, Clone, Copy)]
enum Errors {
    /// χ² over its degrees of freedom: mean squares of this many independent pixels.
    ChiSquared(u32),
    /// Log-normal with this standard deviation of the logarithm.
    LogNormal(f64),
    /// Uniform ones, one in ten with a firefly of nine times the rest.
    Fireflies,
}

impl Errors {
    fn draw(self, generator: &mut Pcg32) -> f64 {
        match self {
            Self::ChiSquared(n) => {
                (0..n).map(|_| normal(generator).powi(2)).sum::<f64>() / f64::from(n)
            }
            Self::LogNormal(sigma) => (sigma * normal(generator) - 0.5 * sigma * sigma).exp(),
            Self::Fireflies => {
                if generator.uniform() < 0.1 {
                    5.0
                } else {
                    5.0 / 9.0 + 0.01 * normal(generator)
                }
            }
        }
    }

    fn sample(self, count: usize, generator: &mut Pcg32) -> Vec<f64> {
        (0..count).map(|_| self.draw(generator)).collect()
    }
}

fn estimates(samples: &[f64], estimator: impl Fn(&[f64]) -> f64) -> Vec<f64> {
    leave_one_out(samples)
        .map(|rest| estimator(&rest))
        .collect()
}

fn of_mean(errors: &[f64]) -> Interval {
    positive_interval(mean_of(errors), &[estimates(errors, mean_of)]).unwrap()
}

#[test]
fn intervals_of_skewed_errors_cover_the_truth_at_four_replicates_and_more() {
    for errors in [
        Errors::ChiSquared(8),
        Errors::ChiSquared(2),
        Errors::LogNormal(0.3),
        Errors::LogNormal(0.5),
    ] {
        for n in [4, 8, 16] {
            let covered = coverage(1.0, |g| of_mean(&errors.sample(n, g)));
            println!("mean of {n} of {errors:?}: {covered}");
            assert_95(covered);
        }
    }
    // Negative controls: Student's interval, and one narrowed by a quarter.
    let skewed = Errors::ChiSquared(2);
    let students = coverage(1.0, |g| mean_interval(&skewed.sample(8, g)).unwrap());
    assert!(students < 0.92, "{students}");
    let narrowed = coverage(1.0, |g| {
        let interval = of_mean(&skewed.sample(8, g));
        let toward = |end: f64| interval.value * (end / interval.value).powf(0.75);
        Interval {
            low: toward(interval.low),
            high: toward(interval.high),
            ..interval
        }
    });
    assert!(narrowed < 0.93, "{narrowed}");
}

#[test]
fn what_few_replicates_do_not_show_no_interval_covers() {
    // As documented in the module: here an interval cannot keep its promise.
    let [few, many] = [4, 64].map(|n| coverage(1.0, |g| of_mean(&Errors::Fireflies.sample(n, g))));
    assert!(few < 0.6, "{few}");
    assert!(many > 0.9, "{many}");
}

#[test]
fn intervals_of_roots_ratios_and_slopes_of_skewed_errors_cover_the_truth() {
    let errors = Errors::ChiSquared(4);
    for n in [4, 8, 16] {
        let root = coverage(1.0, |g| {
            let squares: Vec<f64> = errors.sample(n, g);
            root_mean_interval(&squares).unwrap()
        });
        // Error per second: mean error times mean time, over those of another.
        let ratio = coverage(0.5, |g| {
            let (a, b) = (errors.sample(n, g), errors.sample(n, g));
            let times = Errors::LogNormal(0.1).sample(7, g);
            let value =
                |a: &[f64], b: &[f64], t: &[f64]| mean_of(a) / mean_of(b) * 0.5 * mean_of(t);
            let sources = [
                estimates(&a, |rest| value(rest, &b, &times)),
                estimates(&b, |rest| value(&a, rest, &times)),
                estimates(&times, |rest| value(&a, &b, rest)),
            ];
            positive_interval(value(&a, &b, &times), &sources).unwrap()
        });
        let slope = coverage(-1.0, |g| {
            let at = |x: f64, g: &mut Pcg32| (x, errors.draw(g) / x);
            let curve = |g: &mut Pcg32| (0..6).map(|k| at(2f64.powi(k), g)).collect();
            let curves: Vec<Vec<(f64, f64)>> = (0..n).map(|_| curve(g)).collect();
            log_log_slope(&curves).unwrap()
        });
        println!("of {n}: root {root}, ratio {ratio}, slope {slope}");
        for covered in [root, ratio, slope] {
            assert!(
                (0.93..=0.975).contains(&covered),
                "{n}: {root} {ratio} {slope}"
            );
        }
    }
}

#[test]
fn intervals_of_positive_figures_hold_ratios_and_fall_back_where_there_is_no_logarithm() {
    let interval = positive_interval(2.0, &[vec![1.0, 4.0]]).unwrap();
    assert!(
        (interval.low * interval.high - 4.0).abs() < 1e-9,
        "{interval:?}"
    );
    let plain = positive_interval(0.5, &[vec![-1.0, 2.0]]);
    assert_eq!(plain, jackknife_interval(0.5, &[vec![-1.0, 2.0]]));
    assert_eq!(positive_interval(2.0, &[]), Some(Interval::exact(2.0)));
    assert_eq!(positive_interval(f64::NAN, &[]), None);
}

#[test]
fn the_slope_of_a_power_law_is_its_exponent() {
    let curve = |factor: f64| -> Vec<(f64, f64)> {
        (0..6)
            .map(|k| 2f64.powi(k))
            .map(|x| (x, factor * x.powf(-0.75)))
            .collect()
    };
    let slope = log_log_slope(&[curve(1.0), curve(2.0), curve(5.0)]).unwrap();
    assert!((slope.value + 0.75).abs() < 1e-12);
    assert!(slope.high - slope.low < 1e-12);
    let mut bent = curve(1.0);
    bent[5].1 *= 3.0;
    let slope = log_log_slope(&[curve(1.0), bent]).unwrap();
    assert!(
        slope.value > -0.74 && slope.high - slope.low > 0.05,
        "{slope:?}"
    );
}

#[test]
fn points_that_have_no_logarithm_are_left_out_of_a_slope() {
    let curve = vec![
        (1.0, 1.0),
        (2.0, 0.0),
        (4.0, 0.25),
        (8.0, f64::NAN),
        (16.0, 0.0625),
        (0.0, 3.0),
    ];
    let slope = log_log_slope(std::slice::from_ref(&curve)).unwrap();
    assert!((slope.value + 1.0).abs() < 1e-12);
    let line_through_two = curve[..4].to_vec();
    assert_eq!(log_log_slope(&[line_through_two]), None);
    assert_eq!(log_log_slope(&[]), None);
    assert_eq!(log_log_slope(&[vec![(2.0, 1.0), (2.0, 3.0)]]), None);
}

#[test]
fn the_pareto_front_has_only_points_that_nothing_beats() {
    let points = [
        (3.0, 1.0),
        (1.0, 3.0),
        (2.0, 2.0),
        (2.0, 3.0), // beaten by (2, 2)
        (3.0, 1.0), // equal to the first: kept
        (4.0, 1.0), // beaten by (3, 1)
        (0.5, f64::NAN),
    ];
    assert_eq!(pareto_front(&points), [1, 2, 0, 4]);
    assert!(pareto_front(&[]).is_empty());
}

#[test]
fn the_rank_correlation_sees_order_alone_and_knows_ties() {
    let tau = |pairs: &[[f64; 2]]| kendall_tau(pairs);
    assert_eq!(tau(&[[1.0, 1.0], [2.0, 10.0], [3.0, 1e9]]), Some(1.0));
    assert_eq!(tau(&[[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]), Some(-1.0));
    // Of six pairs five agree and one does not: (5 − 1) / 6.
    let one_wrong = tau(&[[1.0, 1.0], [2.0, 2.0], [3.0, 4.0], [4.0, 3.0]]);
    assert_eq!(one_wrong, Some(4.0 / 6.0));
    // Three pairs, one tied in x and none in y: 2 / √(2 · 3).
    let tied = tau(&[[1.0, 1.0], [1.0, 2.0], [2.0, 3.0]]);
    assert!((tied.unwrap() - 2.0 / 6.0_f64.sqrt()).abs() < 1e-15);
    assert_eq!(tau(&[[1.0, 1.0], [1.0, 2.0]]), None);
    assert_eq!(tau(&[[1.0, 1.0]]), None);
    assert_eq!(tau(&[[1.0, f64::NAN], [2.0, 1.0]]), None);
}
