//! Values of parameters.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum ParamValue {
    /// A real number.
    Number(f64),
    /// An integer.
    Integer(i64),
    /// A switch.
    Flag(bool),
    /// One of a closed list of names, or a text.
    Name(String),
}

impl fmt::Display for ParamValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Integer(x) => write!(f, "{x}"),
            Self::Flag(x) => write!(f, "{x}"),
            Self::Name(x) => write!(f, "{x}"),
        }
    }
}

/// Values of parameters by name, as files and records hold them; what is missing has its default.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Params(pub BTreeMap<String, ParamValue>);

impl Params {
    /// A real parameter (integers widen).
    ///
    /// # Panics
    /// If the entry's schema does not declare `name` as a number: a programming error.
    pub fn number(&self, name: &str) -> f64 {
        match self.0.get(name) {
            Some(ParamValue::Number(x)) => *x,
            Some(ParamValue::Integer(x)) => *x as f64,
            other => panic!("parameter {name} is not a declared number: {other:?}"),
        }
    }

    /// An integer parameter.
    ///
    /// # Panics
    /// If the entry's schema does not declare `name` as an integer.
    pub fn integer(&self, name: &str) -> i64 {
        match self.0.get(name) {
            Some(ParamValue::Integer(x)) => *x,
            other => panic!("parameter {name} is not a declared integer: {other:?}"),
        }
    }

    /// A named choice or a text.
    ///
    /// # Panics
    /// If the entry's schema does not declare `name` as a choice or a text.
    pub fn name(&self, name: &str) -> &str {
        match self.0.get(name) {
            Some(ParamValue::Name(x)) => x,
            other => panic!("parameter {name} is not a declared choice: {other:?}"),
        }
    }

    /// A switch.
    ///
    /// # Panics
    /// If the entry's schema does not declare `name` as a flag.
    pub fn flag(&self, name: &str) -> bool {
        match self.0.get(name) {
            Some(ParamValue::Flag(x)) => *x,
            other => panic!("parameter {name} is not a declared flag: {other:?}"),
        }
    }
}
