//! The JSON text of a glTF document, read leniently: a value that is missing or of another type
//! counts as not given, so that only what is used can make a model unreadable.

use raystone_core::text::plain_text_or_latin1;
use serde_json::Value;

/// A part of the document.
#[derive(Clone, Copy)]
pub(super) struct Item<'a>(&'a Value);

static NOTHING: Value = Value::Null;

impl<'a> Item<'a> {
    pub(crate) fn new(value: &'a Value) -> Self {
        Self(value)
    }

    pub(crate) fn get(self, key: &str) -> Self {
        Self(self.0.get(key).unwrap_or(&NOTHING))
    }

    pub(crate) fn extension(self, name: &str) -> Self {
        self.get("extensions").get(name)
    }

    /// Some exporters write -1 for an index that is none.
    pub(crate) fn is_given(self) -> bool {
        !self.0.is_null() && self.0.as_i64() != Some(-1)
    }

    /// The part, if it is given.
    pub(crate) fn given(self) -> Option<Self> {
        self.is_given().then_some(self)
    }

    pub(crate) fn list(self, key: &str) -> impl ExactSizeIterator<Item = Item<'a>> + Clone {
        let list = self.get(key).0.as_array().map_or(&[][..], Vec::as_slice);
        list.iter().map(Item)
    }

    pub(crate) fn at(self, key: &str, index: usize) -> Option<Self> {
        self.list(key).nth(index)
    }

    /// The members of an object.
    pub(crate) fn members(self) -> impl Iterator<Item = (&'a str, Item<'a>)> {
        let members = self.0.as_object().into_iter().flatten();
        members.map(|(name, value)| (name.as_str(), Item(value)))
    }

    /// The elements of an array, or the members of an object, without `extras`.
    pub(crate) fn parts(self) -> impl Iterator<Item = Item<'a>> {
        let list = self.0.as_array().into_iter().flatten().map(Item);
        let members = self.members().filter(|(name, _)| *name != "extras");
        list.chain(members.map(|(_, part)| part))
    }

    /// A whole number from 0, also one written with a fraction of 0.
    pub(crate) fn as_index(self) -> Option<usize> {
        let real = || self.0.as_f64().filter(|x| x.fract() == 0.0 && *x >= 0.0);
        let whole = self.0.as_u64().or_else(|| real().map(|x| x as u64))?;
        usize::try_from(whole).ok()
    }

    pub(crate) fn index(self, key: &str) -> Option<usize> {
        self.get(key).as_index()
    }

    pub(crate) fn as_number(self) -> Option<f32> {
        let number = self.0.as_f64().map(|x| x as f32);
        number.filter(|x| x.is_finite())
    }

    pub(crate) fn number(self, key: &str) -> Option<f32> {
        self.get(key).as_number()
    }

    /// The numbers of a list, `None` where one is not given; `None` without a list.
    pub(crate) fn numbers<const N: usize>(self, key: &str) -> Option<[Option<f32>; N]> {
        let list = self.get(key).0.as_array()?;
        let number = |k: usize| list.get(k).and_then(|x| Item(x).as_number());
        Some(std::array::from_fn(number))
    }

    /// The numbers of a list, with defaults for those not given.
    pub(crate) fn vector<const N: usize>(self, key: &str, default: [f32; N]) -> [f32; N] {
        let given = self.numbers(key).unwrap_or([None; N]);
        std::array::from_fn(|k| given[k].unwrap_or(default[k]))
    }

    pub(crate) fn as_text(self) -> Option<&'a str> {
        self.0.as_str()
    }

    /// A text that is not empty, or a number as it is written.
    pub(crate) fn as_written(self) -> Option<String> {
        match self.0 {
            Value::String(text) => Some(text.clone()).filter(|text| !text.is_empty()),
            Value::Number(number) => Some(number.to_string()),
            _ => None,
        }
    }

    /// Whether something is given where a list belongs that is none.
    pub(crate) fn lacks_list(self, key: &str) -> bool {
        let part = self.get(key);
        part.is_given() && !part.0.is_array()
    }

    /// A text that is not empty.
    pub(crate) fn text(self, key: &str) -> Option<&'a str> {
        self.get(key).as_text().filter(|text| !text.is_empty())
    }

    pub(crate) fn flag(self, key: &str) -> Option<bool> {
        self.get(key).0.as_bool()
    }

    /// Kind, index and name, for messages.
    pub(crate) fn place(self, kind: &str, index: usize) -> String {
        match self.text("name") {
            Some(name) => format!("{kind} {index} `{name}`"),
            None => format!("{kind} {index}"),
        }
    }
}

/// Parses the text. If it is not JSON, but was once mended, the fault is returned as well.
///
/// # Errors
/// The first fault, with its line and column.
pub(super) fn parse(bytes: &[u8]) -> Result<(Value, Option<String>), String> {
    let text = plain_text_or_latin1(bytes.to_vec());
    let padding = |c: char| c == '\0' || c == '\u{feff}' || c.is_whitespace();
    // Line ends in front are kept, for the numbers of lines.
    let text = text.trim_end_matches(padding);
    let text = text.trim_start_matches(['\0', '\u{feff}']);
    let fault = match serde_json::from_str(text) {
        Ok(value) => return Ok((value, None)),
        Err(error) => error.to_string(),
    };
    if !text.trim_start().starts_with(['{', '[']) {
        let start: String = text.chars().take(8).collect();
        return Err(format!(
            "neither binary glTF, which begins with `glTF`, nor JSON text, which begins with `{{`, but {start:?}, at line 1 column 1"
        ));
    }
    match serde_json::from_str(&mended(text)) {
        Ok(value) => Ok((value, Some(fault))),
        Err(_) => Err(fault),
    }
}

/// The text without what exporters write against the rules of JSON: NaN and infinities (null
/// instead), commas before a closing bracket, stray backslashes, control characters and halves of letters in texts.
fn mended(text: &str) -> String {
    let mut mended = String::with_capacity(text.len());
    let mut letters = text.chars().peekable();
    let mut in_text = false;
    while let Some(letter) = letters.next() {
        match letter {
            '"' => {
                in_text = !in_text;
                mended.push(letter);
            }
            '\\' if in_text => {
                mended.push(letter);
                match letters.next_if(|next| r#""\/bfnrtu"#.contains(*next)) {
                    Some('u') => {
                        let ahead: String = letters.clone().take(10).collect();
                        let (kept, letter) = escaped(&ahead);
                        mended += &letter;
                        letters.by_ref().take(kept).for_each(drop);
                    }
                    Some(next) => mended.push(next),
                    None => mended.push('\\'),
                }
            }
            control if in_text && control < ' ' => {
                mended += &format!("\\u{:04x}", u32::from(control));
            }
            ']' | '}' if !in_text => {
                let kept = mended.trim_end();
                let kept = kept.strip_suffix(',').unwrap_or(kept).len();
                mended.truncate(kept);
                mended.push(letter);
            }
            _ if !in_text && is_of_word(letter) => {
                let start = mended.len();
                mended.push(letter);
                while let Some(next) = letters.next_if(|next| is_of_word(*next)) {
                    mended.push(next);
                }
                // `NaN`, `-inf`, `1.#IND`, `-nan(ind)`: all have an n, which no number has.
                let word = &mended[start..];
                let is_huge = word.parse().is_ok_and(f64::is_infinite);
                if word != "null" && (is_huge || word.contains(['n', 'N'])) {
                    mended.replace_range(start.., "null");
                }
            }
            _ => mended.push(letter),
        }
    }
    mended
}

/// Of the letters behind `\`, from `u` on: how many of them are done with, and what is written in their place. Half of a
/// pair of surrogates alone is no letter.
fn escaped(ahead: &str) -> (usize, String) {
    let unit = |at: usize| u16::from_str_radix(ahead.get(at..at + 4)?, 16).ok();
    match (unit(0), ahead.get(4..6), unit(6)) {
        (Some(0xd800..0xdc00), Some("\\u"), Some(0xdc00..0xe000)) => (10, format!("u{ahead}")),
        (Some(0xd800..0xe000), ..) => (4, "ufffd".to_owned()),
        _ => (0, "u".to_owned()),
    }
}

fn is_of_word(letter: char) -> bool {
    letter.is_ascii_alphanumeric() || "+-.#()".contains(letter)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn halves_of_letters_and_numbers_beyond_all_are_mended_and_whole_ones_stay() {
        for (written, expected) in [
            (r#""K\udcf6rper""#, "K\u{fffd}rper".into()),
            (r#""\ud83d""#, "\u{fffd}".into()),
            (r#""\ud83d\u0041""#, "\u{fffd}A".into()),
            (
                r#""\ud83d\ud83d\ude00\u00e4\\u""#,
                "\u{fffd}\u{1f600}\u{e4}\\u".into(),
            ),
            ("1e400", Value::Null),
            ("-1E+999", Value::Null),
            ("1e300,", 1e300.into()),
        ] {
            let text = format!("[{written}]");
            let (value, fault) = parse(text.as_bytes()).expect(written);
            assert_eq!(value[0], expected, "{written}");
            assert!(fault.is_some(), "{written}");
        }
    }
}
