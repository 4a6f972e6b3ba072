//! Tables, figures and claims of four theses, each by an experiment, with the thesis's numbers beside ours and a
//! verdict on every claim. docs/repro.md.
//!
//! An experiment of `experiments/thesis` has the expectations ([`raystone_config::expect`]); `run` runs it unless its
//! records are there; [`claim`] compares its values with them; [`page`] and [`latex`] show both.

pub mod claim;
pub mod judge;
pub mod latex;
pub mod page;
mod plots;
pub mod scenes;
pub mod select;
pub mod table;

use raystone_config::ConfigError;
use raystone_config::expect::Thesis;
use raystone_core::text::did_you_mean_or_known;
use serde::Deserialize;

/// An experiment of a thesis, embedded in the program.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Source {
    /// Its name, that of its file.
    pub name: &'static str,
    /// The file's text.
    pub text: &'static str,
}

macro_rules! sources {
    ($($name:literal),* $(,)?) => {
        [$(Source {
            name: $name,
            text: include_str!(concat!("../../../experiments/thesis/", $name, ".toml")),
        }),*]
    };
}

/// All experiments, in the order of the theses.
pub static SOURCES: [Source; 21] = sources![
    "nilsson-table-5-2",
    "nilsson-table-5-3",
    "nilsson-table-5-4",
    "dufay-table-2-2",
    "dufay-tables-3-2-to-3-5",
    "dufay-h3b-path-depth",
    "dufay-h15-shadow-rays",
    "dufay-table-4-1",
    "dufay-table-4-2",
    "dufay-h16-kd-tree",
    "dufay-table-5-1",
    "dufay-figs-5-3-and-5-4",
    "dufay-fig-5-14",
    "dufay-fig-5-15",
    "dufay-fig-5-17",
    "micro-jitter-amplitude",
    "roger-cones",
    "roger-ray-hierarchy",
    "roger-specular",
    "roger-stream-reduction",
    "pfeuti-tables-4-1-to-4-5",
];

/// The list of untested parts, with reasons.
const NOT_COVERED: &str = include_str!("not-covered.toml");

/// Parts of the digests that no experiment tests.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotCovered {
    /// Tables and figures whose parts do not exist yet.
    pub table: Vec<NotYet>,
    /// Hypotheses.
    pub claim: Vec<Untested>,
}

/// A table or figure that cannot be run yet.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct NotYet {
    /// Name, as a table's.
    pub name: String,
    /// Its title in the thesis.
    pub title: String,
    /// The missing part.
    pub why: String,
}

/// Hypotheses that nothing tests, for one reason.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Untested {
    /// Stem of the digest's file.
    pub source: String,
    /// Their numbers there.
    pub ids: Vec<String>,
    /// The reason.
    pub why: String,
}

/// Returns the parts that no experiment tests.
///
/// # Errors
/// The embedded list is not readable: a fault of this program.
pub fn not_covered() -> Result<NotCovered, toml::de::Error> {
    toml::from_str(NOT_COVERED)
}

impl Source {
    /// Returns the description of its thesis.
    ///
    /// # Errors
    /// A fault of the file.
    pub fn thesis(&self) -> Result<Thesis, ConfigError> {
        let file = format!("{}.toml", self.name);
        let missing = || ConfigError::Refused {
            at: file.clone(),
            reason: "no [thesis]".to_owned(),
        };
        Thesis::parse(self.text, &file)?.ok_or_else(missing)
    }
}

/// Returns the experiments with these names, all without any, in their own order.
///
/// # Errors
/// An unknown name, with the nearest and all known ones; one whose parts do not exist yet, with the missing part.
pub fn chosen(names: &[String]) -> Result<Vec<Source>, String> {
    for name in names {
        if SOURCES.iter().any(|source| source.name == name) {
            continue;
        }
        let not_yet = not_covered().map(|n| n.table).unwrap_or_default();
        if let Some(table) = not_yet.into_iter().find(|table| table.name == *name) {
            return Err(format!("{name} cannot be run yet: {}", table.why));
        }
        let known: Vec<&str> = SOURCES.iter().map(|source| source.name).collect();
        let near = did_you_mean_or_known(name, &known);
        return Err(format!("unknown table `{name}`{near}"));
    }
    let is_named = |source: &&Source| names.is_empty() || names.iter().any(|n| n == source.name);
    Ok(SOURCES.iter().filter(is_named).copied().collect())
}
