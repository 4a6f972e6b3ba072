//! Figures, times, checks and images of a run for other tools: a file and a line of [`FORMATS`] for each format.
//! All numbers come from the one table of figures ([`crate::values`]) or are raw times ([`samples`]).

mod bencher;
mod github;
mod google_benchmark;
mod hyperfine;
mod json;
mod junit;
mod latex;
mod npy;
pub mod samples;
mod schema;
pub mod select;
mod tables;

pub use json::{OUTPUT_SCHEMA, checks_json, values_json};
pub(crate) use npy::linear as linear_file;
pub use schema::record_schema;

use crate::data::RunData;
use crate::values::{self, Estimate, Value};
use raystone_config::ConfigError;
use raystone_image::ImageError;
use raystone_record::figure::Better;
use raystone_record::{Line, RunRecord};
use select::Selection;
use std::path::{Path, PathBuf};

/// The source of an export: the records of one run, and the chosen figures and times.
pub struct Source<'a> {
    /// The run's folder.
    pub dir: &'a Path,
    /// The records.
    pub lines: &'a [Line],
    /// The records, sorted.
    pub data: RunData<'a>,
    /// The chosen figures.
    pub values: Vec<Value<'a>>,
    /// The chosen raw times.
    pub samples: Vec<samples::Samples>,
}

impl<'a> Source<'a> {
    /// Returns the records of the run in `dir`, and the choice of them.
    ///
    /// # Errors
    /// If nothing matches the choice.
    pub fn new(dir: &'a Path, lines: &'a [Line], choice: &Selection) -> Result<Self, ExportError> {
        let data = RunData::new(lines);
        let values = choice.of(values::values(&data))?;
        let mut samples = samples::samples(&data);
        samples.retain(|s| choice.keeps(&s.key, &s.figure.id));
        Ok(Self {
            dir,
            lines,
            data,
            values,
            samples,
        })
    }

    /// Returns the first line of the run, if it was written.
    fn run(&self) -> Option<&'a RunRecord> {
        self.data.run
    }
}

/// The export of a run as one text.
#[derive(Debug, Default, PartialEq)]
pub struct Exported {
    /// The text of the file.
    pub text: String,
    /// Parts that the format cannot represent, in words.
    pub left_out: Vec<String>,
}

/// The export of a run as files.
#[derive(Debug, Default, PartialEq)]
pub struct Files {
    /// Number of files.
    pub count: usize,
    /// Missing parts, in words.
    pub left_out: Vec<String>,
}

impl Exported {
    fn whole(text: String) -> Self {
        let left_out = Vec::new();
        Self { text, left_out }
    }
}

/// The writer of a format.
pub enum Writer {
    /// Writes one text.
    Text(fn(&Source) -> Exported),
    /// Writes files into a folder.
    Folder(fn(&Source, &Path) -> Result<Files, ExportError>),
}

/// An export format.
pub struct Format {
    /// Name on the command line.
    pub name: &'static str,
    /// One line: its contents and its readers.
    pub description: &'static str,
    /// Extension of its files, without the dot.
    pub ending: &'static str,
    /// `true` if `--figure` and `--only` apply to its contents.
    pub selective: bool,
    /// The writer.
    pub write: Writer,
}

impl Format {
    const fn text(
        name: &'static str,
        ending: &'static str,
        description: &'static str,
        write: fn(&Source) -> Exported,
    ) -> Self {
        Self {
            name,
            description,
            ending,
            selective: true,
            write: Writer::Text(write),
        }
    }

    const fn of_all(mut self) -> Self {
        self.selective = false;
        self
    }
}

/// All formats.
#[rustfmt::skip]
pub static FORMATS: [Format; 11] = [
    Format::text("csv", "csv", "every figure, a line each, with a column for each axis", tidy_csv),
    Format::text("json", "json", "every figure as JSON, in the shape of `--json`", json::write),
    Format::text("bencher", "json", "Bencher Metric Format, for `bencher run --adapter json`", bencher::write),
    Format::text("github-bigger-is-better", "json", "figures that rank upwards, for github-action-benchmark's customBiggerIsBetter", github::bigger),
    Format::text("github-smaller-is-better", "json", "figures that rank downwards, for github-action-benchmark's customSmallerIsBetter", github::smaller),
    Format::text("google-benchmark", "json", "raw times as repetitions, as Google Benchmark writes them, for its compare.py", google_benchmark::write),
    Format::text("hyperfine", "json", "raw times in seconds, as `hyperfine --export-json` writes them", hyperfine::write),
    Format::text("junit", "xml", "gates, checked paths and checks as test cases", junit::write).of_all(),
    Format::text("markdown", "md", "a table for each figure", tables::markdown),
    Format::text("latex", "tex", "a table for each figure, with booktabs", latex::write),
    Format { name: "npy", description: "linear images of a run made with --images, as NumPy arrays [height, width, 3] of f32", ending: "npy", selective: false, write: Writer::Folder(npy::write) },
];

/// The reason why a run cannot be exported.
#[derive(Debug, thiserror::Error)]
pub enum ExportError {
    /// A choice matches nothing.
    #[error("{0}")]
    Choice(String),
    /// `--only` cannot be read, or matches nothing.
    #[error(transparent)]
    Only(#[from] ConfigError),
    /// The run stored no linear images.
    #[error("{} holds none of the {named} linear images that its records name; `raystone run --images npy` keeps them", dir.display())]
    NoImages {
        /// The folder of the run.
        dir: PathBuf,
        /// Number of images that the records name.
        named: usize,
    },
    /// A folder cannot be read or made.
    #[error("cannot use the folder {}: {source}", path.display())]
    Folder {
        /// The folder.
        path: PathBuf,
        /// The cause.
        source: std::io::Error,
    },
    /// An image cannot be read or written.
    #[error(transparent)]
    Image(#[from] ImageError),
}

fn tidy_csv(source: &Source) -> Exported {
    Exported::whole(values::csv(&source.values))
}

/// Returns a unique name of a figure or time, in the style of Google Benchmark's named arguments:
/// `mrays-per-s/v1/scene:cornell-box/accel:bvh/rays:primary`.
fn name(figure: &str, key: &raystone_record::Key) -> String {
    let part = |(axis, label): (&str, &str)| format!("/{axis}:{label}");
    figure.to_owned() + &key.labels().map(part).collect::<String>()
}

/// A numeric value.
struct Number<'v, 'a> {
    value: &'v Value<'a>,
    at: f64,
    /// Ends of the interval, if it has a width.
    bounds: Option<[f64; 2]>,
}

/// Returns the numeric values that rank in one of these directions, and a description of the omissions.
fn numbers<'v, 'a>(
    values: &'v [Value<'a>],
    directions: &[Better],
) -> (Vec<Number<'v, 'a>>, Vec<String>) {
    let (mut numbers, mut below, mut words, mut other_way) = (Vec::new(), 0, 0, 0);
    for value in values {
        match value.estimate {
            _ if !directions.contains(&value.figure.better) => other_way += 1,
            Estimate::Known(i) if i.value.is_finite() => {
                let bounds = [i.low, i.high];
                let has_width = i.low < i.high && bounds.iter().all(|end| end.is_finite());
                numbers.push(Number {
                    value,
                    at: i.value,
                    bounds: has_width.then_some(bounds),
                });
            }
            // A point estimate alone, since its bounds are unreliable.
            Estimate::HeavyTailed(i) if i.value.is_finite() => numbers.push(Number {
                value,
                at: i.value,
                bounds: None,
            }),
            Estimate::Below(_) => below += 1,
            Estimate::Known(_) | Estimate::HeavyTailed(_) | Estimate::Word(_) => words += 1,
        }
    }
    let told = [
        (below, "known only to lie below a bound"),
        (words, "without a number"),
        (other_way, "of figures that do not rank in this direction"),
    ];
    let told = told.into_iter().filter(|(count, _)| *count > 0);
    let left_out = told.map(|(count, why)| format!("{count} of {} values, {why}", values.len()));
    (numbers, left_out.collect())
}

/// Returns JSON text as written to a file.
fn pretty(value: &serde_json::Value) -> String {
    format!("{value:#}\n")
}
