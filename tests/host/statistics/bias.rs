//! The bias check on images with a path tracer's noise: skewed, and mostly in few pixels.

use raystone::image::Image;
use raystone::measure::bias::{BiasCheck, BiasOptions, BiasVerdict, check_bias};
use raystone::random::Pcg32;

const SIZE: [u32; 2] = [32, 24];
const REPLICATES: usize = 16;
/// Samples of a reference part relative to a replicate.
const PART: f64 = 18.0;

/// Mean and noise of a pixel: bright edges of a lamp at the top, coloured walls elsewhere.
fn pixel(index: u32) -> (f64, f64) {
    let (x, y) = (index % SIZE[0], index / SIZE[0]);
    match (x, y) {
        (12 | 19, 2..=5) => (9.0, 2.4),
        _ => (0.1 + 0.02 * f64::from(x), 0.02 + 0.0008 * f64::from(y)),
    }
}

/// An image with this multiple of a replicate's samples: exponential, hence skewed, noise.
fn image(samples: f64, bias: f64, generator: &mut Pcg32) -> Image {
    let pixels = (0..SIZE[0] * SIZE[1]).map(|index| {
        let (mean, noise) = pixel(index);
        let skewed = -(1.0 - generator.uniform()).ln() - 1.0;
        [((mean + noise * skewed / samples.sqrt()) * (1.0 + bias)) as f32; 3]
    });
    Image::new(SIZE[0], SIZE[1], pixels.collect()).unwrap()
}

fn check(bias: f64, generator: &mut Pcg32) -> BiasCheck {
    let parts: Vec<Image> = (0..8).map(|_| image(PART, 0.0, generator)).collect();
    let images: Vec<Image> = (0..REPLICATES)
        .map(|_| image(1.0, bias, generator))
        .collect();
    // No tolerance for rounding, which would make p-values of 1.
    let options = BiasOptions {
        rounding: 0.0,
        ..BiasOptions::default()
    };
    check_bias(&images, &parts, options).unwrap()
}

fn is_biased(check: &BiasCheck) -> bool {
    check.verdict == BiasVerdict::Biased
}

#[test]
fn half_a_percent_is_found_in_95_of_100_runs_which_the_plain_mean_alone_would_miss() {
    let mut generator = Pcg32::new(51);
    let trials = 200;
    for bias in [0.005, -0.005] {
        let (mut found, mut by_plain_mean) = (0, 0);
        for _ in 0..trials {
            let check = check(bias, &mut generator);
            found += usize::from(is_biased(&check));
            by_plain_mean += usize::from(check.whole.unwrap().p <= 0.005);
        }
        assert!(found >= trials * 95 / 100, "{found} of {trials} at {bias}");
        // Negative control: images in which it is not easy.
        assert!(by_plain_mean < trials / 4, "{by_plain_mean} at {bias}");
    }
}

#[test]
fn without_bias_one_run_in_a_hundred_alarms_at_most_and_p_values_are_flat() {
    let mut generator = Pcg32::new(52);
    let trials = 1000;
    let mut alarms = 0;
    let mut bins = [[0; 10]; 3];
    for _ in 0..trials {
        let check = check(0.0, &mut generator);
        alarms += usize::from(is_biased(&check));
        assert_eq!(is_biased(&check), check.p <= check.alpha, "{}", check.p);
        let p_values = [check.whole, check.weighted].map(|test| test.unwrap().p);
        for (bins, p) in bins.iter_mut().zip(p_values) {
            bins[((p * 10.0) as usize).min(9)] += 1;
        }
        for (sum, count) in bins[2].iter_mut().zip(check.p_histogram) {
            *sum += count;
        }
    }
    // 1 % is 10; 20 or more occur by chance with a probability of 0.3 %.
    assert!(alarms < 20, "{alarms} false alarms in {trials} runs");
    for bins in bins {
        assert!(is_flat(&bins), "{bins:?}");
    }
}

/// True if counts in ten bins are consistent with uniform numbers: Pearson's χ² with nine degrees
/// of freedom stays below its 99.9 % point, and no bin deviates by a quarter.
fn is_flat(bins: &[usize; 10]) -> bool {
    let expected = bins.iter().sum::<usize>() as f64 / 10.0;
    let off = |count: &usize| (*count as f64 - expected).abs() / expected;
    let chi2: f64 = bins.iter().map(|count| off(count).powi(2) * expected).sum();
    chi2 < 27.9 && bins.iter().all(|count| off(count) < 0.25)
}

#[test]
fn a_bias_of_a_tenth_of_a_percent_makes_p_values_that_are_not_flat() {
    // Negative control of the test above: a fifth of the detected bias, in as many runs.
    let mut generator = Pcg32::new(53);
    let mut bins = [0; 10];
    for _ in 0..1000 {
        let p = check(0.001, &mut generator).weighted.unwrap().p;
        bins[((p * 10.0) as usize).min(9)] += 1;
    }
    assert!(!is_flat(&bins), "{bins:?}");
}

#[test]
fn the_least_bias_that_would_have_been_found_is_found_in_nine_runs_of_ten() {
    let mut generator = Pcg32::new(54);
    let trials = 300;
    let least = |generator: &mut Pcg32| check(0.0, generator).detectable.unwrap();
    let typical = (0..50).map(|_| least(&mut generator)).sum::<f64>() / 50.0;
    assert!((0.001..0.005).contains(&typical), "{typical}");
    let mut share = |bias: f64| {
        let found = (0..trials).filter(|_| is_biased(&check(bias, &mut generator)));
        found.count() as f64 / f64::from(trials)
    };
    let [half, whole] = [0.5 * typical, typical].map(&mut share);
    // 90 % or slightly more, by the other tests; standard deviation 2 %.
    assert!((0.84..0.98).contains(&whole), "{whole} at {typical}");
    assert!(half < 0.5, "{half} at half of {typical}");
}

#[test]
fn without_noise_in_the_reference_there_is_no_weighted_mean_and_the_others_stand() {
    let mut generator = Pcg32::new(55);
    let exact = Image::new(SIZE[0], SIZE[1], vec![[0.5; 3]; 768]).unwrap();
    let images: Vec<Image> = (0..REPLICATES)
        .map(|_| image(1.0, 0.0, &mut generator))
        .collect();
    let check = check_bias(&images, &vec![exact; 8], BiasOptions::default()).unwrap();
    assert_eq!(check.weighted, None);
    assert!(is_biased(&check), "another image: {:?}", check.whole);
    assert!(check.detectable.is_some());
}
