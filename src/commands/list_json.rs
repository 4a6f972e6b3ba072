//! `raystone list --json`.

use super::adapters;
use super::list::{Topic, default};
use clap::ValueEnum as _;
use raystone::config::Catalogue;
use raystone::discrepancy::Measure;
use raystone::export::FORMATS;
use raystone::measure::figure::FIGURES;
use raystone::measure::metrics::METRICS;
use raystone::params::Entry;
use raystone::scene::{LIGHT_KINDS, MATERIAL_KINDS};
use serde_json::{Value, json};

/// Topic → its entries.
pub fn lists(topics: &[Topic], catalogue: &Catalogue) -> Value {
    let name = |topic: &Topic| {
        let value = topic.to_possible_value();
        value.map_or(String::new(), |value| value.get_name().replace('-', "_"))
    };
    let lists = topics
        .iter()
        .map(|topic| (name(topic), list(*topic, catalogue)));
    json!({ "lists": lists.collect::<serde_json::Map<_, _>>() })
}

fn list(topic: Topic, catalogue: &Catalogue) -> Value {
    if let Some(axis) = topic.axis() {
        return catalogue[axis].iter().map(entry).collect();
    }
    let named = |name: &str, description: &str| json!({ "name": name, "description": description });
    match topic {
        Topic::Setting => catalogue.sections().iter().map(|section| entry(&section.entry)).collect(),
        Topic::Material => (MATERIAL_KINDS.iter())
            .map(|kind| json!({ "name": kind.name, "description": kind.description, "parameters": kind.parameters }))
            .collect(),
        Topic::Light => LIGHT_KINDS.iter().map(|kind| named(kind.name, kind.description)).collect(),
        Topic::Metric => METRICS.iter().map(|metric| named(metric.id, metric.description)).collect(),
        Topic::Measure => Measure::ALL.iter().map(|m| named(m.name(), m.description())).collect(),
        Topic::Format => FORMATS.iter().map(|format| named(format.name, format.description)).collect(),
        Topic::Figure => FIGURES.iter().map(|figure| json!(figure)).collect(),
        _ => raystone::gpu::adapters().iter().map(adapters::json).collect(),
    }
}

fn entry(entry: &Entry) -> Value {
    let parameters = entry.schema.iter().map(|p| {
        json!({
            "name": p.name,
            "default": default(p),
            "range": p.range.to_string(),
            "description": p.description,
        })
    });
    json!({
        "name": entry.name,
        "description": entry.description,
        "parameters": parameters.collect::<Vec<Value>>(),
    })
}
