//! `raystone list`.

use super::adapters;
use super::list_json::lists;
use super::output::{OutputArguments, print, print_json};
use anyhow::Result;
use clap::{Args, ValueEnum};
use raystone::config::{Axis, Catalogue};
use raystone::discrepancy::Measure;
use raystone::export::FORMATS;
use raystone::measure::figure::{Better, FIGURES};
use raystone::measure::metrics::METRICS;
use raystone::params::{Entry, Parameter};
use raystone::scene::{LIGHT_KINDS, MATERIAL_KINDS};
use std::fmt::Write as _;
use std::process::ExitCode;

/// List everything that can be named: scenes, structures, samplers, integrators, settings, materials, lights, metrics,
/// measures, figures, formats, adapters
#[derive(Args)]
pub struct List {
    /// What to list [default: everything]
    what: Option<Topic>,
    #[command(flatten)]
    output: OutputArguments,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
pub enum Topic {
    #[value(alias = "scenes")]
    Scene,
    #[value(alias = "accels", alias = "structure", alias = "structures")]
    Accel,
    #[value(alias = "sequences")]
    Sequence,
    #[value(alias = "decorrelations")]
    Decorrelation,
    #[value(alias = "integrators")]
    Integrator,
    #[value(alias = "materials")]
    Material,
    #[value(alias = "lights")]
    Light,
    #[value(alias = "triangles")]
    Triangle,
    #[value(alias = "box-tests", alias = "box")]
    BoxTest,
    #[value(alias = "offsets")]
    Offset,
    #[value(alias = "organisations")]
    Organisation,
    #[value(alias = "peers")]
    Peer,
    #[value(alias = "workgroups")]
    Workgroup,
    #[value(alias = "settings")]
    Setting,
    #[value(alias = "metrics")]
    Metric,
    #[value(alias = "measures", alias = "discrepancy")]
    Measure,
    #[value(alias = "figures")]
    Figure,
    #[value(alias = "formats")]
    Format,
    #[value(alias = "adapters")]
    Adapter,
}

impl Topic {
    /// The axis that it lists; `None` for what is no axis of experiments.
    pub fn axis(self) -> Option<Axis> {
        Some(match self {
            Self::Scene => Axis::Scene,
            Self::Accel => Axis::Accel,
            Self::Sequence => Axis::Sequence,
            Self::Decorrelation => Axis::Decorrelation,
            Self::Integrator => Axis::Integrator,
            Self::Triangle => Axis::Triangle,
            Self::BoxTest => Axis::BoxTest,
            Self::Offset => Axis::Offset,
            Self::Organisation => Axis::Organisation,
            Self::Peer => Axis::Peer,
            Self::Workgroup => Axis::Workgroup,
            _ => return None,
        })
    }
}

impl List {
    pub fn execute(self) -> Result<ExitCode> {
        let catalogue = raystone::registries().catalogue();
        let topics = match &self.what {
            Some(topic) => std::slice::from_ref(topic),
            None => Topic::value_variants(),
        };
        if self.output.json {
            // Drivers are loaded, and may print, only where they are asked for.
            let asked = topics.iter().copied();
            let asked = asked.filter(|topic| self.what.is_some() || *topic != Topic::Adapter);
            let asked: Vec<Topic> = asked.collect();
            print_json("list", lists(&asked, &catalogue))?;
            return Ok(ExitCode::SUCCESS);
        }
        let sections: Vec<String> = topics
            .iter()
            .map(|topic| match (topic, topic.axis()) {
                (_, Some(axis)) => entries(&heading(axis), &catalogue[axis]),
                (Topic::Setting, _) => settings(&catalogue),
                (Topic::Material, _) => materials(),
                (Topic::Light, _) => lights(),
                (Topic::Metric, _) => metrics(),
                (Topic::Measure, _) => measures(),
                (Topic::Format, _) => formats(),
                (Topic::Figure, _) if self.what.is_none() => {
                    "figure: of the table of figures, by `raystone list figure`\n".to_owned()
                }
                (Topic::Figure, _) => figures(),
                // Drivers are loaded, and may print, only where they are asked for.
                _ if self.what.is_none() => {
                    "adapter: of this machine, by `raystone list adapter`\n".to_owned()
                }
                _ => adapter_list(),
            })
            .collect();
        print(&sections.join("\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

/// What is said of an axis before its entries.
fn heading(axis: Axis) -> String {
    let of = match axis {
        Axis::Scene => ": built in, or the path of a .obj, .gltf, .glb, .ply or Nori .xml file",
        Axis::Triangle => ": ray-triangle test of all structures",
        Axis::BoxTest => ": of all structures",
        Axis::Offset => ": how rays leave a surface",
        Axis::Organisation => ": of the path tracer on the device",
        Axis::Peer => ": ray casters of others, to measure against",
        Axis::Workgroup => ": of kernels that trace",
        _ => "",
    };
    format!("{axis}{of}\n")
}

fn settings(catalogue: &Catalogue) -> String {
    let sections = catalogue.sections().iter();
    let sections: Vec<Entry> = sections.map(|section| section.entry.clone()).collect();
    entries(
        "setting: sections of experiment files, and their keys\n",
        &sections,
    )
}

fn entries(heading: &str, entries: &[Entry]) -> String {
    let width = entries.iter().map(|e| e.name.len()).max().unwrap_or(0);
    let mut text = heading.to_owned();
    // Writing to a string cannot fail.
    for (i, entry) in entries.iter().enumerate() {
        let _ = writeln!(text, "  {:width$}  {}", entry.name, entry.description);
        let (shared, own) = shared_parameters(entry, &entries[..i]);
        for parameter in own {
            let _ = writeln!(
                text,
                "  {:width$}    {} = {}: {} ({})",
                "",
                parameter.name,
                default(parameter),
                parameter.description,
                parameter.range,
            );
        }
        if let Some((from, names)) = shared {
            let _ = writeln!(text, "  {:width$}    as `{from}`: {}", "", names.join(", "));
        }
    }
    text
}

/// The default of a parameter; a dash where it has none that could be written.
pub fn default(parameter: &Parameter) -> String {
    let default = parameter.default_written();
    default.map_or("–".to_owned(), ToString::to_string)
}

fn lights() -> String {
    let width = LIGHT_KINDS.iter().map(|kind| kind.name.len()).max();
    let width = width.unwrap_or(0);
    let mut text = "light: what shines, besides a constant sky\n".to_owned();
    for kind in LIGHT_KINDS {
        let _ = writeln!(text, "  {:width$}  {}", kind.name, kind.description);
    }
    text
}

fn materials() -> String {
    let width = MATERIAL_KINDS.iter().map(|kind| kind.name.len()).max();
    let width = width.unwrap_or(0);
    let mut text = "material: how surfaces scatter light, as model files say\n".to_owned();
    for kind in MATERIAL_KINDS {
        let _ = writeln!(text, "  {:width$}  {}", kind.name, kind.description);
        if !kind.parameters.is_empty() {
            let parameters = kind.parameters.join("; ");
            let _ = writeln!(text, "  {:width$}    base colour; {parameters}", "");
        }
    }
    text
}

/// Parameters shared with the earlier entry that has most of them, if it has more than a few: its name and
/// theirs; and the rest.
fn shared_parameters<'a>(
    entry: &'a Entry,
    earlier: &'a [Entry],
) -> (Option<(&'a str, Vec<&'a str>)>, Vec<&'a Parameter>) {
    const FEW: usize = 3;
    let shared = |other: &Entry| -> usize {
        let with = entry.schema.iter().filter(|p| other.schema.contains(p));
        with.count()
    };
    // The first of those that share most: `max_by_key` alone takes the last.
    let Some(other) = earlier.iter().rev().max_by_key(|other| shared(other)) else {
        return (None, entry.schema.iter().collect());
    };
    if shared(other) <= FEW {
        return (None, entry.schema.iter().collect());
    }
    let (same, own): (Vec<&Parameter>, Vec<&Parameter>) =
        entry.schema.iter().partition(|p| other.schema.contains(p));
    let names = same.iter().map(|p| p.name).collect();
    (Some((&other.name, names)), own)
}

fn metrics() -> String {
    let width = METRICS.iter().map(|m| m.id.len()).max().unwrap_or(0);
    let mut text = "metric: v the image, r the reference, A and B its halves\n".to_owned();
    for metric in METRICS {
        let _ = writeln!(text, "  {:width$}  {}", metric.id, metric.description);
    }
    text
}

fn measures() -> String {
    let all = Measure::ALL;
    let width = all.iter().map(|m| m.name().len()).max().unwrap_or(0);
    let mut text = "measure: of point sets, for `raystone discrepancy`\n".to_owned();
    for measure in all {
        let _ = writeln!(
            text,
            "  {:width$}  {}",
            measure.name(),
            measure.description()
        );
    }
    text
}

fn figures() -> String {
    let width = FIGURES.iter().map(|figure| figure.id.len()).max();
    let width = width.unwrap_or(0);
    let mut text = "figure: what is measured\n".to_owned();
    for figure in FIGURES {
        let better = match figure.better {
            Better::Higher => ", higher is better",
            Better::Lower => ", lower is better",
            Better::Neither => "",
        };
        let _ = writeln!(text, "  {:width$}  {}{better}", figure.id, figure.heading());
    }
    text
}

fn formats() -> String {
    let width = FORMATS.iter().map(|format| format.name.len()).max();
    let width = width.unwrap_or(0);
    let mut text = "format: of `raystone export`\n".to_owned();
    for format in &FORMATS {
        let _ = writeln!(text, "  {:width$}  {}", format.name, format.description);
    }
    text
}

fn adapter_list() -> String {
    let found = raystone::gpu::adapters();
    let mut text = "adapter: best first\n".to_owned();
    if found.is_empty() {
        text += "  none answers; `raystone doctor` says what to do\n";
    }
    for adapter in &found {
        text += &adapters::describe(adapter);
    }
    text
}
