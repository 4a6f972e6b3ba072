//! Synthetic runs with realistic noise of a shared machine.

use raystone::compare::side::Side;
use raystone::measure::record::Environment;
use raystone::measure::record::*;
use raystone::random::Pcg32;
use serde_json::{Value, json};

/// Noise of a run, as standard deviations of logarithms.
#[derive(Clone, Copy)]
pub struct Noise {
    /// Per hour: common to all cells of the run.
    pub hour: f64,
    /// Per cell and run, heavy-tailed (Student's t with 4 degrees of freedom).
    pub cell: f64,
    /// Per round of a cell, half of it shared with the previous round.
    pub round: f64,
    /// Share of rounds that take half as long again.
    pub interrupted: f64,
    /// Per compilation, heavy-tailed: common to all its rounds.
    pub compilation: f64,
}

/// Difference of two runs of one program on a shared machine of two cores, in processor time.
pub const SHARED: Noise = Noise {
    hour: 0.08,
    cell: 0.03,
    round: 0.03,
    interrupted: 0.1,
    compilation: 0.0,
};
/// As on a dedicated machine.
pub const QUIET: Noise = Noise {
    hour: 0.003,
    cell: 0.003,
    round: 0.01,
    interrupted: 0.01,
    compilation: 0.0,
};

#[derive(Clone)]
pub struct Made {
    /// Structures; in the candidate, the second half has other kernels.
    pub structures: usize,
    pub rounds: usize,
    pub replicates: u32,
    pub noise: Noise,
    pub seed: u64,
    /// Seed of the noise shared by both sides of one process, in rounds.
    pub machine: u64,
    pub compilations: usize,
    /// True if kernels of the second half differ.
    pub candidate: bool,
    pub slower: fn(usize) -> f64,
    pub worse: fn(usize) -> f64,
    /// True if errors are another draw of the image noise, as with another sample pattern.
    pub other_images: bool,
}

impl Default for Made {
    fn default() -> Self {
        Self {
            structures: 12,
            rounds: 15,
            replicates: 16,
            noise: SHARED,
            seed: 1,
            machine: 1,
            compilations: 1,
            candidate: false,
            slower: |_| 1.0,
            worse: |_| 1.0,
            other_images: false,
        }
    }
}

pub struct Random(Pcg32);

impl Random {
    pub fn new(seed: u64) -> Self {
        Self(Pcg32::new(seed))
    }

    fn unit(&mut self) -> f64 {
        (self.0.below(1 << 30) as f64 + 0.5) / (1u64 << 30) as f64
    }

    pub fn normal(&mut self) -> f64 {
        (-2.0 * self.unit().ln()).sqrt() * (std::f64::consts::TAU * self.unit()).cos()
    }

    /// Student's t with 4 degrees of freedom, scaled to variance 1.
    fn heavy(&mut self) -> f64 {
        let square: f64 = (0..4).map(|_| self.normal().powi(2)).sum();
        self.normal() / (square / 4.0).sqrt() / 2f64.sqrt()
    }
}

fn line(key: &[(&str, &str)], kernel: &str, body: Value) -> Line {
    let key = key
        .iter()
        .fold(Key::default(), |key, (axis, label)| key.with(axis, label));
    let body = serde_json::from_value(body).expect("a record");
    Line::new(key, Ran::kernel(kernel.to_owned()), body)
}

pub fn environment() -> Environment {
    Environment {
        adapter: "llvmpipe".into(),
        backend: "vulkan".into(),
        device_type: "cpu".into(),
        software: true,
        cpu: "Some Processor".into(),
        cpu_threads: 2,
        ..Environment::default()
    }
}

fn exact(value: f64) -> Value {
    json!({ "value": value, "low": value, "high": value })
}

impl Made {
    pub fn lines(&self) -> Vec<Line> {
        let run = json!({
            "kind": "run", "name": "made", "experiment": "made.toml", "experiment_text": "", "started_unix_s": 0,
            "environment": environment(), "renders_full_product": 1, "renders_planned": 1,
            "compilations": self.compilations,
        });
        let scene = json!({
            "kind": "scene", "triangles": 100, "bounds_min": [0, 0, 0], "bounds_max": [1, 1, 1], "load_ms": 1.0,
            "bytes": 6400, "materials": 1, "textures": 0, "emitters": 1, "scene_hash": "abc",
            "camera": { "eye": [0, 0, 0], "target": [0, 0, 1], "up": [0, 1, 0], "vertical_fov_degrees": 40 },
            "report": { "dropped_non_finite": 0, "zero_area": 0, "warnings": [] },
        });
        let mut lines = vec![line(&[], "", run), line(&[("scene", "box")], "", scene)];
        let mut random = Random::new(self.seed);
        let hour = self.noise.hour * random.normal();
        for structure in 0..self.structures {
            lines.push(self.structure(structure, hour, &mut random));
        }
        lines.push(reference());
        for sampler in 0..4 {
            lines.extend(self.sampler(sampler));
        }
        // Present in every run: their key names no kernels.
        let set = json!({ "kind": "kernels", "id": "set", "modules": { "accel/bvh": "0123" } });
        let done = json!({ "kind": "cell", "unit": "box, structure-0", "outcome": "done", "kernels": "set" });
        lines.extend([line(&[], "", set), line(&[], "", done)]);
        let end = json!({
            "kind": "finished", "wall_s": 1.0, "parts_s": {}, "overhead_s": 0.0, "failed": 0, "skipped": 0,
        });
        lines.push(line(&[], "", end));
        lines
    }

    pub fn side(&self) -> Side {
        Side::new("made", self.lines(), Vec::new())
    }

    fn times(&self, structure: usize, class: usize, hour: f64, random: &mut Random) -> Vec<f64> {
        let Noise { cell, round, .. } = self.noise;
        let base = 1.0 + structure as f64 + 0.3 * class as f64;
        let own = cell * random.heavy();
        let compiled: Vec<f64> = match self.noise.compilation {
            0.0 => vec![0.0; self.compilations],
            spread => (0..self.compilations)
                .map(|_| spread * random.heavy())
                .collect(),
        };
        let mut before = 0.0;
        // Affects all threads of the machine in a round.
        let mut machine = Random::new(self.machine);
        let time = |i: usize| {
            before = 0.5 * before + 0.75f64.sqrt() * random.normal();
            let spike = if random.unit() < self.noise.interrupted {
                1.5f64.ln()
            } else {
                0.0
            };
            let shared = round * machine.normal();
            let chance = own + compiled[i % self.compilations] + round * before;
            base * (self.slower)(structure) * (hour + chance + spike + shared).exp()
        };
        (0..self.rounds).map(time).collect()
    }

    fn structure(&self, structure: usize, hour: f64, random: &mut Random) -> Line {
        let names = ["primary", "bounce"];
        let classes = names.iter().enumerate().map(|(i, class)| {
            let ms = self.times(structure, i, hour, random);
            let rates: Vec<f64> = ms.iter().map(|ms| 1.0 / ms).collect();
            json!({
                "class": class, "rays": 1000, "hit_fraction": 0.75, "ms": ms, "wall_ms": ms, "cpu_ms": ms,
                "mrays_s": raystone::measure::statistics::median_interval(&rates),
                "counters": { "nodes": 20.0 + structure as f64, "box_tests": 40.0, "triangle_tests": 3.0, "stack_high_water": 7 },
            })
        });
        let classes: Vec<Value> = classes.collect();
        let verdicts = names.map(|class| json!({ "class": class, "rays": 1000, "wrong": 0, "ties": 0, "first_wrong": null }));
        let stats = json!({
            "bytes": 6400, "nodes": 50, "leaves": 30, "references": 110, "depth": 9, "sah_cost": 12.5, "epo": 0.4,
            "leaf_histogram": [0, 10, 20],
        });
        let sound = json!({ "rays": 1000, "wrong": 0, "ambiguous": 0 });
        let record = json!({
            "kind": "structure", "build": [{ "name": "build", "ms": 5.0 }], "build_ms": 5.0, "stats": stats,
            "gate": {
                "passed": true, "classes": verdicts, "brute_force": sound, "oracle": sound, "kernel_errors": [], "structural": null,
            },
            "timings": classes, "heat_map": null, "heat_map_max": null, "failure": null,
        });
        let other = self.candidate && structure >= self.structures / 2;
        let kernel = format!("{structure}{}", if other { " changed" } else { "" });
        let key = [
            ("scene", "box"),
            ("accel", &format!("structure-{structure}")),
            ("triangle", "watertight"),
        ];
        line(&key, &kernel, record)
    }

    fn sampler(&self, sampler: usize) -> Vec<Line> {
        let image_seed = if self.other_images { self.seed } else { 7 };
        let error = |replicate: u32, spp: u32| {
            let mut random =
                Random::new(1000 * image_seed + 100 * sampler as u64 + u64::from(replicate));
            let value =
                (self.worse)(sampler) * 0.1 / f64::from(spp) * (0.08 * random.normal()).exp();
            json!({
                "spp": spp,
                "metrics": { "relmse-unbiased/eps=1e-2/v1": value, "mse-unbiased/v1": 2.0 * value, "mae/v1": value.sqrt() },
                "without_part": {
                    "relmse-unbiased/eps=1e-2/v1": [value * 1.0001, value * 0.9999, value * 1.0001, value * 0.9999],
                    "mse-unbiased/v1": [value * 2.0001, value * 1.9999, value * 2.0001, value * 1.9999],
                },
            })
        };
        let replicate = |replicate: u32| {
            let errors: Vec<Value> = [1, 2, 4, 8].map(|spp| error(replicate, spp)).into();
            let hash = format!("{errors:?}");
            let record = json!({
                "kind": "error", "randomised": true, "replicate": replicate, "seed": 1 + replicate, "resolution": [8, 8],
                "errors": errors, "non_finite_pixels": 0, "image_hash": blake3::hash(hash.as_bytes()).to_hex().to_string(),
                "image": null, "error_map": null,
            });
            let key = [
                ("scene", "box"),
                ("integrator", "path"),
                ("sequence", &*format!("sequence-{sampler}")),
                ("decorrelation", "none"),
            ];
            line(&key, "", record)
        };
        let mut lines: Vec<Line> = (0..self.replicates).map(replicate).collect();
        lines.push(stream(sampler));
        lines
    }
}

fn stream(sampler: usize) -> Line {
    let record = json!({
        "kind": "stream", "dimensions": [0, 1], "purpose": "pixel", "randomised": false, "seeds": 1,
        "star": [{ "n": 256, "value": exact(0.01 + 0.001 * sampler as f64) }],
    });
    let name = format!("sequence-{sampler}");
    line(
        &[("sequence", &*name), ("decorrelation", "none")],
        "",
        record,
    )
}

fn reference() -> Line {
    let record = json!({
        "kind": "reference", "spp": 4096, "sampler": "pixel-hash", "seconds": 1.0, "mse": 1e-9, "relmse": 1e-9, "image": "", "mean": 0.5,
    });
    line(&[("scene", "box"), ("integrator", "path")], "", record)
}
