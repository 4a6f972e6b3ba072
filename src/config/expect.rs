//! Expected results: the numbers and claims of a thesis, next to the experiment that tests them.
//!
//! An experiment file of a thesis has more sections, which do not affect measurements: `[thesis]` describes the thesis,
//! `[[substitute]]` the scenes used instead of its own, `[[expect]]` the claims, `[quick]` the changes of a short run,
//! `[software]` those of a whole run on a software adapter. docs/repro.md describes them. Without `[thesis]`,
//! `[[expect]]` holds the experiment's own targets, which are checks of every run. `[[plot]]` asks for plots of the
//! report ([`super::plot`]).

use super::error::{ConfigError, Place};
use super::tree::Table;
use raystone_core::text::did_you_mean;
use serde::Deserialize;
use std::collections::{BTreeMap, BTreeSet};
use std::sync::Arc;

const SECTIONS: [&str; 6] = [
    "thesis",
    "substitute",
    "expect",
    "quick",
    "software",
    "plot",
];

/// Printed results of a thesis, or targets of an experiment, and the tests of them.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Thesis {
    /// Title of the reproduced table; empty if an experiment has targets of its own.
    pub title: String,
    /// File stem of the digest, for instance `dufay-2017`.
    pub source: String,
    /// Interpretation of ambiguous text, differences, and reasons.
    #[serde(default)]
    pub reading: String,
    /// Scenes used instead of the thesis' own.
    #[serde(skip)]
    pub substitutes: Vec<Substitute>,
    /// Expected results.
    #[serde(skip)]
    pub expects: Vec<Expect>,
    /// Overrides (`section.key=value`) for a short run with built-in scenes.
    #[serde(skip)]
    pub quick: Vec<String>,
    /// Overrides for a full run on a software adapter, where GPU sizes would take hours.
    #[serde(skip)]
    pub software: Vec<String>,
}

/// A scene used instead of one of the thesis.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Substitute {
    /// The thesis' name of its scene.
    pub original: String,
    /// Its number of triangles.
    #[serde(default)]
    pub triangles: Option<u64>,
    /// Our scene: built-in (a pattern can select a variant: `instances(*count=8*`), or a path below
    /// the scene directory; `None` if nothing is suitable.
    #[serde(default)]
    pub scene: Option<String>,
    /// The built-in scene for short runs; `None` omits it from them.
    #[serde(default)]
    pub quick: Option<String>,
    /// The differences of the scenes.
    #[serde(default)]
    pub why: String,
}

/// The comparison of a value.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Compare {
    /// Not compared: both are shown.
    Shown,
    /// The value against bounds.
    Bound,
    /// The ratio of two values against bounds.
    Ratio,
    /// Values of several selections, or their ratios to others, ascend in the given order.
    Order,
    /// The exponent of a power law along an axis against bounds.
    Slope,
}

/// Devices on which a figure is meaningful.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Deserialize)]
#[serde(rename_all = "kebab-case")]
pub enum Speaks {
    /// Any device: counts, errors, host times.
    #[default]
    Any,
    /// Not a software adapter: device times.
    Gpu,
}

/// Axis → pattern (see [`super::Pattern`]) for its label.
pub type Pick = BTreeMap<String, String>;

/// An expectation.
// Many fields: one for each key of `[[expect]]`.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Expect {
    /// Name, unique in its file.
    pub id: String,
    /// The thesis' claim or printed value.
    pub says: String,
    /// The digest's hypotheses that it tests, for instance `H5`.
    #[serde(default)]
    pub claims: Vec<String>,
    /// The figure, see `measure`'s table of figures.
    pub figure: String,
    /// The comparison.
    pub compare: Compare,
    /// The selection compared.
    #[serde(default)]
    pub of: Pick,
    /// Divisor; for an order, the divisor of each part.
    #[serde(default)]
    pub over: Pick,
    /// Selections whose values should ascend.
    #[serde(default)]
    pub order: Vec<Pick>,
    /// Numeric axis for a slope.
    #[serde(default)]
    pub along: Option<String>,
    /// Minimum value (ratio, exponent) that agrees.
    #[serde(default)]
    pub least: Option<f64>,
    /// Maximum value that agrees.
    #[serde(default)]
    pub most: Option<f64>,
    /// Agrees within this factor of the thesis' value.
    #[serde(default)]
    pub within: Option<f64>,
    /// Agrees within this distance of the thesis' value.
    #[serde(default)]
    pub off_by: Option<f64>,
    /// Unit of the thesis' values, if they are values of the figure; empty for the figure's unit.
    #[serde(default)]
    pub unit: String,
    /// Devices on which it is meaningful.
    #[serde(default)]
    pub device: Speaks,
    /// Column of the original table.
    #[serde(default)]
    pub column: String,
    /// Interpretation of ambiguous text.
    #[serde(default)]
    pub reading: String,
    /// Counted figures that explain it, compared or shown in the same way.
    #[serde(default)]
    pub explain: Vec<String>,
    /// Places in the original table; if empty, wherever the selections match.
    #[serde(default)]
    pub at: Vec<At>,
}

/// A place in the original table.
#[derive(Debug, Clone, Default, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct At {
    /// Row of the original table.
    #[serde(default)]
    pub row: String,
    /// Column, if it differs from the expectation's.
    #[serde(default)]
    pub column: String,
    /// Original scene, see [`Substitute::original`].
    #[serde(default)]
    pub on: Option<String>,
    /// The printed value.
    #[serde(default)]
    pub thesis: Option<f64>,
    /// Additions to [`Expect::of`].
    #[serde(default)]
    pub of: Pick,
    /// Additions to [`Expect::over`].
    #[serde(default)]
    pub over: Pick,
    /// Replaces [`Expect::least`].
    #[serde(default)]
    pub least: Option<f64>,
    /// Replaces [`Expect::most`].
    #[serde(default)]
    pub most: Option<f64>,
    /// True to omit it from short runs.
    #[serde(default)]
    pub full_only: bool,
}

#[derive(Deserialize)]
struct File {
    thesis: Option<Thesis>,
    #[serde(default)]
    substitute: Vec<Substitute>,
    #[serde(default)]
    expect: Vec<Expect>,
    #[serde(default)]
    quick: Changes,
    #[serde(default)]
    software: Changes,
}

/// Overrides of a kind of run.
#[derive(Default, Deserialize)]
#[serde(deny_unknown_fields)]
struct Changes {
    #[serde(default)]
    set: Vec<String>,
}

impl Thesis {
    /// Reads these sections of an experiment; `None` without `[thesis]` and `[[expect]]`.
    ///
    /// # Errors
    /// An unknown key (with the nearest known one), a wrong type, or an untestable expectation.
    pub fn parse(text: &str, file: &str) -> Result<Option<Self>, ConfigError> {
        let parsed: File = toml::from_str(text).map_err(|error| fault(text, file, &error))?;
        if parsed.thesis.is_none() && parsed.expect.is_empty() {
            return Ok(None);
        }
        let mut thesis = parsed.thesis.unwrap_or_default();
        thesis.substitutes = parsed.substitute;
        thesis.expects = parsed.expect;
        thesis.quick = parsed.quick.set;
        thesis.software = parsed.software.set;
        thesis.check(file)?;
        Ok(Some(thesis))
    }

    fn check(&self, file: &str) -> Result<(), ConfigError> {
        let mut ids = BTreeSet::new();
        for expect in &self.expects {
            let complaint = if ids.insert(&expect.id) {
                expect.complaint(&self.substitutes)
            } else {
                Some("another one has this id".to_owned())
            };
            if let Some(complaint) = complaint {
                let problem = format!("[[expect]] id = \"{}\": {complaint}", expect.id);
                return Err(refused(file, problem));
            }
        }
        Ok(())
    }
}

impl Expect {
    /// The problem with the expectation, if any.
    fn complaint(&self, substitutes: &[Substitute]) -> Option<String> {
        let bounds = [self.least, self.most, self.within, self.off_by];
        let at_bounds = |at: &At| at.least.or(at.most).is_some();
        let bounded = bounds.iter().any(Option::is_some)
            || (!self.at.is_empty() && self.at.iter().all(at_bounds));
        let needs_thesis = self.within.or(self.off_by).is_some();
        if let Some(on) = (self.at.iter().filter_map(|at| at.on.as_ref()))
            .find(|on| substitutes.iter().all(|s| s.original != **on))
        {
            let known = substitutes.iter().map(|s| s.original.as_str());
            let near = did_you_mean(on, known);
            return Some(format!("no [[substitute]] is called `{on}`{near}"));
        }
        if needs_thesis && (self.at.is_empty() || self.at.iter().any(|at| at.thesis.is_none())) {
            return Some(
                "`within` and `off_by` need a `thesis` value at every place of `at`".to_owned(),
            );
        }
        if self.within.is_some_and(|factor| factor < 1.0) {
            return Some("`within` is a factor: at least 1".to_owned());
        }
        let lacks = match self.compare {
            Compare::Shown => None,
            Compare::Order => {
                (self.order.len() < 2).then_some("`order`, a list of two or more selections")
            }
            _ if !bounded => Some("a bound: `least`, `most`, `within` or `off_by`"),
            Compare::Ratio => {
                let over = !self.over.is_empty() || self.at.iter().any(|at| !at.over.is_empty());
                (!over).then_some("`over`, what to divide by")
            }
            Compare::Slope => {
                let along = self.along.is_none();
                along.then_some("`along`, the axis of numbers, for instance \"spp\"")
            }
            Compare::Bound => None,
        };
        lacks.map(|what| format!("it needs {what}"))
    }
}

pub(super) fn refused(file: &str, reason: String) -> ConfigError {
    ConfigError::Refused {
        at: file.to_owned(),
        reason,
    }
}

/// An error in one of these sections, with the nearest known key for an unknown one.
pub(super) fn fault(text: &str, file: &str, error: &toml::de::Error) -> ConfigError {
    let offset = error.span().map_or(0, |span| span.start);
    let line = 1 + text[..offset.min(text.len())].matches('\n').count();
    let at = Place::File {
        file: Arc::from(file),
        line,
    };
    let quoted: Vec<&str> = error.message().split('`').skip(1).step_by(2).collect();
    match (error.message().starts_with("unknown field"), &quoted[..]) {
        (true, [name, known @ ..]) => ConfigError::Unknown {
            at,
            what: "key".to_owned(),
            name: (*name).to_owned(),
            known: known.iter().map(|name| (*name).to_owned()).collect(),
        },
        _ => ConfigError::Syntax {
            at,
            message: error.message().to_owned(),
        },
    }
}

/// Removes these sections from an experiment's tree. Returns true if there were any.
pub(super) fn take(tree: &mut Table) -> bool {
    let mut any = false;
    for section in SECTIONS {
        any |= tree.remove(section).is_some();
    }
    any
}

/// True if two texts are the same experiment: equal except for comments and these sections, with
/// the same overrides appended (as `# --set …`).
pub fn same_experiment(a: &str, b: &str) -> bool {
    let read = |text: &str| {
        let mut table: toml::Table = toml::from_str(text).ok()?;
        for section in SECTIONS {
            table.remove(section);
        }
        let overrides = text.lines().filter(|line| line.starts_with("# --set "));
        Some((table, overrides.map(str::to_owned).collect::<Vec<_>>()))
    };
    read(a).is_some_and(|a| Some(a) == read(b))
}

#[cfg(test)]
mod tests {
    use super::*;

    const HEAD: &str = "[thesis]\ntitle = \"t\"\nsource = \"s\"\n";
    const ITEM: &str =
        "[[expect]]\nid = \"a\"\nsays = \"b\"\nfigure = \"f/v1\"\ncompare = \"bound\"\n";

    fn complaint(text: &str) -> String {
        let error = Thesis::parse(text, "x.toml").expect_err("a fault");
        error.to_string()
    }

    #[test]
    fn an_unknown_key_names_the_nearest_known_one_and_its_line() {
        let text = complaint(&format!("{HEAD}{ITEM}lest = 1.0\n"));
        assert!(
            text.contains("x.toml:9") && text.contains("`least`"),
            "{text}"
        );
    }

    #[test]
    fn an_expectation_that_cannot_be_judged_is_refused() {
        let bound = complaint(&format!("{HEAD}{ITEM}"));
        assert!(
            bound.contains("\"a\"") && bound.contains("`least`"),
            "{bound}"
        );
        let some = "at = [{ row = \"x\", most = 2.0 }, { row = \"y\" }]\n";
        let partly = complaint(&format!("{HEAD}{ITEM}{some}"));
        assert!(partly.contains("needs a bound"), "{partly}");
        let all = some.replace("\"y\"", "\"y\", least = 1.0");
        assert!(Thesis::parse(&format!("{HEAD}{ITEM}{all}"), "x").is_ok());
        let twice = complaint(&format!("{HEAD}{ITEM}least = 1.0\n{ITEM}least = 1.0\n"));
        assert!(twice.contains("another one"), "{twice}");
        let ratio = ITEM.replace("bound", "ratio");
        assert!(complaint(&format!("{HEAD}{ratio}least = 1.0\n")).contains("`over`"));
        let slope = ITEM.replace("bound", "slope");
        assert!(complaint(&format!("{HEAD}{slope}least = 1.0\n")).contains("`along`"));
        let order = ITEM.replace("bound", "order");
        assert!(complaint(&format!("{HEAD}{order}")).contains("`order`"));
        let on = format!("{HEAD}{ITEM}least = 1.0\nat = [{{ on = \"Spnza\" }}]\n");
        let sponza = "[[substitute]]\noriginal = \"Sponza\"\n";
        assert!(complaint(&format!("{on}{sponza}")).contains("did you mean `Sponza`"));
        let within = complaint(&format!(
            "{HEAD}{ITEM}within = 1.1\nat = [{{ row = \"x\" }}]\n"
        ));
        assert!(within.contains("`thesis`"), "{within}");
        let target = Thesis::parse(&format!("{ITEM}most = 1.0\n"), "x");
        assert!(
            target
                .expect("a target")
                .is_some_and(|t| t.title.is_empty())
        );
        assert!(
            Thesis::parse("[run]\nname = \"x\"\n", "x")
                .expect("none")
                .is_none()
        );
    }

    #[test]
    fn expectations_do_not_make_another_experiment_but_values_and_overrides_do() {
        let base = "[run]\nspp = [1]\n";
        let thesis = format!("# said\n{HEAD}{ITEM}least = 1.0\n{base}");
        assert!(same_experiment(base, &thesis));
        assert!(!same_experiment(base, "[run]\nspp = [2]\n"));
        assert!(!same_experiment(
            base,
            &format!("{base}# --set run.seed=2\n")
        ));
    }
}
