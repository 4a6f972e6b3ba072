//! Hypothesis tests against published values, closed forms and simulations.

use raystone::measure::hypothesis::*;
use raystone::measure::interval::Spread;
use raystone::measure::statistics::{mean, variance};
use raystone::random::Pcg32;
use std::f64::consts::PI;

#[track_caller]
fn assert_close(actual: f64, expected: f64, relative: f64) {
    let error = (actual - expected).abs();
    assert!(
        error <= relative * expected.abs(),
        "{actual} is not {expected}"
    );
}

#[test]
fn student_t_has_its_closed_forms_and_tabled_values() {
    for t in [1e-6, 0.1, 1.0, 2.5, 12.0, 300.0] {
        // The complement of the arctangent preserves digits in the tail.
        assert_close(
            student_t_two_sided(t, 1.0),
            2.0 / PI * (1.0 / t).atan(),
            1e-12,
        );
        let root: f64 = (2.0 + t * t).sqrt();
        assert_close(
            student_t_two_sided(t, 2.0),
            2.0 / (root * (root + t)),
            1e-12,
        );
    }
    for (freedom, t, p) in [
        (10.0, 2.228_138_851_986_3, 0.05),
        (10.0, 3.169_272_672_616_951, 0.01),
        (30.0, 2.042_272_456_301, 0.05),
        (5.0, 4.032_142_983_555_227, 0.01),
    ] {
        assert_close(student_t_two_sided(t, freedom), p, 1e-9);
        assert_close(student_t_two_sided(-t, freedom), p, 1e-9);
    }
}

fn welch(a: &[f64], b: &[f64]) -> f64 {
    let both = Spread::together(&[a, b].map(|x| Spread::of_mean(x).unwrap()));
    both.p(mean(a).unwrap() - mean(b).unwrap())
}

#[test]
fn welch_agrees_with_a_worked_example() {
    let a = [
        27.5, 21.0, 19.0, 23.6, 17.0, 17.9, 16.9, 20.1, 21.9, 22.6, 23.1, 19.6, 19.0, 21.7, 21.4,
    ];
    let b = [
        27.1, 22.0, 20.8, 23.4, 23.4, 23.5, 25.8, 22.0, 24.8, 20.2, 21.9, 22.1, 22.9, 20.5, 24.4,
    ];
    let gap = mean(&a).unwrap() - mean(&b).unwrap();
    let both = Spread::together(&[&a, &b].map(|x| Spread::of_mean(x).unwrap()));
    assert_close(gap / both.variance.sqrt(), -2.455356398286006, 1e-9);
    assert_close(both.freedom, 24.98852929023142, 1e-9);
    assert_close(both.p(gap), 0.02137800146286698, 1e-7);
    assert_close(welch(&b, &a), 0.02137800146286698, 1e-7);
}

#[test]
fn samples_without_spread_are_equal_or_not() {
    let same = capped_t_test(&[2.0, 2.0], &[2.0, 2.0, 2.0], 0.0).unwrap();
    assert_eq!((same.t, same.p), (0.0, 1.0));
    let different = capped_t_test(&[2.0, 2.0], &[2.1, 2.1], 0.0).unwrap();
    assert_eq!((different.t, different.p), (f64::NEG_INFINITY, 0.0));
    let within = capped_t_test(&[2.0, 2.0], &[2.1, 2.1], 0.2).unwrap();
    assert_eq!(within.p, 1.0);
    assert_eq!(capped_t_test(&[1.0], &[1.0, 2.0], 0.0), None);
    assert_eq!(capped_t_test(&[1.0, f64::NAN], &[1.0, 2.0], 0.0), None);
}

#[test]
fn p_values_are_uniform_when_the_means_are_equal_and_small_when_not() {
    let mut generator = Pcg32::new(3);
    let mut normal = |mean: f64| -> Vec<f64> {
        let mut draw = || mean + (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0;
        (0..8).map(|_| draw()).collect()
    };
    let share_below =
        |p: &[f64], x: f64| p.iter().filter(|&&p| p < x).count() as f64 / p.len() as f64;
    let equal: Vec<f64> = (0..2000)
        .map(|_| welch(&normal(0.0), &normal(0.0)))
        .collect();
    for x in [0.05, 0.25, 0.5, 0.75] {
        let share = share_below(&equal, x);
        let sd = (x * (1.0 - x) / 2000.0f64).sqrt();
        assert!(
            (share - x).abs() < 4.0 * sd,
            "{share} of p-values below {x}"
        );
    }
    let apart: Vec<f64> = (0..200)
        .map(|_| welch(&normal(0.0), &normal(2.0)))
        .collect();
    assert!(share_below(&apart, 0.05) > 0.9);
}

/// Frequency of small p-values for samples with equal means, relative to nominal: for Welch's test
/// and the capped one. The second sample has eight values, each with a third of the noise.
fn shares_below(p: f64, replicates: usize, generator: &mut Pcg32) -> [f64; 2] {
    const TRIALS: usize = 200_000;
    let mut normal = |sigma: f64, count: usize| -> Vec<f64> {
        let mut draw = || (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0;
        (0..count).map(|_| sigma * draw()).collect()
    };
    let mut below = [0; 2];
    for _ in 0..TRIALS {
        let (ours, reference) = (normal(3.0, replicates), normal(1.0, 8));
        let capped = capped_t_test(&ours, &reference, 0.0).expect("two samples or more");
        for (count, found) in below.iter_mut().zip([welch(&ours, &reference), capped.p]) {
            *count += usize::from(found <= p);
        }
    }
    below.map(|count| count as f64 / TRIALS as f64 / p)
}

#[test]
fn few_replicates_cry_wolf_by_welch_and_not_with_the_cap() {
    let mut generator = Pcg32::new(11);
    for replicates in [2, 3, 5, 8] {
        let [welch, capped] = shares_below(1e-3, replicates, &mut generator);
        assert!(capped < 1.2, "{replicates}: {capped}");
        // Negative control: the test without a cap.
        assert!(replicates > 3 || welch > 5.0, "{replicates}: {welch}");
    }
}

#[test]
fn of_infinitely_many_degrees_of_freedom_t_is_a_normal_number() {
    assert_close(
        student_t_two_sided(1.959_963_984_540_054, f64::INFINITY),
        0.05,
        1e-9,
    );
    assert_close(
        student_t_quantile(0.05, f64::INFINITY),
        1.959_963_984_540_054,
        1e-9,
    );
    assert_eq!(student_t_two_sided(0.0, f64::INFINITY), 1.0);
}

#[test]
fn quantiles_of_t_are_tabled_ones() {
    for (p, n, t) in [
        (0.05, 1.0, 12.706204736174698),
        (0.05, 7.0, 2.364624251592784),
        (0.01, 7.0, 3.4994832973505026),
        (0.001, 30.0, 3.6459586350420214),
    ] {
        assert_close(student_t_quantile(p, n), t, 1e-9);
    }
}

#[test]
fn the_power_of_a_t_test_is_what_trials_have() {
    let mut generator = Pcg32::new(4);
    let trials = 4000;
    for (effect, alpha) in [(5.0, 0.005), (2.0, 0.05), (0.0, 0.05)] {
        let found = (0..trials).filter(|_| {
            let mut normal =
                || (0..12).map(|_| generator.uniform()).sum::<f64>() - 6.0 + effect / 8f64.sqrt();
            let samples: Vec<f64> = (0..8).map(|_| normal()).collect();
            let error = (variance(&samples).unwrap() / 8.0).sqrt();
            mean(&samples).unwrap() / error > student_t_quantile(alpha, 7.0)
        });
        let share = found.count() as f64 / f64::from(trials);
        let power = t_test_power(effect, alpha, 7.0);
        assert!((share - power).abs() < 0.025, "{share}, not {power}");
    }
}

#[test]
fn with_many_replicates_the_power_is_that_of_a_normal_number() {
    for (beyond, power) in [
        (0.0, 0.5),
        (1.281_551_565_544_6, 0.9),
        (-3.0, 0.001_349_898),
    ] {
        let found = t_test_power(1.959_963_984_540_054 + beyond, 0.05, 1000.0);
        assert!((found - power).abs() < 2e-3, "{found}, not {power}");
    }
}

#[test]
fn benjamini_hochberg_steps_up() {
    // The example of the paper's section 3.2: four of fifteen at 0.05.
    let p = [
        0.0001, 0.0004, 0.0019, 0.0095, 0.0201, 0.0278, 0.0298, 0.0344, 0.0459, 0.3240, 0.4262,
        0.5719, 0.6528, 0.7590, 1.0,
    ];
    let rejected = benjamini_hochberg(&p, 0.05);
    assert_eq!(rejected, [vec![true; 4], vec![false; 11]].concat());
    // A larger p that passes also rejects the smaller ones, in any order.
    assert_eq!(
        benjamini_hochberg(&[0.04, 0.9, 0.035], 0.06),
        [true, false, true]
    );
    assert_eq!(benjamini_hochberg(&[0.5, 0.2], 0.05), [false, false]);
    assert!(benjamini_hochberg(&[], 0.05).is_empty());
}

#[test]
fn the_least_effect_that_a_t_test_finds_has_the_power_asked_for() {
    for (power, alpha, freedom) in [(0.9, 0.005, 15.0), (0.9, 1e-4, 7.0), (0.5, 0.05, 1.0)] {
        let effect = t_test_effect(power, alpha, freedom);
        assert_close(t_test_power(effect, alpha, freedom), power, 1e-2);
    }
    // For the normal distribution: 1.2816 above the critical 1.96.
    assert_close(t_test_effect(0.9, 0.05, 1000.0), 1.2816 + 1.96, 5e-3);
}

#[test]
fn holms_correction_steps_down() {
    // The running maximum applies: 3 · 0.01, then 2 · 0.04, then 1 · 0.06 below that.
    assert_close(holm(&[0.04, 0.01, 0.06])[0], 0.08, 1e-12);
    assert_eq!(holm(&[0.04, 0.01, 0.06]), [0.08, 0.03, 0.08]);
    assert_eq!(holm(&[0.7, 0.6]), [1.0, 1.0]);
    assert_eq!(holm(&[f64::NAN, 0.01]), [1.0, 0.02]);
    assert!(holm(&[]).is_empty());
}

#[test]
fn holms_correction_keeps_the_chance_of_any_false_rejection() {
    // Ten true hypotheses, each p twice so that the tests are dependent.
    let mut generator = Pcg32::new(12);
    let trials = 4000;
    let (mut corrected, mut plain) = (0, 0);
    for _ in 0..trials {
        let p: Vec<f64> = (0..5).map(|_| generator.uniform()).collect();
        let p = [&p[..], &p[..]].concat();
        corrected += usize::from(holm(&p).iter().any(|p| *p <= 0.05));
        plain += usize::from(p.iter().any(|p| *p <= 0.05));
    }
    assert!(corrected <= trials * 6 / 100, "{corrected}");
    // Negative control: without the correction.
    assert!(plain > trials * 15 / 100, "{plain}");
}
