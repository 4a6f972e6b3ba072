//! Registry entries, and variants: entries with parameters set.

use super::{ParamValue, Parameter, ParameterSchema, Params};
use serde::{Deserialize, Serialize};
use std::fmt;

/// Description of a registry entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name as typed.
    pub name: String,
    /// One line: description and source (paper).
    pub description: String,
    /// Its parameters.
    pub schema: ParameterSchema,
}

impl Entry {
    /// The entry with all parameters at their defaults.
    pub fn default_variant(&self) -> Variant {
        self.variant(&[])
    }

    /// The entry with some parameters set; the label shows those that differ from the default.
    pub fn variant(&self, set: &[(&'static str, ParamValue)]) -> Variant {
        let value_of = |parameter: &Parameter| {
            let set = set.iter().find(|(name, _)| *name == parameter.name);
            set.map_or(&parameter.default, |(_, value)| value).clone()
        };
        let mut params = Params::default();
        let mut shown = Vec::new();
        for parameter in &self.schema {
            let value = value_of(parameter);
            if value != parameter.default {
                shown.push(format!("{}={value}", parameter.name));
            }
            params.0.insert(parameter.name.to_owned(), value);
        }
        let label = match shown.as_slice() {
            [] => self.name.clone(),
            shown => format!("{}({})", self.name, shown.join(",")),
        };
        Variant {
            name: self.name.clone(),
            params,
            label,
        }
    }
}

/// A registry entry with all its parameters set.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Variant {
    /// Name in the registry.
    pub name: String,
    /// Every parameter, defaults included.
    pub params: Params,
    /// Short text that distinguishes the variants of one experiment: the name, and in brackets the parameters that
    /// differ from the default.
    pub label: String,
}

impl Variant {
    /// An entry without parameters.
    pub fn plain(name: &str) -> Self {
        Self {
            name: name.to_owned(),
            params: Params::default(),
            label: name.to_owned(),
        }
    }
}

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::params::ParamRange;

    #[test]
    fn labels_show_only_what_differs_from_the_default() {
        let number = |name, default| Parameter {
            name,
            description: "",
            default: ParamValue::Number(default),
            range: ParamRange::Number {
                min: 0.0,
                max: 10.0,
            },
        };
        let entry = Entry {
            name: "grid".into(),
            description: String::new(),
            schema: vec![number("b", 1.0), number("a", 2.0)],
        };
        assert_eq!(entry.default_variant().label, "grid");
        let set = [
            ("a", ParamValue::Number(2.0)),
            ("b", ParamValue::Number(0.5)),
        ];
        let variant = entry.variant(&set);
        assert_eq!(variant.label, "grid(b=0.5)");
        assert_eq!(variant.params.0["a"], ParamValue::Number(2.0));
    }
}
