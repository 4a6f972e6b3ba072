//! Lines of `raystone/1`, whose bodies each held their own names of axes.

use super::{SCHEMA, axis};
use serde_json::{Map, Value, json};

/// The version before this one.
pub(crate) const OLD_SCHEMA: &str = "raystone/1";

/// Axes that stood in bodies, and in what they ran with.
const IN_BODY: [&str; 5] = [
    axis::SCENE,
    axis::ACCEL,
    axis::SEQUENCE,
    axis::DECORRELATION,
    axis::INTEGRATOR,
];
const IN_RAN: [&str; 4] = [axis::KERNELS, axis::TRIANGLE, axis::BOX_TEST, axis::OFFSET];

/// What stood between a name and its kernels.
const KERNELS_MARK: &str = " @";

/// The same line in the present schema.
pub(crate) fn renewed(mut line: Value) -> Value {
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
