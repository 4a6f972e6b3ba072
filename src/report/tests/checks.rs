//! Every check of a run can fail.

use super::fixture::*;
use super::*;

/// Puts a fault into a record of its kind.
type Plant = fn(&mut Body);

/// A fault in the records of one kind.
macro_rules! plant {
    ($kind:ident, $record:ident => $fault:expr) => {
        |body: &mut Body| {
            if let Body::$kind($record) = body {
                $fault
            }
        }
    };
}

/// A run without any fault.
fn clean_run() -> Vec<Line> {
    full_run()
        .into_iter()
        .map(|mut line| {
            match &mut line.body {
                Body::Structure(s) => s.gate = Some(gate(0)),
                Body::Bias(b) if b.verdict == BiasVerdict::Biased => {
                    b.verdict = BiasVerdict::NoBiasFound
                }
                Body::Finished(f) => f.failed = 0,
                _ => {}
            }
            line
        })
        .collect()
}

#[test]
fn an_image_that_no_other_structure_rendered_proves_nothing() {
    let mut lone = clean_run();
    lone.retain(|line| !matches!(line.body, Body::Time(_)) || line.key.name(axis::ACCEL) == "bvh");
    assert!(lone.len() < clean_run().len());
    let checks = sections::belief::checks(&RunData::new(&lone));
    let images = checks
        .iter()
        .find(|c| c.title.contains("across structures"));
    assert_eq!(images.map(|check| check.verdict), Some(Verdict::Open));
}

#[test]
fn every_check_passes_on_a_clean_run_and_fails_on_its_planted_fault() {
    let clean = clean_run();
    let failing = |lines: &[Line]| -> Vec<String> {
        let checks = sections::belief::checks(&RunData::new(lines));
        checks
            .into_iter()
            .filter(|check| check.verdict != Verdict::Pass)
            .map(|check| check.title)
            .collect()
    };
    assert_eq!(failing(&clean), Vec::<String>::new());
    let faults: [(&str, Plant); 9] = [
        (
            "equal to the bit",
            plant!(Structure, s => s.gate = Some(gate(1))),
        ),
        (
            "brute force",
            plant!(Structure, s => s.gate.as_mut().unwrap().brute_force.wrong = 1),
        ),
        (
            "oracle",
            plant!(Structure, s => s.gate.as_mut().unwrap().oracle.wrong = 1),
        ),
        (
            "across structures",
            plant!(Time, t => t.image_equal = false),
        ),
        (
            "without bias",
            plant!(Bias, b => b.verdict = BiasVerdict::Biased),
        ),
        ("finite", plant!(Error, e => e.non_finite_pixels = 1)),
        ("Reference noise", plant!(Reference, f => f.mse = 1.0)),
        ("Reference noise", plant!(Reference, f => f.mse = 0.0)),
        (
            "Reference noise",
            plant!(Error, e => {
                e.errors[5].metrics.values_mut().for_each(|v| *v = -1e-9)
            }),
        ),
    ];
    let planted = faults.map(|(title, plant)| {
        let mut lines = clean.clone();
        lines.iter_mut().for_each(|line| plant(&mut line.body));
        (title, lines)
    });
    let mut astray = clean.clone();
    for line in &mut astray {
        if matches!(line.body, Body::Reference(_)) {
            line.key = line.key.clone().with(axis::INTEGRATOR, "another");
        }
    }
    for (title, lines) in planted.into_iter().chain([("Reference noise", astray)]) {
        let failed = failing(&lines);
        assert!(
            failed.iter().any(|name| name.contains(title)),
            "{title} in {failed:?}"
        );
    }
}
