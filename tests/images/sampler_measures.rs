//! Sampler figures of a run against independent computations; and controls that must be detected.

use crate::support;
use crate::support::{plan, run, sampler_of};
use raystone::config::{Axis, Experiment};
use raystone::discrepancy::{Budget, Measure, PointSet, Value, measure};
use raystone::integrator::integrand::Function;
use raystone::measure::record::{
    BiasRecord, ErrorRecord, Kind, Line, MeasuredRecord, Recorded, ReferenceRecord, SpectrumRecord,
    StreamRecord, all_of, axis,
};
use raystone::measure::spectrum::error_spectrum;
use raystone::run::Registries;
use raystone::sampling::{Coordinate, Demand, Sampler, to_unit};
use std::sync::OnceLock;

/// Integrands alone: no scene, no structure.
const EXPERIMENT: &str = r#"
[run]
replicates = 8
resolution = [96, 64]
spp = { pow2 = [2, 4] }
[axes]
sequence = ["halton"]
decorrelation = ["none", "cranley-patterson", "micro-jitter"]
integrator = ["integrand:disk", "integrand:exponential"]
[decorrelation.micro-jitter]
k = 64                                        # a full shift: with `wrap` exactly Cranley and Patterson's
edge = ["wrap", "clamp"]
[timing]
rounds = 3
min_warmup_ms = 0
max_warmup_ms = 5
rays = 1024
[gate]
rays = 256
brute_force_tests = 1000
oracle_rays = 64
[discrepancy]
points = 64
pairs = [[0, 1], [2, 3]]
seeds = 8
"#;

fn records() -> &'static [Line] {
    static RECORDS: OnceLock<Vec<Line>> = OnceLock::new();
    RECORDS.get_or_init(|| {
        let folder = tempfile::tempdir().expect("a temporary folder");
        let (summary, records) = run(EXPERIMENT, &Registries::default(), folder.path(), None);
        assert_eq!(summary.failed, 0);
        records
    })
}

fn find<T: Kind>() -> Vec<Recorded<'static, T>> {
    let found: Vec<_> = all_of(records()).collect();
    assert!(!found.is_empty());
    found
}

fn at(pixel: u32, sample: u32, dimension: u32, seed: u32) -> Coordinate {
    Coordinate {
        pixel,
        sample,
        dimension,
        seed,
    }
}

fn point(sampler: &Sampler, pixel: u32, sample: u32, seed: u32) -> [f32; 2] {
    [0, 1].map(|dimension| to_unit(sampler.sample_u32(at(pixel, sample, dimension, seed))))
}

#[test]
fn integrands_need_no_scene_and_other_integrators_do() {
    let (experiment, plan) = plan(EXPERIMENT, &Registries::default());
    assert_eq!(experiment.axes[Axis::Scene][0].name, "single-triangle");
    assert_eq!(experiment.axes[Axis::Accel][0].name, "brute-force");
    assert_eq!(plan.scenes.len(), 1);
    let traced = EXPERIMENT.replace("\"integrand:disk\"", "\"ao\"");
    let catalogue = Registries::default().catalogue();
    let error = Experiment::parse(&traced, "trial.toml", &[], &catalogue).expect_err("no scene");
    assert!(error.to_string().contains("axes.scene"), "{error}");
}

#[test]
fn the_error_against_an_exact_reference_is_what_the_host_computes() {
    let references = find::<ReferenceRecord>();
    for reference in &references {
        assert_eq!((reference.mse, reference.spp), (Some(0.0), 0));
        assert!(reference.exact.is_some());
    }
    let errors = find::<ErrorRecord>();
    let sampler = sampler_of("halton", "cranley-patterson", 16);
    let mut compared = 0;
    for error in errors {
        if error.key.name(axis::INTEGRATOR) != "integrand:disk"
            || error.key.name(axis::DECORRELATION) != "cranley-patterson"
        {
            continue;
        }
        for measured in &error.errors {
            let exact = f64::from(Function::Disk.integral() as f32);
            let pixel_error = |pixel: u32| {
                let values = (0..measured.spp)
                    .map(|i| Function::Disk.evaluate(point(&sampler, pixel, i, error.seed)));
                let mean = values.sum::<f32>() / measured.spp as f32;
                (f64::from(mean) - exact).powi(2)
            };
            let squares: f64 = (0..96 * 64).map(pixel_error).sum();
            let expected = (squares / (96.0 * 64.0)).sqrt();
            let found = measured.metrics["rmse/v1"];
            assert!((found / expected - 1.0).abs() < 1e-5, "{found} {expected}");
            compared += 1;
        }
    }
    assert_eq!(compared, 8 * 3);
}

#[test]
fn a_clamped_jitter_is_found_to_be_biased_and_a_wrapped_one_is_not() {
    let checks = find::<BiasRecord>();
    let of = |edge: &str| -> Vec<f64> {
        let jittered = checks.iter().filter(|b| {
            let decorrelation = b.key.get(axis::DECORRELATION).expect("a decorrelation");
            decorrelation.name == "micro-jitter"
                && decorrelation.params.0["edge"].to_string() == edge
        });
        jittered.map(|b| b.z.expect("a z-score").abs()).collect()
    };
    let (wrapped, clamped) = (of("wrap"), of("clamp"));
    assert_eq!((wrapped.len(), clamped.len()), (2, 2));
    assert!(wrapped.iter().all(|z| *z < 5.0), "{wrapped:?}");
    assert!(clamped.iter().all(|z| *z > 10.0), "{clamped:?}");
}

#[test]
fn an_error_that_all_pixels_share_survives_the_widest_filter() {
    let spectra = find::<SpectrumRecord>();
    let share = |decorrelation: &str| -> Vec<f64> {
        let found = spectra
            .iter()
            .filter(|s| s.key.name(axis::DECORRELATION) == decorrelation);
        let share = |s: &Recorded<SpectrumRecord>| {
            let [first, .., last] = &s.filtered[..] else {
                panic!("{s:?}");
            };
            last.rmse.value / first.rmse.value
        };
        found.map(share).collect()
    };
    for same in share("none") {
        assert!((same - 1.0).abs() < 1e-9, "{same}");
    }
    for independent in share("cranley-patterson") {
        assert!(independent < 0.35, "{independent}");
    }
}

#[test]
fn streams_have_every_figure_and_jitter_lies_between_its_ends() {
    let streams = find::<StreamRecord>();
    let mut angles = Vec::new();
    for stream in streams {
        let figures = &stream.figures;
        assert_eq!(stream.star.len(), 3, "{stream:?}");
        assert_eq!((figures.l2_star.len(), figures.centered.len()), (3, 3));
        assert_eq!(figures.integrands.len(), 6);
        assert!(figures.star_slope.is_some());
        match stream.dimensions {
            [2, 3] => {
                assert_eq!(figures.pixels.len(), 2, "N = 16 and 64");
                let last = figures.pixels[1];
                angles.push((stream.key.name(axis::DECORRELATION), last));
            }
            _ => assert!(figures.pixels.is_empty()),
        }
    }
    for (decorrelation, pixels) in &angles {
        if *decorrelation == "none" {
            assert_eq!(pixels.neighbour_angle, 0.0);
            assert!(pixels.coverage <= 1.0 / 16.0);
        } else {
            assert!(pixels.neighbour_angle > 0.8, "{angles:?}");
            assert!(pixels.coverage > 0.9, "{angles:?}");
        }
    }
    let costs = find::<MeasuredRecord>();
    assert_eq!(costs.len(), 4);
    for cost in costs {
        assert_eq!(cost.measurement, "sampler-cost");
        assert!(cost.reading("ns-per-sample/v1").is_some());
    }
}

#[test]
fn one_shift_for_two_dimensions_shows_in_the_matrix_of_pairs() {
    let sampler = sampler_of("halton", "cranley-patterson", 16);
    // The shifts of 1024 pixels: their first points minus the common point.
    let points = |source: fn(u32) -> u32| -> Vec<[f64; 3]> {
        let of_pixel = |pixel| [0, 1, 2].map(|d| sampler.sample_u32(at(pixel, 0, source(d), 3)));
        (0..1024)
            .map(|pixel| of_pixel(pixel).map(|x| f64::from(to_unit(x))))
            .collect()
    };
    let matrix = |points: &[[f64; 3]]| {
        let set = PointSet::from_points(points).expect("points");
        match measure(&set, Measure::Pairs, &Budget::seconds(60.0)) {
            Ok(Value::Matrix(matrix)) => [(0, 1), (0, 2), (1, 2)].map(|(i, j)| matrix[i][j]),
            other => panic!("{other:?}"),
        }
    };
    let good = matrix(&points(|d| d)).map(|v| v.expect("a pair"));
    assert!(good.iter().all(|star| *star < 0.06), "{good:?}");
    let shared = matrix(&points(|d| d.min(1))).map(|v| v.expect("a pair"));
    assert!(
        shared[0] < 0.06 && shared[1] < 0.06 && shared[2] > 0.2,
        "{shared:?}"
    );
}

#[test]
fn a_mask_of_blue_noise_has_little_power_at_low_frequencies() {
    let demand = Demand {
        samples: Some(1),
        dimensions: 2,
        width: Some(64),
    };
    let power = |decorrelation: &str| {
        let registries = Registries::default();
        let [sequence, decorrelation] = [
            (registries.samplers.sequence_entries(), "sobol"),
            (registries.samplers.decorrelation_entries(), decorrelation),
        ]
        .map(|(entries, name)| support::variant(&entries, name, &[]));
        let sampler = registries
            .samplers
            .sampler(&sequence, &decorrelation, &demand);
        let sampler = sampler.unwrap_or_else(|e| panic!("{e}"));
        let errors: Vec<f64> = (0..64 * 64)
            .map(|pixel| f64::from(to_unit(sampler.sample_u32(at(pixel, 0, 0, 1)))))
            .collect();
        error_spectrum(&errors, [64, 64])
            .low_frequency
            .expect("a spectrum")
    };
    let (blue, white) = (power("blue-noise"), power("cranley-patterson"));
    assert!(blue < 0.1, "{blue}");
    assert!((0.7..1.3).contains(&white), "{white}");
}
