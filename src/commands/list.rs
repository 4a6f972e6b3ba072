//! `raystone list`.

use super::adapters;
use super::arguments::unknown;
use super::mitsuba::MITSUBA;
use super::output::OutputArguments;
use anyhow::Result;
use clap::Args;
use raystone::config::{Axis, Catalogue};
use raystone::discrepancy::Measure;
use raystone::export::FORMATS;
use raystone::measure::figure::{Better, FIGURES, Figure};
use raystone::measure::metrics::METRICS;
use raystone::params::{Entry, Parameter};
use raystone::report::format::count;
use raystone::repro::scenes::{MODELS, Model, directory};
use raystone::scene::{LIGHT_KINDS, MATERIAL_KINDS, MaterialKind};
use serde_json::{Map, Value, json};
use std::fmt::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;

/// List everything that can be named: scenes, structures, samplers, integrators, settings, materials, lights, metrics,
/// measures, figures, formats, models, adapters
#[derive(Args)]
pub struct List {
    /// What to list [default: everything but adapters]
    #[arg(value_parser = topic)]
    what: Option<&'static Topic>,
    /// Folder of models [default: ../shared/scenes if it is there, else raystone/scenes in the user's data]
    #[arg(long, value_name = "DIR")]
    scenes: Option<PathBuf>,
    #[command(flatten)]
    output: OutputArguments,
}

/// A topic of the list.
struct Topic {
    name: &'static str,
    also: &'static [&'static str],
    about: &'static str,
    rows: Rows,
}

enum Rows {
    Axis(Axis),
    Of(fn(&Catalogue, &List) -> Vec<Row>),
}

/// Something that can be named.
pub struct Row {
    name: String,
    text: String,
    /// Lines below it.
    below: Vec<String>,
    pub json: Value,
}

const fn axis(
    axis: Axis,
    name: &'static str,
    also: &'static [&'static str],
    about: &'static str,
) -> Topic {
    let rows = Rows::Axis(axis);
    Topic {
        name,
        also,
        about,
        rows,
    }
}

const fn other(
    name: &'static str,
    about: &'static str,
    rows: fn(&Catalogue, &List) -> Vec<Row>,
) -> Topic {
    Topic {
        name,
        also: &[],
        about,
        rows: Rows::Of(rows),
    }
}

/// Adapters: drivers are loaded, and may print, only if they are asked for.
const ADAPTER: &str = "adapter";

#[rustfmt::skip]
static TOPICS: [Topic; 21] = [
    axis(Axis::Scene, "scene", &[], "built in, or the path of a .obj, .gltf, .glb, .ply or Nori .xml file"),
    axis(Axis::Accel, "accel", &["structure"], ""),
    axis(Axis::Sequence, "sequence", &[], ""),
    axis(Axis::Decorrelation, "decorrelation", &[], ""),
    axis(Axis::Integrator, "integrator", &[], ""),
    other("material", "how surfaces scatter light, as model files say", |_, _| materials()),
    other("light", "what shines, besides a constant sky", |_, _| {
        LIGHT_KINDS.iter().map(|kind| Row::new(kind.name, kind.description)).collect()
    }),
    axis(Axis::Triangle, "triangle", &[], "ray-triangle test of all structures"),
    axis(Axis::BoxTest, "box-test", &["box"], "of all structures"),
    axis(Axis::Offset, "offset", &[], "how rays leave a surface"),
    axis(Axis::Organisation, "organisation", &[], "of the path tracer on the device"),
    axis(Axis::Peer, "peer", &[], "ray casters of others, to measure against"),
    axis(Axis::Workgroup, "workgroup", &[], "of kernels that trace"),
    axis(Axis::Load, "load", &[], "how kernels read nodes and triangles"),
    other("setting", "sections of experiment files, and their keys", |catalogue, _| {
        let sections = catalogue.sections().iter().map(|section| section.entry.clone());
        entries(&sections.collect::<Vec<_>>())
    }),
    other("metric", "v the image, r the reference, A and B its halves", |_, _| {
        METRICS.iter().map(|metric| Row::new(metric.id, metric.description)).collect()
    }),
    Topic { also: &["discrepancy"], ..other("measure", "of point sets, for `raystone points`", |_, _| {
        Measure::ALL.iter().map(|m| Row::new(m.name(), m.description())).collect()
    }) },
    other("figure", "what is measured", |_, _| figures()),
    other("format", "of `raystone export`", |_, _| {
        let formats = FORMATS.iter().map(|format| (format.name, format.description));
        formats.chain([MITSUBA]).map(|(name, text)| Row::new(name, text)).collect()
    }),
    other("model", "that experiments of theses use: there or missing, licence, source", |_, list| models(list)),
    other(ADAPTER, "best first", |_, _| raystone::gpu::adapters().iter().map(adapters::row).collect()),
];

/// Returns the topic of this name, or of its plural.
fn topic(name: &str) -> Result<&'static Topic, String> {
    let is_it = |known: &str| name.strip_suffix('s').unwrap_or(name) == known || name == known;
    let found = TOPICS
        .iter()
        .find(|topic| is_it(topic.name) || topic.also.iter().any(|also| is_it(also)));
    found.ok_or_else(|| unknown(name, TOPICS.iter().map(|topic| topic.name)))
}

impl List {
    pub fn execute(self) -> Result<ExitCode> {
        let catalogue = raystone::registries().catalogue();
        let is_asked = |topic: &&Topic| match self.what {
            Some(what) => what.name == topic.name,
            None => topic.name != ADAPTER,
        };
        let mut texts = Vec::new();
        let mut lists = Map::new();
        for topic in TOPICS.iter().filter(is_asked) {
            let rows = match topic.rows {
                Rows::Axis(axis) => entries(&catalogue[axis]),
                Rows::Of(rows) => rows(&catalogue, &self),
            };
            let name = topic.name.replace('-', "_");
            let colon = if topic.about.is_empty() { "" } else { ": " };
            let mut text = format!("{name}{colon}{}\n{}", topic.about, table(&rows));
            if rows.is_empty() {
                text += "  none answers; `raystone doctor` says what to do\n";
            }
            texts.push(text);
            lists.insert(name, rows.into_iter().map(|row| row.json).collect());
        }
        if self.what.is_none() {
            texts.push("adapter: of this machine, by `raystone list adapter`\n".to_owned());
        }
        let fields = json!({ "lists": lists });
        self.output.show("list", fields, &texts.join("\n"))?;
        Ok(ExitCode::SUCCESS)
    }
}

impl Row {
    fn new(name: &str, text: &str) -> Self {
        Self {
            name: name.to_owned(),
            text: text.to_owned(),
            below: Vec::new(),
            json: json!({ "name": name, "description": text }),
        }
    }

    pub fn with(name: impl ToString, text: String, below: Vec<String>, json: Value) -> Self {
        Self {
            name: name.to_string(),
            text,
            below,
            json,
        }
    }
}

/// Formats a line for each row with its text after the name, and further lines below it.
pub fn table(rows: &[Row]) -> String {
    let width = rows.iter().map(|row| row.name.len()).max().unwrap_or(0);
    let mut text = String::new();
    for row in rows {
        // Writing to a string cannot fail.
        let _ = writeln!(text, "  {:width$}  {}", row.name, row.text);
        for line in &row.below {
            let _ = writeln!(text, "  {:width$}    {line}", "");
        }
    }
    text
}

fn entries(entries: &[Entry]) -> Vec<Row> {
    let row = |(i, entry): (usize, &Entry)| {
        let (shared, own) = shared_parameters(entry, &entries[..i]);
        let shared = shared.map(|(from, names)| format!("as `{from}`: {}", names.join(", ")));
        let own = own.into_iter().map(|p| {
            let (name, default) = (p.name, default(p));
            format!("{name} = {default}: {} ({})", p.description, p.range)
        });
        let parameters = entry.schema.iter().map(|p| {
            let (default, range) = (default(p), p.range.to_string());
            json!({ "name": p.name, "default": default, "range": range, "description": p.description })
        });
        let mut row = Row::new(&entry.name, &entry.description);
        row.json["parameters"] = parameters.collect();
        row.below = own.chain(shared).collect();
        row
    };
    entries.iter().enumerate().map(row).collect()
}

/// Returns the default of a parameter; a dash where it has none that could be written.
fn default(parameter: &Parameter) -> String {
    let default = parameter.default_written();
    default.map_or("–".to_owned(), ToString::to_string)
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
    // The first of those that share most: `max_by_key` alone returns the last.
    let most = earlier.iter().rev().max_by_key(|other| shared(other));
    let Some(other) = most.filter(|other| shared(other) > FEW) else {
        return (None, entry.schema.iter().collect());
    };
    let (same, own): (Vec<&Parameter>, Vec<&Parameter>) =
        entry.schema.iter().partition(|p| other.schema.contains(p));
    let names = same.iter().map(|p| p.name).collect();
    (Some((&other.name, names)), own)
}

fn materials() -> Vec<Row> {
    let row = |kind: &&MaterialKind| {
        let mut row = Row::new(kind.name, kind.description);
        row.json["parameters"] = json!(kind.parameters);
        if !kind.parameters.is_empty() {
            row.below = vec![format!("base colour; {}", kind.parameters.join("; "))];
        }
        row
    };
    MATERIAL_KINDS.iter().map(row).collect()
}

fn figures() -> Vec<Row> {
    let row = |figure: &&Figure| {
        let better = match figure.better {
            Better::Higher => ", higher is better",
            Better::Lower => ", lower is better",
            Better::Neither => "",
        };
        let text = format!("{}{better}", figure.heading());
        Row::with(&figure.id, text, Vec::new(), json!(figure))
    };
    FIGURES.iter().map(row).collect()
}

fn models(list: &List) -> Vec<Row> {
    let directory = directory(list.scenes.as_deref());
    let row = |model: &Model| {
        let file = directory.join(model.path);
        let there = file.is_file();
        let word = if there { "there" } else { "missing" };
        let (triangles, licence, from) = (model.triangles, model.licence, model.from);
        Row::with(
            model.path,
            format!("{} triangles, {word}: {}", count(triangles), file.display()),
            vec![format!("licence: {licence}"), format!("from:    {from}")],
            json!({ "name": model.path, "file": file, "there": there, "triangles": triangles, "licence": licence, "from": from }),
        )
    };
    MODELS.iter().map(row).collect()
}
