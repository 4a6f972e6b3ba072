//! Parameters as a library user hands them over: checked against their schema, and completed from it.

use super::{ParamRange, ParamValue, Parameter, Params};
use crate::text::nearest;
use thiserror::Error;

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

/// Whether a parameter may have this value. Integers are numbers.
fn fits(range: &ParamRange, value: &ParamValue) -> bool {
    match (range, value) {
        (ParamRange::Number { min, max }, ParamValue::Number(x)) => (min..=max).contains(&x),
        (ParamRange::Number { min, max }, ParamValue::Integer(x)) => {
            (*min..=*max).contains(&(*x as f64))
        }
        (ParamRange::Integer { min, max }, ParamValue::Integer(x)) => (min..=max).contains(&x),
        (ParamRange::Choice(names), ParamValue::Name(x)) => names.contains(&x.as_str()),
        (ParamRange::Flag, ParamValue::Flag(_)) | (ParamRange::Text, ParamValue::Name(_)) => true,
        _ => false,
    }
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
            if fits(&parameter.range, value) {
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
