//! Patterns that choose variants: names with `*`, optionally negated.

use raystone_core::params::Variant;
use std::fmt;

/// Chooses variants of one axis: a name, a label, or either with `*` for any text; a leading `!`
/// turns the choice round.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(String);

impl Pattern {
    /// A pattern from its text; every text is a pattern.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// Whether the pattern chooses `variant`, by its name or by its label.
    pub fn matches(&self, variant: &Variant) -> bool {
        let (positive, glob) = match self.0.strip_prefix('!') {
            Some(rest) => (false, rest),
            None => (true, self.0.as_str()),
        };
        let fits = glob_matches(glob, &variant.name) || glob_matches(glob, &variant.label);
        fits == positive
    }

    /// Whether the pattern chooses a plain text.
    pub fn fits_text(&self, text: &str) -> bool {
        match self.0.strip_prefix('!') {
            Some(rest) => !glob_matches(rest, text),
            None => glob_matches(&self.0, text),
        }
    }

    /// The pattern without its negation: what must exist for the pattern to make sense.
    pub(super) fn without_negation(&self) -> Pattern {
        Pattern(self.0.trim_start_matches('!').to_owned())
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// Whether `text` fits `glob`, in which `*` stands for any text, the empty one included.
fn glob_matches(glob: &str, text: &str) -> bool {
    let Some((head, rest)) = glob.split_once('*') else {
        return glob == text;
    };
    let Some(mut text) = text.strip_prefix(head) else {
        return false;
    };
    let mut parts: Vec<&str> = rest.split('*').collect();
    let tail = parts.pop().unwrap_or_default();
    for part in parts {
        // The leftmost fit leaves the most text for what follows.
        let Some(found) = text.find(part) else {
            return false;
        };
        text = &text[found + part.len()..];
    }
    text.ends_with(tail)
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::params::Params;

    #[test]
    fn a_star_stands_for_any_text() {
        for (glob, text, fits) in [
            ("bvh", "bvh", true),
            ("bvh", "roped-bvh", false),
            ("*bvh", "roped-bvh", true),
            ("*", "", true),
            ("uni*grid*", "uniform-grid(lambda=3)", true),
            ("uni*grid", "uniform-grid(lambda=3)", false),
            ("a*a", "a", false),
            ("*ab*ab", "abab", true),
            ("*ab*ab", "xab", false),
        ] {
            assert_eq!(glob_matches(glob, text), fits, "{glob} against {text}");
        }
    }

    #[test]
    fn a_pattern_fits_name_or_label_and_can_be_negated() {
        let variant = Variant {
            name: "uniform-grid".into(),
            params: Params::default(),
            label: "uniform-grid(lambda=3)".into(),
        };
        for (text, fits) in [
            ("uniform-grid", true),
            ("uniform-grid(lambda=3)", true),
            ("uniform-grid(lambda=8)", false),
            ("!uniform-grid", false),
            ("!bvh", true),
        ] {
            assert_eq!(Pattern::new(text).matches(&variant), fits, "{text}");
        }
    }
}
