//! False alarms and power over many synthetic pairs of runs.

use super::records::{Made, QUIET, SHARED};
use super::{compared, said};
use raystone::compare::confirm::COMPILATIONS;
use raystone::compare::judge::ChangeVerdict;
use raystone::compare::side::Side;
use raystone::compare::{Comparison, Confirmed, Options, compare_sides};

const REPEATED: u64 = 120;
/// At the 5 % level, more false alarms than this occur once in a thousand times.
const MOST: usize = 14;

fn alarms(found: &Comparison) -> usize {
    found.count(ChangeVerdict::Worse) + found.count(ChangeVerdict::Better)
}

fn with_alarm(pair: impl Fn(u64) -> [Side; 2]) -> usize {
    let ends = (0..REPEATED).map(|i| {
        let [base, candidate] = pair(i);
        alarms(&compared(&base, &candidate))
    });
    ends.filter(|alarms| *alarms > 0).count()
}

/// Two identical runs, hours apart; kernel texts differ in the second half of the structures.
fn two_runs(i: u64, noise: super::records::Noise, slower: fn(usize) -> f64) -> [Side; 2] {
    let base = Made {
        rounds: 21,
        noise,
        seed: 2 * i + 1,
        machine: 2 * i + 1,
        ..Made::default()
    };
    let candidate = Made {
        seed: 2 * i + 2,
        machine: 2 * i + 2,
        candidate: true,
        slower,
        ..base.clone()
    };
    [base.side(), candidate.side()]
}

/// Two sets of kernels in the same rounds of one process, each compiled `compilations` times.
fn one_run(i: u64, slower: fn(usize) -> f64, compilation: f64, compilations: usize) -> [Side; 2] {
    // In processor time: cells of one process moved by 1.1 % (root mean square).
    let noise = super::records::Noise {
        hour: 0.0,
        cell: 0.005,
        round: 0.015,
        interrupted: 0.02,
        compilation,
    };
    let base = Made {
        rounds: 21,
        noise,
        seed: 2 * i + 1,
        machine: 2 * i + 1,
        compilations,
        ..Made::default()
    };
    let candidate = Made {
        seed: 2 * i + 2,
        candidate: true,
        slower,
        ..base.clone()
    };
    let [mut base, mut candidate] = [base.side(), candidate.side()];
    (base.in_rounds, candidate.in_rounds) = (true, true);
    [base, candidate]
}

/// Difference between compilations of one text when it is large.
const SCATTERED: f64 = 0.03;

#[test]
fn two_runs_of_the_same_give_no_more_false_alarms_than_stated() {
    let shared = with_alarm(|i| two_runs(i, SHARED, |_| 1.0));
    let quiet = with_alarm(|i| two_runs(i, QUIET, |_| 1.0));
    println!("alarms: {shared} and {quiet} of {REPEATED}");
    assert!(
        shared <= MOST && quiet <= MOST,
        "{shared} and {quiet} of {REPEATED}"
    );
}

#[test]
fn two_equal_sets_of_kernels_in_one_run_give_no_more_false_alarms_than_stated() {
    for compilation in [0.0, SCATTERED] {
        let alarms = with_alarm(|i| one_run(i, |_| 1.0, compilation, COMPILATIONS));
        println!("compilations that differ by {compilation}: alarms: {alarms} of {REPEATED}");
        assert!(alarms <= MOST, "{compilation}: {alarms} of {REPEATED}");
    }
}

#[test]
fn images_of_another_pattern_that_is_no_worse_give_no_more_false_alarms_than_stated() {
    let options = Options {
        effects: raystone::compare::judge::Effects {
            images: true,
            ..Default::default()
        },
        ..Options::default()
    };
    let alarm = |i: &u64| {
        let base = Made {
            other_images: true,
            seed: 2 * i + 1,
            ..Made::default()
        };
        let candidate = Made {
            seed: 2 * i + 2,
            ..base.clone()
        };
        let found = compare_sides(&base.side(), &candidate.side(), &options, &Confirmed::new());
        let errors = found.findings.iter().filter(|f| !f.is_time);
        errors
            .filter(|f| matches!(f.verdict, ChangeVerdict::Worse | ChangeVerdict::Better))
            .count()
            > 0
    };
    let alarms = (0..REPEATED).filter(alarm).count();
    println!("alarms: {alarms} of {REPEATED}");
    assert!(alarms <= MOST, "{alarms} of {REPEATED}");
}

#[test]
fn a_structure_that_is_five_percent_slower_is_found() {
    let slower: fn(usize) -> f64 = |structure| if structure == 8 { 1.05 } else { 1.0 };
    let is_found = |found: &Comparison| {
        let worse = said(found, "mrays-per-s/v1").filter(|f| f.verdict == ChangeVerdict::Worse);
        worse
            .filter(|f| f.key.label("accel") == "structure-8")
            .count()
    };
    let found = |pair: &dyn Fn(u64) -> [Side; 2]| {
        let count = |i| {
            let [base, candidate] = pair(i);
            is_found(&compared(&base, &candidate))
        };
        (0..20).map(count).sum::<usize>()
    };
    let in_rounds = found(&|i| one_run(i, slower, 0.0, COMPILATIONS));
    let quiet = found(&|i| two_runs(i, QUIET, slower));
    println!("found: {in_rounds} and {quiet} of 40");
    assert!(quiet >= 30, "{quiet} of 40");
    assert!(in_rounds >= 24, "{in_rounds} of 40");
}

#[test]
fn a_faster_structure_is_better_and_not_worse() {
    let of_pair = |i| {
        let slower = |structure| if structure == 8 { 0.8 } else { 1.0 };
        let [base, candidate] = one_run(i, slower, 0.0, 1 + i as usize % 2);
        let found = compared(&base, &candidate);
        let caution = |note: &String| note.contains("where its data lies");
        assert!(found.notes.iter().any(caution), "{:?}", found.notes);
        let caution = |note: &String| note.contains("was compiled once");
        assert_eq!(
            found.notes.iter().any(caution),
            i % 2 == 0,
            "{:?}",
            found.notes
        );
        let of_it = said(&found, "mrays-per-s/v1");
        let of_it = of_it.filter(|f| f.key.label("accel") == "structure-8");
        of_it.map(|f| f.verdict).collect::<Vec<_>>()
    };
    let verdicts: Vec<ChangeVerdict> = (0..10).flat_map(of_pair).collect();
    assert_eq!(verdicts, [ChangeVerdict::Better; 20]);
}

#[test]
fn an_error_that_is_one_percent_larger_is_found_for_every_seed_together() {
    let base = Made::default();
    let candidate = Made {
        worse: |sampler| if sampler == 2 { 1.01 } else { 1.0 },
        ..base.clone()
    };
    let found = compared(&base.side(), &candidate.side());
    let worse: Vec<_> = said(&found, "relmse-unbiased/v1").collect();
    assert_eq!(worse.len(), 4, "{worse:?}");
    for finding in worse {
        let change = finding.measured.expect("a difference").change;
        assert_eq!(
            (finding.verdict, finding.key.label("sequence")),
            (ChangeVerdict::Worse, "sequence-2")
        );
        assert!((change.value - 0.01).abs() < 0.002, "{change:?}");
    }
    // Per seed, only that sampler differs.
    let touched = said(&found, "rmse-unbiased/v1").all(|f| f.key.label("sequence") == "sequence-2");
    assert!(touched);
}

#[test]
fn drift_of_the_control_widens_the_interval() {
    let slower: fn(usize) -> f64 = |structure| if structure == 8 { 1.05 } else { 1.0 };
    let of = |noise| {
        let [base, candidate] = two_runs(5, noise, slower);
        let found = compared(&base, &candidate);
        let times = found
            .findings
            .into_iter()
            .filter(|f| f.key.label("accel") == "structure-8" && f.is_time);
        let change = times
            .map(|f| f.measured.expect("a difference").change)
            .next()
            .expect("a time");
        change.high - change.low
    };
    let (quiet, shared) = (of(QUIET), of(SHARED));
    assert!(shared > 4.0 * quiet, "{quiet} {shared}");
}
