//! A run whose samplers end where their error is small enough.

use crate::support;
use raystone::config::StopRule;
use raystone::measure::record::{Body, ErrorRecord, Line, axis};
use raystone::run::Registries;

/// Two samplers to 64 samples, and the changes of a test. Under the open sky no pixel dominates the error, as one with a sliver of the
/// lamp would in an equally small picture of the Cornell box: the rule would never be met.
fn experiment(changes: &[&str]) -> String {
    let common = [
        "axes.scene = [\"displaced-sphere\"]",
        "scene.displaced-sphere.triangles = [2000]",
        "run.replicates = 8",
        "run.spp = { pow2 = [0, 6] }",
        "axes.sequence = [\"pixel-hash\", \"sobol\"]",
        "reference.spp = 8192",
    ];
    support::small_with(&[&common, changes].concat())
}

const METRIC: &str = "relmse-unbiased/eps=1e-2/v1";

/// The records of a run.
fn lines(text: &str) -> Vec<Line> {
    let folder = tempfile::tempdir().expect("a temporary folder");
    support::run(text, &Registries::default(), folder.path(), None).1
}

/// The error records of a sequence.
fn errors<'a>(lines: &'a [Line], sequence: &str) -> Vec<&'a ErrorRecord> {
    let of = |line: &'a Line| match &line.body {
        Body::Error(record) if line.key.label(axis::SEQUENCE) == sequence => Some(record),
        _ => None,
    };
    lines.iter().filter_map(of).collect()
}

fn mean_at(records: &[&ErrorRecord], spp: u32) -> f64 {
    let at = |r: &&ErrorRecord| {
        r.errors
            .iter()
            .find(|e| e.spp == spp)
            .map(|e| e.metrics[METRIC])
    };
    let values: Vec<f64> = records.iter().filter_map(at).collect();
    values.iter().sum::<f64>() / values.len() as f64
}

#[test]
fn a_sampler_ends_where_its_error_is_below_the_target_and_says_so() {
    let all = lines(&experiment(&[]));
    let full = errors(&all, "pixel-hash");
    let target = mean_at(&full, 8);
    let rule = format!("run.stop = {{ relmse = {target}, confidence = 0.95 }}");
    let stopped = lines(&experiment(&[&rule]));
    let ended = errors(&stopped, "pixel-hash");
    assert_eq!(ended.len(), 8);
    let last = ended[0].errors.last().expect("an error").spp;
    // Half of the target is met at 16 samples, or at 32 because of noise.
    assert!(last == 16 || last == 32, "{last}");
    assert!(mean_at(&ended, last) < target);
    for (ended, full) in ended.iter().zip(&full) {
        let stop = StopRule {
            relmse: target,
            confidence: 0.95,
            tile: None,
        };
        assert_eq!((ended.stop, full.stop), (Some(stop), None));
        assert_eq!(
            ended.errors.last().expect("an error").spp,
            last,
            "all replicates alike"
        );
        for (a, b) in ended.errors.iter().zip(&full.errors) {
            let [a, b] = [a, b].map(|at| (at.spp, at.metrics[METRIC]));
            // The same samples, added in another order.
            assert!(a.0 == b.0 && (a.1 / b.1 - 1.0).abs() < 1e-4, "{a:?} {b:?}");
        }
    }
    let spectrum = stopped.iter().find_map(|line| match &line.body {
        Body::Spectrum(s) if line.key.label(axis::SEQUENCE) == "pixel-hash" => Some(s.spp),
        _ => None,
    });
    assert_eq!(spectrum, Some(last));
    // A single image has no known spread: it gets all samples.
    let single = errors(&stopped, "sobol");
    assert_eq!((single.len(), single[0].errors.len()), (1, 7));
}
