//! Parameter values.

use serde::{Deserialize, Serialize};
use std::collections::BTreeMap;
use std::fmt;

/// The value of a parameter.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
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
    /// Values of one kind.
    List(Vec<ParamValue>),
}

impl fmt::Display for ParamValue {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Number(x) => write!(f, "{x}"),
            Self::Integer(x) => write!(f, "{x}"),
            Self::Flag(x) => write!(f, "{x}"),
            Self::Name(x) => write!(f, "{x}"),
            Self::List(items) => {
                let items: Vec<String> = items.iter().map(Self::to_string).collect();
                write!(f, "[{}]", items.join(", "))
            }
        }
    }
}

/// Values of parameters by name, as files and records hold them; missing ones have their defaults.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize, schemars::JsonSchema)]
pub struct Params(pub BTreeMap<String, ParamValue>);
