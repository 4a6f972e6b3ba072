//! From what is written to the value of a parameter or a key.

use super::error::ConfigError;
use super::tree::{Item, Table, Value};
use raystone_core::params::{Length, ParamRange, ParamValue, repeated};

/// The value that is written, if `range` allows it. `key` is what messages call it.
///
/// # Errors
/// A value of another type, or out of the range, with the line on which that part of it stands.
pub(super) fn value(key: &str, item: &Item, range: &ParamRange) -> Result<ParamValue, ConfigError> {
    Wanted { key, range }.value(item, range)
}

/// What is read: messages say what the whole of it must be.
struct Wanted<'a> {
    key: &'a str,
    range: &'a ParamRange,
}

impl Wanted<'_> {
    fn value(&self, item: &Item, range: &ParamRange) -> Result<ParamValue, ConfigError> {
        let value = match (range, &item.value) {
            (ParamRange::Number { .. }, Value::Number(x)) => ParamValue::Number(*x),
            (ParamRange::Number { .. }, Value::Integer(x)) => ParamValue::Number(*x as f64),
            (ParamRange::Integer { .. } | ParamRange::Stepped { .. }, Value::Integer(x)) => {
                ParamValue::Integer(*x)
            }
            (ParamRange::Flag, Value::Flag(x)) => ParamValue::Flag(*x),
            (
                ParamRange::Choice(_)
                | ParamRange::Entry(_)
                | ParamRange::Text
                | ParamRange::Filled,
                Value::Text(x),
            ) => ParamValue::Name(x.clone()),
            (ParamRange::List { of, length }, Value::List(items)) if length.allows(items.len()) => {
                self.list(items, of, *length)?
            }
            (ParamRange::Ascending { max }, Value::List(items)) => {
                let count = ParamRange::Integer { min: 1, max: *max };
                // Repetition is a matter of order here.
                self.list(items, &count, Length::Exactly(items.len()))?
            }
            (ParamRange::Ascending { max }, Value::Table(table)) => {
                self.powers(item, table, *max)?
            }
            _ => return Err(self.wrong_type(item)),
        };
        match range {
            _ if range.allows(&value) => Ok(value),
            ParamRange::Choice(names) => Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("value of `{}`", self.key),
                name: value.to_string(),
                known: names.iter().map(|name| (*name).to_owned()).collect(),
            }),
            _ => Err(self.out_of_range(item)),
        }
    }

    fn list(
        &self,
        items: &[Item],
        of: &ParamRange,
        length: Length,
    ) -> Result<ParamValue, ConfigError> {
        let values = items.iter().map(|item| self.value(item, of));
        let values: Vec<ParamValue> = values.collect::<Result<_, _>>()?;
        match repeated(&values) {
            Some(again) if length == Length::Any => Err(ConfigError::Duplicate {
                at: items[again].at.clone(),
                key: self.key.to_owned(),
                value: items[again].value.to_string(),
            }),
            _ => Ok(ParamValue::List(values)),
        }
    }

    /// The powers of two that `{ pow2 = [lo, hi] }` stands for.
    fn powers(&self, item: &Item, table: &Table, max: i64) -> Result<ParamValue, ConfigError> {
        if let Some((other, item)) = table.iter().find(|(key, _)| *key != "pow2") {
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("key in `{}`", self.key),
                name: other.clone(),
                known: vec!["pow2".to_owned()],
            });
        }
        let item = table.get("pow2").ok_or_else(|| self.wrong_type(item))?;
        let exponent = ParamRange::Integer {
            min: 0,
            max: max.ilog2().into(),
        };
        let ends = ParamRange::List {
            of: Box::new(exponent),
            length: Length::Exactly(2),
        };
        let ParamValue::List(ends) = self.value(item, &ends)? else {
            return Err(self.wrong_type(item));
        };
        let ends: Vec<i64> = ends.iter().filter_map(ParamValue::as_integer).collect();
        match ends[..] {
            [low, high] if low <= high => Ok(ParamValue::List(
                (low..=high).map(|x| ParamValue::Integer(1 << x)).collect(),
            )),
            _ => Err(self.out_of_range(item)),
        }
    }

    fn wrong_type(&self, item: &Item) -> ConfigError {
        ConfigError::WrongType {
            at: item.at.clone(),
            key: self.key.to_owned(),
            expected: self.range.to_string(),
            found: item.value.describe(),
        }
    }

    fn out_of_range(&self, item: &Item) -> ConfigError {
        ConfigError::OutOfRange {
            at: item.at.clone(),
            key: self.key.to_owned(),
            value: item.value.to_string(),
            expected: self.range.to_string(),
        }
    }
}
