//! Arguments that several commands share.

use anyhow::{Context as _, Result, anyhow, bail};
use clap::Args;
use raystone::config::{Axis, Cell, Experiment, Plan, split_outside_brackets};
use raystone::gpu::{self, AdapterChoice, Gpu, KernelLibrary};
use raystone::run::{LEAST_FOR_TILES, Registries, RunOptions, kernel_library};
use raystone::scene::{SceneData, check_files, check_model};
use raystone::text::{nearest, plain_text};
use std::fs::File;
use std::io::{IsTerminal as _, Read as _};
use std::path::{Path, PathBuf};

/// Where kernels come from and run.
#[derive(Args)]
pub struct DeviceArguments {
    /// Adapter, by its number in `raystone list adapter` or a part of its name [default: discrete
    /// before integrated before virtual before software]
    #[arg(long, value_name = "INDEX|NAME")]
    pub adapter: Option<AdapterChoice>,
    /// Folder of kernels (*.wesl) that replace or join the embedded ones; in an experiment short for
    /// `--set axes.kernels=["DIR"]`
    #[arg(long, value_name = "DIR")]
    pub kernels: Option<PathBuf>,
}

impl DeviceArguments {
    /// Options of the library; a progress bar needs a terminal.
    pub fn options(&self, out: PathBuf, values: &ValueArguments, quiet: bool) -> RunOptions {
        RunOptions {
            program: raystone::PROGRAM,
            out,
            allow_outside: values.allow_outside,
            adapter: self.adapter.clone().unwrap_or_default(),
            warn: Some(super::output::warn),
            tell: (!quiet).then_some(super::output::tell as fn(&str)),
            progress: !quiet && std::io::stderr().is_terminal(),
            ..RunOptions::default()
        }
    }

    /// Returns the folder of kernels as an override of an experiment.
    pub fn kernels_override(&self) -> Option<String> {
        on_axis(Axis::Kernels, self.kernels.iter().map(|f| f.display()))
    }

    /// Opens the adapter with the kernels.
    ///
    /// # Errors
    /// No adapter, or kernels that cannot be read.
    pub fn open(&self, registries: &Registries) -> Result<Gpu> {
        let kernels = match &self.kernels {
            Some(folder) => kernel_library(folder, registries)?,
            None => KernelLibrary::default(),
        };
        Ok(gpu::open(
            &self.adapter.clone().unwrap_or_default(),
            kernels,
        )?)
    }
}

/// Values laid over those of an experiment.
#[derive(Args)]
pub struct ValueArguments {
    /// Value laid over the file or the defaults: `--set run.replicates=16`, `--set axes.accel=bvh,roped-bvh`,
    /// `--set camera.eye=[0,1,5]`; the last one of a key counts
    #[arg(long, value_name = "KEY=VALUE")]
    pub set: Vec<String>,
    /// Let glTF models name files outside their folder, and OBJ models absolute paths
    #[arg(long)]
    pub allow_outside: bool,
}

/// Changes of an experiment.
#[derive(Args)]
pub struct ExperimentArguments {
    #[command(flatten)]
    pub values: ValueArguments,
    /// Keep the cells that fit: `--only 'accel=*bvh,uniform-grid,sequence=sobol'`; patterns of one axis are
    /// alternatives
    #[arg(long, value_name = "AXIS=PATTERN,…")]
    pub only: Vec<String>,
}

/// The start of commands without an experiment file: one cell, so that one parser checks names, parameters, flags and
/// `--set` everywhere.
const CELL: &str =
    "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\"]\nsequence = [\"pixel-hash\"]\n";

/// Returns an override of an experiment that sets an axis to these names, with any characters; nothing without any.
pub fn on_axis<T: ToString>(axis: Axis, names: impl IntoIterator<Item = T>) -> Option<String> {
    let names: Vec<String> = names.into_iter().map(|name| name.to_string()).collect();
    (!names.is_empty()).then(|| format!("axes.{axis}={}", toml::Value::from(names)))
}

/// Returns the names of a flag that may be given many times and may have several at once, as in `bvh,cwbvh`.
pub fn listed(names: &[String]) -> impl Iterator<Item = &str> {
    let parts = names
        .iter()
        .flat_map(|some| split_outside_brackets(some, ','));
    parts.map(str::trim)
}

/// Returns the experiment of a command without a file: its flags, and `--set`, which overrides them.
///
/// # Errors
/// Those of an experiment file.
pub fn of_flags(
    command: &str,
    flags: impl IntoIterator<Item = String>,
    set: &[String],
    registries: &Registries,
) -> Result<Experiment> {
    let flags: Vec<String> = flags.into_iter().collect();
    let overrides: Vec<String> = flags.iter().chain(set).cloned().collect();
    let name = format!("raystone {command}");
    let catalogue = registries.catalogue();
    Experiment::parse(CELL, &name, &overrides, &catalogue)
        .map_err(|error| anyhow!(as_typed(error.to_string(), &flags)))
}

/// Returns a message about flags that are read as overrides with the flags in their place.
pub fn as_typed(message: String, flags: &[String]) -> String {
    let named = |text: String, flag: &String| {
        let key = flag.split('=').next().unwrap_or_default();
        let typed = match key.split_once('.') {
            Some(("run", "resolution")) => "size",
            Some(("axes" | "run" | "gate" | "stress", name)) => name,
            // Of `points`, which has no other way to set them.
            Some(("sequence" | "decorrelation", of)) => {
                let name = of.rsplit('.').next().unwrap_or_default();
                let value = &flag[key.len()..];
                return text.replace(&format!("--set {flag}"), &format!("--param {name}{value}"));
            }
            _ => return text,
        };
        text.replace(&format!("--set {flag}"), &format!("--{typed}"))
    };
    flags.iter().fold(message, named)
}

/// Returns the one cell of an experiment.
///
/// # Errors
/// An axis with several values.
pub fn one_cell(experiment: &Experiment) -> Result<Cell> {
    let mut cell = Cell::default();
    for (axis, variants) in experiment.axes.iter() {
        let [variant] = variants.as_slice() else {
            let labels: Vec<&str> = variants.iter().map(|v| v.label.as_str()).collect();
            let (count, labels) = (labels.len(), labels.join(", "));
            bail!(
                "{axis} has {count} values ({labels}), and one cell is asked for: give one value"
            );
        };
        cell = cell.with(axis, variant);
    }
    Ok(cell)
}

/// Returns the text of a file, or of standard input for the name `-`, and its name in messages.
///
/// # Errors
/// A file that cannot be read, or is no text.
pub fn read_text(file: &Path) -> Result<(String, String)> {
    let mut bytes = Vec::new();
    let (name, read) = if file.as_os_str() == "-" {
        let read = std::io::stdin().lock().read_to_end(&mut bytes);
        ("standard input".to_owned(), read)
    } else {
        let read = File::open(file).and_then(|mut file| file.read_to_end(&mut bytes));
        (file.display().to_string(), read)
    };
    read.with_context(|| format!("cannot read {name}"))?;
    match plain_text(bytes) {
        Ok(text) => Ok((text, name)),
        Err(error) => bail!("{name}:{}: it is not UTF-8 text", error.line),
    }
}

/// Returns the message for an unknown name.
pub fn unknown<'a>(name: &str, known: impl IntoIterator<Item = &'a str>) -> String {
    let known: Vec<&str> = known.into_iter().collect();
    let hint = nearest(name, known.iter().copied());
    let hint = hint.map_or(String::new(), |near| format!(", did you mean `{near}`?"));
    let known = if known.is_empty() {
        "none".to_owned()
    } else {
        known.join(", ")
    };
    format!("there is no `{name}`{hint} (known: {known})")
}

/// Reads `512x384` as width and height.
pub fn parse_size(text: &str) -> Result<[u32; 2], String> {
    let parsed = text
        .split_once(['x', 'X', '×'])
        .and_then(|(width, height)| {
            Some([width.trim().parse().ok()?, height.trim().parse().ok()?])
        });
    parsed.ok_or_else(|| "must be width x height in pixels, for instance 512x384".to_owned())
}

/// Returns the plan of an experiment after a check that its models look like models: an error comes before minutes
/// are spent on other cells.
///
/// # Errors
/// Cells that do not fit together, and the first model that is none.
pub fn plan(experiment: &Experiment, only: &[String], registries: &Registries) -> Result<Plan> {
    let plan = Plan::new(experiment, only, |s, d| registries.is_randomised(s, d))?;
    let catalogue = registries.catalogue();
    let is_model = |name: &str| {
        catalogue[Axis::Scene]
            .iter()
            .all(|entry| entry.name != name)
    };
    for scene in plan.scenes.iter().filter(|scene| is_model(&scene.name)) {
        check_model(Path::new(&scene.name))?;
    }
    for scene in &plan.scenes {
        check_files(scene)?;
    }
    let by_tile = experiment.stop.is_some_and(|rule| rule.tile.is_some());
    if by_tile
        && plan.samplers.iter().any(|cell| cell.randomised)
        && (plan.replicates as usize) < LEAST_FOR_TILES
    {
        bail!(
            "`run.stop.tile` ends tiles by what replicates say of each other, which takes {LEAST_FOR_TILES} or more, and there are {}: \
             raise `run.replicates`",
            plan.replicates
        );
    }
    Ok(plan)
}

/// Warns of everything that makes a scene differ from its file.
pub fn warn_of(scene: &SceneData) {
    for line in scene.report.lines() {
        super::output::warn(&format!("{}: {line}", scene.name));
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_of_a_flag_are_separated_by_commas_outside_brackets() {
        let given = ["bvh(leaf_size=2,builder=sbvh), cwbvh", "kd-tree"].map(str::to_owned);
        let names: Vec<_> = listed(&given).collect();
        assert_eq!(names, ["bvh(leaf_size=2,builder=sbvh)", "cwbvh", "kd-tree"]);
    }

    #[test]
    fn what_was_typed_is_named_and_not_what_it_stands_for() {
        for (flag, typed) in [
            ("sequence.halton.digits=a=b", "--param digits=a=b"),
            ("decorrelation.micro-jitter.k=x", "--param k=x"),
            ("run.resolution=[0,1]", "--size"),
            ("axes.accel=['bvx']", "--accel"),
        ] {
            let said = as_typed(format!("--set {flag}: wrong"), &[flag.to_owned()]);
            assert_eq!(said, format!("{typed}: wrong"));
        }
    }
}
