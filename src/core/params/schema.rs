//! Allowed values of parameters, and errors of values that do not fit.

use super::{ParamValue, ParameterType as _, Params};
use crate::text::nearest;
use std::fmt;
use std::ops::RangeInclusive;
use thiserror::Error;

/// Allowed values of a parameter.
#[derive(Debug, Clone, PartialEq)]
pub enum ParamRange {
    /// A real number in `[min, max]`.
    Number {
        /// Minimum.
        min: f64,
        /// Maximum.
        max: f64,
    },
    /// An integer in `[min, max]`.
    Integer {
        /// Minimum.
        min: i64,
        /// Maximum.
        max: i64,
    },
    /// Certain integers in a range.
    Stepped(Step, RangeInclusive<i64>),
    /// A flag.
    Flag,
    /// One of these names.
    Choice(&'static [&'static str]),
    /// The name of an entry of this registry.
    Entry(&'static str),
    /// Any text; empty means none.
    Text,
    /// Any non-empty text.
    Filled,
    /// A list of values of this range.
    List(Box<ParamRange>, Length),
    /// Ascending integers from 1 to this one, at least one; in files also `{ pow2 = [lo, hi] }`.
    Ascending(i64),
}

/// A subset of the integers.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Step {
    /// 1, 2, 4, 8, …
    PowerOfTwo,
    /// Multiples of this number.
    MultipleOf(i64),
}

/// Lengths of lists.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Length {
    /// Any length, without repeated values.
    Any,
    /// This length.
    Exactly(usize),
    /// This length, without repeated values.
    Different(usize),
}

impl Length {
    /// True if a list may have `count` values.
    pub fn allows(self, count: usize) -> bool {
        match self {
            Self::Any => true,
            Self::Exactly(length) | Self::Different(length) => count == length,
        }
    }
}

/// Prints the length as a prefix: `two different `.
impl fmt::Display for Length {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let (length, which) = match self {
            Self::Any => return Ok(()),
            Self::Exactly(length) => (length, ""),
            Self::Different(length) => (length, "different "),
        };
        match length {
            2 => write!(f, "two {which}"),
            3 => write!(f, "three {which}"),
            length => write!(f, "{length} {which}"),
        }
    }
}

impl fmt::Display for ParamRange {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.words(false))
    }
}

/// Formats an interval. An end that adjoins a shorter number prints as that number, excluded.
fn interval(min: f64, max: f64) -> String {
    let is_next = |end: f64, next: f64| next.to_string().len() < end.to_string().len();
    let (below, above) = (min.next_down(), max.next_up());
    let low = if is_next(min, below) {
        format!("({below}")
    } else {
        format!("[{min}")
    };
    let high = if is_next(max, above) {
        format!("{above})")
    } else {
        format!("{max}]")
    };
    format!(" in {low}, {high}")
}

impl ParamRange {
    /// Restricts integers or lists of them to powers of two.
    #[must_use]
    pub fn power_of_two(self) -> Self {
        self.stepped(Step::PowerOfTwo)
    }

    /// Restricts integers or lists of them to multiples of `step`.
    #[must_use]
    pub fn multiple_of(self, step: i64) -> Self {
        self.stepped(Step::MultipleOf(step))
    }

    fn stepped(self, step: Step) -> Self {
        match self {
            Self::Integer { min, max } => Self::Stepped(step, min..=max),
            Self::List(of, length) => Self::List(Box::new(of.stepped(step)), length),
            other => other,
        }
    }

    /// Restricts lists of integers to non-empty ascending ones from 1 or more.
    #[must_use]
    pub fn ascending(self) -> Self {
        match self {
            Self::List(of, _) => of.ascending(),
            Self::Integer { max, .. } => Self::Ascending(max),
            other => other,
        }
    }

    /// Restricts arrays, or lists of them, to distinct values.
    #[must_use]
    pub fn different(self) -> Self {
        match self {
            Self::List(of, Length::Exactly(n)) => Self::List(of, Length::Different(n)),
            Self::List(of, length) => Self::List(Box::new(of.different()), length),
            other => other,
        }
    }

    /// Restricts texts to names of entries of a registry.
    #[must_use]
    pub fn entry_of(self, registry: &'static str) -> Self {
        Self::Entry(registry)
    }

    /// Describes one value, or many.
    fn words(&self, many: bool) -> String {
        let (one, several, which) = match self {
            Self::Number { min, max } if *max >= f32::MAX.into() && *min <= f32::MIN.into() => (
                "a finite number",
                "finite numbers",
                " of single precision".to_owned(),
            ),
            Self::Number { min, max } => ("a number", "numbers", interval(*min, *max)),
            Self::Integer { min, max } => ("an integer", "integers", format!(" in [{min}, {max}]")),
            Self::Stepped(step, range) => {
                let which = format!(" in [{}, {}]", range.start(), range.end());
                match step {
                    Step::PowerOfTwo => ("a power of two", "powers of two", which),
                    Step::MultipleOf(x) => ("a multiple", "multiples", format!(" of {x}{which}")),
                }
            }
            Self::Flag => ("true or false", "true or false", String::new()),
            Self::Choice(names) => ("one of ", "some of ", names.join(", ")),
            Self::Entry(registry) => ("the name of one ", "names of one ", (*registry).to_owned()),
            Self::Text => ("a text", "texts", String::new()),
            Self::Filled => ("a text", "texts", " that is not empty".to_owned()),
            Self::List(of, length) if many && length.allows(2) && *length != Length::Any => {
                let length = length.to_string();
                let length = length.trim_start_matches("two ");
                ("", "pairs", format!(" of {length}{}", of.words(true)))
            }
            Self::List(of, length) => {
                ("a list", "lists", format!(" of {length}{}", of.words(true)))
            }
            Self::Ascending(max) => (
                "a list",
                "lists",
                format!(
                    " of ascending integers in [1, {max}], or a table {{ pow2 = [lo, hi] }} with 0 <= lo <= hi <= {}",
                    max.ilog2()
                ),
            ),
        };
        format!("{}{which}", if many { several } else { one })
    }

    /// True if the value is allowed. Integers count as numbers.
    pub fn allows(&self, value: &ParamValue) -> bool {
        match (self, value) {
            (Self::Number { min, max }, ParamValue::Number(x)) => (min..=max).contains(&x),
            (Self::Number { min, max }, ParamValue::Integer(x)) => {
                (*min..=*max).contains(&(*x as f64))
            }
            (Self::Integer { min, max }, ParamValue::Integer(x)) => (min..=max).contains(&x),
            (Self::Stepped(step, range), ParamValue::Integer(x)) => {
                let is_step = match step {
                    Step::PowerOfTwo => x.count_ones() == 1,
                    Step::MultipleOf(step) => x % step == 0,
                };
                is_step && range.contains(x)
            }
            (Self::Choice(names), ParamValue::Name(x)) => names.contains(&x.as_str()),
            (Self::Entry(_) | Self::Filled, ParamValue::Name(x)) => !x.is_empty(),
            (Self::Flag, ParamValue::Flag(_)) | (Self::Text, ParamValue::Name(_)) => true,
            (Self::List(of, length), ParamValue::List(items)) => {
                let may_repeat = matches!(length, Length::Exactly(_));
                length.allows(items.len())
                    && items.iter().all(|item| of.allows(item))
                    && (may_repeat || repeated(items).is_none())
            }
            (Self::Ascending(max), value) => <Vec<u32>>::parse(value).is_some_and(|counts| {
                let ends = counts.first().zip(counts.last());
                let within = |(first, last): (&u32, &u32)| *first > 0 && i64::from(*last) <= *max;
                ends.is_some_and(within) && counts.is_sorted_by(|a, b| a < b)
            }),
            _ => false,
        }
    }
}

/// Index of the first value that repeats an earlier one.
pub fn repeated(items: &[ParamValue]) -> Option<usize> {
    (0..items.len()).find(|&i| items[..i].contains(&items[i]))
}

/// One parameter of a registry entry.
#[derive(Debug, Clone, PartialEq)]
pub struct Parameter {
    /// Key in the experiment file.
    pub name: &'static str,
    /// One line: meaning, unit, source.
    pub description: &'static str,
    /// Value if the experiment gives none. One outside the range means none.
    pub default: ParamValue,
    /// Allowed values.
    pub range: ParamRange,
}

impl Parameter {
    /// The default, or `None` if it cannot be written.
    pub fn default_written(&self) -> Option<&ParamValue> {
        self.range.allows(&self.default).then_some(&self.default)
    }
}

/// Parameters of a registry entry, for parser, help, docs table and sweeps.
pub type ParameterSchema = Vec<Parameter>;

/// Parameters do not fit their schema.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum ParamError {
    /// Unknown parameter name.
    #[error("there is no parameter `{name}`{}", .nearest.map_or(String::new(), |n| format!("; did you mean `{n}`?")))]
    Unknown {
        /// The name given.
        name: String,
        /// The most similar name, if the entry has parameters.
        nearest: Option<&'static str>,
    },
    /// A value of another type, or out of range.
    #[error("parameter `{name}` must be {expected}, not {found}")]
    Value {
        /// The parameter.
        name: &'static str,
        /// Type and range of its values.
        expected: String,
        /// The value given.
        found: String,
    },
}

impl Params {
    /// These values, with the schema's defaults for missing ones.
    ///
    /// # Errors
    /// A name unknown to the schema, or a value it does not allow.
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
            let given = self.0.get(parameter.name);
            let value = given.unwrap_or(&parameter.default);
            if given.is_none() || parameter.range.allows(value) {
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
