//! Sections of settings, which are declared as structs: what is known of them, and how they are read.

use super::error::{ConfigError, Place};
use super::tree::{Item, Table, Value};
use super::values;
use raystone_core::params::{Entry, ParamError, Parameters, Params};
use std::collections::BTreeMap;

/// A section of settings of an experiment, declared by [`parameters!`](raystone_core::parameters).
pub trait Settings: Parameters {
    /// Name of the section; behind a dot, of a table within a section.
    const SECTION: &'static str;
    /// Keys that must be given where the section is. Their defaults are not in their ranges.
    const REQUIRED: &'static [&'static str] = &[];

    /// The key whose value others forbid, and what it must be.
    fn contradiction(&self) -> Option<(&'static str, String)> {
        None
    }
}

/// What the parser knows of a section of settings.
#[derive(Debug, Clone)]
pub struct Section {
    /// Name, meaning and keys.
    pub entry: Entry,
    /// Keys that must be given.
    pub required: &'static [&'static str],
    check: fn(&Params) -> Result<Option<(&'static str, String)>, ParamError>,
}

impl Section {
    /// The section that `S` declares.
    pub fn of<S: Settings>() -> Self {
        Self {
            entry: Entry {
                name: S::SECTION.to_owned(),
                description: S::ABOUT.to_owned(),
                schema: S::schema(),
            },
            required: S::REQUIRED,
            check: |params| Ok(S::from_params(params)?.contradiction()),
        }
    }

    /// Its name.
    pub fn name(&self) -> &str {
        &self.entry.name
    }

    /// Its values where it is written in a tree.
    fn read(&self, tree: &Table, file: &str) -> Result<Option<Params>, ConfigError> {
        let name = self.name();
        let Some(item) = find(tree, name)? else {
            return Ok(None);
        };
        let table = as_table(item, name, "a section")?;
        let key = |key: &str| format!("{name}.{key}");
        let mut params = Params::default();
        for parameter in &self.entry.schema {
            let name = parameter.name;
            match table.get(name) {
                Some(item) => {
                    let value = values::value(&key(name), item, &parameter.range)?;
                    params.0.insert(name.to_owned(), value);
                }
                None if self.required.contains(&name) => {
                    return Err(ConfigError::Missing {
                        at: place_in(file, item),
                        key: key(name),
                        expected: parameter.range.to_string(),
                    });
                }
                None => {}
            }
        }
        match (self.check)(&params) {
            Ok(None) => Ok(Some(params)),
            Ok(Some((name, expected))) => {
                let default = self.entry.schema.iter().find(|p| p.name == name);
                let default = default.map(|p| p.default.to_string());
                Err(not_allowed(table, &key(name), default, expected))
            }
            Err(error) => Err(ConfigError::Refused {
                at: format!("{}: [{name}]", item.at),
                reason: error.to_string(),
            }),
        }
    }
}

/// Where something is missing from `item`; the begin of the file, if the item is not written there.
fn place_in(file: &str, item: &Item) -> Place {
    match &item.at {
        Place::Default => Place::start_of(file),
        at => at.clone(),
    }
}

/// The error for a value that its own range allows and another key forbids.
pub(super) fn not_allowed(
    section: &Table,
    key: &str,
    default: Option<String>,
    expected: String,
) -> ConfigError {
    let name = key.rsplit('.').next().unwrap_or(key);
    let item = section.get(name);
    ConfigError::OutOfRange {
        at: item.map_or(Place::Default, |item| item.at.clone()),
        key: key.to_owned(),
        value: match item {
            Some(item) => item.value.to_string(),
            None => default.unwrap_or_default(),
        },
        expected,
    }
}

/// The item of a section, or of a table within one.
fn find<'t>(tree: &'t Table, name: &str) -> Result<Option<&'t Item>, ConfigError> {
    match name.split_once('.') {
        None => Ok(tree.get(name)),
        Some((outer, inner)) => match tree.get(outer) {
            Some(item) => find(as_table(item, outer, "a section")?, inner),
            None => Ok(None),
        },
    }
}

/// The settings of all sections that are written.
pub(super) type Read = BTreeMap<String, Params>;

/// Reads and checks the values of all sections.
pub(super) fn read_all(
    sections: &[Section],
    tree: &Table,
    file: &str,
) -> Result<Read, ConfigError> {
    let mut read = Read::new();
    for section in sections {
        if let Some(params) = section.read(tree, file)? {
            read.insert(section.name().to_owned(), params);
        }
    }
    Ok(read)
}

/// Takes the settings of a section, which were checked.
pub(super) fn take<S: Settings>(read: &mut Read) -> Option<S> {
    read.remove(S::SECTION)
        .map(|params| S::from_checked(&params))
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
