//! Checks of the merged tree that need no typed reading: unknown sections, keys and names, and
//! sections and patterns that concern nothing on an axis.

use super::axis::Axis;
use super::error::{ConfigError, Place};
use super::experiment::Axes;
use super::faults::Faults;
use super::pattern::Pattern;
use super::settings::Section;
use super::tree::{Item, Table, Value};
use super::{Catalogue, variants};

pub(super) const AXES: &str = "axes";

const CELL_SETS: [&str; 2] = ["exclude", "include"];

/// Checks that every section, key and entry is known.
pub(super) fn check_sections(tree: &Table, catalogue: &Catalogue) -> Result<(), ConfigError> {
    let mut faults = Faults::default();
    for (name, item) in tree {
        faults.keep(check_section(name, item, catalogue));
    }
    faults.end()
}

fn check_section(name: &str, item: &Item, catalogue: &Catalogue) -> Result<(), ConfigError> {
    let axes = Axis::ALL.map(Axis::name);
    let mut faults = Faults::default();
    if let Some(axis) = Axis::from_name(name) {
        for (entry, item) in item.table(name, "sections [NAME] of parameters")? {
            faults.keep(variants::resolve(axis, &item.at, entry, catalogue));
            faults.keep(parameter_tables(axis, entry, item));
        }
    } else if CELL_SETS.contains(&name) {
        for (_, table) in cell_tables(name, item)? {
            faults.keep(check_keys(&key_in(name), table, &axes));
        }
    } else if name == AXES {
        check_keys(&key_in(name), item.table(name, "a section")?, &axes)?;
    } else if catalogue.keys_of(name).is_empty() {
        return Err(unknown_section(name, item, catalogue));
    } else {
        check_settings(name, item, catalogue)?;
    }
    faults.end()
}

/// Checks the keys of a section of settings, and of the tables within it.
fn check_settings(name: &str, item: &Item, catalogue: &Catalogue) -> Result<(), ConfigError> {
    let keys = catalogue.keys_of(name);
    let expected = if name.contains('.') {
        format!("a table of {}", keys.join(", "))
    } else {
        "a section".to_owned()
    };
    let table = item.table(name, &expected)?;
    let mut faults = Faults::default();
    faults.keep(check_keys(&key_in(name), table, &keys));
    for (key, item) in table {
        let within = format!("{name}.{key}");
        if !catalogue.keys_of(&within).is_empty() {
            faults.keep(check_settings(&within, item, catalogue));
        }
    }
    faults.end()
}

fn unknown_section(name: &str, item: &Item, catalogue: &Catalogue) -> ConfigError {
    if name == "intersection" {
        return ConfigError::Refused {
            at: item.at.to_string(),
            reason:
                "its keys are axes: write `triangle`, `box_test` and `offset` under [axes], each a \
                     name or a list of names"
                    .to_owned(),
        };
    }
    let settings = catalogue.sections().iter().map(Section::name);
    let settings = settings.filter(|name| !name.contains('.'));
    let known = settings
        .chain([AXES])
        .chain(CELL_SETS)
        .chain(Axis::ALL.map(Axis::name));
    let what = match item.value {
        Value::Table(_) => "section",
        _ => "key outside all sections",
    };
    ConfigError::unknown(&item.at, what, name, known)
}

pub(super) fn key_in(section: &str) -> String {
    format!("key in [{section}]")
}

/// Checks that keys are among those known; `what` describes them in messages.
pub(super) fn check_keys(what: &str, table: &Table, known: &[&str]) -> Result<(), ConfigError> {
    let mut faults = Faults::default();
    for (name, item) in table {
        let known = known.iter().copied();
        if !known.clone().any(|key| key == name) {
            faults.keep::<()>(Err(ConfigError::unknown(&item.at, what, name, known)));
        }
    }
    faults.end()
}

pub(super) fn cell_tables<'t>(
    section: &str,
    item: &'t Item,
) -> Result<Vec<(&'t Place, &'t Table)>, ConfigError> {
    let expected = format!("a list of tables, each under a line [[{section}]]");
    match &item.value {
        Value::List(items) => items
            .iter()
            .map(|item| Ok((&item.at, item.table(section, &expected)?)))
            .collect(),
        _ => Err(item.wrong_type(section, expected)),
    }
}

/// The parameter tables of an entry: one `[axis.NAME]`, or several separate `[[axis.NAME]]`.
pub(super) fn parameter_tables<'t>(
    axis: Axis,
    entry: &str,
    item: &'t Item,
) -> Result<Vec<&'t Table>, ConfigError> {
    let key = format!("{axis}.{entry}");
    const EXPECTED: &str = "a section of parameters";
    match &item.value {
        Value::List(items) if !items.is_empty() => items
            .iter()
            .map(|item| item.table(&key, EXPECTED))
            .collect(),
        _ => Ok(vec![item.table(&key, EXPECTED)?]),
    }
}

/// Checks that parameter sections are for entries on the axis. If the command line replaced the
/// axis, the file's sections for other entries are allowed.
pub(super) fn check_on_axis(
    axis: Axis,
    parameters: &Table,
    used: &[String],
    replaced: bool,
) -> Result<(), ConfigError> {
    for (name, item) in parameters {
        let left_over = replaced && !matches!(item.at, Place::Override(_));
        if !used.contains(name) && !left_over {
            return Err(ConfigError::NotOnAxis {
                at: item.at.clone(),
                axis: axis.name(),
                name: name.clone(),
                used: used.to_vec(),
            });
        }
    }
    Ok(())
}

/// Patterns that each match a variant of their axis, unless `lenient`.
pub(super) fn pattern_list(
    axis: Axis,
    texts: &[(&Item, &str)],
    axes: &Axes,
    lenient: bool,
) -> Result<Vec<Pattern>, ConfigError> {
    let variants = &axes[axis];
    let patterns = texts.iter().map(|(item, text)| {
        let pattern = Pattern::new(*text);
        let named = pattern.without_negation();
        if !lenient && !variants.iter().any(|variant| named.matches(variant)) {
            return Err(ConfigError::NoMatch {
                at: item.at.to_string(),
                axis: axis.name(),
                pattern: (*text).to_owned(),
                known: variants.iter().map(|v| v.label.clone()).collect(),
            });
        }
        Ok(pattern)
    });
    patterns.collect()
}

/// The texts of a non-empty list; a single text is a list of one.
pub(super) fn texts<'t>(
    key: &str,
    item: &'t Item,
) -> Result<Vec<(&'t Item, &'t str)>, ConfigError> {
    let wrong_type = |item: &Item| item.wrong_type(key, "a text or a list of texts");
    let items = match &item.value {
        Value::Text(_) => std::slice::from_ref(item),
        Value::List(items) => items,
        _ => return Err(wrong_type(item)),
    };
    if items.is_empty() {
        return Err(item.empty(key));
    }
    let text = |item: &'t Item| match &item.value {
        Value::Text(text) => Ok((item, text.as_str())),
        _ => Err(wrong_type(item)),
    };
    items.iter().map(text).collect()
}
