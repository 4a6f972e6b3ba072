//! The shapes that tools require, and the part of JSON Schema that the schema of records uses.

use serde_json::Value;
use std::collections::BTreeSet;

type Checked = Result<(), String>;

fn fail(what: &str, value: &Value) -> Checked {
    Err(format!("{what}: {value}"))
}

fn number(value: &Value, field: &str) -> Result<f64, String> {
    let found = value[field].as_f64();
    found.ok_or_else(|| format!("{field} is no number: {value}"))
}

/// <https://bencher.dev/bmf.json>, with the lengths that the documentation gives.
pub fn bencher(file: &Value) -> Checked {
    let benchmarks = file.as_object().ok_or("no object")?;
    for (name, measures) in benchmarks {
        if name.is_empty() || name.chars().count() > 1024 {
            return fail("name of a benchmark", measures);
        }
        for (measure, metric) in measures.as_object().ok_or("no measures")? {
            if measure.is_empty() || measure.len() > 64 {
                return fail("name of a measure", metric);
            }
            let value = number(metric, "value")?;
            for (bound, sign) in [("lower_value", 1.0), ("upper_value", -1.0)] {
                if !metric[bound].is_null() && (value - number(metric, bound)?) * sign < 0.0 {
                    return fail("bounds on the wrong side", metric);
                }
            }
        }
    }
    if benchmarks.is_empty() {
        Err("no benchmark".into())
    } else {
        Ok(())
    }
}

/// `BenchmarkResult` of the action's `src/extract.ts`; its charts distinguish benchmarks by name.
pub fn github(file: &Value) -> Checked {
    let entries = file.as_array().ok_or("no array")?;
    let mut names = BTreeSet::new();
    for entry in entries {
        number(entry, "value")?;
        let texts = [
            ("name", true),
            ("unit", true),
            ("range", false),
            ("extra", false),
        ];
        for (field, needed) in texts {
            if !(entry[field].is_string() || (!needed && entry[field].is_null())) {
                return fail(field, entry);
            }
        }
        if !names.insert(entry["name"].as_str()) {
            return fail("a name twice", entry);
        }
    }
    if entries.is_empty() {
        Err("no entry".into())
    } else {
        Ok(())
    }
}

/// The format that `tools/gbench/report.py` reads, with repetitions numbered from 0.
pub fn google_benchmark(file: &Value) -> Checked {
    if !file["context"].is_object() {
        return Err("no context".into());
    }
    let benchmarks = file["benchmarks"].as_array().ok_or("no benchmarks")?;
    let mut next = 0;
    for one in benchmarks {
        if number(one, "real_time")? < 0.0 || number(one, "cpu_time")? < 0.0 {
            return fail("a negative time", one);
        }
        let repetition = number(one, "repetition_index")? as usize;
        let sound = one["run_type"] == "iteration"
            && one["time_unit"] == "ns"
            && one["name"].is_string()
            && one["run_name"] == one["name"]
            && repetition == next;
        if !sound {
            return fail("no repetition", one);
        }
        next = repetition + 1;
        if number(one, "repetitions")? as usize == next {
            next = 0;
        }
    }
    if next == 0 && !benchmarks.is_empty() {
        Ok(())
    } else {
        Err("a family with too few repetitions, or none".into())
    }
}

/// The fields of hyperfine's `BenchmarkResult`, and statistics that are those of the times.
pub fn hyperfine(file: &Value) -> Checked {
    let results = file["results"].as_array().ok_or("no results")?;
    for one in results {
        let times = one["times"].as_array().ok_or("no times")?;
        let times: Vec<f64> = times.iter().filter_map(Value::as_f64).collect();
        let mean = times.iter().sum::<f64>() / times.len() as f64;
        let off = (number(one, "mean")? - mean).abs();
        let inside = times.iter().all(|t| {
            let (Ok(min), Ok(max)) = (number(one, "min"), number(one, "max")) else {
                return false;
            };
            min <= *t && *t <= max
        });
        let sound = one["command"].is_string()
            && one["exit_codes"].as_array().map(Vec::len) == Some(times.len())
            && one["parameters"].is_object()
            && off <= 1e-9 * mean.abs()
            && inside;
        if !sound {
            return fail("no result", one);
        }
        number(one, "median")?;
    }
    if results.is_empty() {
        Err("no result".into())
    } else {
        Ok(())
    }
}

/// Checks that a value fits a schema: types, constants, enumerations, references, alternatives, properties, items and
/// bounds.
pub fn validate(root: &Value, schema: &Value, value: &Value) -> Checked {
    if let Some(reference) = schema["$ref"].as_str() {
        let target = root.pointer(reference.trim_start_matches('#'));
        validate(root, target.ok_or("a reference to nothing")?, value)?;
    }
    if !schema["const"].is_null() && schema["const"] != *value {
        return fail("not the constant", value);
    }
    if let Some(values) = schema["enum"].as_array()
        && !values.contains(value)
    {
        return fail("none of the names", value);
    }
    for part in schema["allOf"].as_array().into_iter().flatten() {
        validate(root, part, value)?;
    }
    for (word, most) in [("anyOf", usize::MAX), ("oneOf", 1)] {
        if let Some(parts) = schema[word].as_array() {
            let fits = parts
                .iter()
                .filter(|part| validate(root, part, value).is_ok())
                .count();
            if fits == 0 || fits > most {
                return Err(format!("{fits} alternatives fit: {value}"));
            }
        }
    }
    of_type(schema, value)?;
    of_object(root, schema, value)?;
    of_array(root, schema, value)
}

fn of_type(schema: &Value, value: &Value) -> Checked {
    let is = |name: &str| match name {
        "object" => value.is_object(),
        "array" => value.is_array(),
        "string" => value.is_string(),
        "boolean" => value.is_boolean(),
        "null" => value.is_null(),
        "number" => value.is_number(),
        "integer" => value.is_i64() || value.is_u64(),
        _ => false,
    };
    let fits = match &schema["type"] {
        Value::String(name) => is(name),
        Value::Array(names) => names.iter().filter_map(Value::as_str).any(is),
        _ => true,
    };
    let least = schema["minimum"].as_f64().zip(value.as_f64());
    if fits && least.is_none_or(|(least, value)| value >= least) {
        Ok(())
    } else {
        fail(&format!("not of type {}", schema["type"]), value)
    }
}

fn of_object(root: &Value, schema: &Value, value: &Value) -> Checked {
    let Some(fields) = value.as_object() else {
        return Ok(());
    };
    for name in schema["required"].as_array().into_iter().flatten() {
        if !name.as_str().is_some_and(|name| fields.contains_key(name)) {
            return fail(&format!("{name} is missing"), value);
        }
    }
    for (name, field) in fields {
        let inside = |fault| format!("{name}: {fault}");
        match (&schema["properties"][name], &schema["additionalProperties"]) {
            (Value::Null, Value::Bool(false)) => return fail(&format!("{name} is unknown"), value),
            (Value::Null, Value::Object(_)) => {
                validate(root, &schema["additionalProperties"], field).map_err(inside)?;
            }
            (Value::Null, _) => {}
            (property, _) => validate(root, property, field).map_err(inside)?,
        }
    }
    Ok(())
}

fn of_array(root: &Value, schema: &Value, value: &Value) -> Checked {
    let items = value.as_array().into_iter().flatten();
    for (index, item) in items.enumerate() {
        let first = &schema["prefixItems"][index];
        let schema = if first.is_null() {
            &schema["items"]
        } else {
            first
        };
        if schema.is_object() {
            validate(root, schema, item).map_err(|fault| format!("[{index}]: {fault}"))?;
        }
    }
    Ok(())
}
