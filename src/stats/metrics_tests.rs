//! Known values of every metric, planted faults and bad input.

use super::*;

fn image(pixels: &[[f32; 3]]) -> Image {
    Image::new(pixels.len() as u32, 1, pixels.to_vec()).unwrap()
}

fn grey(values: &[f32]) -> Image {
    image(&values.iter().map(|&v| [v; 3]).collect::<Vec<_>>())
}

#[test]
fn every_metric_has_its_value_worked_by_hand() {
    // r = 2, 0; v = 3, 0.5; halves 1.5 and 2.5, -0.5 and 0.5.
    let reference = Reference::from_parts(vec![grey(&[1.5, -0.5]), grey(&[2.5, 0.5])]).unwrap();
    let report = measure(&grey(&[3.0, 0.5]), &reference).unwrap();
    let expected = [
        ("mse/v1", (1.0 + 0.25) / 2.0),
        ("rmse/v1", 0.625f64.sqrt()),
        ("mae/v1", 0.75),
        ("relmse/eps=1e-2/v1", (1.0 / 4.01 + 0.25 / 0.01) / 2.0),
        ("mse-unbiased/v1", (1.5 * 0.5 + 0.0) / 2.0),
        ("relmse-unbiased/eps=1e-2/v1", 0.75 / 4.01 / 2.0),
    ];
    for (id, value) in expected {
        let error = (report.metrics[id] - value).abs();
        assert!(error < 1e-12, "{id}: {} is not {value}", report.metrics[id]);
    }
    assert_eq!(report.non_finite_pixels, 0);
    assert_eq!(reference.own_mse(), Some(0.25));
}

#[test]
fn estimates_without_a_part_are_those_of_a_reference_without_it() {
    let parts: Vec<Image> = [
        [1.0, 0.2],
        [1.5, 0.1],
        [2.5, 0.4],
        [0.5, 0.3],
        [1.25, 0.5],
        [2.0, 0.0],
    ]
    .map(|values| grey(&values))
    .to_vec();
    let picture = grey(&[3.0, 0.7]);
    let reference = Reference::from_parts(parts.clone()).unwrap();
    let report = measure(&picture, &reference).unwrap();
    let ids = ["mse-unbiased/v1", "relmse-unbiased/eps=1e-2/v1"];
    assert!(report.without_part.keys().eq(ids), "{report:?}");
    for left_out in 0..6 {
        let mean = |of: std::ops::Range<usize>, channel: usize| {
            let kept: Vec<f64> = of
                .filter(|&i| i != left_out)
                .map(|i| f64::from(parts[i].pixels[channel][0]))
                .collect();
            kept.iter().sum::<f64>() / kept.len() as f64
        };
        let [mut mse, mut relmse] = [0.0; 2];
        for (i, v) in [3.0, f64::from(0.7f32)].into_iter().enumerate() {
            let (a, b) = (mean(0..3, i), mean(3..6, i));
            mse += (v - a) * (v - b) / 2.0;
            relmse += (v - a) * (v - b) / ((a + b).powi(2) / 4.0 + 0.01) / 2.0;
        }
        for (id, expected) in ids.into_iter().zip([mse, relmse]) {
            let found = report.without_part[id][left_out];
            // Means of halves are rounded to f32.
            assert!(
                (found / expected - 1.0).abs() < 1e-5,
                "{id}: {found} {expected}"
            );
        }
    }
    let two = Reference::from_parts(parts[..2].to_vec()).unwrap();
    assert!(measure(&picture, &two).unwrap().without_part.is_empty());
}

#[test]
fn channels_count_apart() {
    let reference = Reference::single(image(&[[1.0, 2.0, 4.0]])).unwrap();
    let report = measure(&image(&[[1.0, 2.0, 1.0]]), &reference).unwrap();
    assert_eq!(report.metrics["mse/v1"], 3.0);
    assert_eq!(report.metrics["mae/v1"], 1.0);
}

#[test]
fn metric_ids_are_unique_and_carry_a_version() {
    assert!(!METRICS.is_empty());
    for (i, metric) in METRICS.iter().enumerate() {
        assert!(metric.id.ends_with("/v1"), "{}", metric.id);
        assert!(!metric.description.is_empty());
        assert!(METRICS[..i].iter().all(|m| m.id != metric.id));
    }
}

#[test]
fn an_equal_image_has_no_error_and_one_changed_pixel_shows() {
    let picture = grey(&[0.1, 0.2, 0.3]);
    let reference = Reference::single(picture.clone()).unwrap();
    let same = measure(&picture, &reference).unwrap();
    // SSIM needs a window of 11 pixels, and PSNR would be infinite.
    assert_eq!(same.metrics.len(), METRICS.len() - 4);
    assert!(same.metrics.values().all(|&v| v == 0.0));
    assert!(!same.metrics.contains_key("mse-unbiased/v1"), "no halves");
    let changed = measure(&grey(&[0.1, 0.2, 0.3001]), &reference).unwrap();
    let only = [
        "mse-red/v1",
        "mse-green/v1",
        "mse-blue/v1",
        "mse/v1",
        "flip/tone-mapped/ppd=67/v1",
    ];
    assert!(only.iter().all(|id| changed.metrics[*id] > 0.0));
    assert!(changed.metrics.values().all(|&v| v > 0.0));
}

#[test]
fn pixels_that_are_not_finite_are_counted_and_in_no_mean() {
    let reference = Reference::single(grey(&[1.0, 1.0, 1.0])).unwrap();
    let spoiled = image(&[[2.0; 3], [f32::NAN, 1.0, 1.0], [1.0, 1.0, f32::INFINITY]]);
    let report = measure(&spoiled, &reference).unwrap();
    assert_eq!(report.non_finite_pixels, 2);
    assert_eq!(report.metrics["mse/v1"], 1.0);
    let nothing_left = measure(&grey(&[f32::NAN; 3]), &reference).unwrap();
    assert_eq!(nothing_left.non_finite_pixels, 3);
    assert!(nothing_left.metrics.is_empty());
    let error = Reference::single(grey(&[1.0, f32::NAN])).unwrap_err();
    assert!(error.to_string().contains("(1, 0)"), "{error}");
}

#[test]
fn sizes_that_do_not_fit_are_errors() {
    assert!(Image::new(2, 2, vec![[0.0; 3]; 3]).is_err());
    assert!(Image::new(0, 0, vec![]).is_err());
    assert!(Image::mean_of(&[]).is_err());
    let reference = Reference::single(grey(&[1.0, 1.0])).unwrap();
    let error = measure(&grey(&[1.0]), &reference).unwrap_err();
    assert!(error.to_string().contains("1×1"), "{error}");
    assert!(Reference::from_parts(vec![grey(&[1.0])]).is_err());
    assert!(Reference::from_parts(vec![grey(&[1.0]), grey(&[1.0, 2.0])]).is_err());
}

#[test]
fn the_error_map_shows_where_the_error_is() {
    let reference = Reference::single(grey(&[0.0, 0.0, 0.0, 0.0])).unwrap();
    let picture = grey(&[0.0, 0.05, 7.0, f32::NAN]);
    let shade = |v: f32| [(v * 100.0).round() as u8; 3];
    let map = error_map(&picture, &reference, 1.0, shade).unwrap();
    assert_eq!(map.pixels, [[0; 3], [50; 3], [100; 3], NON_FINITE_COLOUR]);
}

/// Two images without symmetry, one pixel far off.
fn patterns() -> [Image; 2] {
    let (width, height) = (48, 40);
    let mut images = [Vec::new(), Vec::new()];
    for (y, x) in (0..height).flat_map(|y| (0..width).map(move |x| (y, x))) {
        let (x, y) = (f64::from(x), f64::from(y));
        let reference = [0.0, 1.0, 2.0].map(|c: f64| {
            let wave = 1.0 + 0.9 * (0.31 * x + 0.7 * c).sin() * (0.23 * y - 0.4 * c).cos();
            wave.abs() + if x > 24.0 && c != 1.0 { 0.5 } else { 0.0 }
        });
        let value = [0, 1, 2].map(|c| {
            let factor = 1.0 + 0.2 * (1.7 * x + 2.3 * y + c as f64).sin();
            reference[c] * factor + 0.05 * (2.9 * x - 1.1 * y).cos()
        });
        let outlier = [x, y] == [9.0, 7.0];
        images[0].push(reference.map(|v| v as f32));
        images[1].push(if outlier {
            [20.0, 1.0, 3.0]
        } else {
            value.map(|v| v as f32)
        });
    }
    images.map(|pixels| Image::new(width as u32, height as u32, pixels).unwrap())
}

/// Values computed with NumPy 2.4 from the formulas in double precision; SSIM with scikit-image
/// 0.26 (`structural_similarity(gaussian_weights=True, sigma=1.5, use_sample_covariance=False,
/// data_range=1)`), FLIP with `flip-evaluator` 1.7 (`evaluate(…, "LDR")`, single precision).
#[test]
fn metrics_have_the_values_of_independent_programs() {
    let [reference, image] = patterns();
    let reference = Reference::single(reference).unwrap();
    let report = measure(&image, &reference).unwrap();
    let expected = [
        ("mse/v1", 0.097_670_811_447_887_83, 1e-12),
        ("rmse/v1", 0.312_523_297_448_186_8, 1e-12),
        ("mae/v1", 0.155_163_792_964_433_22, 1e-12),
        ("relmse/eps=1e-2/v1", 0.091_049_742_710_001_56, 1e-12),
        ("mse-red/v1", 0.225_781_57, 1e-7),
        ("mse-green/v1", 0.026_017_75, 1e-6),
        ("mse-blue/v1", 0.041_213_12, 1e-6),
        ("mse-luminance/v1", 0.031_187_234_904_586_122, 1e-12),
        (
            "relmse-luminance/eps=1e-2/v1",
            0.029_009_995_218_518_252,
            1e-12,
        ),
        (
            "relmse-trimmed/top=0.1%/eps=1e-2/v1",
            0.022_302_992_298_677_74,
            1e-12,
        ),
        ("smape/eps=1e-2/v1", 0.067_056_463_903_346_97, 1e-12),
        ("psnr/tone-mapped/v1", 29.123_707_722_461_33, 1e-8),
        ("ssim/tone-mapped/v1", 0.875_607_547_548_228_8, 1e-8),
        (
            "flip/tone-mapped/ppd=67/v1",
            0.018_775_219_097_733_498,
            1e-4,
        ),
    ];
    // All but those that need halves.
    assert_eq!(report.metrics.len(), METRICS.len() - 2);
    assert_eq!(expected.len(), report.metrics.len());
    for (id, value, tolerance) in expected {
        let found = report.metrics[id];
        assert!(
            (found / value - 1.0).abs() < tolerance,
            "{id}: {found} is not {value}"
        );
    }
    // An outlier dominates the mean but not the trimmed mean, beyond the tolerances.
    let mut calm = image.clone();
    calm.pixels[7 * 48 + 9] = reference.image().pixels[7 * 48 + 9];
    let calm = measure(&calm, &reference).unwrap();
    assert!(report.metrics["mse/v1"] > 2.0 * calm.metrics["mse/v1"]);
    for (id, value, tolerance) in expected {
        assert!((calm.metrics[id] / value - 1.0).abs() > tolerance, "{id}");
    }
}

#[test]
fn what_needs_whole_images_is_absent_where_a_pixel_is_not_finite() {
    let [reference, mut image] = patterns();
    image.pixels[3][1] = f32::NAN;
    let report = measure(&image, &Reference::single(reference).unwrap()).unwrap();
    assert_eq!(report.non_finite_pixels, 1);
    assert!(report.metrics.contains_key("mse/v1"));
    for kind in [
        "flip/",
        "ssim/",
        "psnr/",
        "relmse-trimmed/",
        "mse-luminance/",
    ] {
        assert!(
            !report.metrics.keys().any(|id| id.starts_with(kind)),
            "{kind}"
        );
    }
}
