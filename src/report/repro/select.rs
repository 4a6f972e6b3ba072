//! Selection of the values that an expectation is about.

use crate::values::Value;
use raystone_config::Pattern;
use raystone_config::expect::Pick;
use raystone_record::Key;

/// Returns `true` if a key has a matching label on every axis of the pick; axes that a figure lacks have an empty label.
pub(crate) fn fits(key: &Key, pick: &Pick) -> bool {
    pick.iter()
        .all(|(axis, pattern)| Pattern::new(pattern.as_str()).fits_text(key.label(axis)))
}

/// Returns the values of a figure that match a pick.
pub fn select<'v, 'a>(values: &'v [Value<'a>], figure: &str, pick: &Pick) -> Vec<&'v Value<'a>> {
    let of_figure = values.iter().filter(|value| value.figure.id == figure);
    of_figure.filter(|v| fits(&v.key, pick)).collect()
}

/// Returns the one value of `others` that differs from `value` only on axes that the picks name.
///
/// # Errors
/// If there is none, or more than one.
pub(crate) fn partner<'v, 'a>(
    value: &Value,
    others: &[&'v Value<'a>],
    picks: &[&Pick],
) -> Result<&'v Value<'a>, String> {
    let named = |axis: &str| picks.iter().any(|pick| pick.contains_key(axis));
    let rest = |key: &Key| {
        let labels = key.labels().filter(|(axis, _)| !named(axis));
        let owned = labels.map(|(axis, label)| (axis.to_owned(), label.to_owned()));
        owned.collect::<Vec<_>>()
    };
    let wanted = rest(&value.key);
    let mut fitting = others.iter().filter(|other| rest(&other.key) == wanted);
    match (fitting.next(), fitting.next()) {
        (Some(only), None) => Ok(only),
        (None, _) => Err(format!("nothing to compare `{}` with", value.key)),
        (Some(a), Some(b)) => Err(format!(
            "both `{}` and `{}` could be compared with `{}`; name the axis on which they differ",
            a.key, b.key, value.key
        )),
    }
}

/// Returns `base` with the entries of `over` replacing its own.
pub(crate) fn merged(base: &Pick, over: &Pick) -> Pick {
    let mut pick = base.clone();
    pick.extend(over.iter().map(|(a, p)| (a.clone(), p.clone())));
    pick
}

/// Returns a pick in words.
pub fn words(pick: &Pick) -> String {
    let parts: Vec<String> = pick.iter().map(|(a, p)| format!("{a} = {p}")).collect();
    if parts.is_empty() {
        "everything".to_owned()
    } else {
        parts.join(", ")
    }
}
