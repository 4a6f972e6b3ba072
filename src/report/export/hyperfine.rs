//! JSON in the format of `hyperfine --export-json` (<https://github.com/sharkdp/hyperfine>): every round is a run of a
//! command. User and system time and exit codes are unknown: null.

use super::samples::Samples;
use super::{Exported, Source, name, pretty};
use raystone_stats::statistics::{mean, median, variance};
use serde_json::{Map, Value as Json, json};

pub(super) fn write(source: &Source) -> Exported {
    let results: Vec<Json> = source.samples.iter().map(result).collect();
    Exported::whole(pretty(&json!({ "results": results })))
}

fn result(samples: &Samples) -> Json {
    let seconds: Vec<f64> = samples.ms.iter().map(|ms| ms * 1e-3).collect();
    let labels = samples.key.labels();
    let labels = labels.map(|(axis, label)| (axis.to_owned(), Json::from(label)));
    let parameters: Map<String, Json> = labels.collect();
    json!({
        "command": name(&samples.figure.id, &samples.key),
        "mean": mean(&seconds),
        "stddev": variance(&seconds).map(f64::sqrt),
        "median": median(&seconds),
        "user": null,
        "system": null,
        "min": seconds.iter().copied().reduce(f64::min),
        "max": seconds.iter().copied().reduce(f64::max),
        "times": seconds,
        "exit_codes": vec![Json::Null; seconds.len()],
        "parameters": parameters,
    })
}
