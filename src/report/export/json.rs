//! Figures and checks as printed by `--json`.

use super::{Exported, Source, pretty};
use crate::document::Check;
use crate::samplers::HEAVY_TAILED;
use crate::values::{Estimate, Value};
use serde_json::{Map, Value as Json, json};

/// Version of the output of `--json`, incremented with any change of a field's meaning.
pub const OUTPUT_SCHEMA: &str = "raystone-output/1";

pub(super) fn write(source: &Source) -> Exported {
    let figures = values_json(&source.values);
    Exported::whole(pretty(
        &json!({ "schema": OUTPUT_SCHEMA, "figures": figures }),
    ))
}

/// Returns one object for each value: its key, its row of the table of figures, and the reading: `value` with `low` and
/// `high`, `below`, or `word`.
pub fn values_json(values: &[Value]) -> Json {
    values.iter().map(value_json).collect()
}

fn value_json(value: &Value) -> Json {
    let labels = value.key.labels();
    let labels = labels.map(|(axis, label)| (axis.to_owned(), Json::from(label)));
    let figure = &value.figure;
    let mut object = json!({
        "key": labels.collect::<Map<_, _>>(),
        "figure": figure.id,
        "title": figure.title,
        "unit": figure.unit,
        "better": figure.better,
        "interval": figure.spread,
    });
    let known = match value.estimate {
        Estimate::Known(i) => vec![("value", i.value), ("low", i.low), ("high", i.high)],
        Estimate::HeavyTailed(i) => {
            object["doubt"] = json!(format!("its interval is not to be trusted: {HEAVY_TAILED}"));
            vec![("value", i.value), ("low", i.low), ("high", i.high)]
        }
        Estimate::Below(bound) => vec![("below", bound)],
        Estimate::Word(word) => {
            object["word"] = json!(word);
            Vec::new()
        }
    };
    for (name, number) in known {
        object[name] = json!(number);
    }
    object
}

/// Returns one object for each check: verdict, claim and evidence.
pub fn checks_json(checks: &[Check]) -> Json {
    let object = |check: &Check| json!({ "verdict": check.verdict, "title": check.title, "detail": check.detail });
    checks.iter().map(object).collect()
}
