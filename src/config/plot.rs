//! Plots that an experiment asks for: its `[[plot]]`, which affect no measurement.

use super::error::ConfigError;
use super::expect::{Pick, fault, refused};
use serde::Deserialize;

/// A plot of the report, of any figures of a run.
#[derive(Debug, Clone, PartialEq, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct PlotRequest {
    /// The text below it.
    pub caption: String,
    /// Id of the figure whose values are the ordinates, for instance `rays-ns/v1`.
    pub y: String,
    /// Abscissas, see [`Abscissa`].
    pub x: String,
    /// Axes whose labels have a curve each; one curve if there are none.
    #[serde(default)]
    pub curves: Vec<String>,
    /// The selection.
    #[serde(default)]
    pub of: Pick,
}

/// Where abscissas come from.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Abscissa<'a> {
    /// The figure with this id, of the same cell.
    Figure(&'a str),
    /// The number at the end of the labels of an axis: `spp`, or `subject` with `level 03`.
    Axis(&'a str),
    /// A parameter of the variants of an axis, with its default, which labels do not name: `integrator.spread=0`. Without one
    /// such labels have no abscissa.
    Parameter {
        /// The axis.
        axis: &'a str,
        /// The parameter.
        name: &'a str,
        /// Its default.
        default: Option<f64>,
    },
}

#[derive(Deserialize)]
struct File {
    #[serde(default)]
    plot: Vec<PlotRequest>,
}

impl PlotRequest {
    /// Reads the requests of an experiment.
    ///
    /// # Errors
    /// An unknown key (with the nearest known one), a missing key, a wrong type, or a default that is no number.
    pub fn all(text: &str, file: &str) -> Result<Vec<Self>, ConfigError> {
        let read: File = toml::from_str(text).map_err(|error| fault(text, file, &error))?;
        let is_number = |text: &str| text.parse::<f64>().is_ok();
        let no_number = |plot: &&Self| {
            plot.x
                .split_once('=')
                .is_some_and(|(_, text)| !is_number(text))
        };
        match read.plot.iter().find(no_number) {
            Some(PlotRequest { x, .. }) => {
                let problem =
                    "the default behind `=` must be a number, as in \"integrator.spread=0\"";
                Err(refused(file, format!("[[plot]] x = \"{x}\": {problem}")))
            }
            None => Ok(read.plot),
        }
    }

    /// Where its abscissas come from. Ids of figures have a version.
    pub fn abscissa(&self) -> Abscissa<'_> {
        let (path, default) = match self.x.split_once('=') {
            Some((path, default)) => (path, default.parse().ok()),
            None => (self.x.as_str(), None),
        };
        match path.split_once('.') {
            _ if path.contains("/v") => Abscissa::Figure(path),
            Some((axis, name)) => Abscissa::Parameter {
                axis,
                name,
                default,
            },
            None => Abscissa::Axis(path),
        }
    }

    /// The abscissa that a label says; `None` if it says none, or is of a figure.
    pub fn number_in(&self, label: &str) -> Option<f64> {
        match self.abscissa() {
            Abscissa::Figure(_) => None,
            Abscissa::Axis(_) => label.rsplit(' ').next()?.parse().ok(),
            Abscissa::Parameter { name, default, .. } => match parameter(label, name) {
                Some(value) => value.parse().ok(),
                None => default.filter(|_| !label.is_empty()),
            },
        }
    }
}

/// The value of a parameter that a label says, which is none for its default.
fn parameter<'l>(label: &'l str, name: &str) -> Option<&'l str> {
    let inside = label.split_once('(')?.1.strip_suffix(')')?;
    let mut depth = 0;
    let is_end = |c: char| {
        depth += i32::from(c == '(') - i32::from(c == ')');
        c == ',' && depth == 0
    };
    let mut said = inside.split(is_end).filter_map(|part| part.split_once('='));
    said.find_map(|(key, value)| (key == name).then_some(value))
}

#[cfg(test)]
mod tests {
    use super::*;

    fn plot(rest: &str) -> Result<Vec<PlotRequest>, ConfigError> {
        let head = "[[plot]]\ncaption = \"c\"\ny = \"a/v1\"\n";
        PlotRequest::all(&format!("{head}{rest}"), "x.toml")
    }

    #[test]
    fn abscissas_are_figures_numbers_of_labels_and_parameters_with_their_default() {
        let one = |rest: &str| plot(rest).unwrap().remove(0);
        assert_eq!(one("x = \"b/v2\"").abscissa(), Abscissa::Figure("b/v2"));
        let spp = one("x = \"spp\"");
        assert_eq!(spp.number_in("16"), Some(16.0));
        assert_eq!(one("x = \"subject\"").number_in("level 03"), Some(3.0));
        assert_eq!(spp.number_in("slope"), None);
        let spread = one("x = \"integrator.spread=0.5\"");
        assert_eq!(
            spread.number_in("rays:bounce(side=64,spread=20)"),
            Some(20.0)
        );
        assert_eq!(spread.number_in("rays:bounce(spreads=20)"), Some(0.5));
        assert_eq!(spread.number_in(""), None);
        let side = one("x = \"integrator.side\"");
        assert_eq!(side.number_in("rays:bounce"), None);
        let label = "a(b=c(d=1,e=2),d=3)";
        let said = ["b", "d", "e"].map(|name| parameter(label, name));
        assert_eq!(said, [Some("c(d=1,e=2)"), Some("3"), None]);
    }

    #[test]
    fn a_misspelt_key_and_a_default_that_is_no_number_are_refused() {
        let text = plot("x = \"spp\"\ncurve = [\"accel\"]")
            .unwrap_err()
            .to_string();
        assert!(
            text.contains("x.toml:5") && text.contains("`curves`"),
            "{text}"
        );
        let text = plot("x = \"a.b=c\"").unwrap_err().to_string();
        assert!(text.contains("must be a number"), "{text}");
    }
}
