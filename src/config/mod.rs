//! Experiment files: parse, validate, expand axes into cells.
//!
//! [`Experiment::load`] reads a file, lays the defaults under it and the overrides of the command
//! line over it, and checks every key against [`keys::KEYS`] and every name against a
//! [`Catalogue`]. [`Plan::new`] turns the axes into the cells that have to be run, and
//! [`cell_hash`] gives each its content hash.

mod cells;
mod check;
mod complete;
mod error;
mod experiment;
pub mod keys;
mod parse;
mod pattern;
mod plan;
mod section;
mod tree;
mod variants;

pub use cells::{SamplerCell, StreamCell, StructureCell, TimeCell};
pub use complete::ParamError;
pub use error::{ConfigError, Place};
pub use experiment::{
    Axes, Discrepancy, Exclude, Experiment, Gate, REFERENCE_PARTS, Reference, Seeds, SppRange,
    Tests, Timing,
};
pub use keys::Axis;
pub use pattern::Pattern;
pub use plan::{Plan, Skipped};

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

/// Values of all parameters of an entry, by name.
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

/// A registry entry with all its parameters set.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Variant {
    /// Name in the registry.
    pub name: String,
    /// Every parameter, defaults included.
    pub params: Params,
    /// Short text that tells the variants of one experiment apart: the name, and in brackets the
    /// parameters that differ from the default.
    pub label: String,
}

impl Variant {
    /// What records call these kernels: nothing if they are the embedded ones.
    pub fn kernels_label(&self) -> &str {
        match self.name.as_str() {
            "" => "",
            _ => &self.label,
        }
    }

    /// This variant run with `kernels`: where they are not the embedded ones, the label ends with theirs.
    #[must_use]
    pub fn with_kernels(mut self, kernels: &Variant) -> Self {
        if !kernels.name.is_empty() {
            self.label += KERNELS_MARK;
            self.label += &kernels.label;
        }
        self
    }
}

/// What stands between a name and its kernels in labels.
pub const KERNELS_MARK: &str = " @";

impl fmt::Display for Variant {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.label)
    }
}

/// What the parser knows of one registry entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Entry {
    /// Name as a user types it.
    pub name: String,
    /// One line: what it is and its source (paper).
    pub description: String,
    /// Its parameters.
    pub schema: ParameterSchema,
}

/// Every name that an experiment may use, by axis. Built from the registries, so that a new entry
/// is known to the parser, `raystone list` and the docs without another edit.
#[derive(Debug, Clone, Default)]
pub struct Catalogue {
    /// Built-in scenes; any other scene name is a path.
    pub scene: Vec<Entry>,
    /// Acceleration structures.
    pub accel: Vec<Entry>,
    /// Sample sequences.
    pub sequence: Vec<Entry>,
    /// Decorrelations.
    pub decorrelation: Vec<Entry>,
    /// Integrators.
    pub integrator: Vec<Entry>,
}

impl Catalogue {
    /// The known entries of one axis.
    pub fn entries(&self, axis: Axis) -> &[Entry] {
        match axis {
            Axis::Scene => &self.scene,
            Axis::Accel => &self.accel,
            Axis::Sequence => &self.sequence,
            Axis::Decorrelation => &self.decorrelation,
            Axis::Integrator => &self.integrator,
            Axis::Kernels => &[],
        }
    }
}
