//! Checks of the merged tree that need no typed reading: is every section, key and name known, and
//! does every section and pattern concern something that is on an axis.

use super::error::{ConfigError, Place};
use super::experiment::Axes;
use super::keys::{self, Axis};
use super::pattern::Pattern;
use super::tree::{Item, Table, Value};
use super::{Catalogue, variants};

fn owned(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// Every section, key and entry that is written must be known.
pub(super) fn check_sections(tree: &Table, catalogue: &Catalogue) -> Result<(), ConfigError> {
    let sections = keys::sections();
    for (name, item) in tree {
        if name == "intersection" {
            return Err(ConfigError::Refused {
                at: item.at.to_string(),
                reason: "its keys are axes: write `triangle`, `box_test` and `offset` under [axes], each a \
                         name or a list of names"
                    .to_owned(),
            });
        }
        if !sections.contains(&name.as_str()) {
            let what = match item.value {
                Value::Table(_) => "section",
                _ => "key outside all sections",
            };
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: what.to_owned(),
                name: name.clone(),
                known: owned(&sections),
            });
        }
        if let Some(axis) = Axis::from_name(name) {
            let section = as_table(item, name, "sections [NAME] of parameters")?;
            for (entry, item) in section {
                variants::resolve(axis, item, entry, catalogue)?;
                parameter_tables(axis, entry, item)?;
            }
        } else if name == "exclude" || name == "include" {
            for (_, table) in cell_tables(name, item)? {
                check_keys(name, table)?;
            }
        } else {
            check_keys(name, as_table(item, name, "a section")?)?;
        }
    }
    Ok(())
}

fn check_keys(section: &str, table: &Table) -> Result<(), ConfigError> {
    for (name, item) in table {
        if keys::find(section, name).is_none() {
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("key in [{section}]"),
                name: name.clone(),
                known: owned(&keys::names_in(section)),
            });
        }
    }
    Ok(())
}

pub(super) fn as_table<'t>(
    item: &'t Item,
    key: &str,
    expected: &str,
) -> Result<&'t Table, ConfigError> {
    match &item.value {
        Value::Table(table) => Ok(table),
        other => Err(ConfigError::WrongType {
            at: item.at.clone(),
            key: key.to_owned(),
            expected: expected.to_owned(),
            found: other.describe(),
        }),
    }
}

/// The tables of a section that names cells.
pub(super) fn cell_tables<'t>(
    section: &str,
    item: &'t Item,
) -> Result<Vec<(&'t Place, &'t Table)>, ConfigError> {
    let expected = format!("a list of tables, each under a line [[{section}]]");
    match &item.value {
        Value::List(items) => items
            .iter()
            .map(|item| Ok((&item.at, as_table(item, section, &expected)?)))
            .collect(),
        other => Err(ConfigError::WrongType {
            at: item.at.clone(),
            key: section.to_owned(),
            expected,
            found: other.describe(),
        }),
    }
}

/// The parameter tables of an entry: one `[axis.NAME]`, or several `[[axis.NAME]]`, each of which
/// makes variants of its own.
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
            .map(|item| as_table(item, &key, EXPECTED))
            .collect(),
        _ => Ok(vec![as_table(item, &key, EXPECTED)?]),
    }
}

/// Sections with parameters are for entries on the axis. Where the command line replaced the axis,
/// the file's sections for other entries are left over, not wrong.
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

/// Patterns that each fit a variant of their axis, unless `lenient`.
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
