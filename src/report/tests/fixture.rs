//! Synthetic but realistic records.

use super::streams::*;
use crate::accel::Space;
use crate::accel::{Phase, StructureStats};
use crate::geometry::Camera;
use crate::gpu::Environment;
use crate::measure::bias::BiasVerdict;
use crate::measure::record::*;
use crate::scene::LoadReport;
use std::collections::BTreeMap;

/// Uniform noise in [-1, 1], the same in every run.
pub(super) struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }
}

/// A line of a view, or of all views without names.
fn line(scene: &str, integrator: &str, body: Body) -> Line {
    let key = Key::default().with(axis::SCENE, scene);
    Line::new(key.with(axis::INTEGRATOR, integrator), Ran::default(), body)
}

/// A line of a sampler.
pub(super) fn sampled(view: [&str; 2], sampler: &Sampler, body: Body) -> Line {
    let mut line = line(view[0], view[1], body);
    line.key = line.key.with(axis::SEQUENCE, sampler.0);
    line.key = line.key.with(axis::DECORRELATION, sampler.1);
    line
}

pub(super) fn around(value: f64, share: f64) -> Interval {
    Interval {
        value,
        low: value * (1.0 - share),
        high: value * (1.0 + share),
    }
}

pub(super) fn run() -> Body {
    Body::Run(RunRecord {
        name: "quick".into(),
        experiment: "experiments/quick.toml".into(),
        experiment_text:
            "[run]\nname = \"quick\"\nspp = { pow2 = [0, 5] }\n# set: axes.scene = [\"a<b>&c\"]\n"
                .into(),
        started_unix_s: 1_763_700_000,
        environment: Environment {
            adapter: "llvmpipe (LLVM 15.0.6, 256 bits)".into(),
            backend: "vulkan".into(),
            driver: "llvmpipe".into(),
            driver_info: "Mesa 25.0.7".into(),
            device_type: "cpu".into(),
            software: true,
            timestamps: true,
            denormals: Some(true),
            os: "Linux x86_64".into(),
            cpu: "Some Processor".into(),
            cpu_threads: 2,
            version: "0.1.0".into(),
            commit: Some("0123abc".into()),
            dirty: Some(false),
            ..Environment::default()
        },
        renders_full_product: 560,
        renders_planned: 152,
        kernels: Vec::new(),
        figures: Vec::new(),
    })
}

pub(super) fn scene(name: &str, triangles: usize) -> Line {
    let camera = Camera {
        eye: glam::Vec3::ZERO,
        target: glam::Vec3::Z,
        up: glam::Vec3::Y,
        vertical_fov_degrees: 40.0,
    };
    let record = SceneRecord {
        triangles,
        bounds_min: [0.0; 3],
        bounds_max: [1.0; 3],
        load_ms: 12.3,
        bytes: triangles as u64 * 64,
        materials: 4,
        textures: 0,
        emitters: 2,
        camera,
        report: LoadReport {
            dropped_non_finite: 3,
            zero_area: 1,
            warnings: vec!["no texture <x.png>".into()],
        },
        scene_hash: "abc".into(),
    };
    line(name, "", Body::Scene(record))
}

pub(super) fn gate(wrong: usize) -> GateVerdict {
    let classes = [
        RayClass::Primary,
        RayClass::Shadow,
        RayClass::Ao,
        RayClass::Bounce,
    ];
    GateVerdict {
        passed: wrong == 0,
        classes: classes
            .map(|class| ClassVerdict {
                class,
                rays: 32_768,
                wrong: if class == RayClass::Bounce { wrong } else { 0 },
                ties: 1,
                first_wrong: (wrong > 0 && class == RayClass::Bounce).then(|| {
                    "ray 17: o=(0,1,2) d=(0,0,1): judge triangle 4 t=1.5, structure miss".into()
                }),
            })
            .to_vec(),
        brute_force: JudgeCheck {
            rays: 4_096,
            ..JudgeCheck::default()
        },
        oracle: JudgeCheck {
            rays: 1_024,
            ambiguous: 3,
            ..JudgeCheck::default()
        },
        kernel_errors: Vec::new(),
        structural: None,
        elsewhere: None,
    }
}

pub(super) fn structure(scene: &str, accel: &str, mrays: f64, wrong: usize) -> Line {
    let timing = |(class, factor): (RayClass, f64)| ClassTiming {
        class,
        rays: 32_768,
        hit_fraction: 0.55,
        ms: vec![1.0, 1.1, 0.9, 1.0, 1.05, 0.95, 1.0],
        wall_ms: vec![1.2, 1.3, 1.1, 1.2, 1.25, 1.15, 1.2],
        mrays_s: around(mrays * factor, 0.03),
        counters: CountersPerRay {
            nodes: 40.0 / factor,
            box_tests: 80.0 / factor,
            triangle_tests: 5.3,
            stack_high_water: 12,
        },
    };
    let classes = [
        (RayClass::Primary, 1.0),
        (RayClass::Shadow, 0.8),
        (RayClass::Ao, 0.7),
        (RayClass::Bounce, 0.45),
    ];
    let record = StructureRecord {
        refused: false,
        build: vec![
            Phase {
                name: "bounds".into(),
                ms: 0.8,
            },
            Phase {
                name: "binned-sah".into(),
                ms: 31.0,
            },
            Phase {
                name: "layout".into(),
                ms: 2.2,
            },
        ],
        build_ms: 34.0,
        build_peak_bytes: Some(23_000_000),
        space: Space::World,
        update_ms: None,
        stats: StructureStats {
            nodes: 44_381,
            leaves: 22_191,
            references: 99_856,
            leaf_histogram: vec![0, 9_000, 8_000, 5_000, 191],
            depth: (accel != "uniform-grid").then_some(31),
            sah_cost: (accel != "uniform-grid").then_some(61.2),
            epo: None,
            bytes: 2_840_384,
        },
        figures: BTreeMap::new(),
        gate: Some(gate(wrong)),
        timings: if wrong == 0 {
            classes.map(timing).to_vec()
        } else {
            Vec::new()
        },
        heat_map: Some(format!("images/heat-{scene}-{accel}.png")),
        heat_map_max: Some(96.0),
        failure: None,
    };
    let mut line = line(scene, "", Body::Structure(record));
    line.key = line.key.with(axis::ACCEL, accel);
    line
}

pub(super) type Sampler = (&'static str, &'static str, f64, f64, bool, f64);

/// `(sequence, decorrelation, relMSE at 1 spp, exponent, randomised, ms per spp relative)`.
pub(super) const SAMPLERS: [Sampler; 5] = [
    ("pixel-hash", "none", 2.1, -1.0, true, 1.0),
    ("halton", "none", 1.7, -1.15, false, 1.08),
    ("halton", "cranley-patterson", 1.9, -1.22, true, 1.15),
    ("sobol", "none", 1.6, -1.2, false, 1.1),
    ("sobol", "cranley-patterson", 1.8, -1.35, true, 1.2),
];

pub(super) fn errors(scene: &str, integrator: &str, replicates: u32) -> Vec<Line> {
    let mut noise = Noise(3);
    let mut records = Vec::new();
    for sampler in SAMPLERS {
        let (sequence, decorrelation, start, exponent, randomised, _) = sampler;
        for replicate in 0..if randomised { replicates } else { 1 } {
            let at = |spp: u32, noise: &mut Noise| {
                let relmse = start * f64::from(spp).powf(exponent) * (1.0 + 0.25 * noise.next());
                ErrorAtSpp {
                    spp,
                    // The reference's noise in the plain figures must not show anywhere.
                    metrics: BTreeMap::from([
                        ("relmse/eps=1e-2/v1".into(), relmse + 7.0),
                        ("rmse/v1".into(), relmse.sqrt() * 0.3 + 7.0),
                        ("mse-unbiased/v1".into(), relmse * 0.09),
                        ("relmse-unbiased/eps=1e-2/v1".into(), relmse),
                    ]),
                    without_part: BTreeMap::new(),
                }
            };
            let picture = |kind: &str| {
                (replicate == 0).then(|| {
                    format!("images/{kind}-{scene}-{integrator}-{sequence}-{decorrelation}.png")
                })
            };
            let record = ErrorRecord {
                randomised,
                replicate,
                seed: 1 + replicate,
                resolution: [192, 144],
                errors: (0..6).map(|i| at(1 << i, &mut noise)).collect(),
                non_finite_pixels: 0,
                image_hash: "0".into(),
                image: picture("render"),
                error_map: picture("error"),
            };
            records.push(sampled([scene, integrator], &sampler, Body::Error(record)));
        }
    }
    records
}

pub(super) fn bias(scene: &str, integrator: &str, index: usize, verdict: BiasVerdict) -> Line {
    let testable = !matches!(verdict, BiasVerdict::NotTestable(_));
    let biased = verdict == BiasVerdict::Biased;
    let record = BiasRecord {
        tiles: 432,
        rejected: if biased { 57 } else { 0 },
        alpha: 0.01,
        min_p: 0.003,
        z: testable.then_some(0.4),
        p: testable.then_some(0.7),
        degrees_of_freedom: testable.then_some(9.5),
        by_design: false,
        p_histogram: match (testable, biased) {
            (false, _) => vec![0; 10],
            (true, false) => vec![44, 41, 39, 47, 42, 40, 45, 46, 44, 44],
            (true, true) => vec![150, 52, 40, 36, 31, 29, 27, 25, 22, 20],
        },
        verdict,
    };
    sampled([scene, integrator], &SAMPLERS[index], Body::Bias(record))
}

pub(super) fn times(scene: &str, integrator: &str, accels: &[(&str, f64)]) -> Vec<Line> {
    let mut noise = Noise(9);
    let mut records = Vec::new();
    for &(accel, factor) in accels {
        for sampler in SAMPLERS {
            let record = TimeRecord {
                resolution: [192, 144],
                spp: 4,
                ms: vec![10.0; 7],
                wall_ms: vec![11.0; 7],
                ms_per_spp: Some(around(
                    6.5 * factor * sampler.5 * (1.0 + 0.02 * noise.next()),
                    0.02,
                )),
                rays: BTreeMap::from([("primary".into(), 110_592)]),
                mrays_s: Some(around(4.0, 0.02)),
                image_hash: "0".into(),
                image_equal: true,
                failure: None,
            };
            let mut line = sampled([scene, integrator], &sampler, Body::Time(record));
            line.key = line.key.with(axis::ACCEL, accel);
            records.push(line);
        }
    }
    records
}

pub(super) fn reference(scene: &str, integrator: &str) -> Line {
    let record = ReferenceRecord {
        spp: 4096,
        exact: None,
        sampler: "pixel-hash × none".into(),
        seconds: 21.4,
        mse: 2.0e-6,
        image: format!("images/reference-{scene}-{integrator}.png"),
        mean: 0.31,
    };
    line(scene, integrator, Body::Reference(record))
}

pub(super) fn finished() -> Body {
    let parts = [
        ("load", 0.4),
        ("build", 1.1),
        ("gate", 9.0),
        ("gpu", 51.0),
        ("judge", 6.0),
        ("report", 1.2),
    ];
    Body::Finished(FinishedRecord {
        wall_s: 72.0,
        parts_s: parts.map(|(name, s)| (name.to_owned(), s)).into(),
        overhead_s: 3.3,
        failed: 1,
        skipped: 1,
    })
}

/// Two scenes, four structures (one fails its gate, one is skipped on the second scene), five
/// samplers, two integrators, eight replicates.
pub(super) fn full_run() -> Vec<Line> {
    let mut records = vec![Line::about_all(run())];
    for (name, triangles) in [("cornell-box", 36), ("displaced-sphere", 99_856)] {
        let small = name == "cornell-box";
        records.push(scene(name, triangles));
        records.push(structure(name, "bvh", 5.02, 0));
        records.push(structure(
            name,
            "roped-bvh",
            if small { 4.98 } else { 4.1 },
            0,
        ));
        records.push(structure(
            name,
            "uniform-grid [lambda=3]",
            1.9,
            if small { 0 } else { 41 },
        ));
        let mut timed = vec![("bvh", 1.0), ("roped-bvh", 1.2)];
        if small {
            records.push(structure(name, "brute-force", 0.31, 0));
            timed.extend([("uniform-grid [lambda=3]", 2.3), ("brute-force", 14.0)]);
        } else {
            let cell = format!("{name} · brute-force");
            let reason = "99,856 triangles are more than brute-force takes (20,000)".into();
            let skipped = Body::Skipped(SkippedRecord { cell, reason });
            records.push(Line::about_all(skipped));
        }
        for integrator in ["path", "ao"] {
            records.push(reference(name, integrator));
            records.extend(errors(name, integrator, 8));
            records.extend(spectra(name, integrator));
            records.extend(times(name, integrator, &timed));
            let clean = BiasVerdict::NoBiasFound;
            let untestable = BiasVerdict::NotTestable("deterministic".into());
            let third = if small {
                clean.clone()
            } else {
                BiasVerdict::Biased
            };
            let verdicts = [clean.clone(), untestable.clone(), third, untestable, clean];
            let verdicts = verdicts.into_iter().enumerate();
            records.extend(verdicts.map(|(i, verdict)| bias(name, integrator, i, verdict)));
        }
    }
    records.extend(streams());
    records.extend(costs());
    records.push(Line::about_all(finished()));
    records
}

/// The first scene of [`full_run`] with one integrator: as much in kind, a quarter in plots.
pub(super) fn small_run() -> Vec<Line> {
    let kept = |line: &Line| {
        ["", "cornell-box"].contains(&line.key.label(axis::SCENE))
            && ["", "path"].contains(&line.key.label(axis::INTEGRATOR))
    };
    full_run().into_iter().filter(kept).collect()
}
