//! The JSON Schema of the records, from their types.

use raystone_record::{Line, SCHEMA};
use schemars::schema_for;
use serde_json::{Value, json};

/// Returns the JSON Schema (draft 2020-12) of a line of `records.jsonl`. Descriptions come from the fields' documentation.
pub fn record_schema() -> Value {
    let mut schema = schema_for!(Line).to_value();
    schema["title"] = json!(format!("a line of records.jsonl, {SCHEMA}"));
    schema["properties"]["schema"]["const"] = json!(SCHEMA);
    schema
}
