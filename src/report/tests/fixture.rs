//! Synthetic but realistic records, written as in a file of records.

use raystone_record::Environment;
use raystone_record::*;
use raystone_stats::bias::BiasVerdict;
use serde_json::{Value, json};

/// Uniform noise in [-1, 1], the same in every run.
struct Noise(u64);

impl Noise {
    fn next(&mut self) -> f64 {
        let [factor, step] = [6_364_136_223_846_793_005, 1_442_695_040_888_963_407];
        self.0 = self.0.wrapping_mul(factor).wrapping_add(step);
        (self.0 >> 33) as f64 / (1u64 << 30) as f64 - 1.0
    }
}

/// Returns a line with this key; axes with empty labels are left out.
pub(super) fn line(key: &[(&str, &str)], body: Value) -> Line {
    let add = |key: Key, (axis, label): &(&str, &str)| key.with(axis, label);
    let key = key.iter().fold(Key::default(), add);
    let body = serde_json::from_value(body).expect("a record");
    Line::new(key, Ran::default(), body)
}

/// Returns a line of a sampler in a view.
pub(super) fn sampled([scene, integrator]: [&str; 2], sampler: &Sampler, body: Value) -> Line {
    let view = [(axis::SCENE, scene), (axis::INTEGRATOR, integrator)];
    let sampler = [
        (axis::SEQUENCE, sampler.0),
        (axis::DECORRELATION, sampler.1),
    ];
    line(&[view, sampler].concat(), body)
}

pub(super) fn around(value: f64, share: f64) -> Value {
    json!({ "value": value, "low": value * (1.0 - share), "high": value * (1.0 + share) })
}

pub(super) fn run() -> Line {
    let environment = Environment {
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
    };
    let text =
        "[run]\nname = \"quick\"\nspp = { pow2 = [0, 5] }\n# set: axes.scene = [\"a<b>&c\"]\n";
    let record = json!({
        "kind": "run", "name": "quick", "experiment": "experiments/quick.toml", "experiment_text": text,
        "started_unix_s": 1_763_700_000, "environment": environment,
        "renders_full_product": 560, "renders_planned": 152,
    });
    line(&[], record)
}

fn scene(name: &str, triangles: usize) -> Line {
    let record = json!({
        "kind": "scene", "triangles": triangles, "bounds_min": [0, 0, 0], "bounds_max": [1, 1, 1], "load_ms": 12.3,
        "bytes": triangles * 64, "materials": 4, "textures": 0, "emitters": 2, "scene_hash": "abc",
        "camera": { "eye": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0], "vertical_fov_degrees": 40 },
        "report": { "dropped_non_finite": 3, "zero_area": 1, "warnings": ["no texture <x.png>"] },
    });
    line(&[(axis::SCENE, name)], record)
}

/// Classes of rays, with their speed per speed of primary rays.
pub(super) const CLASSES: [(&str, f64); 4] = [
    ("primary", 1.0),
    ("shadow", 0.8),
    ("ao", 0.7),
    ("bounce", 0.45),
];

pub(super) fn gate(wrong: usize) -> GateVerdict {
    let class = |(class, _): (&str, f64)| {
        let wrong = if class == "bounce" { wrong } else { 0 };
        let first = "ray 17: o=(0,1,2) d=(0,0,1): judge triangle 4 t=1.5, structure miss";
        let first = (wrong > 0).then_some(first);
        json!({ "class": class, "rays": 32_768, "wrong": wrong, "ties": 1, "first_wrong": first })
    };
    let gate = json!({
        "passed": wrong == 0, "classes": CLASSES.map(class), "kernel_errors": [],
        "brute_force": { "rays": 4_096, "wrong": 0, "ambiguous": 0 },
        "oracle": { "rays": 1_024, "wrong": 0, "ambiguous": 3 },
    });
    serde_json::from_value(gate).expect("a verdict")
}

/// Returns seven times around this one, their median.
pub(super) fn jittered(ms: f64) -> [f64; 7] {
    [1.0, 1.03, 0.97, 1.0, 1.02, 0.98, 1.0].map(|factor| factor * ms)
}

pub(super) fn structure(scene: &str, accel: &str, mrays: f64, wrong: usize) -> Line {
    let timing = |(class, factor): (&str, f64)| {
        json!({
            "class": class, "rays": 32_768, "hit_fraction": 0.55, "mrays_s": around(mrays * factor, 0.03),
            "ms": jittered(32.768 / (mrays * factor)), "wall_ms": [1.2, 1.3, 1.1, 1.2, 1.25, 1.15, 1.2],
            "counters": {
                "nodes": 40.0 / factor, "box_tests": 80.0 / factor, "triangle_tests": 5.3, "stack_high_water": 12,
            },
        })
    };
    let is_tree = accel != "uniform-grid";
    let record = json!({
        "kind": "structure", "build_ms": 34.0, "build_peak_bytes": 23_000_000,
        "build": [
            { "name": "bounds", "ms": 0.8 }, { "name": "binned-sah", "ms": 31.0 }, { "name": "layout", "ms": 2.2 },
        ],
        "stats": {
            "nodes": 44_381, "leaves": 22_191, "references": 99_856, "leaf_histogram": [0, 9_000, 8_000, 5_000, 191],
            "depth": is_tree.then_some(31), "sah_cost": is_tree.then_some(61.2), "bytes": 2_840_384,
        },
        "gate": gate(wrong),
        "timings": if wrong == 0 { CLASSES.map(timing).to_vec() } else { Vec::new() },
        "heat_map": format!("images/heat-{scene}-{accel}.png"), "heat_map_max": 96.0,
    });
    line(&[(axis::SCENE, scene), (axis::ACCEL, accel)], record)
}

/// `(sequence, decorrelation, relMSE at 1 spp, exponent, randomised, ms per spp relative)`.
pub(super) type Sampler = (&'static str, &'static str, f64, f64, bool, f64);

pub(super) const SAMPLERS: [Sampler; 5] = [
    ("pixel-hash", "none", 2.1, -1.0, true, 1.0),
    ("halton", "none", 1.7, -1.15, false, 1.08),
    ("halton", "cranley-patterson", 1.9, -1.22, true, 1.15),
    ("sobol", "none", 1.6, -1.2, false, 1.1),
    ("sobol", "cranley-patterson", 1.8, -1.35, true, 1.2),
];

fn errors([scene, integrator]: [&str; 2]) -> Vec<Line> {
    let mut noise = Noise(3);
    let mut lines = Vec::new();
    for sampler in SAMPLERS {
        let (sequence, decorrelation, start, exponent, randomised, _) = sampler;
        for replicate in 0..if randomised { 8 } else { 1 } {
            let mut at = |i: u32| {
                let spp = 1 << i;
                let relmse = start * f64::from(spp).powf(exponent) * (1.0 + 0.25 * noise.next());
                // The reference's noise in the plain figures must not show anywhere.
                json!({ "spp": spp, "metrics": {
                    "relmse/eps=1e-2/v1": relmse + 7.0, "rmse/v1": relmse.sqrt() * 0.3 + 7.0,
                    "mse-unbiased/v1": relmse * 0.09, "relmse-unbiased/eps=1e-2/v1": relmse,
                } })
            };
            let errors: Vec<Value> = (0..6).map(&mut at).collect();
            let stem = format!("{scene}-{integrator}-{sequence}-{decorrelation}.png");
            let picture = |kind: &str| (replicate == 0).then(|| format!("images/{kind}-{stem}"));
            let record = json!({
                "kind": "error", "randomised": randomised, "replicate": replicate, "seed": 1 + replicate,
                "resolution": [192, 144], "errors": errors, "non_finite_pixels": 0, "image_hash": "0",
                "image": picture("render"), "error_map": picture("error"),
            });
            lines.push(sampled([scene, integrator], &sampler, record));
        }
    }
    lines
}

fn bias(view: [&str; 2], index: usize, verdict: &BiasVerdict) -> Line {
    let testable = !matches!(verdict, BiasVerdict::NotTestable(_));
    let biased = *verdict == BiasVerdict::Biased;
    let record = json!({
        "kind": "bias", "tiles": 432, "rejected": if biased { 57 } else { 0 }, "alpha": 0.01, "min_p": 0.003,
        "z": testable.then_some(0.4), "p": testable.then_some(0.7),
        "degrees_of_freedom": testable.then_some(9.5), "verdict": verdict,
        "p_histogram": match (testable, biased) {
            (false, _) => [0; 10],
            (true, false) => [44, 41, 39, 47, 42, 40, 45, 46, 44, 44],
            (true, true) => [150, 52, 40, 36, 31, 29, 27, 25, 22, 20],
        },
    });
    sampled(view, &SAMPLERS[index], record)
}

pub(super) fn times(view: [&str; 2], accels: &[(&str, f64)]) -> Vec<Line> {
    let mut noise = Noise(9);
    let mut lines = Vec::new();
    for &(accel, factor) in accels {
        for sampler in SAMPLERS {
            let ms = 6.5 * factor * sampler.5 * (1.0 + 0.02 * noise.next());
            let record = json!({
                "kind": "time", "resolution": [192, 144], "spp": 4, "ms": jittered(4.0 * ms), "wall_ms": vec![11.0; 7],
                "ms_per_spp": around(ms, 0.02), "rays": { "primary": 110_592 }, "mrays_s": around(4.0, 0.02),
                "image_hash": "0", "image_equal": true,
            });
            let mut line = sampled(view, &sampler, record);
            line.key = line.key.with(axis::ACCEL, accel);
            lines.push(line);
        }
    }
    lines
}

fn reference([scene, integrator]: [&str; 2]) -> Line {
    let record = json!({
        "kind": "reference", "spp": 4096, "sampler": "pixel-hash × none", "seconds": 21.4, "mse": 2.0e-7,
        "image": format!("images/reference-{scene}-{integrator}.png"), "mean": 0.31,
    });
    line(
        &[(axis::SCENE, scene), (axis::INTEGRATOR, integrator)],
        record,
    )
}

/// Returns the verdict on an integrator.
fn paths([scene, integrator]: [&str; 2]) -> Line {
    let record = json!({
        "kind": "paths", "paths": 494, "ill_conditioned": 3, "flips": 1, "wrong": 0, "median": 4.2e-6, "worst": 8.1e-5,
    });
    line(
        &[(axis::SCENE, scene), (axis::INTEGRATOR, integrator)],
        record,
    )
}

/// Returns spectra that rise, so that low frequencies are weak.
fn spectrum(view: [&str; 2], sampler: &Sampler) -> Line {
    let power = |k: i32| {
        let quantiles = [0.18, 0.2, 0.3, 0.5].map(|q| q * f64::from(k));
        let power = around(0.2 * f64::from(k), 0.1);
        json!({ "frequency": 0.05 * f64::from(k), "power": power, "quantiles": quantiles })
    };
    let filtered =
        |sigma: f64| json!({ "sigma": sigma, "rmse": around(0.02 / (1.0 + sigma), 0.05) });
    let (power, filtered): (Vec<_>, _) =
        ((1..10).map(power).collect(), [0.0, 1.0, 2.0].map(filtered));
    let record = json!({
        "kind": "spectrum", "spp": 32, "replicates": if sampler.4 { 8 } else { 1 },
        "power": power, "filtered": filtered,
        "low_frequency": around(0.4, 0.1), "autocorrelation": around(-0.1, -0.1),
    });
    sampled(view, sampler, record)
}

fn stream(sampler: &Sampler) -> Line {
    let (sequence, _, _, _, randomised, _) = *sampler;
    let exponent = if sequence == "pixel-hash" {
        -0.48
    } else {
        -0.87
    };
    let at = |factor: f64, n: u32, share: f64| {
        let value = factor * f64::from(n).powf(exponent);
        json!({ "n": n, "value": around(value.min(1.0), share) })
    };
    let (factor, share) = (
        if sequence == "sobol" { 1.1 } else { 1.4 },
        if randomised { 0.08 } else { 0.0 },
    );
    let star: Vec<Value> = (2..13).map(|i| at(factor, 1 << i, share)).collect();
    let slope = json!({ "value": exponent, "low": exponent - 0.1, "high": exponent + 0.1 });
    let few = |counts: &[u32]| counts.iter().map(|&n| at(0.3, n, 0.1)).collect::<Vec<_>>();
    // Two pixels with 16 points each.
    let words: Vec<u32> = (0..64_u32).map(|i| i.wrapping_mul(0x9e37_79b9)).collect();
    let seeds = if randomised { 8 } else { 1 };
    let record = json!({
        "kind": "stream", "dimensions": [2, 3], "purpose": "bounce 0: direction", "randomised": randomised,
        "seeds": seeds, "star": star, "points": RecordedPoints::new([16, 2], 1, &words, vec![1.0; 64]),
        "figures": {
            "star_slope": slope, "l2_star": few(&[16, 64, 256]), "l2_star_slope": slope, "centered": few(&[16, 64]),
            "integrands": [
                { "function": "disk", "integral": 0.5, "rmse": few(&[16, 64, 256]), "slope": slope },
            ],
            "pixels": [{ "n": 64, "neighbour_angle": 0.7, "coverage": 0.9 }],
        },
    });
    sampled([""; 2], sampler, record)
}

fn cost(sampler: &Sampler) -> Line {
    let (own, empty) = (around(12.5, 0.1), around(1.5, 0.1));
    let record = json!({ "kind": "measured", "measurement": "sampler-cost" });
    let readings = [(&figure::NS_PER_SAMPLE, own), (&figure::LOOP_NS, empty)];
    let readings = readings.map(|(figure, value)| {
        Reading::new(figure, serde_json::from_value(value).expect("an interval"))
    });
    sampled([""; 2], sampler, record).with_readings(readings.into())
}

fn finished() -> Line {
    let record = json!({
        "kind": "finished", "wall_s": 72.0, "overhead_s": 3.3, "cpu": { "whole_s": 120.0, "overhead_s": 3.6 }, "failed": 1, "skipped": 1,
        "parts_s": { "load": 0.4, "build": 1.1, "gate": 9.0, "gpu": 51.0, "judge": 6.0, "report": 1.2 },
    });
    line(&[], record)
}

/// Returns two scenes, four structures (one fails its gate, one is skipped on the second scene), five samplers, two
/// integrators, eight replicates.
pub(super) fn full_run() -> Vec<Line> {
    let mut lines = vec![run()];
    for (name, triangles) in [("cornell-box", 36), ("displaced-sphere", 99_856)] {
        let small = name == "cornell-box";
        let pick = |here: f64, there: f64| if small { here } else { there };
        lines.push(scene(name, triangles));
        lines.push(structure(name, "bvh", 5.02, 0));
        lines.push(structure(name, "roped-bvh", pick(4.98, 4.1), 0));
        let wrong = pick(0.0, 41.0) as usize;
        lines.push(structure(name, "uniform-grid [lambda=3]", 1.9, wrong));
        let mut timed = vec![("bvh", 1.0), ("roped-bvh", 1.2)];
        if small {
            lines.push(structure(name, "brute-force", 0.31, 0));
            timed.extend([("uniform-grid [lambda=3]", 2.3), ("brute-force", 14.0)]);
        } else {
            let reason = "99,856 triangles are more than brute-force takes (20,000)";
            let cell = format!("{name} · brute-force");
            lines.push(line(
                &[],
                json!({ "kind": "skipped", "cell": cell, "reason": reason }),
            ));
        }
        for view in ["path", "ao"].map(|integrator| [name, integrator]) {
            lines.push(reference(view));
            lines.push(paths(view));
            lines.extend(errors(view));
            lines.extend(SAMPLERS.iter().map(|sampler| spectrum(view, sampler)));
            lines.extend(times(view, &timed));
            let clean = BiasVerdict::NoBiasFound;
            let untestable = BiasVerdict::NotTestable("deterministic".into());
            let third = if small { &clean } else { &BiasVerdict::Biased };
            let verdicts = [&clean, &untestable, third, &untestable, &clean];
            let verdicts = verdicts.into_iter().enumerate();
            lines.extend(verdicts.map(|(i, verdict)| bias(view, i, verdict)));
        }
    }
    lines.extend(SAMPLERS.iter().map(stream));
    lines.extend(SAMPLERS.iter().map(cost));
    lines.push(finished());
    lines
}

/// Returns the first scene of [`full_run`] with one integrator: as much in kind, a quarter in plots.
pub(super) fn small_run() -> Vec<Line> {
    let kept = |line: &Line| {
        ["", "cornell-box"].contains(&line.key.label(axis::SCENE))
            && ["", "path"].contains(&line.key.label(axis::INTEGRATOR))
    };
    full_run().into_iter().filter(kept).collect()
}
