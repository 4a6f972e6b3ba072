//! Numbers of the verdicts against scipy 1.17, and effects too small to count.

use super::records::Made;
use super::{compared, said};
use raystone::compare::judge::{ChangeVerdict, IN_TURNS, TimeRatio};
use raystone::compare::{Confirmed, Options, compare_sides};
use raystone::measure::figure::figure;
use raystone::measure::interval::Spread;

#[test]
fn students_test_of_a_ratio_agrees_with_scipy() {
    let ratio = TimeRatio {
        log: 1.05f64.ln(),
        rounds: Spread {
            variance: 1.0,
            freedom: 3.0,
        },
        by_round: Vec::new(),
        clock: "processor time",
    };
    let noise = Spread {
        variance: 1e-4,
        freedom: 8.0,
    };
    let time = ratio.measured(figure("ms-per-spp/v1"), Some(noise), 0.02);
    // 2 * scipy.stats.t.sf(log(1.05) / 0.01, 8), and t.ppf(0.975, 8) * 0.01.
    assert!((time.p - 0.0012258845860621747).abs() < 1e-9, "{}", time.p);
    let half = 0.02306004135204166_f64;
    assert!((time.change.high - (1.05f64.ln() + half).exp_m1()).abs() < 1e-9);
    assert!((time.change.value - 0.05).abs() < 1e-12);
    // For a rate, the inverse.
    let rate = ratio.measured(figure("mrays-per-s/v1"), Some(noise), 0.02);
    assert!((rate.change.value - (1.0 / 1.05 - 1.0)).abs() < 1e-12);
    assert!(rate.change.low < rate.change.value && rate.change.high < 0.0);
}

#[test]
fn an_effect_that_does_not_count_is_the_same() {
    let base = Made::default();
    let candidate = Made {
        worse: |sampler| if sampler == 2 { 1.002 } else { 1.0 },
        ..base.clone()
    };
    let found = compared(&base.side(), &candidate.side());
    assert_eq!(said(&found, "relmse-unbiased/v1").count(), 0);
    let of_it = found
        .findings
        .iter()
        .filter(|f| f.figure.id == "relmse-unbiased/v1");
    let tested: Vec<_> = of_it.filter_map(|f| f.measured).collect();
    assert!(
        tested.len() == 4
            && tested
                .iter()
                .all(|m| m.p < 1e-4 && m.change.value < m.margin)
    );
}

#[test]
fn what_was_measured_again_in_turns_counts_even_of_equal_kernels() {
    let base = Made::default();
    let later = Made {
        seed: 2,
        ..Made::default()
    };
    let found = compared(&base.side(), &later.side());
    assert!(found.findings.iter().any(|f| f.is_time && f.is_control));
    let again = |ratio: f64| -> Confirmed {
        let ratios = [
            ratio,
            ratio * 1.001,
            ratio * 0.999,
            ratio * 1.002,
            ratio,
            ratio,
            ratio * 1.001,
            ratio,
        ];
        let identity = (
            "scene=box\u{1}accel=structure-3\u{1}triangle=watertight\u{1}rays=primary",
            "mrays-per-s/v1",
        );
        let ratio = TimeRatio::of_rounds(&ratios, IN_TURNS).expect("a ratio");
        [((identity.0.to_owned(), identity.1.to_owned()), ratio)].into()
    };
    for (ratio, verdict) in [
        (1.2, ChangeVerdict::Worse),
        (0.8, ChangeVerdict::Better),
        (1.0, ChangeVerdict::Same),
    ] {
        let found = compare_sides(
            &base.side(),
            &base.side(),
            &Options::default(),
            &again(ratio),
        );
        let of_it = found.findings.iter().find(|f| {
            f.is_time && f.key.label("accel") == "structure-3" && f.key.label("rays") == "primary"
        });
        let of_it = of_it.expect("a time");
        assert_eq!(of_it.verdict, verdict, "{of_it:?}");
        assert!(!of_it.is_control && of_it.why.contains("again"));
    }
}
