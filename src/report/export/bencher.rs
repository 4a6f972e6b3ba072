//! Bencher Metric Format (<https://bencher.dev/docs/reference/bencher-metric-format>): benchmark → measure →
//! value and bounds. A measure is the id of a figure as a slug; the better direction is set in Bencher.

use super::{Exported, Source, numbers, pretty};
use raystone_record::figure::Better::{Higher, Lower, Neither};
use serde_json::{Map, Value as Json, json};

pub(super) fn write(source: &Source) -> Exported {
    let (numbers, left_out) = numbers(&source.values, &[Higher, Lower, Neither]);
    let mut benchmarks: Map<String, Json> = Map::new();
    for number in numbers {
        let metric = match number.bounds {
            Some([low, high]) => {
                json!({ "value": number.at, "lower_value": low, "upper_value": high })
            }
            None => json!({ "value": number.at }),
        };
        let key = number.value.key.to_string();
        let name = if key.is_empty() {
            "run".to_owned()
        } else {
            key
        };
        let measures = benchmarks.entry(name).or_insert_with(|| json!({}));
        measures[number.value.figure.id.replace('/', "-")] = metric;
    }
    Exported {
        text: pretty(&Json::Object(benchmarks)),
        left_out,
    }
}
