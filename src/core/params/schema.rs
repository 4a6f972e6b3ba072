//! What values parameters may take, and why some do not fit.

use super::{ParamValue, Params};
use crate::text::nearest;
use std::fmt;
use thiserror::Error;

/// What values a parameter may take.
#[derive(Debug, Clone, PartialEq)]
pub enum ParamRange {
    /// A real number in `[min, max]`.
    Number {
        /// Least value.
        min: f64,
        /// Greatest value.
        max: f64,
    },
    /// An integer in `[min, max]`.
    Integer {
        /// Least value.
        min: i64,
        /// Greatest value.
        max: i64,
    },
    /// A switch.
    Flag,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// Any text; the empty one stands for nothing.
    Text,
}

impl fmt::Display for ParamRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number { min, max } => write!(f, "a number in [{min}, {max}]"),
            Self::Integer { min, max } => write!(f, "an integer in [{min}, {max}]"),
            Self::Flag => f.write_str("true or false"),
            Self::Choice(names) => write!(f, "one of {}", names.join(", ")),
            Self::Text => f.write_str("a text"),
        }
    }
}

impl ParamRange {
    /// Whether a parameter may have this value. Integers are numbers.
    pub fn allows(&self, value: &ParamValue) -> bool {
        match (self, value) {
            (Self::Number { min, max }, ParamValue::Number(x)) => (min..=max).contains(&x),
            (Self::Number { min, max }, ParamValue::Integer(x)) => {
                (*min..=*max).contains(&(*x as f64))
            }
            (Self::Integer { min, max }, ParamValue::Integer(x)) => (min..=max).contains(&x),
            (Self::Choice(names), ParamValue::Name(x)) => names.contains(&x.as_str()),
            (Self::Flag, ParamValue::Flag(_)) | (Self::Text, ParamValue::Name(_)) => true,
            _ => false,
        }
    }
}

/// One parameter of a registry entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Key in the experiment file.
    pub name: &'static str,
    /// One line: meaning, unit, source.
    pub description: &'static str,
    /// Value when the experiment says nothing.
    pub default: ParamValue,
    /// Allowed values.
    pub range: ParamRange,
}

/// The parameters of a registry entry: the parser, the help, the docs table and sweeps read it.
pub type ParameterSchema = Vec<Parameter>;

/// Why parameters do not fit their schema.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ParamError {
    /// No parameter has this name.
    #[error("there is no parameter `{name}`{}", .nearest.map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// What was given.
        name: String,
        /// The most similar name, if there are parameters at all.
        nearest: Option<&'static str>,
    },
    /// A value of another type, or outside the range.
    #[error("parameter `{name}` must be {expected}, not {found}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// The type and range of its values.
        expected: String,
        /// What was given.
        found: String,
    },
}

impl Params {
    /// These values, and for what is missing the defaults of `schema`.
    ///
    /// # Errors
    /// A name that the schema does not know, or a value that it does not allow.
    pub fn completed(&self, schema: &[Parameter]) -> Result<Params, ParamError> {
        for name in self.0.keys() {
            if schema.iter().all(|p| p.name != name) {
                return Err(ParamError::Unknown {
                    name: name.clone(),
                    nearest: nearest(name, schema.iter().map(|p| p.name)),
                });
            }
        }
        let one = |parameter: &Parameter| {
            let value = self.0.get(parameter.name).unwrap_or(&parameter.default);
            if parameter.range.allows(value) {
                return Ok((parameter.name.to_owned(), value.clone()));
            }
            Err(ParamError::Value {
                name: parameter.name,
                expected: parameter.range.to_string(),
                found: value.to_string(),
            })
        };
        Ok(Params(schema.iter().map(one).collect::<Result<_, _>>()?))
    }
}
