//! Errors over replicates against simulations of known truth.

use super::*;
use raystone_core::random::Pcg32;
use raystone_image::Image;
use raystone_record::ErrorAtSpp;
use raystone_stats::metrics::{Reference, measure};

const PIXELS: usize = 40;
/// The true value of every pixel.
const TRUTH: f64 = 0.5;
/// Standard deviation of a pixel at one sample; it falls as the root of the samples.
const NOISE: f64 = 0.1;

/// Returns a nearly normal number, mean 0, variance 1.
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
            tail: None,
            partial_net: false,
        }
    };
    let record = |replicate| ErrorRecord {
        randomised: true,
        replicate,
        seed: replicate,
        resolution: [PIXELS as u32, 1],
        errors: [1, 2, 4].map(&mut at).to_vec(),
        stop: None,
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
        means: Default::default(),
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
    assert!(raystone_stats::statistics::mean(&plain).unwrap() > 1.6 * relmse);
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
fn a_time_has_a_place_on_a_curve_and_none_outside() {
    let curve = [1.0, 4.0, 16.0];
    let (neighbours, share) = place_on(&curve, 8.0).unwrap();
    assert_eq!(neighbours, [1, 2]);
    assert!((share - 0.5).abs() < 1e-12);
    assert_eq!(place_on(&curve, 4.0), Some(([1, 1], 0.0)));
    assert_eq!(place_on(&curve, 17.0), None);
    assert_eq!(place_on(&curve, 0.5), None);
}

#[test]
fn what_samples_an_error_takes_has_an_interval_that_holds_the_truth() {
    const TRIALS: usize = 400;
    // The error of one sample falls as one over the samples: three are needed for a third of it.
    let target = NOISE * NOISE / 3.0 / (TRUTH * TRUTH + 0.01);
    let mut generator = Pcg32::new(35);
    let (mut covered, mut narrowed) = (0, 0);
    for _ in 0..TRIALS {
        let records = records(NOISE, NOISE / 8.0, 8, &mut generator);
        let sampler = sampler(&records);
        let Some(spp) = sampler.spp_to(Metric::RelMse, target) else {
            continue;
        };
        let interval = spp.interval();
        let off = (interval.value / 3.0).ln().abs();
        covered += usize::from(interval.low <= 3.0 && 3.0 <= interval.high);
        narrowed += usize::from(off <= 0.5 * (interval.high / interval.value).ln());
        assert_eq!(sampler.spp_to(Metric::RelMse, 100.0 * target), None);
    }
    let share = |count: usize| count as f64 / TRIALS as f64;
    assert!((0.92..=0.98).contains(&share(covered)), "{covered}");
    // Negative control: half of the width.
    assert!(share(narrowed) < 0.8, "{narrowed}");
}

#[test]
fn errors_on_one_reference_are_compared_without_the_noise_that_they_share() {
    let mut generator = Pcg32::new(36);
    // The reference is so noisy that it makes most of both intervals.
    let parts: Vec<Image> = (0..8).map(|_| noisy(0.5 * NOISE, &mut generator)).collect();
    let reference = Reference::from_parts(parts).unwrap();
    let mut of = |noise: f64| -> Vec<ErrorRecord> {
        let mut record = |replicate| {
            let report = measure(&noisy(noise, &mut generator), &reference).unwrap();
            let mut record = records(NOISE, NOISE, 1, &mut Pcg32::new(1)).remove(0);
            record.replicate = replicate;
            record.errors.truncate(1);
            record.errors[0].metrics = report.metrics;
            record.errors[0].without_part = report.without_part;
            record
        };
        (0..16).map(&mut record).collect()
    };
    let (a, b) = (of(NOISE), of(1.15 * NOISE));
    let log = |records: &[ErrorRecord]| {
        sampler(records)
            .log_error(Metric::RelMse, [1, 1], 0.0)
            .unwrap()
    };
    let (a, b) = (log(&a), log(&b));
    let together = a.compared_with(&b).p;
    // Of an interval alone nobody knows which part of it is the reference's.
    let apart = LogFigure::of_interval(a.interval(), 15.0).expect("an interval");
    assert!(together < apart.compared_with(&b).p, "{together}");
    assert!(together < 0.01, "{together}");
}
