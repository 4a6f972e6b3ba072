//! Reads the value of a parameter or key.

use super::check::{check_keys, key_in};
use super::error::ConfigError;
use super::tree::{Item, Table, Value};
use raystone_core::params::{
    Bounded as _, Length, ParamRange, ParamValue, ParameterType as _, repeated,
};

/// Reads a value allowed by `range`. `key` is its name in messages.
///
/// # Errors
/// A value of another type or out of range, with the line of the invalid part.
pub(super) fn value(key: &str, item: &Item, range: &ParamRange) -> Result<ParamValue, ConfigError> {
    Wanted { key, range }.value(item, range)
}

/// A value being read, with the overall range for messages.
struct Wanted<'a> {
    key: &'a str,
    range: &'a ParamRange,
}

impl Wanted<'_> {
    fn value(&self, item: &Item, range: &ParamRange) -> Result<ParamValue, ConfigError> {
        let value = match (range, &item.value) {
            (ParamRange::Number { .. }, Value::Number(x)) => ParamValue::Number(*x),
            (ParamRange::Number { .. }, Value::Integer(x)) => ParamValue::Number(*x as f64),
            (ParamRange::Integer { .. } | ParamRange::Stepped(..), Value::Integer(x)) => {
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
            (ParamRange::List(of, length), Value::List(items)) if length.allows(items.len()) => {
                self.list(items, of, *length)?
            }
            (ParamRange::Ascending(max), Value::List(items)) => {
                let count = ParamRange::Integer { min: 1, max: *max };
                // Repeated values are caught by the order here.
                self.list(items, &count, Length::Exactly(items.len()))?
            }
            (ParamRange::Ascending(max), Value::Table(table)) => self.powers(item, table, *max)?,
            _ => return Err(item.wrong_type(self.key, self.range)),
        };
        match range {
            _ if range.allows(&value) => Ok(value),
            ParamRange::Choice(names) => {
                let what = format!("value of `{}`", self.key);
                let (name, known) = (value.to_string(), names.iter().copied());
                Err(ConfigError::unknown(&item.at, what, &name, known))
            }
            _ => Err(item.out_of_range(self.key, self.range)),
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
            Some(again) if length == Length::Any => Err(items[again].duplicate(self.key)),
            _ => Ok(ParamValue::List(values)),
        }
    }

    /// The powers of two of `{ pow2 = [lo, hi] }`.
    fn powers(&self, item: &Item, table: &Table, max: i64) -> Result<ParamValue, ConfigError> {
        check_keys(&key_in(self.key), table, &["pow2"])?;
        let item = table
            .get("pow2")
            .ok_or_else(|| item.wrong_type(self.key, self.range))?;
        let ends = self.value(item, &<[u32; 2]>::range(0..=max.ilog2()))?;
        match <[u32; 2]>::parse(&ends) {
            Some([low, high]) if low <= high => {
                let powers = (low..=high).map(|x| ParamValue::Integer(1 << x));
                Ok(ParamValue::List(powers.collect()))
            }
            _ => Err(item.out_of_range(self.key, self.range)),
        }
    }
}
