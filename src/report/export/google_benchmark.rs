//! JSON in the format of Google Benchmark's `--benchmark_format=json`
//! (<https://github.com/google/benchmark/blob/main/docs/user_guide.md>): every round is a repetition, which
//! `compare.py` tests with Mann and Whitney's U.

use super::samples::Samples;
use super::{Exported, Source, name, pretty};
use crate::format;
use serde_json::{Value as Json, json};

/// Nanoseconds per millisecond: `compare.py` prints whole numbers.
const NS: f64 = 1e6;

pub(super) fn write(source: &Source) -> Exported {
    let rows = source.samples.iter().enumerate();
    let benchmarks: Vec<Json> = rows
        .flat_map(|(family, s)| repetitions(family, s))
        .collect();
    Exported::whole(pretty(
        &json!({ "context": context(source), "benchmarks": benchmarks }),
    ))
}

fn context(source: &Source) -> Json {
    let mut context = json!({ "json_schema_version": 1, "executable": "raystone" });
    if let Some(run) = source.run() {
        let machine = &run.environment;
        context["date"] = json!(format::utc(run.started_unix_s));
        context["num_cpus"] = json!(machine.cpu_threads);
        context["library_version"] = json!(machine.version);
        context["run"] = json!(run.name);
        context["adapter"] = json!(machine.adapter);
        context["driver"] = json!(format!("{} {}", machine.driver, machine.driver_info));
        context["cpu"] = json!(machine.cpu);
        context["commit"] = json!(machine.commit);
    }
    context
}

/// Returns a repetition for each round: `real_time` by the clock of the figure (the adapter's, or else the wall clock),
/// `cpu_time` by the CPU clock. The format requires the latter: if it was not measured, it is the real time, as the label
/// says.
fn repetitions(family: usize, samples: &Samples) -> Vec<Json> {
    let name = name(&samples.figure.id, &samples.key);
    let (cpu_ms, label) = if samples.cpu_ms.len() == samples.ms.len() {
        (&samples.cpu_ms, "cpu_time: processors, all threads")
    } else {
        (&samples.ms, "cpu_time: not measured, the same as real_time")
    };
    let rounds = samples.ms.iter().zip(cpu_ms).enumerate();
    let repetition = |(index, (ms, cpu_ms)): (usize, (&f64, &f64))| {
        let mut entry = json!({
            "name": name,
            "family_index": family,
            "per_family_instance_index": 0,
            "run_name": name,
            "run_type": "iteration",
            "repetitions": samples.ms.len(),
            "repetition_index": index,
            "threads": 1,
            "iterations": 1,
            "real_time": ms * NS,
            "cpu_time": cpu_ms * NS,
            "time_unit": "ns",
            "label": label,
        });
        if let Some(rays) = samples.rays.filter(|_| *ms > 0.0) {
            entry["items_per_second"] = json!(rays / (ms * 1e-3));
        }
        entry
    };
    rounds.map(repetition).collect()
}
