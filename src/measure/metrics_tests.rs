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
    assert_eq!(report.metrics.len(), METRICS.len());
    assert_eq!(expected.len(), METRICS.len());
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
    assert!(same.metrics.values().all(|&v| v == 0.0));
    assert!(!same.metrics.contains_key("mse-unbiased/v1"), "no halves");
    let changed = measure(&grey(&[0.1, 0.2, 0.3001]), &reference).unwrap();
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
