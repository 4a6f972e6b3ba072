//! Custom results of github-action-benchmark (<https://github.com/benchmark-action/github-action-benchmark>): one file
//! for each direction, since the action compares a whole file in one.

use super::{Exported, Source, name, numbers, pretty};
use raystone_record::figure::Better;
use serde_json::{Value as Json, json};

pub(super) fn bigger(source: &Source) -> Exported {
    of_direction(source, Better::Higher)
}

pub(super) fn smaller(source: &Source) -> Exported {
    of_direction(source, Better::Lower)
}

fn of_direction(source: &Source, direction: Better) -> Exported {
    let (numbers, left_out) = numbers(&source.values, &[direction]);
    let entries = numbers.iter().map(|number| {
        let figure = &number.value.figure;
        let mut entry = json!({
            "name": name(&figure.id, &number.value.key),
            "unit": figure.unit,
            "value": number.at,
            "extra": format!("{} ({})", figure.title, number.value.spread_words()),
        });
        if let Some([low, high]) = number.bounds {
            entry["range"] = json!(format!("{low} to {high}"));
        }
        entry
    });
    Exported {
        text: pretty(&Json::Array(entries.collect())),
        left_out,
    }
}
