//! The whole report on synthetic but realistic records.

use super::*;
use crate::config::{Params, Variant};
use crate::measure::record::*;
use crate::scene::{Camera, LoadReport};
use std::collections::BTreeMap;

/// Uniform noise in [-1, 1], the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        self.0 = self
            .0
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }
}

fn variant(label: &str) -> Variant {
    let name = label.split(' ').next().unwrap_or(label).to_owned();
    Variant {
        name,
        params: Params::default(),
        label: label.into(),
    }
}

fn line(record: Record) -> Line {
    Line {
        schema: SCHEMA.into(),
        hash: "0".into(),
        record,
    }
}

fn around(value: f64, share: f64) -> Interval {
    Interval {
        value,
        low: value * (1.0 - share),
        high: value * (1.0 + share),
    }
}

fn run() -> Record {
    Record::Run(RunRecord {
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
            os: "Linux x86_64".into(),
            cpu: "Some Processor".into(),
            cpu_threads: 2,
            version: "0.1.0".into(),
            commit: Some("0123abc".into()),
            dirty: Some(false),
        },
        renders_full_product: 560,
        renders_planned: 152,
    })
}

fn scene(name: &str, triangles: usize) -> Record {
    let camera = Camera {
        eye: glam::Vec3::ZERO,
        target: glam::Vec3::Z,
        up: glam::Vec3::Y,
        vertical_fov_degrees: 40.0,
    };
    Record::Scene(SceneRecord {
        scene: name.into(),
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
    })
}

fn gate(wrong: usize) -> GateVerdict {
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
            wrong: 0,
            ambiguous: 0,
        },
        oracle: JudgeCheck {
            rays: 1_024,
            wrong: 0,
            ambiguous: 3,
        },
        kernel_errors: Vec::new(),
        structural: None,
    }
}

fn structure(scene: &str, accel: &str, mrays: f64, wrong: usize) -> StructureRecord {
    let timing = |(class, factor): (RayClass, f64)| ClassTiming {
        class,
        rays: 32_768,
        hit_fraction: 0.55,
        ms: vec![1.0, 1.1, 0.9],
        wall_ms: vec![1.2, 1.3, 1.1],
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
    StructureRecord {
        scene: scene.into(),
        accel: variant(accel),
        features: vec!["counters".into()],
        runtime_checks: true,
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
        stats: StructureStats {
            nodes: 44_381,
            leaves: 22_191,
            references: 99_856,
            depth: (accel != "uniform-grid").then_some(31),
            sah_cost: (accel != "uniform-grid").then_some(61.2),
            bytes: 2_840_384,
        },
        gate: Some(gate(wrong)),
        timings: if wrong == 0 {
            classes.map(timing).to_vec()
        } else {
            Vec::new()
        },
        heat_map: Some(format!("images/heat-{scene}-{accel}.png")),
        heat_map_max: Some(96.0),
        failure: None,
    }
}

/// `(sequence, decorrelation, relMSE at 1 spp, exponent, randomised, ms per spp relative)`.
const SAMPLERS: [(&str, &str, f64, f64, bool, f64); 5] = [
    ("pixel-hash", "none", 2.1, -1.0, true, 1.0),
    ("halton", "none", 1.7, -1.15, false, 1.08),
    ("halton", "cranley-patterson", 1.9, -1.22, true, 1.15),
    ("sobol", "none", 1.6, -1.2, false, 1.1),
    ("sobol", "cranley-patterson", 1.8, -1.35, true, 1.2),
];

fn errors(scene: &str, integrator: &str, replicates: u32) -> Vec<Record> {
    let mut noise = Noise(3);
    let mut records = Vec::new();
    for (sequence, decorrelation, start, exponent, randomised, _) in SAMPLERS {
        for replicate in 0..if randomised { replicates } else { 1 } {
            let at = |spp: u32, noise: &mut Noise| {
                let relmse = start * f64::from(spp).powf(exponent) * (1.0 + 0.06 * noise.next());
                ErrorAtSpp {
                    spp,
                    metrics: BTreeMap::from([
                        ("relmse/eps=1e-2/v1".into(), relmse),
                        ("rmse/v1".into(), relmse.sqrt() * 0.3),
                    ]),
                }
            };
            let picture = |kind: &str| {
                (replicate == 0).then(|| {
                    format!("images/{kind}-{scene}-{integrator}-{sequence}-{decorrelation}.png")
                })
            };
            records.push(Record::Error(ErrorRecord {
                scene: scene.into(),
                integrator: variant(integrator),
                sequence: variant(sequence),
                decorrelation: variant(decorrelation),
                randomised,
                replicate,
                seed: 1 + replicate,
                resolution: [192, 144],
                errors: (0..6).map(|i| at(1 << i, &mut noise)).collect(),
                non_finite_pixels: 0,
                image_hash: "0".into(),
                image: picture("render"),
                error_map: picture("error"),
            }));
        }
    }
    records
}

fn bias(scene: &str, integrator: &str, index: usize, verdict: &str) -> Record {
    let (sequence, decorrelation, ..) = SAMPLERS[index];
    let testable = !verdict.starts_with("not-testable");
    let biased = verdict == "biased";
    Record::Bias(BiasRecord {
        scene: scene.into(),
        integrator: variant(integrator),
        sequence: variant(sequence),
        decorrelation: variant(decorrelation),
        tiles: 432,
        rejected: if biased { 57 } else { 0 },
        alpha: 0.01,
        min_p: 0.003,
        p_histogram: match (testable, biased) {
            (false, _) => vec![0; 10],
            (true, false) => vec![44, 41, 39, 47, 42, 40, 45, 46, 44, 44],
            (true, true) => vec![150, 52, 40, 36, 31, 29, 27, 25, 22, 20],
        },
        verdict: verdict.into(),
    })
}

fn times(scene: &str, integrator: &str, accels: &[(&str, f64)]) -> Vec<Record> {
    let mut noise = Noise(9);
    let mut records = Vec::new();
    for &(accel, factor) in accels {
        for (sequence, decorrelation, .., cost) in SAMPLERS {
            records.push(Record::Time(TimeRecord {
                scene: scene.into(),
                accel: variant(accel),
                sequence: variant(sequence),
                decorrelation: variant(decorrelation),
                integrator: variant(integrator),
                resolution: [192, 144],
                spp: 4,
                ms: vec![10.0; 5],
                wall_ms: vec![11.0; 5],
                ms_per_spp: around(6.5 * factor * cost * (1.0 + 0.02 * noise.next()), 0.02),
                rays: BTreeMap::from([("primary".into(), 110_592)]),
                mrays_s: around(4.0, 0.02),
                image_hash: "0".into(),
                image_equal: true,
                runtime_checks: true,
                features: vec!["nee".into()],
                failure: None,
            }));
        }
    }
    records
}

fn reference(scene: &str, integrator: &str) -> Record {
    Record::Reference(ReferenceRecord {
        scene: scene.into(),
        integrator: variant(integrator),
        spp: 4096,
        sampler: "pixel-hash × none".into(),
        seconds: 21.4,
        mse: 2.0e-6,
        image: format!("images/reference-{scene}-{integrator}.png"),
        mean: 0.31,
    })
}

fn streams() -> Vec<Record> {
    let stream =
        |&(sequence, decorrelation, _, _, randomised, _): &(&str, &str, f64, f64, bool, f64)| {
            let exponent = if sequence == "pixel-hash" {
                -0.48
            } else {
                -0.87
            };
            let star = |i: u32| {
                let n = 4usize << i;
                let value = (n as f64).powf(exponent) * if sequence == "sobol" { 1.1 } else { 1.4 };
                StarAtCount {
                    n,
                    star: around(value.min(1.0), if randomised { 0.08 } else { 0.0 }),
                }
            };
            Record::Stream(StreamRecord {
                sequence: variant(sequence),
                decorrelation: variant(decorrelation),
                dimensions: [2, 3],
                purpose: "bounce 0: direction".into(),
                randomised,
                seeds: if randomised { 8 } else { 1 },
                star: (0..11).map(star).collect(),
            })
        };
    SAMPLERS.iter().map(stream).collect()
}

fn finished() -> Record {
    let parts = [
        ("load", 0.4),
        ("build", 1.1),
        ("gate", 9.0),
        ("gpu", 51.0),
        ("judge", 6.0),
        ("report", 1.2),
    ];
    Record::Finished(FinishedRecord {
        wall_s: 72.0,
        parts_s: parts.map(|(name, s)| (name.to_owned(), s)).into(),
        overhead_s: 3.3,
        failed: 1,
        skipped: 1,
    })
}

/// Two scenes, four structures (one fails its gate, one is skipped on the second scene), five
/// samplers, two integrators, eight replicates.
fn full_run() -> Vec<Line> {
    let mut records = vec![run()];
    for (name, triangles) in [("cornell-box", 36), ("displaced-sphere", 99_856)] {
        let small = name == "cornell-box";
        records.push(scene(name, triangles));
        records.push(structure(name, "bvh", 5.02, 0).into());
        records.push(structure(name, "roped-bvh", if small { 4.98 } else { 4.1 }, 0).into());
        records.push(
            structure(
                name,
                "uniform-grid [lambda=3]",
                1.9,
                if small { 0 } else { 41 },
            )
            .into(),
        );
        let mut timed = vec![("bvh", 1.0), ("roped-bvh", 1.2)];
        if small {
            records.push(structure(name, "brute-force", 0.31, 0).into());
            timed.extend([("uniform-grid [lambda=3]", 2.3), ("brute-force", 14.0)]);
        } else {
            let cell = format!("{name} · brute-force");
            let reason = "99,856 triangles are more than brute-force takes (20,000)".into();
            records.push(Record::Skipped(SkippedRecord { cell, reason }));
        }
        for integrator in ["path", "ao"] {
            records.push(reference(name, integrator));
            records.extend(errors(name, integrator, 8));
            records.extend(times(name, integrator, &timed));
            let verdicts = [
                "no-bias-found",
                "not-testable: deterministic",
                if small { "no-bias-found" } else { "biased" },
                "not-testable: deterministic",
                "no-bias-found",
            ];
            records.extend((0..5).map(|i| bias(name, integrator, i, verdicts[i])));
        }
    }
    records.extend(streams());
    records.push(finished());
    records.into_iter().map(line).collect()
}

impl From<StructureRecord> for Record {
    fn from(record: StructureRecord) -> Self {
        Self::Structure(record)
    }
}

/// A run's folder; pictures for the first scene only.
fn folder(lines: &[Line]) -> tempfile::TempDir {
    let dir = tempfile::tempdir().unwrap();
    std::fs::create_dir(dir.path().join("images")).unwrap();
    let text: String = lines
        .iter()
        .map(|line| serde_json::to_string(line).unwrap() + "\n")
        .collect();
    let named = text
        .split('"')
        .filter(|part| part.starts_with("images/") && part.contains("cornell"));
    for path in named.collect::<std::collections::BTreeSet<_>>() {
        let colour = |x: u32, y: u32| image::Rgb(color::viridis((x * y) as f32 / (96.0 * 72.0)));
        image::RgbImage::from_fn(96, 72, colour)
            .save(dir.path().join(path))
            .unwrap();
    }
    std::fs::write(dir.path().join(read::RECORDS_FILE), text).unwrap();
    dir
}

/// Page and summary of these records. With `RAYSTONE_REPORT_DIR` set, the folder is kept there to be
/// looked at.
fn report(name: &str, lines: &[Line]) -> (String, String) {
    let dir = folder(lines);
    let paths = write_report(dir.path()).unwrap();
    let texts = (
        std::fs::read_to_string(&paths.html).unwrap(),
        std::fs::read_to_string(&paths.summary).unwrap(),
    );
    assert!(paths.plots.iter().all(|path| path.is_file()));
    if let Some(keep) = std::env::var_os("RAYSTONE_REPORT_DIR") {
        let to = Path::new(&keep).join(name);
        std::fs::create_dir_all(to.parent().unwrap()).unwrap();
        std::process::Command::new("cp")
            .arg("-rT")
            .arg(dir.path())
            .arg(&to)
            .status()
            .unwrap();
    }
    texts
}

fn without(lines: Vec<Line>, dropped: fn(&Record) -> bool) -> Vec<Line> {
    lines
        .into_iter()
        .filter(|line| !dropped(&line.record))
        .collect()
}

#[test]
fn a_full_run_names_winners_failures_and_reasons() {
    let (html, summary) = report("full", &full_run());
    for text in [
        "no clear winner: bvh, roped-bvh",
        "FAILED: 41 of 131072 rays differ",
        "first wrong bounce ray: ray 17",
        "more than brute-force takes",
        "biased: 57 of 432 tiles rejected",
        "times compare structures on this adapter only",
        "152 (73 % saved)",
        "fit of Dufay 2017 for Halton",
        "images/heat-displaced-sphere-bvh.png is missing",
    ] {
        assert!(html.contains(text), "{text}");
    }
    assert!(
        summary.contains("## Verdict") && summary.contains("(plots/scene-0-cornell-box-rates.png)")
    );
}

#[test]
fn the_page_is_self_contained_and_escapes_names() {
    let (html, _) = report("escape", &full_run());
    assert!(html.contains("a&lt;b&gt;&amp;c") && !html.contains("a<b>"));
    assert!(html.contains("no texture &lt;x.png&gt;"));
    assert!(!html.contains("<script") && !html.contains("src=\"http") && !html.contains("@import"));
    assert!(html.contains("<svg") && html.contains("src=\"data:image/png;base64,"));
    assert!(!html.contains("<?xml"));
}

#[test]
fn hostile_names_stay_text_everywhere() {
    let mut lines = full_run();
    for line in &mut lines {
        if let Record::Structure(record) = &mut line.record {
            record.accel.label = format!("<b>&{}", record.accel.label);
        }
    }
    let (html, summary) = report("hostile", &lines);
    assert!(html.contains("&lt;b&gt;&amp;bvh") && !html.contains("<b>"));
    assert!(!summary.contains(" <b>"));
}

#[test]
fn a_biased_sampler_and_a_failed_structure_never_win() {
    let lines = full_run();
    let data = RunData::new(&lines);
    let view = &data.scenes[1].views[0];
    let mut spoiled = lines.clone();
    let best = sections::verdict::best_per_sample(view, 32).answer();
    assert_eq!(best, "sobol × cranley-patterson");
    for line in &mut spoiled {
        match &mut line.record {
            Record::Bias(b) if b.sequence.label == "sobol" => b.verdict = "biased".into(),
            Record::Structure(s) if s.accel.label == "bvh" => s.gate = Some(gate(1)),
            _ => {}
        }
    }
    let data = RunData::new(&spoiled);
    let scene = &data.scenes[1];
    assert_ne!(
        sections::verdict::best_per_sample(&scene.views[0], 32).answer(),
        best
    );
    assert_eq!(
        sections::verdict::fastest(scene, RayClass::Primary).answer(),
        "roped-bvh (alone)"
    );
}

#[test]
fn every_check_passes_on_a_clean_run_and_fails_on_its_planted_fault() {
    let clean: Vec<Line> = full_run()
        .into_iter()
        .map(|mut line| {
            match &mut line.record {
                Record::Structure(s) => s.gate = Some(gate(0)),
                Record::Bias(b) if b.verdict == "biased" => b.verdict = "no-bias-found".into(),
                Record::Finished(f) => f.failed = 0,
                _ => {}
            }
            line
        })
        .collect();
    let failing = |lines: &[Line]| -> Vec<String> {
        let checks = sections::belief::checks(&RunData::new(lines));
        checks
            .into_iter()
            .filter(|check| check.word() != "PASS")
            .map(|check| check.title)
            .collect()
    };
    assert_eq!(failing(&clean), Vec::<String>::new());
    let faults: [(&str, fn(&mut Record)); 7] = [
        ("equal to the bit", |r| {
            if let Record::Structure(s) = r {
                s.gate = Some(gate(1))
            }
        }),
        ("brute force", |r| {
            if let Record::Structure(s) = r {
                s.gate.as_mut().unwrap().brute_force.wrong = 1
            }
        }),
        ("oracle", |r| {
            if let Record::Structure(s) = r {
                s.gate.as_mut().unwrap().oracle.wrong = 1
            }
        }),
        ("across structures", |r| {
            if let Record::Time(t) = r {
                t.image_equal = false
            }
        }),
        ("without bias", |r| {
            if let Record::Bias(b) = r {
                b.verdict = "biased".into()
            }
        }),
        ("finite", |r| {
            if let Record::Error(e) = r {
                e.non_finite_pixels = 1
            }
        }),
        ("Reference noise", |r| {
            if let Record::Reference(f) = r {
                f.mse = 1.0
            }
        }),
    ];
    for (title, plant) in faults {
        let mut lines = clean.clone();
        lines.iter_mut().for_each(|line| plant(&mut line.record));
        let failed = failing(&lines);
        assert!(
            failed.iter().any(|name| name.contains(title)),
            "{title} in {failed:?}"
        );
    }
}

#[test]
fn a_run_without_one_kind_of_record_still_reports() {
    let kinds: [(&str, fn(&Record) -> bool); 9] = [
        ("no-run", |r| matches!(r, Record::Run(_))),
        ("no-scene", |r| matches!(r, Record::Scene(_))),
        ("no-structure", |r| matches!(r, Record::Structure(_))),
        ("no-reference", |r| matches!(r, Record::Reference(_))),
        ("no-error", |r| matches!(r, Record::Error(_))),
        ("no-bias", |r| matches!(r, Record::Bias(_))),
        ("no-time", |r| matches!(r, Record::Time(_))),
        ("no-stream", |r| matches!(r, Record::Stream(_))),
        ("no-finished", |r| matches!(r, Record::Finished(_))),
    ];
    let small = without(
        full_run(),
        |r| matches!(r, Record::Reference(f) if f.scene != "cornell-box"),
    );
    for (name, is_kind) in kinds {
        let (html, _) = report(name, &without(small.clone(), is_kind));
        assert!(
            html.contains("Why to believe it") && !html.contains("NaN") && !html.contains(">inf"),
            "{name}"
        );
    }
    let only_run = vec![line(run())];
    let (html, _) = report("only-run", &only_run);
    assert!(html.contains("Nothing was measured") && html.contains("did not finish"));
}

#[test]
fn one_structure_one_sampler_and_one_spp_are_enough() {
    let mut lines = without(full_run(), |record| match record {
        Record::Structure(s) => s.accel.label != "bvh",
        Record::Time(t) => t.accel.label != "bvh" || t.sequence.label != "pixel-hash",
        Record::Error(e) => e.sequence.label != "pixel-hash",
        Record::Bias(_) => true,
        _ => false,
    });
    for line in &mut lines {
        if let Record::Error(record) = &mut line.record {
            record.errors.truncate(1);
        }
    }
    let (html, _) = report("one", &lines);
    assert!(html.contains("bvh (alone)") && html.contains("pixel-hash × none (alone)"));
}

#[test]
fn a_run_where_everything_failed_shows_it_and_no_figure() {
    let mut lines = without(full_run(), |r| {
        matches!(r, Record::Error(_) | Record::Bias(_))
    });
    for line in &mut lines {
        match &mut line.record {
            Record::Structure(s) => *s = structure(&s.scene, &s.accel.label, 1.0, 9),
            Record::Time(t) => t.failure = Some("device lost".into()),
            _ => {}
        }
    }
    let (html, _) = report("failed", &lines);
    assert!(html.contains("device lost") && html.contains("9 of 131072 rays differ"));
    assert!(!html.contains("5.02"));
}

#[test]
fn twelve_structures_fit_into_plots_and_tables() {
    let mut lines = without(full_run(), |r| {
        matches!(r, Record::Structure(_) | Record::Time(_))
    });
    let names: Vec<String> = (0..12)
        .map(|i| format!("structure-{i} [leaf-size={i}, split-limit=0.25]"))
        .collect();
    for scene in ["cornell-box", "displaced-sphere"] {
        for (i, name) in names.iter().enumerate() {
            lines.push(line(
                structure(scene, name, 6.0 / (1.0 + i as f64 * 0.3), 0).into(),
            ));
        }
        let timed: Vec<(&str, f64)> = names
            .iter()
            .enumerate()
            .map(|(i, name)| (name.as_str(), 1.0 + 0.3 * i as f64))
            .collect();
        lines.extend(times(scene, "path", &timed).into_iter().map(line));
    }
    let (html, _) = report("twelve", &lines);
    assert!(names.iter().all(|name| html.contains(name)));
}

#[test]
fn the_terminal_shows_tables_and_checks() {
    let text = terminal_tables(&full_run());
    if std::env::var_os("RAYSTONE_REPORT_DIR").is_some() {
        println!("{text}");
    }
    for part in [
        "Speed on cornell-box",
        "Verdict on displaced-sphere",
        "no clear winner",
        "FAIL  Hits equal",
    ] {
        assert!(text.contains(part), "{part} in\n{text}");
    }
    assert!(!terminal_tables(&[]).contains("NaN"));
}
