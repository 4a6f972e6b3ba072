//! Expands names and parameter lists into the variants of an axis.

use super::Catalogue;
use super::axis::Axis;
use super::error::{ConfigError, Place};
use super::faults::Faults;
use super::pattern::split_outside_brackets;
use super::tree::{Item, Table, Value, loose_value};
use super::values::value;
use raystone_core::files::MODEL_ENDINGS;
use raystone_core::params::{
    Entry, ParamRange, ParamValue, Parameter, ParameterSchema, Variant, repeated,
};
use std::path::Path;

/// The entry called `name`; for a model path or kernel folder, a generated one.
pub(super) fn resolve(
    axis: Axis,
    at: &Place,
    text: &str,
    catalogue: &Catalogue,
) -> Result<Entry, ConfigError> {
    let entries = &catalogue[axis];
    if let Some(entry) = entries.iter().find(|entry| entry.name == text) {
        return Ok(entry.clone());
    }
    let path_of = match axis {
        Axis::Scene if is_path(text) => Some("model file"),
        Axis::Kernels => Some("folder of kernels"),
        _ => None,
    };
    if let Some(description) = path_of {
        return Ok(Entry {
            name: text.to_owned(),
            description: description.to_owned(),
            schema: shared_parameters(entries),
        });
    }
    let what = match axis {
        Axis::Scene => {
            "scene (neither built in nor a path of a .obj, .gltf, .glb, .ply or Nori .xml file)"
        }
        axis => axis.name(),
    };
    let known = entries.iter().map(|entry| entry.name.as_str());
    Err(ConfigError::unknown(at, what, text, known))
}

/// The name and the parameters of a label as reports write it, such as `bvh(builder=sbvh)`; `None` for a name alone.
pub(super) fn of_label<'a>(
    axis: Axis,
    item: &Item,
    text: &'a str,
    catalogue: &Catalogue,
) -> Option<(&'a str, Table)> {
    let (name, rest) = text.split_once('(')?;
    let inner = rest.strip_suffix(')')?;
    resolve(axis, &item.at, name, catalogue).ok()?;
    let parameter = |part: &str| {
        let (key, value) = part.split_once('=')?;
        let (at, value) = (item.at.clone(), loose_value(value.trim(), &item.at));
        Some((key.trim().to_owned(), Item { at, value }))
    };
    let parts = split_outside_brackets(inner, ',');
    Some((name, parts.map(parameter).collect::<Option<_>>()?))
}

/// Parameters shared by all entries of an axis, including files.
fn shared_parameters(entries: &[Entry]) -> ParameterSchema {
    let Some((first, others)) = entries.split_first() else {
        return Vec::new();
    };
    let is_shared = |parameter: &&Parameter| {
        let has = |entry: &Entry| entry.schema.iter().any(|p| p.name == parameter.name);
        others.iter().all(has)
    };
    first.schema.iter().filter(is_shared).cloned().collect()
}

fn is_path(text: &str) -> bool {
    text.contains(['/', '\\']) || has_model_ending(Path::new(text))
}

pub(super) fn has_model_ending(path: &Path) -> bool {
    let extension = path.extension().and_then(|e| e.to_str());
    extension.is_some_and(|e| MODEL_ENDINGS.contains(&e.to_lowercase().as_str()))
}

const EMBEDDED: &str = "embedded";

/// Key in a parameter table that restricts its variants to certain cells.
pub(super) const WHEN: &str = "when";

/// All variants of `entry`: the product of the value lists in `section` (one `[axis.NAME]`).
pub(super) fn expand(
    axis: Axis,
    entry: &Entry,
    section: &Table,
) -> Result<Vec<Variant>, ConfigError> {
    let mut faults = Faults::default();
    for (name, item) in section.iter().filter(|(name, _)| name.as_str() != WHEN) {
        let known = entry.schema.iter().map(|p| p.name);
        if !known.clone().any(|key| key == name) {
            let what = format!("parameter of {axis} {}", entry.name);
            faults.keep::<()>(Err(ConfigError::unknown(&item.at, what, name, known)));
        }
    }
    let mut products = vec![Vec::new()];
    for parameter in &entry.schema {
        let Some(item) = section.get(parameter.name) else {
            continue;
        };
        let key = format!("{axis}.{}.{}", entry.name, parameter.name);
        let Some(values) = faults.keep(listed(&key, item, &parameter.range)) else {
            continue;
        };
        check_count(axis, item, products.len().saturating_mul(values.len()))?;
        products = products
            .iter()
            .flat_map(|product| {
                values.iter().map(|value| {
                    let mut product = product.clone();
                    product.push((parameter.name, value.clone()));
                    product
                })
            })
            .collect();
    }
    let variants = products.into_iter().map(|set| entry.variant(&set));
    faults.or(variants.collect())
}

const MAX_VARIANTS: usize = 1024;

/// Checks the number of variants on an axis; `item` is the place for the error.
pub(super) fn check_count(axis: Axis, item: &Item, count: usize) -> Result<(), ConfigError> {
    if count <= MAX_VARIANTS {
        return Ok(());
    }
    Err(ConfigError::TooMany {
        at: item.at.clone(),
        what: format!("the variants on the axis {axis}"),
        count,
        limit: MAX_VARIANTS,
    })
}

/// The values given for one parameter: one, or a list of distinct ones.
fn listed(key: &str, item: &Item, range: &ParamRange) -> Result<Vec<ParamValue>, ConfigError> {
    let items = match &item.value {
        // For a parameter of lists, a list is one value.
        Value::List(items) if !matches!(range, ParamRange::List(..) | ParamRange::Ascending(_)) => {
            items
        }
        _ => std::slice::from_ref(item),
    };
    if items.is_empty() {
        return Err(item.empty(key));
    }
    let values = items.iter().map(|item| value(key, item, range));
    let values: Vec<ParamValue> = values.collect::<Result<_, _>>()?;
    match repeated(&values) {
        None => Ok(values),
        Some(again) => Err(items[again].duplicate(key)),
    }
}

/// Shortens path labels to a unique last component; the empty path becomes [`EMBEDDED`].
pub(super) fn shorten_labels(scenes: &mut [Variant]) {
    let short: Vec<String> = scenes
        .iter()
        .map(|scene| {
            // Parameters may be paths, too, and stay as they are.
            let set = scene.label.strip_prefix(&scene.name).unwrap_or_default();
            let path = scene.label.strip_suffix(set).unwrap_or(&scene.label);
            let mut parts = path.split(['/', '\\']);
            let last = parts.rfind(|part| !part.is_empty());
            if scene.label.is_empty() {
                EMBEDDED.to_owned()
            } else {
                format!("{}{set}", last.unwrap_or(path))
            }
        })
        .collect();
    for (i, scene) in scenes.iter_mut().enumerate() {
        let is_only = short.iter().filter(|other| **other == short[i]).count() == 1;
        if is_only || scene.label.is_empty() {
            scene.label.clone_from(&short[i]);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::params::Params;

    #[test]
    fn short_labels_stay_distinct() {
        let variant = |label: &str| Variant {
            name: label.into(),
            params: Params::default(),
            label: label.into(),
        };
        let mut scenes = ["x/a.obj", "y/a.obj", "../z/b.obj", "dir/", "cornell-box"].map(variant);
        shorten_labels(&mut scenes);
        let labels = scenes.map(|scene| scene.label);
        assert_eq!(
            labels,
            ["x/a.obj", "y/a.obj", "b.obj", "dir", "cornell-box"]
        );
    }

    #[test]
    fn a_separator_or_a_model_extension_makes_a_path() {
        for (text, path) in [
            ("a/b", true),
            ("b.OBJ", true),
            ("b.glb", true),
            ("b.txt", false),
            ("cornell-bxo", false),
        ] {
            assert_eq!(is_path(text), path, "{text}");
        }
    }
}
