//! Tests of the bias check on images with known bias.

use super::*;
use raystone_core::random::Pcg32;

const WIDTH: u32 = 44; // not a multiple of the tile
const HEIGHT: u32 = 24;

/// Images with mean 1 and uniform noise of ± `noise` per pixel.
fn noisy(count: usize, noise: f64, generator: &mut Pcg32) -> Vec<Image> {
    let mut pixel = |_| [(1.0 + noise * (2.0 * generator.uniform() - 1.0)) as f32; 3];
    let mut image = |_| {
        let pixels = (0..WIDTH * HEIGHT).map(&mut pixel).collect();
        Image::new(WIDTH, HEIGHT, pixels).unwrap()
    };
    (0..count).map(&mut image).collect()
}

fn scaled(images: &[Image], factor: f64) -> Vec<Image> {
    let scale = |image: &Image| Image {
        pixels: (image.pixels.iter())
            .map(|p| p.map(|v| (f64::from(v) * factor) as f32))
            .collect(),
        ..image.clone()
    };
    images.iter().map(scale).collect()
}

fn check(replicates: &[Image], parts: &[Image]) -> BiasCheck {
    check_bias(replicates, parts, BiasOptions::default()).unwrap()
}

#[test]
fn a_bias_of_the_whole_image_is_found_in_either_direction_though_no_tile_shows_it() {
    let mut generator = Pcg32::new(77);
    let reference = noisy(16, 0.2, &mut generator);
    let images = noisy(16, 0.2, &mut generator);
    // Standard error of the mean of 16 images of 1,056 pixels, against 16 more.
    let error = 0.2 / 3f64.sqrt() / (1056.0f64 * 16.0).sqrt() * 2f64.sqrt();
    for (bias, expected) in [
        (0.0, BiasVerdict::NoBiasFound),
        (8.0, BiasVerdict::Biased),
        (-8.0, BiasVerdict::Biased),
    ] {
        let images = scaled(&images, 1.0 + bias * error);
        let options = BiasOptions {
            tile: 2,
            ..BiasOptions::default()
        };
        let check = check_bias(&images, &reference, options).unwrap();
        let whole = check.whole.unwrap();
        assert!((whole.t - bias).abs() < 3.5, "{bias}: {whole:?}");
        assert_eq!(check.rejected.len(), 0, "{bias}");
        assert_eq!(whole.degrees_of_freedom, 15.0, "those of the images alone");
        assert_eq!(check.verdict, expected, "{bias}: {whole:?}");
    }
}

#[test]
fn too_few_replicates_say_how_many_are_needed_and_nothing_of_a_bias() {
    let mut generator = Pcg32::new(78);
    let reference = noisy(8, 0.2, &mut generator);
    let images = noisy(3, 0.2, &mut generator);
    let few = check(&images, &reference);
    let needed = replicates_needed(BiasOptions::default().alpha);
    let words = format!("not testable: 3 replicates, {needed} are needed");
    let said = few.verdict.to_string();
    assert!(said.starts_with(&words), "{said}");
    assert!(few.whole.is_some(), "the figures are told all the same");
    let biased = check(&scaled(&images, 1.5), &reference);
    assert_eq!(biased.verdict.to_string(), said);
    assert_eq!((biased.p, biased.rejected.len()), (1.0, 0));
}

#[test]
fn the_replicates_needed_give_the_power_that_is_stated() {
    assert!(replicates_needed(0.01) < replicates_needed(1e-4));
    let needed = replicates_needed(0.01);
    let mut generator = Pcg32::new(79);
    let reference = noisy(8, 0.001, &mut generator);
    let error = 0.2 / 3f64.sqrt() / (f64::from(WIDTH * HEIGHT * needed)).sqrt();
    let found = (0..200).filter(|_| {
        let images = noisy(needed as usize, 0.2, &mut generator);
        let images = scaled(&images, 1.0 - EFFECT * error);
        check(&images, &reference).verdict == BiasVerdict::Biased
    });
    // 90 % or a little more, standard deviation 2 %.
    let share = found.count() as f64 / 200.0;
    assert!(share > 0.84, "{share}");
}

fn brighten_tile(images: &[Image], factor: f32) -> Vec<Image> {
    let mut images = images.to_vec();
    for image in &mut images {
        for (x, y) in (0..64).map(|i| (16 + i % 8, 8 + i / 8)) {
            let pixel = &mut image.pixels[y * WIDTH as usize + x];
            *pixel = pixel.map(|v| v * factor);
        }
    }
    images
}

#[test]
fn rounding_of_a_constant_is_no_bias_and_one_percent_in_a_tile_is() {
    let exact = noisy(8, 0.0, &mut Pcg32::new(80));
    // For samples summed in blocks of 256.
    let rounding = 128.0 * f64::from(f32::EPSILON);
    let options = BiasOptions {
        rounding,
        ..BiasOptions::default()
    };
    // A plain f32 sum of 65,536 numbers turns one tenth into this.
    let sum = (0..1 << 16).fold(0.0f32, |sum, _| sum + 0.1);
    let plain = f64::from(sum / 65_536.0) / f64::from(0.1f32);
    assert!((plain - 1.0).abs() > 1e-4, "{plain}");
    for (images, verdict, rejected) in [
        (
            scaled(&exact, 1.0 + 0.9 * rounding),
            BiasVerdict::NoBiasFound,
            0,
        ),
        (
            scaled(&exact, 1.0 - 0.9 * rounding),
            BiasVerdict::NoBiasFound,
            0,
        ),
        (
            scaled(&exact, 1.0 + 1.1 * rounding),
            BiasVerdict::Biased,
            18,
        ),
        (brighten_tile(&exact, 1.01), BiasVerdict::Biased, 1),
    ] {
        let check = check_bias(&images, &exact, options).unwrap();
        assert_eq!((check.verdict, check.rejected.len()), (verdict, rejected));
    }
}

#[test]
fn what_rounding_explains_is_never_detectable() {
    let mut generator = Pcg32::new(81);
    let [images, exact] = [8, 8].map(|count| noisy(count, 0.1, &mut generator));
    let detectable = |rounding: f64| {
        let options = BiasOptions {
            rounding,
            ..BiasOptions::default()
        };
        let check = check_bias(&images, &exact, options).unwrap();
        check.detectable.expect("noise on both sides")
    };
    let (without, with) = (detectable(0.0), detectable(0.01));
    assert!((with - without - 0.01).abs() < 1e-9, "{without} {with}");
}

#[test]
fn a_planted_bias_of_a_few_percent_in_one_tile_is_found_there() {
    let mut generator = Pcg32::new(5);
    let parts = noisy(8, 0.1, &mut generator);
    let replicates = noisy(8, 0.2, &mut generator);
    let before = check(&replicates, &parts);
    assert_eq!(before.verdict, BiasVerdict::NoBiasFound);
    assert_eq!(before.tiles, 6 * 3);
    assert_eq!(before.p_histogram.iter().sum::<usize>(), before.tiles);
    let after = check(&brighten_tile(&replicates, 1.06), &parts);
    assert_eq!(after.verdict, BiasVerdict::Biased);
    assert_eq!(after.rejected, [[16, 8]]);
    assert!(after.min_p < 1e-4);
}

#[test]
fn without_bias_alarms_are_as_rare_as_promised() {
    let mut generator = Pcg32::new(6);
    let trials = 400;
    let options = BiasOptions {
        alpha: 0.05,
        ..BiasOptions::default()
    };
    let (mut alarms, mut histogram) = (0, [0; 10]);
    for _ in 0..trials {
        let parts = noisy(4, 0.3, &mut generator);
        let replicates = noisy(8, 0.5, &mut generator);
        let check = check_bias(&replicates, &parts, options).unwrap();
        let bins = histogram.iter_mut().zip(check.p_histogram);
        bins.for_each(|(sum, count)| *sum += count);
        alarms += u32::from(check.verdict == BiasVerdict::Biased);
    }
    // At most 20 expected of 400, standard deviation 4.4.
    assert!(alarms <= 30, "{alarms} false alarms in {trials}");
    let tiles: usize = histogram.iter().sum();
    let shares = histogram.map(|count| count as f64 / tiles as f64);
    let flat = shares.iter().all(|share| (0.08..0.12).contains(share));
    assert!(flat, "p-values not flat: {shares:?}");
}

/// Images in which most tiles are uniform; every third is hit by a lamp `hits` times on average,
/// adding a half each time (Knuth's Poisson sampling).
fn seldom_hit(count: usize, noise: f64, hits: f64, generator: &mut Pcg32) -> Vec<Image> {
    let mut images = noisy(count, noise, generator);
    for image in &mut images {
        for tile in (0..18).step_by(3) {
            let mut left = generator.uniform();
            let mut lift = 0.0;
            while left > (-hits).exp() {
                lift += 0.5 / hits;
                left *= generator.uniform();
            }
            for (x, y) in (0..64).map(|i| (tile % 6 * 8 + i % 8, tile / 6 * 8 + i / 8)) {
                let place = y * WIDTH as usize + x;
                if x < WIDTH as usize {
                    image.pixels[place] = image.pixels[place].map(|v| v + lift as f32);
                }
            }
        }
    }
    images
}

#[test]
fn tiles_that_are_hit_seldom_make_no_alarm_at_any_number_of_replicates() {
    let mut generator = Pcg32::new(9);
    let needed = replicates_needed(BiasOptions::default().alpha) as usize;
    for (noise, hits) in [(0.2, 0.1), (0.0, 0.1), (0.2, 0.5), (0.0, 0.5)] {
        for n in [2, 3, 4, 5, 6, 8, 12, 16] {
            let alarms = (0..60).filter(|_| {
                let parts = seldom_hit(8, noise / 8.0, 64.0 * hits, &mut generator);
                let replicates = seldom_hit(n, noise, hits, &mut generator);
                let verdict = check(&replicates, &parts).verdict;
                let testable = !matches!(verdict, BiasVerdict::NotTestable(_));
                assert_eq!(testable, n >= needed, "{n} replicates: {verdict}");
                verdict == BiasVerdict::Biased
            });
            // 0.6 expected at most; five or more have a chance of 0.04 %.
            let alarms = alarms.count();
            assert!(
                alarms < 5,
                "noise {noise}, {hits} hits, {n} replicates: {alarms} of 60"
            );
        }
    }
}

#[test]
fn tiles_without_noise_are_equal_or_biased() {
    let flat = noisy(3, 0.0, &mut Pcg32::new(7));
    let equal = check(&flat, &flat);
    assert_eq!(equal.verdict, BiasVerdict::NoBiasFound);
    assert_eq!((equal.min_p, equal.p_histogram), (1.0, [0; 10]));
    let rounded = check(&brighten_tile(&flat, 1.0 + 1e-6), &flat);
    assert_eq!(rounded.verdict, BiasVerdict::NoBiasFound);
    let brighter = check(&brighten_tile(&flat, 1.001), &flat);
    assert_eq!((brighter.rejected.len(), brighter.min_p), (1, 0.0));
}

#[test]
fn what_cannot_be_tested_says_why() {
    let mut images = noisy(3, 0.1, &mut Pcg32::new(8));
    let said = |check: BiasCheck| check.verdict.to_string();
    let single = said(check(&images[..1], &images));
    assert!(single.starts_with("not testable: 1 replicates"), "{single}");
    images[2].pixels[0][1] = f32::NAN;
    let nan = said(check(&images[..2], &images));
    assert!(nan.contains("1 pixels of the parts"), "{nan}");
    let other = Image::new(1, 1, vec![[0.0; 3]]).unwrap();
    assert!(check_bias(&[other.clone(), other], &images, BiasOptions::default()).is_err());
}
