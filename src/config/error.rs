//! Errors of experiment files, with key, place and remedy.

use raystone_core::text::did_you_mean;
use std::fmt;
use std::path::PathBuf;
use std::sync::Arc;
use thiserror::Error;

/// The place where a value was written.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Place {
    /// In the experiment file.
    File {
        /// The file as named by the user.
        file: Arc<str>,
        /// Line, from 1.
        line: usize,
    },
    /// On the command line, as `--set TEXT`.
    Override(Arc<str>),
    /// Nowhere: the value is its key's default.
    Default,
}

impl Place {
    /// The first line of a file, for anything missing from it.
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

/// Errors of an experiment file, its overrides, or a filter of its cells.
#[derive(Debug, Error)]
pub enum ConfigError {
    /// The file cannot be read.
    #[error("cannot read the experiment file {}: {source}; name a .toml file, such as experiments/quick.toml", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// The file is a model by its name.
    #[error("{path} is a model, not an experiment file; type: --scene {path}", path = path.display())]
    Model {
        /// The file.
        path: PathBuf,
    },
    /// The text is not TOML (for instance, a key is written twice).
    #[error("{at}: not valid TOML: {message}")]
    Syntax {
        /// The place.
        at: Place,
        /// The TOML parser's message.
        message: String,
    },
    /// An unknown section, key or name.
    #[error("{at}: unknown {what} `{name}`{}", suggestion(name, known))]
    Unknown {
        /// The place.
        at: Place,
        /// The kind expected: `section`, `key in [run]`, `accel`, …
        what: String,
        /// The text written.
        name: String,
        /// All allowed names.
        known: Vec<String>,
    },
    /// A value of the wrong type.
    #[error("{at}: `{key}` must be {expected}, not {found}")]
    WrongType {
        /// The place.
        at: Place,
        /// Full key.
        key: String,
        /// Type and range of the key.
        expected: String,
        /// The value written.
        found: String,
    },
    /// A value of the right type that is not allowed.
    #[error("{at}: `{key}` = {value} is not allowed; it must be {expected}")]
    OutOfRange {
        /// The place.
        at: Place,
        /// Full key.
        key: String,
        /// The value written.
        value: String,
        /// The allowed values.
        expected: String,
    },
    /// A required key is missing.
    #[error("{at}: `{key}` is missing; add it, as {expected}")]
    Missing {
        /// The file or section.
        at: Place,
        /// Full key.
        key: String,
        /// Type and range of the key.
        expected: String,
    },
    /// An axis or list of parameter values is empty.
    #[error("{at}: `{key}` is empty; list at least one value")]
    Empty {
        /// The place.
        at: Place,
        /// Full key.
        key: String,
    },
    /// A list contains the same value twice.
    #[error("{at}: `{key}` lists {value} twice; remove one")]
    Duplicate {
        /// The place.
        at: Place,
        /// Full key.
        key: String,
        /// The repeated value.
        value: String,
    },
    /// Too many variants or cells to run.
    #[error("{at}: {what} make {count} or more, the limit is {limit}; list fewer values")]
    TooMany {
        /// The place.
        at: Place,
        /// The factors.
        what: String,
        /// Their number, or a lower bound.
        count: usize,
        /// The limit.
        limit: usize,
    },
    /// Parameters are set for an entry that the experiment does not use.
    #[error(
        "{at}: [{axis}.{name}] sets parameters, but `{name}` is not in axes.{axis} ({}); \
         add it there or remove the section",
        quoted(used)
    )]
    NotOnAxis {
        /// The place.
        at: Place,
        /// The axis.
        axis: &'static str,
        /// The entry.
        name: String,
        /// The names on the axis.
        used: Vec<String>,
    },
    /// An override does not have the form `key=value`.
    #[error("--set {text}: {problem}; write --set section.key=value")]
    Override {
        /// The argument.
        text: String,
        /// The problem.
        problem: String,
    },
    /// A filter does not have the form `axis=pattern`.
    #[error("--only {text}: {problem}; write --only axis=pattern, for instance accel=bvh*")]
    Only {
        /// The argument.
        text: String,
        /// The problem.
        problem: String,
    },
    /// A pattern of an exclude or filter matches no variant of its axis.
    #[error("{at}: no {axis} fits `{pattern}`{}", suggestion(pattern, known))]
    NoMatch {
        /// A place in the file, or the filter.
        at: String,
        /// The axis.
        axis: &'static str,
        /// The pattern.
        pattern: String,
        /// Labels of the variants on the axis.
        known: Vec<String>,
    },
    /// The patterns of an exclude each match something, but never the same cell.
    #[error("{at}: this [[{section}]] ({exclude}) fits no cell; correct or remove it")]
    UselessExclude {
        /// The place.
        at: Place,
        /// Its patterns.
        exclude: String,
        /// `exclude` or `include`.
        section: &'static str,
    },
    /// A sequence and a decorrelation are incompatible.
    #[error("{at}: {reason}")]
    Refused {
        /// File and section.
        at: String,
        /// The pair and the reason.
        reason: String,
    },
    /// Several mistakes, one a line.
    #[error("{}", lines(.0))]
    Several(Vec<ConfigError>),
    /// Excludes and filters remove every cell.
    #[error("{file}: nothing is left to run: {reason}")]
    NothingLeft {
        /// The experiment file.
        file: String,
        /// The rule that removed the last cell.
        reason: String,
    },
}

impl ConfigError {
    /// Where the mistake was written.
    pub(super) fn place(&self) -> Option<&Place> {
        match self {
            Self::Syntax { at, .. }
            | Self::Unknown { at, .. }
            | Self::WrongType { at, .. }
            | Self::OutOfRange { at, .. }
            | Self::Missing { at, .. }
            | Self::Empty { at, .. }
            | Self::Duplicate { at, .. }
            | Self::TooMany { at, .. }
            | Self::NotOnAxis { at, .. }
            | Self::UselessExclude { at, .. } => Some(at),
            _ => None,
        }
    }

    /// The error for an unknown name.
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

fn lines(faults: &[ConfigError]) -> String {
    let lines: Vec<String> = faults.iter().map(ToString::to_string).collect();
    lines.join("\n")
}

/// Maximum number of known names in an error message.
const LIST_LIMIT: usize = 16;

fn suggestion(name: &str, known: &[String]) -> String {
    let near = did_you_mean(name, known.iter().map(String::as_str));
    let is_short = known.len() <= LIST_LIMIT;
    match (is_short, near.is_empty()) {
        _ if known.is_empty() => "; nothing is known here".to_owned(),
        (true, true) => format!("; known: {}", quoted(known)),
        (true, false) => format!("{near} Known: {}", quoted(known)),
        (false, true) => "; `raystone list` shows all that is known".to_owned(),
        (false, false) => near,
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
