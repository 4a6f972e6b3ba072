//! Lines of versions before this one, as lines of this one.
//!
//! Bodies of `raystone/1` each held their own names of axes. In `raystone/2` compactions and the cost of
//! samplers had bodies of their own, whose figures are readings now.

use super::{Body, Interval, MeasuredRecord, Reading, SCHEMA, Samples, axis};
use crate::figure::{self, Figure};
use serde::Deserialize;
use serde_json::{Map, Value, json};

/// The versions before this one.
const OLD_SCHEMAS: [&str; 2] = ["raystone/1", "raystone/2"];

/// Returns `true` if a file of records of the schema `wanted` may have lines of this one, which can be [`renewed`].
pub(crate) fn is_old(schema: &str, wanted: &str) -> bool {
    wanted == SCHEMA && OLD_SCHEMAS.contains(&schema)
}

/// Axes that older schemas wrote into bodies, and into `ran`.
const IN_BODY: [&str; 5] = [
    axis::SCENE,
    axis::ACCEL,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::INTEGRATOR,
];
const IN_RAN: [&str; 4] = [axis::KERNELS, axis::TRIANGLE, axis::BOX_TEST, axis::OFFSET];

/// The separator of a name and its kernels.
const KERNELS_MARK: &str = " @";

/// Returns the same line in the present schema.
///
/// # Errors
/// A line that is no object, or a body that lacks a field.
pub(crate) fn renewed(line: Value) -> serde_json::Result<Value> {
    if !line.is_object() {
        return Err(serde::de::Error::custom("a line is an object"));
    }
    let mut line = if line.get("schema").and_then(Value::as_str) == Some(OLD_SCHEMAS[0]) {
        with_key(line)
    } else {
        line
    };
    line["schema"] = SCHEMA.into();
    let body = &line["body"];
    let found = match body["kind"].as_str() {
        Some("compaction") => Compaction::deserialize(body)?.measured(),
        Some("sampler-cost") => SamplerCost::deserialize(body)?.measured(),
        _ => return Ok(line),
    };
    let (measured, readings) = found;
    line["readings"] = serde_json::to_value(readings)?;
    line["body"] = serde_json::to_value(Body::Measured(measured))?;
    Ok(line)
}

/// A compaction of a stream, as `raystone/2` wrote it.
#[derive(Deserialize)]
struct Compaction {
    elements: u32,
    bytes: u32,
    passes: u32,
    kept: u32,
    scratch_bytes: u64,
    least_bytes: u64,
    ms: Vec<f64>,
    wall_ms: Vec<f64>,
    ns_per_element: Option<Interval>,
    melements_s: Option<Interval>,
    gb_s: Option<Interval>,
    failure: Option<String>,
}

impl Compaction {
    fn measured(self) -> (MeasuredRecord, Vec<Reading>) {
        let readings = self.readings();
        let measured = MeasuredRecord {
            measurement: "compaction".to_owned(),
            failure: self.failure,
            ..MeasuredRecord::default()
        };
        (measured, readings)
    }

    fn readings(&self) -> Vec<Reading> {
        let Some(ns) = self.ns_per_element.filter(|_| self.failure.is_none()) else {
            return Vec::new();
        };
        let per_element = |ms: &[f64]| {
            ms.iter()
                .map(|ms| ms * 1e6 / f64::from(self.elements))
                .collect()
        };
        let samples = Samples::Rounds {
            adapter: per_element(&self.ms),
            wall: per_element(&self.wall_ms),
            processors: Vec::new(),
        };
        let work = format!("{} elements of {} bytes", self.elements, self.bytes);
        let of = |figure: &Figure, value: Option<Interval>| {
            value.map(|value| Reading::new(figure, value))
        };
        let mut readings = vec![
            Reading::new(&figure::COMPACTION_NS, ns)
                .with_samples(samples)
                .of_work(work),
        ];
        readings.extend(of(&figure::COMPACTION_MELEMENTS_PER_S, self.melements_s));
        readings.extend(of(&figure::COMPACTION_GB_PER_S, self.gb_s));
        let counted = [
            (&figure::COMPACTION_PASSES, f64::from(self.passes)),
            (&figure::COMPACTION_KEPT, f64::from(self.kept)),
            (&figure::COMPACTION_LEAST_BYTES, self.least_bytes as f64),
            (&figure::COMPACTION_SCRATCH, self.scratch_bytes as f64),
        ];
        readings.extend(counted.map(|(figure, value)| Reading::exact(figure, value)));
        readings
    }
}

/// Cost of drawing from a sampler, as `raystone/2` wrote it.
#[derive(Deserialize)]
struct SamplerCost {
    ns_per_sample: Interval,
    loop_ns_per_sample: Interval,
}

impl SamplerCost {
    fn measured(self) -> (MeasuredRecord, Vec<Reading>) {
        let measured = MeasuredRecord {
            measurement: "sampler-cost".to_owned(),
            ..MeasuredRecord::default()
        };
        let readings = [
            Reading::new(&figure::NS_PER_SAMPLE, self.ns_per_sample),
            Reading::new(&figure::LOOP_NS, self.loop_ns_per_sample),
        ];
        (measured, readings.into())
    }
}

/// Returns a line of `raystone/1` with a key and a body.
fn with_key(mut line: Value) -> Value {
    let mut take = |name: &str| line.as_object_mut().and_then(|line| line.remove(name));
    let hash = take("hash").unwrap_or_default();
    let Some(Value::Object(mut body)) = take("record") else {
        return json!({ "schema": SCHEMA });
    };
    let mut key = Map::new();
    let mut ran = match body.remove("ran") {
        Some(Value::Object(ran)) => ran,
        _ => Map::new(),
    };
    key.extend(IN_RAN.iter().filter_map(|axis| ran.remove_entry(*axis)));
    key.extend(IN_BODY.iter().filter_map(|axis| body.remove_entry(*axis)));
    let mark = key.get(axis::KERNELS).and_then(Value::as_str);
    if let Some(mark) = mark.map(|kernels| format!("{KERNELS_MARK}{kernels}")) {
        let labels = key
            .values_mut()
            .filter_map(|variant| variant.get_mut("label"));
        for label in labels {
            let stem = label.as_str().and_then(|text| text.strip_suffix(&mark));
            if let Some(stem) = stem.map(str::to_owned) {
                *label = stem.into();
            }
        }
    }
    ran.extend(body.remove_entry("features"));
    let unchecked = body.remove("runtime_checks") == Some(Value::Bool(false));
    ran.insert("unchecked".into(), unchecked.into());
    let points = body.get_mut("star").and_then(Value::as_array_mut);
    for point in points
        .into_iter()
        .flatten()
        .filter_map(Value::as_object_mut)
    {
        let star = point.remove("star");
        point.extend(star.map(|star| ("value".to_owned(), star)));
    }
    if let Some(Value::String(verdict)) = body.get_mut("verdict")
        && let Some(("not-testable", reason)) = verdict.split_once(": ")
    {
        let reason = json!({ "not-testable": reason });
        body.insert("verdict".into(), reason);
    }
    json!({ "schema": SCHEMA, "key": key, "hash": hash, "ran": ran, "body": body })
}
