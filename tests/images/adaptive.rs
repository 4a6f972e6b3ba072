//! Samples by block, and tiles with as many samples as they need.

use crate::support;
use crate::support::*;
use raystone::integrator::{IntegratorRegistry, RayOffset, RenderJob, Renderer};
use raystone::measure::bias::BiasVerdict;
use raystone::measure::record::{Body, ErrorRecord, Line};
use raystone::run::Registries;

const SIZE: [u32; 2] = [40, 24];

#[test]
fn blocks_on_the_list_have_the_samples_of_a_whole_image_and_others_none() {
    let stage = Stage::builtin(gpu(), "cornell-box", &[]);
    let traced = stage.traced(gpu(), structure("bvh"));
    let sampler = sampler("pixel-hash", "none");
    let integrator = IntegratorRegistry::default().configured(&path(4));
    let job = RenderJob {
        size: SIZE,
        camera: stage.camera,
        sampler: &sampler,
        integrator: &integrator.expect("the path tracer"),
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let whole = Renderer::new(gpu(), &stage.buffers, &traced, &job, false).expect("a kernel");
    let blocks = Renderer::by_blocks(gpu(), &stage.buffers, &traced, &job).expect("a kernel");
    assert!(!whole.features().contains(&"block_list".to_owned()));
    assert_ne!(whole.kernel_hash(), blocks.kernel_hash());
    // More than one block of sums on the host.
    let image = |renderer: &Renderer| {
        let shots = renderer.render(&[300], 3).expect("a render");
        shots.into_iter().next().expect("an image").image.pixels
    };
    let all = image(&whole);
    assert_eq!(all, image(&blocks), "every block");
    // In any order, one twice; the first is at the edge and black, the others see the room.
    let some = [[4, 0], [2, 1], [1, 2], [2, 1]];
    blocks.only(&some);
    let mut lit = 0;
    for (pixel, (found, whole)) in image(&blocks).iter().zip(&all).enumerate() {
        let at = [pixel % 40, pixel / 40].map(|at| at as u32 / 8);
        let expected = if some.contains(&at) { *whole } else { [0.0; 3] };
        assert_eq!(*found, expected, "pixel {pixel}");
        lit += usize::from(expected != [0.0; 3]);
    }
    assert!(lit > 64, "{lit}");
}

/// 16 replicates up to 128 samples, with changes.
fn experiment(changes: &[&str]) -> String {
    let common = [
        "run.replicates = 16",
        "run.resolution = [32, 32]",
        "run.spp = { pow2 = [3, 7] }",
        "axes.accel = [\"cwbvh\"]",
        "reference.spp = 8192",
    ];
    small_with(&[&common, changes].concat())
}

const METRIC: &str = "relmse-unbiased/eps=1e-2/v1";

fn run(text: &str) -> (Vec<ErrorRecord>, BiasVerdict) {
    let folder = tempfile::tempdir().expect("a temporary folder");
    let lines: Vec<Line> = support::run(text, &Registries::default(), folder.path(), None).1;
    let errors = lines.iter().filter_map(|line| match &line.body {
        Body::Error(record) => Some(record.clone()),
        _ => None,
    });
    let verdict = lines.iter().find_map(|line| match &line.body {
        Body::Bias(bias) => Some(bias.verdict.clone()),
        _ => None,
    });
    (errors.collect(), verdict.expect("a bias check"))
}

/// Sample counts, with the mean error at each.
fn curve(records: &[ErrorRecord]) -> Vec<(u32, f64)> {
    let at = |k: usize| {
        let values: Vec<f64> = records
            .iter()
            .map(|r| r.errors[k].metrics[METRIC])
            .collect();
        let mean = values.iter().sum::<f64>() / values.len() as f64;
        (records[0].errors[k].spp, mean)
    };
    (0..records[0].errors.len()).map(at).collect()
}

#[test]
fn tiles_end_on_their_own_without_bias_and_the_target_is_met() {
    let (uniform, _) = run(&experiment(&[]));
    let uniform = curve(&uniform);
    // The error of a uniform image at 32 samples, so that some tiles need fewer and some more.
    let target = uniform[2].1;
    let rule = format!("run.stop = {{ relmse = {target}, confidence = 0.95, tile = 8 }}");
    let text = experiment(&[&rule]);
    let (records, verdict) = run(&text);
    assert_eq!(verdict, BiasVerdict::NoBiasFound);
    let adaptive = curve(&records);
    println!("uniform {uniform:?}\nadaptive {adaptive:?}");
    let (spp, error) = *adaptive.last().expect("an error");
    assert!((9..128).contains(&spp), "{adaptive:?}");
    assert!(error < target, "{error} of {target}");
    assert_eq!(adaptive[0], uniform[0], "the first stage is even");
    // A further run, the longest here.
    if !is_full() {
        return;
    }
    let (again, _) = run(&text);
    let hashes = |all: &[ErrorRecord]| all.iter().map(|r| r.image_hash.clone()).collect::<Vec<_>>();
    assert_eq!(
        hashes(&records),
        hashes(&again),
        "a rule that is deterministic"
    );
}
