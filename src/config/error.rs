//! What can be wrong with an experiment, said with the key, the place and what to do.

use raystone_core::text::nearest;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// Where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In the experiment file.
    File {
        /// The file as the user named it.
        file: Arc<str>,
        /// Line, counted from 1.
        line: usize,
    },
    /// On the command line, as `--set TEXT`.
    Override(Arc<str>),
    /// Nowhere: the value is the default of its key.
    Default,
}

impl Place {
    /// The first line of a file, for what is missing from it.
    pub(super) fn start_of(file: &str) -> Self {
        Self::File {
            file: file.into(),
            line: 1,
        }
    }
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::File { file, line } => write!(f, "{file}:{line}"),
            Self::Override(text) => write!(f, "--set {text}"),
            Self::Default => f.write_str("built-in default"),
        }
    }
}

/// What can be wrong with an experiment file, its overrides, or a filter of its cells.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the experiment file {}: {source}; name a .toml file, such as experiments/quick.toml", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// Why.
        source: std::io::Error,
    },
    /// The text is not TOML (a key written twice is one such fault).
    #[error("{at}: not valid TOML: {message}")]
    Syntax {
        /// Where.
        at: Place,
        /// The TOML parser's words.
        message: String,
    },
    /// A section, key or name that nobody knows.
    #[error("{at}: unknown {what} `{name}`{}", suggestion(name, known))]
    Unknown {
        /// Where.
        at: Place,
        /// What was expected: `section`, `key in [run]`, `accel`, …
        what: String,
        /// What was written.
        name: String,
        /// Everything that could have been written.
        known: Vec<String>,
    },
    /// A value of the wrong type.
    #[error("{at}: `{key}` must be {expected}, not {found}")]
    WrongType {
        /// Where.
        at: Place,
        /// Full key.
        key: String,
        /// The type and range of the key.
        expected: String,
        /// What was written.
        found: String,
    },
    /// A value of the right type that is not allowed.
    #[error("{at}: `{key}` = {value} is not allowed; it must be {expected}")]
    OutOfRange {
        /// Where.
        at: Place,
        /// Full key.
        key: String,
        /// What was written.
        value: String,
        /// What is allowed.
        expected: String,
    },
    /// A key without a default is absent.
    #[error("{at}: `{key}` is missing; add it, as {expected}")]
    Missing {
        /// The file or section.
        at: Place,
        /// Full key.
        key: String,
        /// The type and range of the key.
        expected: String,
    },
    /// An axis or a list of parameter values without an element.
    #[error("{at}: `{key}` is empty; list at least one value, or leave the key out")]
    Empty {
        /// Where.
        at: Place,
        /// Full key.
        key: String,
    },
    /// The same value twice in one list.
    #[error("{at}: `{key}` lists {value} twice; remove one")]
    Duplicate {
        /// Where.
        at: Place,
        /// Full key.
        key: String,
        /// The repeated value.
        value: String,
    },
    /// More variants or cells than anybody can want to run.
    #[error("{at}: {what} make {count} or more, the limit is {limit}; list fewer values")]
    TooMany {
        /// Where.
        at: Place,
        /// What is multiplied.
        what: String,
        /// How many there would be, or a part of them.
        count: usize,
        /// How many there may be.
        limit: usize,
    },
    /// Parameters for an entry that the experiment does not use.
    #[error(
        "{at}: [{axis}.{name}] sets parameters, but `{name}` is not in axes.{axis} ({}); \
         add it there or remove the section",
        quoted(used)
    )]
    NotOnAxis {
        /// Where.
        at: Place,
        /// The axis.
        axis: &'static str,
        /// The entry.
        name: String,
        /// The names that are on the axis.
        used: Vec<String>,
    },
    /// An override that is not of the form `key=value`.
    #[error("--set {text}: {problem}; write --set section.key=value")]
    Override {
        /// The argument.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A filter that is not of the form `axis=pattern`.
    #[error("--only {text}: {problem}; write --only axis=pattern, for instance accel=bvh*")]
    Only {
        /// The argument.
        text: String,
        /// What is wrong with it.
        problem: String,
    },
    /// A pattern of an exclude or a filter that fits no variant of its axis.
    #[error("{at}: no {axis} fits `{pattern}`{}", suggestion(pattern, known))]
    NoMatch {
        /// Where: a place in the file, or the filter.
        at: String,
        /// The axis.
        axis: &'static str,
        /// The pattern.
        pattern: String,
        /// Labels of the variants on the axis.
        known: Vec<String>,
    },
    /// An exclude whose patterns all fit something, but never the same cell.
    #[error("{at}: this [[{section}]] ({exclude}) fits no cell; correct or remove it")]
    UselessExclude {
        /// Where.
        at: Place,
        /// Its patterns.
        exclude: String,
        /// `exclude` or `include`.
        section: &'static str,
    },
    /// A sequence and a decorrelation that make no sense together.
    #[error("{at}: {reason}")]
    Refused {
        /// File and section.
        at: String,
        /// The pair, and why.
        reason: String,
    },
    /// Excludes and filters leave nothing.
    #[error("{file}: nothing is left to run: {reason}")]
    NothingLeft {
        /// The experiment file.
        file: String,
        /// What removed the last cell.
        reason: String,
    },
}

impl ConfigError {
    /// The error for a name that is not among those known.
    pub(super) fn unknown<'n>(
        at: &Place,
        what: impl Into<String>,
        name: &str,
        known: impl IntoIterator<Item = &'n str>,
    ) -> Self {
        Self::Unknown {
            at: at.clone(),
            what: what.into(),
            name: name.to_owned(),
            known: known.into_iter().map(str::to_owned).collect(),
        }
    }
}

/// Longest list of known names that an error message spells out.
const LIST_LIMIT: usize = 16;

fn suggestion(name: &str, known: &[String]) -> String {
    match nearest(name, known.iter().map(String::as_str)) {
        None => "; nothing is known here".to_owned(),
        Some(near) if known.len() > LIST_LIMIT => format!("; did you mean `{near}`?"),
        Some(near) => format!("; did you mean `{near}`? Known: {}", quoted(known)),
    }
}

fn quoted(names: &[String]) -> String {
    let names: Vec<_> = names.iter().map(|name| format!("`{name}`")).collect();
    names.join(", ")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_long_list_of_known_names_is_not_spelled_out() {
        let known: Vec<String> = (0..40).map(|i| format!("name-{i}")).collect();
        let text = suggestion("name-3x", &known);
        assert!(text.contains("`name-3"), "{text}");
        assert!(!text.contains("Known"), "{text}");
    }
}
