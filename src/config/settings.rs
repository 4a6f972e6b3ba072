//! Sections of settings, declared as structs, and their reading.

use super::error::{ConfigError, Place};
use super::faults::Faults;
use super::tree::{Item, Table, Value};
use super::values;
use raystone_core::params::{Entry, ParamError, Parameters, Params};
use std::collections::BTreeMap;

/// A key whose value conflicts with others, and the allowed values.
pub type Contradiction = (&'static str, String);

/// A section of experiment settings, declared by [`parameters!`](raystone_core::parameters).
pub trait Settings: Parameters {
    /// Section name; after a dot, that of a table within a section.
    const SECTION: &'static str;
    /// Required keys, whose defaults lie outside their ranges.
    const REQUIRED: &'static [&'static str] = &[];

    /// A conflict between two of its values.
    fn contradiction(&self) -> Option<Contradiction> {
        None
    }
}

/// The parser's description of a section of settings.
#[derive(Debug, Clone)]
pub struct Section {
    /// Name, meaning and keys.
    pub entry: Entry,
    /// Keys that must be given.
    pub required: &'static [&'static str],
    check: fn(&Params) -> Result<Option<Contradiction>, ParamError>,
}

impl Section {
    /// The section declared by `S`.
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

    /// Section name.
    pub fn name(&self) -> &str {
        &self.entry.name
    }

    /// Its values, if present in a tree.
    fn read(&self, tree: &Table) -> Result<Option<Params>, ConfigError> {
        let name = self.name();
        let Some(item) = find(tree, name) else {
            return Ok(None);
        };
        let table = item.table(name, "a section")?;
        let key = |key: &str| format!("{name}.{key}");
        let (mut params, mut faults) = (Params::default(), Faults::default());
        for parameter in &self.entry.schema {
            let name = parameter.name;
            match table.get(name) {
                Some(item) => {
                    let value = values::value(&key(name), item, &parameter.range);
                    let value = faults.keep(value).map(|value| (name.to_owned(), value));
                    params.0.extend(value);
                }
                None if self.required.contains(&name) => {
                    faults.keep::<()>(Err(ConfigError::Missing {
                        at: item.at.clone(),
                        key: key(name),
                        expected: parameter.range.to_string(),
                    }));
                }
                None => {}
            }
        }
        faults.end()?;
        match (self.check)(&params) {
            Ok(None) => Ok(Some(params)),
            Ok(Some((name, expected))) => {
                let known = self.entry.schema.iter();
                let default = known.filter(|p| p.name == name).map(|p| &p.default);
                let default: String = default.map(ToString::to_string).collect();
                Err(not_allowed(tree, &key(name), default, expected))
            }
            Err(error) => Err(ConfigError::Refused {
                at: format!("{}: [{name}]", item.at),
                reason: error.to_string(),
            }),
        }
    }
}

/// The error for a value in range but forbidden by another key.
pub(super) fn not_allowed(
    tree: &Table,
    key: &str,
    default: impl ToString,
    expected: String,
) -> ConfigError {
    let unwritten = || ConfigError::OutOfRange {
        at: Place::Default,
        key: key.to_owned(),
        value: default.to_string(),
        expected: expected.clone(),
    };
    find(tree, key).map_or_else(unwritten, |item| item.out_of_range(key, &expected))
}

/// The item of a section, or of a table within it, named with dots.
pub(super) fn find<'t>(tree: &'t Table, name: &str) -> Option<&'t Item> {
    match name.split_once('.') {
        None => tree.get(name),
        Some((outer, inner)) => match &tree.get(outer)?.value {
            Value::Table(table) => find(table, inner),
            _ => None,
        },
    }
}

/// The settings of all sections present.
pub(super) type Read = BTreeMap<String, Params>;

pub(super) fn read_all(sections: &[Section], tree: &Table) -> Result<Read, ConfigError> {
    let (mut read, mut faults) = (Read::new(), Faults::default());
    for section in sections {
        let params = faults.keep(section.read(tree)).flatten();
        read.extend(params.map(|params| (section.name().to_owned(), params)));
    }
    faults.or(read)
}

/// Removes and returns the checked settings of a section.
pub(super) fn take<S: Settings>(read: &mut Read) -> Option<S> {
    read.remove(S::SECTION)
        .map(|params| S::from_checked(&params))
}
