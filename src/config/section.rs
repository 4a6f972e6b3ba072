//! Typed reading of one section: every value is checked against its row in [`keys::KEYS`].

use super::error::{ConfigError, Place};
use super::experiment::{SppCounts, StopRule};
use super::keys::{self, KeyRow, ValueKind};
use super::tree::{Item, Table, Value};
use glam::Vec3;

/// A section of the merged tree.
pub(super) struct Section<'t> {
    pub name: &'static str,
    pub at: Place,
    pub table: &'t Table,
    pub file: &'t str,
}

impl<'t> Section<'t> {
    pub(crate) fn has(&self, name: &str) -> bool {
        self.table.contains_key(name)
    }

    /// Where a key was written; where its section was, if the key is absent.
    pub(crate) fn place(&self, name: &str) -> Place {
        let item = self.table.get(name);
        item.map_or_else(|| self.at.clone(), |item| item.at.clone())
    }

    pub(crate) fn item(&self, name: &str) -> Result<&'t Item, ConfigError> {
        let key = self.key(name);
        self.table.get(name).ok_or_else(|| ConfigError::Missing {
            at: match &self.at {
                Place::Default => Place::File {
                    file: self.file.into(),
                    line: 1,
                },
                at => at.clone(),
            },
            key: key.path(),
            expected: key.kind.to_string(),
        })
    }

    /// The row of a key.
    ///
    /// # Panics
    /// If the parser asks for a key that has no row: a programming error.
    fn key(&self, name: &str) -> &'static KeyRow {
        match keys::find(self.name, name) {
            Some(key) => key,
            None => panic!("{}.{name} has no row in KEYS", self.name),
        }
    }

    fn wrong_type(&self, name: &str, item: &Item) -> ConfigError {
        let key = self.key(name);
        ConfigError::WrongType {
            at: item.at.clone(),
            key: key.path(),
            expected: key.kind.to_string(),
            found: item.value.describe(),
        }
    }

    fn out_of_range(&self, name: &str, at: &Place, value: impl ToString) -> ConfigError {
        let key = self.key(name);
        ConfigError::OutOfRange {
            at: at.clone(),
            key: key.path(),
            value: value.to_string(),
            expected: key.kind.to_string(),
        }
    }

    /// The error for a value that its own range allows and another key forbids.
    pub(crate) fn not_allowed(&self, name: &str, expected: &str) -> ConfigError {
        let value = self.table.get(name).map(|item| item.value.describe());
        ConfigError::OutOfRange {
            at: self.place(name),
            key: self.key(name).path(),
            value: value.unwrap_or_default(),
            expected: expected.to_owned(),
        }
    }

    pub(crate) fn text(&self, name: &str) -> Result<&'t str, ConfigError> {
        let item = self.item(name)?;
        match &item.value {
            Value::Text(text) if text.is_empty() => Err(self.out_of_range(name, &item.at, "\"\"")),
            Value::Text(text) => Ok(text),
            _ => Err(self.wrong_type(name, item)),
        }
    }

    pub(crate) fn flag(&self, name: &str) -> Result<bool, ConfigError> {
        let item = self.item(name)?;
        match item.value {
            Value::Flag(flag) => Ok(flag),
            _ => Err(self.wrong_type(name, item)),
        }
    }

    pub(crate) fn number(&self, name: &str) -> Result<f64, ConfigError> {
        let item = self.item(name)?;
        let x = number(item).ok_or_else(|| self.wrong_type(name, item))?;
        match self.key(name).kind {
            ValueKind::Number { min, max } if (min..=max).contains(&x) => Ok(x),
            _ => Err(self.out_of_range(name, &item.at, x)),
        }
    }

    pub(crate) fn integer(&self, name: &str) -> Result<i64, ConfigError> {
        let item = self.item(name)?;
        let Value::Integer(x) = item.value else {
            return Err(self.wrong_type(name, item));
        };
        let allowed = match self.key(name).kind {
            ValueKind::Integer { min, max } => (min..=max).contains(&x),
            ValueKind::PowerOfTwo { min, max } => (min..=max).contains(&x) && x.count_ones() == 1,
            _ => false,
        };
        match allowed {
            true => Ok(x),
            false => Err(self.out_of_range(name, &item.at, x)),
        }
    }

    pub(crate) fn unsigned(&self, name: &str) -> Result<u32, ConfigError> {
        let x = self.integer(name)?;
        u32::try_from(x).map_err(|_| self.out_of_range(name, &self.place(name), x))
    }

    /// Place of a word among those of its key.
    pub(crate) fn word(&self, name: &str) -> Result<usize, ConfigError> {
        let word = self.text(name)?;
        let place = match self.key(name).kind {
            ValueKind::Word(words) => words.iter().position(|known| *known == word),
            _ => None,
        };
        place.ok_or_else(|| self.out_of_range(name, &self.place(name), format!("\"{word}\"")))
    }

    pub(crate) fn unsigned_pair(&self, name: &str) -> Result<[u32; 2], ConfigError> {
        let item = self.item(name)?;
        let ValueKind::IntegerPair { min, max } = self.key(name).kind else {
            return Err(self.wrong_type(name, item));
        };
        self.pair(name, item, min, max)
    }

    /// Two integers of one list, each in `[min, max]`.
    fn pair(&self, name: &str, item: &Item, min: i64, max: i64) -> Result<[u32; 2], ConfigError> {
        let Value::List(items) = &item.value else {
            return Err(self.wrong_type(name, item));
        };
        let [first, second] = items.as_slice() else {
            return Err(self.wrong_type(name, item));
        };
        let unsigned = |item: &Item| match item.value {
            Value::Integer(x) if (min..=max).contains(&x) => {
                u32::try_from(x).map_err(|_| self.out_of_range(name, &item.at, x))
            }
            Value::Integer(x) => Err(self.out_of_range(name, &item.at, x)),
            _ => Err(self.wrong_type(name, item)),
        };
        Ok([unsigned(first)?, unsigned(second)?])
    }

    pub(crate) fn counts(&self, name: &str) -> Result<SppCounts, ConfigError> {
        let item = self.item(name)?;
        let ValueKind::Counts { max_exponent: max } = self.key(name).kind else {
            return Err(self.wrong_type(name, item));
        };
        let table = match &item.value {
            Value::Table(table) => table,
            Value::List(items) => return self.listed_counts(name, item, items, 1 << max),
            _ => return Err(self.wrong_type(name, item)),
        };
        if let Some((other, item)) = table.iter().find(|(key, _)| *key != "pow2") {
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("key in `{}`", self.key(name).path()),
                name: other.clone(),
                known: vec!["pow2".to_owned()],
            });
        }
        let pow2 = table
            .get("pow2")
            .ok_or_else(|| self.wrong_type(name, item))?;
        let [first, last] = self.pair(name, pow2, 0, max)?;
        let powers = (first..=last).map(|exponent| 1 << exponent).collect();
        SppCounts::new(powers)
            .ok_or_else(|| self.out_of_range(name, &pow2.at, format!("[{first}, {last}]")))
    }

    fn listed_counts(
        &self,
        name: &str,
        list: &Item,
        items: &[Item],
        max: i64,
    ) -> Result<SppCounts, ConfigError> {
        let count = |item: &Item| match item.value {
            Value::Integer(x) if (1..=max).contains(&x) => {
                u32::try_from(x).map_err(|_| self.out_of_range(name, &item.at, x))
            }
            Value::Integer(x) => Err(self.out_of_range(name, &item.at, x)),
            _ => Err(self.wrong_type(name, item)),
        };
        let counts: Vec<u32> = items.iter().map(count).collect::<Result<_, _>>()?;
        let written = format!("{counts:?}");
        SppCounts::new(counts).ok_or_else(|| self.out_of_range(name, &list.at, written))
    }

    pub(crate) fn stop_rule(&self, name: &str) -> Result<StopRule, ConfigError> {
        let item = self.item(name)?;
        let Value::Table(table) = &item.value else {
            return Err(self.wrong_type(name, item));
        };
        let known = ["relmse", "confidence", "tile"];
        if let Some((other, item)) = table.iter().find(|(key, _)| !known.contains(&key.as_str())) {
            return Err(ConfigError::Unknown {
                at: item.at.clone(),
                what: format!("key in `{}`", self.key(name).path()),
                name: other.clone(),
                known: known.map(str::to_owned).to_vec(),
            });
        }
        let tile = table.get("tile").map(|inner| match inner.value {
            Value::Integer(edge) if (8..=512).contains(&edge) && edge % 8 == 0 => Ok(edge as u32),
            _ => Err(self.wrong_type(name, inner)),
        });
        let [relmse, confidence] = ["relmse", "confidence"].map(|key| {
            let inner = table.get(key).ok_or_else(|| self.wrong_type(name, item))?;
            let value = number(inner).ok_or_else(|| self.wrong_type(name, inner))?;
            let allowed = match key {
                "relmse" => value > 0.0 && value.is_finite(),
                _ => (0.5..1.0).contains(&value),
            };
            match allowed {
                true => Ok(value),
                false => Err(self.out_of_range(name, &inner.at, format!("{key} = {value}"))),
            }
        });
        Ok(StopRule {
            relmse: relmse?,
            confidence: confidence?,
            tile: tile.transpose()?,
        })
    }

    pub(crate) fn dimension_pairs(&self, name: &str) -> Result<Vec<[u32; 2]>, ConfigError> {
        let item = self.item(name)?;
        let (Value::List(items), ValueKind::DimensionPairs { max }) =
            (&item.value, self.key(name).kind)
        else {
            return Err(self.wrong_type(name, item));
        };
        let mut pairs = Vec::with_capacity(items.len());
        for item in items {
            let pair = self.pair(name, item, 0, max)?;
            if pair[0] == pair[1] {
                return Err(self.out_of_range(name, &item.at, format!("{pair:?}")));
            }
            if pairs.contains(&pair) {
                return Err(ConfigError::Duplicate {
                    at: item.at.clone(),
                    key: self.key(name).path(),
                    value: format!("{pair:?}"),
                });
            }
            pairs.push(pair);
        }
        Ok(pairs)
    }

    pub(crate) fn vector(&self, name: &str) -> Result<Vec3, ConfigError> {
        let item = self.item(name)?;
        let Value::List(items) = &item.value else {
            return Err(self.wrong_type(name, item));
        };
        let [x, y, z] = items.as_slice() else {
            return Err(self.wrong_type(name, item));
        };
        let component = |item: &Item| match number(item).map(|x| x as f32) {
            Some(x) if x.is_finite() => Ok(x),
            Some(x) => Err(self.out_of_range(name, &item.at, x)),
            None => Err(self.wrong_type(name, item)),
        };
        Ok(Vec3::new(component(x)?, component(y)?, component(z)?))
    }
}

fn number(item: &Item) -> Option<f64> {
    match item.value {
        Value::Number(x) => Some(x),
        Value::Integer(x) => Some(x as f64),
        _ => None,
    }
}

/// The texts of a list that is not empty; a text alone is a list of one.
pub(super) fn texts<'t>(
    key: &str,
    item: &'t Item,
) -> Result<Vec<(&'t Item, &'t str)>, ConfigError> {
    let wrong_type = |item: &Item| ConfigError::WrongType {
        at: item.at.clone(),
        key: key.to_owned(),
        expected: "a text or a list of texts".to_owned(),
        found: item.value.describe(),
    };
    let items = match &item.value {
        Value::Text(_) => std::slice::from_ref(item),
        Value::List(items) => items,
        _ => return Err(wrong_type(item)),
    };
    if items.is_empty() {
        return Err(ConfigError::Empty {
            at: item.at.clone(),
            key: key.to_owned(),
        });
    }
    let text = |item: &'t Item| match &item.value {
        Value::Text(text) => Ok((item, text.as_str())),
        _ => Err(wrong_type(item)),
    };
    items.iter().map(text).collect()
}
