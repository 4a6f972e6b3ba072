//! Errors over replicates against simulations of known truth.

use super::*;
use crate::image::Image;
use crate::measure::metrics::{Reference, measure};
use crate::measure::record::ErrorAtSpp;
use crate::random::Pcg32;

const PIXELS: usize = 40;
/// What every pixel should have.
const TRUTH: f64 = 0.5;
/// Standard deviation of a pixel at one sample; it falls as the root of the samples.
const NOISE: f64 = 0.1;

/// About normal, mean 0, variance 1.
fn normal(generator: &mut Pcg32) -> f64 {
    (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0
}

fn noisy(noise: f64, generator: &mut Pcg32) -> Image {
    let mut channel = || (TRUTH + noise * normal(generator)) as f32;
    let pixels = (0..PIXELS).map(|_| std::array::from_fn(|_| channel()));
    Image::new(PIXELS as u32, 1, pixels.collect()).unwrap()
}

/// Replicates as a run records them, against a reference of eight parts with this noise each.
fn records(noise: f64, part_noise: f64, replicates: u32, g: &mut Pcg32) -> Vec<ErrorRecord> {
    let parts = (0..8).map(|_| noisy(part_noise, g)).collect();
    let reference = Reference::from_parts(parts).unwrap();
    let mut at = |spp: u32| {
        let image = noisy(noise / f64::from(spp).sqrt(), g);
        let report = measure(&image, &reference).unwrap();
        ErrorAtSpp {
            spp,
            metrics: report.metrics,
            without_part: report.without_part,
            partial_net: false,
        }
    };
    let record = |replicate| ErrorRecord {
        randomised: true,
        replicate,
        seed: replicate,
        resolution: [PIXELS as u32, 1],
        errors: [1, 2, 4].map(&mut at).to_vec(),
        non_finite_pixels: 0,
        image_hash: String::new(),
        image: None,
        error_map: None,
    };
    (0..replicates).map(record).collect()
}

fn sampler(records: &[ErrorRecord]) -> MeasuredSampler<'_> {
    MeasuredSampler {
        key: Key::default(),
        name: "a × b".into(),
        replicates: records.iter().collect(),
        bias: None,
        spectrum: None,
    }
}

#[test]
fn intervals_hold_the_true_figure_as_often_as_promised_whatever_the_reference() {
    const TRIALS: usize = 800;
    // At four samples; the reference has 1/32 of that variance, or none at all.
    let variance = NOISE * NOISE / 4.0;
    let truths = [variance / (TRUTH * TRUTH + 0.01), variance.sqrt(), -1.0];
    for part_noise in [(variance / 4.0).sqrt(), 0.0] {
        let mut generator = Pcg32::new(31);
        let mut covered = [0; 3];
        for _ in 0..TRIALS {
            let records = records(NOISE, part_noise, 8, &mut generator);
            let sampler = sampler(&records);
            let error = |metric| sampler.mean_error_at(metric, 4).unwrap().error;
            let figures = [
                error(Metric::RelMse),
                error(Metric::Rmse),
                sampler.slope(Metric::RelMse).unwrap(),
            ];
            for ((count, figure), truth) in covered.iter_mut().zip(figures).zip(truths) {
                *count += usize::from(figure.low <= truth && truth <= figure.high);
            }
        }
        for count in covered {
            let share = count as f64 / TRIALS as f64;
            assert!((0.93..=0.97).contains(&share), "{part_noise}: {covered:?}");
        }
    }
}

#[test]
fn the_noise_of_the_reference_is_in_the_interval_and_not_in_the_figure() {
    let mut generator = Pcg32::new(32);
    // The reference is as noisy as the image: the plain figure is twice too large.
    let records = records(NOISE, NOISE / 2.0 * 8f64.sqrt(), 200, &mut generator);
    let sampler = sampler(&records);
    let relmse = NOISE * NOISE / 4.0 / (TRUTH * TRUTH + 0.01);
    let mean = sampler.mean_error_at(Metric::RelMse, 4).unwrap();
    let plain: Vec<f64> = records
        .iter()
        .map(|r| r.errors[2].metrics["relmse/eps=1e-2/v1"])
        .collect();
    assert!(crate::measure::statistics::mean(&plain).unwrap() > 1.6 * relmse);
    let Interval { value, low, high } = mean.error;
    assert!((value / relmse - 1.0).abs() < 0.6, "{mean:?}");
    assert!(low < relmse && relmse < high, "{mean:?}");
    // 200 replicates alone would leave 2 % open.
    assert!(high - low > 0.2 * relmse, "{mean:?}");
}

#[test]
fn what_the_reference_does_not_resolve_is_found_out() {
    let mut generator = Pcg32::new(33);
    let trials = 200;
    let mut count = |noise: f64| {
        let resolved = (0..trials).filter(|_| {
            let records = records(noise, NOISE, 4, &mut generator);
            sampler(&records)
                .mean_error_at(Metric::Rmse, 4)
                .unwrap()
                .resolved
        });
        resolved.count()
    };
    let (exact, noisy) = (count(0.0), count(10.0 * NOISE));
    assert!(exact <= 12, "{exact} errors of 0 resolved");
    assert_eq!(noisy, trials);
}

#[test]
fn one_replicate_is_shown_without_interval_and_not_ranked() {
    let mut generator = Pcg32::new(34);
    let records = records(NOISE, NOISE, 1, &mut generator);
    let sampler = sampler(&records);
    assert!(!sampler.is_ranked());
    let error = sampler.mean_error_at(Metric::RelMse, 4).unwrap().error;
    assert_eq!((error.low, error.high), (error.value, error.value));
}

#[test]
fn interpolation_follows_a_power_law_and_ends_with_the_curve() {
    let curve = [(1.0, Interval::exact(8.0)), (4.0, Interval::exact(2.0))];
    assert!((error_after(&curve, 2.0).unwrap().value - 4.0).abs() < 1e-12);
    assert_eq!(error_after(&curve, 4.0).unwrap().value, 2.0);
    assert!(error_after(&curve, 5.0).is_none());
    let wide = |value| Interval {
        value,
        low: -1.0,
        high: 10.0,
    };
    let between = error_after(&[(1.0, wide(8.0)), (4.0, wide(2.0))], 2.0).unwrap();
    assert!(between.low == 0.0 && (between.high - 10.0).abs() < 1e-9);
}
