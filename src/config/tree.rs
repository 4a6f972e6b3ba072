//! TOML values with their source places, and layers of them.
//!
//! The file and the command-line overrides are merged into one tree. Since every item has its
//! [`Place`], a single pass checks both and can still locate an error.

use super::error::{ConfigError, Place};
use super::pattern::split_outside_brackets;
use std::collections::BTreeMap;
use std::fmt;
use std::ops::Range;
use std::sync::Arc;
use toml::de::{DeTable, DeValue};

#[derive(Debug, Clone, PartialEq)]
pub(super) struct Item {
    pub at: Place,
    pub value: Value,
}

impl Item {
    /// The item as a table; `key` and `expected` are used in the error message.
    pub(crate) fn table(&self, key: &str, expected: &str) -> Result<&Table, ConfigError> {
        match &self.value {
            Value::Table(table) => Ok(table),
            _ => Err(self.wrong_type(key, expected)),
        }
    }

    /// The error for a value of the wrong type for `key`.
    pub(crate) fn wrong_type(&self, key: &str, expected: impl ToString) -> ConfigError {
        ConfigError::WrongType {
            at: self.at.clone(),
            key: key.to_owned(),
            expected: expected.to_string(),
            found: self.value.describe(),
        }
    }

    /// The error for a disallowed value of `key`.
    pub(crate) fn out_of_range(&self, key: &str, expected: impl ToString) -> ConfigError {
        ConfigError::OutOfRange {
            at: self.at.clone(),
            key: key.to_owned(),
            value: self.value.to_string(),
            expected: expected.to_string(),
        }
    }

    pub(crate) fn empty(&self, key: &str) -> ConfigError {
        ConfigError::Empty {
            at: self.at.clone(),
            key: key.to_owned(),
        }
    }

    /// The error for a repeated list value.
    pub(crate) fn duplicate(&self, key: &str) -> ConfigError {
        ConfigError::Duplicate {
            at: self.at.clone(),
            key: key.to_owned(),
            value: self.value.to_string(),
        }
    }

    /// A text from a default.
    pub(crate) fn default_text(text: &str) -> Self {
        Self {
            at: Place::Default,
            value: Value::Text(text.to_owned()),
        }
    }

    /// True if any part of the item comes from the command line.
    pub(crate) fn has_override(&self) -> bool {
        let inside = match &self.value {
            Value::Table(table) => table.values().any(Item::has_override),
            _ => false,
        };
        inside || matches!(self.at, Place::Override(_))
    }
}

/// Named items, in alphabetical order.
pub(super) type Table = BTreeMap<String, Item>;

/// A TOML value, as far as experiments use TOML.
#[derive(Debug, Clone, PartialEq)]
pub(super) enum Value {
    Text(String),
    Integer(i64),
    Number(f64),
    Flag(bool),
    /// Dates and integers beyond 64 bits, as written; never valid.
    Other(String),
    List(Vec<Item>),
    Table(Table),
}

impl Value {
    /// Describes the value for "must be …, not …".
    pub(crate) fn describe(&self) -> String {
        match self {
            Self::Text(text) => format!("the text \"{text}\""),
            Self::Integer(x) => format!("the integer {x}"),
            Self::Number(x) => format!("the number {x}"),
            Self::Flag(x) => format!("{x}"),
            Self::Other(text) => text.clone(),
            Self::List(items) => format!("a list of {}", items.len()),
            Self::Table(_) => "a table".to_owned(),
        }
    }
}

/// Formats the value as written in a file.
impl fmt::Display for Value {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            // Control characters must not reach a terminal.
            Self::Text(text) => write!(f, "{text:?}"),
            Self::Integer(x) => write!(f, "{x}"),
            Self::Number(x) => write!(f, "{x}"),
            Self::Flag(x) => write!(f, "{x}"),
            Self::Other(text) => f.write_str(text),
            Self::List(items) => {
                let items: Vec<_> = items.iter().map(|item| item.value.to_string()).collect();
                write!(f, "[{}]", items.join(", "))
            }
            Self::Table(_) => f.write_str("a table"),
        }
    }
}

/// Parses a file's text; `file` is its name in messages.
pub(super) fn parse_file(text: &str, file: &str) -> Result<Table, ConfigError> {
    let file: Arc<str> = file.into();
    let ends: Vec<usize> = text.match_indices('\n').map(|(at, _)| at).collect();
    let place = |offset: usize| Place::File {
        file: file.clone(),
        line: 1 + ends.partition_point(|end| *end < offset),
    };
    let table = DeTable::parse(text).map_err(|error| ConfigError::Syntax {
        at: place(error.span().map_or(0, |span| span.start)),
        message: match (error.span(), one_line(error.message())) {
            (Some(span), message) if message.contains("duplicate key") => {
                let first = first_of(text, &span).map(&place);
                let first = first.map_or(String::new(), |at| format!(", given first in {at}"));
                let name = text.get(span).unwrap_or_default();
                format!("{message} `{name}`{first}")
            }
            (_, message) => message,
        },
    })?;
    Ok(convert_table(table.get_ref(), &place))
}

/// First position of the key repeated at `again`: the last key of that name before it.
fn first_of(text: &str, again: &Range<usize>) -> Option<usize> {
    let name = text.get(again.clone())?;
    let line = text[..again.start].rfind('\n').map_or(0, |end| end + 1);
    let before = DeTable::parse(&text[..line]).ok()?;
    let mut starts = Vec::new();
    key_starts(before.get_ref(), name, &mut starts);
    starts.into_iter().max()
}

fn key_starts(table: &DeTable<'_>, name: &str, starts: &mut Vec<usize>) {
    for (key, value) in table {
        if key.get_ref() == name {
            starts.push(key.span().start);
        }
        if let DeValue::Table(inner) = value.get_ref() {
            key_starts(inner, name, starts);
        }
    }
}

/// Parses one `section.key=value` override into a tree with a single leaf.
///
/// A value that is not TOML is a text; commas make it a list, whose elements are again TOML or
/// texts. A value that starts as TOML structure (`[`, `{`, a quote) must be TOML.
pub(super) fn parse_override(text: &str) -> Result<Table, ConfigError> {
    let at = Place::Override(text.into());
    let fault = |problem: String| ConfigError::Override {
        text: text.to_owned(),
        problem,
    };
    let (key, value) = key_and_value(text).ok_or_else(|| fault("no `=` in it".into()))?;
    // A TOML document with this one key handles dots and quotes.
    let document = format!("{} = 0", key.trim());
    let keys = DeTable::parse(&document)
        .map_err(|error| fault(format!("bad key: {}", one_line(error.message()))))?;
    let mut table = convert_table(keys.get_ref(), &|_| at.clone());
    let leaf = sole_leaf(&mut table).ok_or_else(|| fault("one key is needed".into()))?;
    leaf.value = parse_override_value(value.trim(), &at).map_err(fault)?;
    Ok(table)
}

/// What stands before and behind the first `=` that no quotes hold: names of files may have one.
fn key_and_value(text: &str) -> Option<(&str, &str)> {
    let (mut quote, mut is_escaped) = (None, false);
    let is_end = |letter: char| match quote {
        None => {
            quote = Some(letter).filter(|letter| ['"', '\''].contains(letter));
            letter == '='
        }
        Some(_) if is_escaped => {
            is_escaped = false;
            false
        }
        Some(open) => {
            is_escaped = open == '"' && letter == '\\';
            quote = quote.filter(|open| *open != letter);
            false
        }
    };
    match text.find(is_end) {
        Some(end) => Some((&text[..end], &text[end + 1..])),
        // A quote that nothing closes.
        None => text.split_once('='),
    }
}

fn parse_override_value(text: &str, at: &Place) -> Result<Value, String> {
    let error = match DeValue::parse(text) {
        Ok(value) => return Ok(convert(value.get_ref(), &|_| at.clone())),
        Err(error) => error,
    };
    if text.starts_with(['[', '{', '"', '\'']) {
        return Err(format!("bad value: {}", one_line(error.message())));
    }
    // Commas in labels such as `grid(a=1,b=2)` are theirs.
    let parts: Vec<&str> = split_outside_brackets(text, ',').collect();
    if parts.len() == 1 {
        return Ok(Value::Text(text.to_owned()));
    }
    let element = |part: &str| {
        Ok(Item {
            at: at.clone(),
            value: parse_override_value(part.trim(), at)?,
        })
    };
    let elements = parts.into_iter().map(element);
    elements.collect::<Result<_, _>>().map(Value::List)
}

/// One value, as on the command line: TOML, or a text.
pub(super) fn loose_value(text: &str, at: &Place) -> Value {
    match DeValue::parse(text) {
        Ok(value) => convert(value.get_ref(), &|_| at.clone()),
        Err(_) => Value::Text(text.to_owned()),
    }
}

/// The leaf of a tree with a single branch.
fn sole_leaf(table: &mut Table) -> Option<&mut Item> {
    let mut item = table.values_mut().next()?;
    loop {
        match item {
            Item {
                value: Value::Table(inner),
                ..
            } => item = inner.values_mut().next()?,
            leaf => return Some(leaf),
        }
    }
}

/// Merges `over` into `base`: tables merge key by key, everything else is replaced.
pub(super) fn merge(base: &mut Table, over: Table) {
    for (key, item) in over {
        match (base.get_mut(&key), item) {
            (
                Some(Item {
                    value: Value::Table(base),
                    ..
                }),
                Item {
                    value: Value::Table(over),
                    ..
                },
            ) => merge(base, over),
            (_, item) => {
                base.insert(key, item);
            }
        }
    }
}

fn convert_table(table: &DeTable<'_>, place: &dyn Fn(usize) -> Place) -> Table {
    let items = table.iter().map(|(key, value)| {
        let item = Item {
            at: place(key.span().start),
            value: convert(value.get_ref(), place),
        };
        (key.get_ref().to_string(), item)
    });
    items.collect()
}

fn convert(value: &DeValue<'_>, place: &dyn Fn(usize) -> Place) -> Value {
    match value {
        DeValue::String(text) => Value::Text(text.to_string()),
        DeValue::Integer(x) => match i64::from_str_radix(x.as_str(), x.radix()) {
            Ok(x) => Value::Integer(x),
            Err(_) => Value::Other(format!("the integer {x}")),
        },
        DeValue::Float(x) => match x.as_str().parse() {
            Ok(x) => Value::Number(x),
            Err(_) => Value::Other(format!("the number {x}")),
        },
        DeValue::Boolean(x) => Value::Flag(*x),
        DeValue::Datetime(x) => Value::Other(format!("the date {x}")),
        DeValue::Array(items) => Value::List(
            items
                .iter()
                .map(|item| Item {
                    at: place(item.span().start),
                    value: convert(item.get_ref(), place),
                })
                .collect(),
        ),
        DeValue::Table(table) => Value::Table(convert_table(table, place)),
    }
}

/// Joins the TOML parser's message into one line.
fn one_line(message: &str) -> String {
    message.split_whitespace().collect::<Vec<_>>().join(" ")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn leaf(table: &Table, path: &[&str]) -> Item {
        let (last, first) = path.split_last().expect("a path");
        let mut table = table;
        for key in first {
            let Value::Table(inner) = &table[*key].value else {
                panic!("{key} is not a table");
            };
            table = inner;
        }
        table[*last].clone()
    }

    #[test]
    fn items_know_their_line() {
        let table = parse_file("[a]\nx = 1\n\n[b]\ny = [\n 'p',\n 'q']\n", "f.toml").unwrap();
        assert_eq!(leaf(&table, &["a", "x"]).at.to_string(), "f.toml:2");
        let Value::List(items) = leaf(&table, &["b", "y"]).value else {
            panic!("not a list");
        };
        assert_eq!(items[1].at.to_string(), "f.toml:7");
    }

    #[test]
    fn integers_in_any_notation_are_read_and_too_large_ones_are_not_mangled() {
        let text = "a = 0x1F\nb = 2_000\nc = -5\nd = 99999999999999999999\ne = +7";
        let table = parse_file(text, "f").unwrap();
        for (key, value) in [("a", 31), ("b", 2000), ("c", -5), ("e", 7)] {
            assert_eq!(table[key].value, Value::Integer(value), "{key}");
        }
        assert!(matches!(table["d"].value, Value::Other(_)));
    }

    #[test]
    fn an_override_is_toml_or_text_or_a_list_by_commas() {
        let value = |text| leaf(&parse_override(text).unwrap(), &["a", "b"]).value;
        assert_eq!(value("a.b=3"), Value::Integer(3));
        assert_eq!(value("a.b = true"), Value::Flag(true));
        assert_eq!(value("a.b=x/y.obj"), Value::Text("x/y.obj".into()));
        assert_eq!(value("a.b='x,y'"), Value::Text("x,y".into()));
        let Value::List(items) = value("a.b=3,eight") else {
            panic!("not a list");
        };
        assert_eq!(items[0].value, Value::Integer(3));
        assert_eq!(items[1].value, Value::Text("eight".into()));
        assert!(matches!(value("a.b=[1,2]"), Value::List(items) if items.len() == 2));
        for (text, name) in [
            ("scene.\"x.obj\".n=1", "x.obj"),
            // A name may have what ends keys and quotes.
            ("scene.\"x=\\\"y.obj\".n=1", "x=\"y.obj"),
            ("scene.'x=\"y.obj'.n=1", "x=\"y.obj"),
        ] {
            let value = leaf(&parse_override(text).unwrap(), &["scene", name, "n"]).value;
            assert_eq!(value, Value::Integer(1), "{text}");
        }
    }

    #[test]
    fn an_override_without_sense_is_refused_with_its_text() {
        for text in [
            "run.seed",
            "=3",
            "run.=3",
            "run.resolution=[64",
            "a\nb=1",
            "a'b=1",
        ] {
            let message = parse_override(text).unwrap_err().to_string();
            assert!(message.contains(text), "{message}");
        }
    }

    #[test]
    fn merging_replaces_leaves_and_keeps_the_rest() {
        let mut base = parse_file("[a]\nx = 1\ny = 2", "f").unwrap();
        merge(&mut base, parse_override("a.x=5").unwrap());
        merge(&mut base, parse_override("b.z=6").unwrap());
        assert_eq!(leaf(&base, &["a", "x"]).value, Value::Integer(5));
        assert_eq!(leaf(&base, &["a", "x"]).at.to_string(), "--set a.x=5");
        assert_eq!(leaf(&base, &["a", "y"]).value, Value::Integer(2));
        assert_eq!(leaf(&base, &["b", "z"]).value, Value::Integer(6));
    }
}
