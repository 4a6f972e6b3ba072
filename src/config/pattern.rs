//! Patterns that select variants (names with `*`, optionally negated), and their use by `--only`.

use super::ConfigError;
use raystone_core::params::Variant;
use raystone_core::text::did_you_mean_or_known;
use std::fmt;

/// Selects variants of one axis by name or label, with `*` for any text; a leading `!` negates. `bvh()` is the variant whose label
/// is `bvh`, alone.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Pattern(String);

impl Pattern {
    /// Creates a pattern; every text is valid.
    pub fn new(text: impl Into<String>) -> Self {
        Self(text.into())
    }

    /// True if the pattern matches the name or label of `variant`.
    pub fn matches(&self, variant: &Variant) -> bool {
        let (positive, glob) = match self.0.strip_prefix('!') {
            Some(rest) => (false, rest),
            None => (true, self.0.as_str()),
        };
        let fits = match glob.strip_suffix("()") {
            Some(label) => glob_matches(label, &variant.label),
            None => glob_matches(glob, &variant.name) || glob_matches(glob, &variant.label),
        };
        fits == positive
    }

    /// True if the pattern matches a plain text.
    pub fn fits_text(&self, text: &str) -> bool {
        match self.0.strip_prefix('!') {
            Some(rest) => !glob_matches(rest, text),
            None => glob_matches(&self.0, text),
        }
    }

    /// The pattern without its negation, which must match something to make sense.
    pub(super) fn without_negation(&self) -> Pattern {
        Pattern(self.0.trim_start_matches('!').to_owned())
    }
}

impl fmt::Display for Pattern {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        f.write_str(&self.0)
    }
}

/// The selection of `--only`: patterns by axis. One pattern per axis must match, on all axes.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Selector(Vec<(&'static str, Vec<Pattern>)>);

impl Selector {
    /// Parses texts `axis=pattern`, several per text if separated by commas:
    /// `accel=*bvh,grid(a=1,b=2),scene=cornell-box` has two patterns of `accel` and one of `scene`.
    /// Commas in parentheses or before a blank, as in labels (`rays=shadow, reversed`), do not
    /// separate, unless an axis follows.
    ///
    /// # Errors
    /// [`ConfigError::Only`]: a text without an axis, or with one not in `axes`.
    pub fn parse(only: &[String], axes: &[&'static str]) -> Result<Self, ConfigError> {
        let mut selector = Self::default();
        for text in only {
            let mut axis = None;
            for whole in split_outside_brackets(text, ',') {
                let part = whole.trim();
                let fault = |problem| ConfigError::Only {
                    text: part.to_owned(),
                    problem,
                };
                let named = split_outside_brackets(part, '=').next().unwrap_or_default();
                let (pattern, continues) = match part.get(named.len() + 1..) {
                    Some(pattern) => {
                        axis = Some(known(named.trim(), axes).map_err(fault)?);
                        (pattern.trim(), false)
                    }
                    None if part.is_empty() => continue,
                    None => (part, whole.starts_with(' ')),
                };
                let axis = axis.ok_or_else(|| fault("no `=` in it".to_owned()))?;
                let patterns = selector.of(axis);
                match patterns.last_mut() {
                    Some(last) if continues => last.0 += &format!(", {pattern}"),
                    _ => patterns.push(Pattern::new(pattern)),
                }
            }
            if axis.is_none() {
                return Err(ConfigError::Only {
                    text: format!("'{text}'"),
                    problem: "it is empty; without it all cells are kept".to_owned(),
                });
            }
        }
        Ok(selector)
    }

    fn of(&mut self, axis: &'static str) -> &mut Vec<Pattern> {
        let place = self.0.iter().position(|(other, _)| *other == axis);
        let place = place.unwrap_or_else(|| {
            self.0.push((axis, Vec::new()));
            self.0.len() - 1
        });
        &mut self.0[place].1
    }

    /// Checks that every pattern matches, or if negated excludes, a variant on its axis.
    ///
    /// # Errors
    /// [`ConfigError::NoMatch`].
    pub fn check<'v>(
        &self,
        variants: impl Fn(&str) -> Vec<&'v Variant>,
    ) -> Result<(), ConfigError> {
        for (axis, patterns) in &self.0 {
            let known = variants(axis);
            for pattern in patterns {
                let named = pattern.without_negation();
                if !known.iter().any(|variant| named.matches(variant)) {
                    return Err(ConfigError::NoMatch {
                        at: format!("--only {axis}={pattern}"),
                        axis,
                        pattern: pattern.to_string(),
                        known: known.iter().map(|variant| variant.label.clone()).collect(),
                    });
                }
            }
        }
        Ok(())
    }

    /// True if every axis matches, as decided by `on`.
    pub fn fits(&self, on: impl Fn(&str, &dyn Fn(&Variant) -> bool) -> bool) -> bool {
        let mut axes = self.0.iter();
        axes.all(|(axis, patterns)| {
            on(axis, &|variant| patterns.iter().any(|p| p.matches(variant)))
        })
    }
}

fn known(name: &str, axes: &[&'static str]) -> Result<&'static str, String> {
    let found = axes.iter().find(|axis| **axis == name).copied();
    found.ok_or_else(|| format!("unknown axis `{name}`{}", did_you_mean_or_known(name, axes)))
}

/// Splits at separators outside parentheses and brackets, as labels such as `grid(a=1,b=2)` contain them.
pub fn split_outside_brackets(text: &str, separator: char) -> impl Iterator<Item = &str> {
    let mut depth = 0usize;
    text.split(move |c| {
        match c {
            '(' | '[' => depth += 1,
            ')' | ']' => depth = depth.saturating_sub(1),
            _ => {}
        }
        c == separator && depth == 0
    })
}

/// True if `text` matches `glob`, in which `*` matches any text, including none.
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
        // The leftmost match leaves the most text for the rest.
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
            ("uniform-grid()", false),
            ("uniform-grid(lambda=3)()", true),
            ("!uniform-grid()", true),
            ("uniform-grid", true),
            ("uniform-grid(lambda=3)", true),
            ("uniform-grid(lambda=8)", false),
            ("!uniform-grid", false),
            ("!bvh", true),
        ] {
            assert_eq!(Pattern::new(text).matches(&variant), fits, "{text}");
        }
    }

    #[test]
    fn a_selector_reads_labels_as_they_are_written() {
        let parsed = |texts: &[&str]| {
            let texts: Vec<String> = texts.iter().map(|text| (*text).to_owned()).collect();
            Selector::parse(&texts, &["accel", "scene"])
        };
        let same = |texts: &[&str], axes: &[(&'static str, &[&str])]| {
            let of = |(axis, patterns): &(&'static str, &[&str])| {
                (*axis, patterns.iter().map(|p| Pattern::new(*p)).collect())
            };
            let expected = Selector(axes.iter().map(of).collect());
            assert_eq!(parsed(texts).expect("a selector"), expected, "{texts:?}");
        };
        same(
            &["accel=g(a=1,b=2), scene=x,,"],
            &[("accel", &["g(a=1,b=2)"]), ("scene", &["x"])],
        );
        same(
            &["accel=*bvh,g(a=1,b=2),!h"],
            &[("accel", &["*bvh", "g(a=1,b=2)", "!h"])],
        );
        same(
            &["accel=a,scene=x", "accel=b"],
            &[("accel", &["a", "b"]), ("scene", &["x"])],
        );
        same(&["scene=a b=c"], &[("scene", &["a b=c"])]);
        same(
            &["scene=a, b, accel=g"],
            &[("scene", &["a, b"]), ("accel", &["g"])],
        );
        same(&[], &[]);
        for (wrong, told) in [
            ("g(a=1)", "no `=`"),
            ("", "it is empty"),
            (" , ", "it is empty"),
            ("acel=bvh", "did you mean `accel`"),
            ("accel=a,scne=b", "unknown axis `scne`"),
        ] {
            let error = parsed(&[wrong]).expect_err(wrong).to_string();
            assert!(error.contains(told), "{error}");
        }
        // Every text must name its axis.
        assert!(parsed(&["accel=a", "b"]).is_err());
    }
}
