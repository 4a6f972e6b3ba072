//! `raystone compare`.

use super::arguments::{ValueArguments, read_text};
use super::failure::FAILED;
use super::output::{print, print_json, screen, tell};
use super::signals;
use anyhow::{Context as _, Result, anyhow, bail};
use clap::{Args, ValueEnum};
use raystone::atomic::write_atomic;
use raystone::compare::confirm::{LEAST_ROUNDS, in_this_process, in_turns, measure_kernels};
use raystone::compare::judge::{ChangeVerdict, Effects};
use raystone::compare::side::Side;
use raystone::compare::{Comparison, Confirmed, Finding, Options, compare_sides, show};
use raystone::gpu::AdapterChoice;
use raystone::run::{Existing, RunOptions};
use raystone::store::user_folder;
use std::io::IsTerminal as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

/// The noise leaves something open.
const UNDECIDED: u8 = 4;

/// The experiment of `--kernels` where none is given.
const SMALL: (&str, &str) = (
    include_str!("../../experiments/ci.toml"),
    "experiments/ci.toml",
);

/// Compare two runs, or two sets of kernels: better, worse, same or undecided, per cell and figure
///
/// Two runs (`raystone compare BASE CANDIDATE`): folders or files of records. One run with two sets of kernels on its axis
/// (`raystone compare RUN`). Or two sets of kernels that are measured first, in the same rounds (`raystone compare
/// --kernels A B [FILE]`).
// Many fields: one for each argument.
#[derive(Args)]
pub struct Compare {
    /// Base and candidate; one run that holds both; with --kernels an experiment (*.toml) [default: a small one]
    #[arg(value_name = "PATH", num_args = 0..=2)]
    paths: Vec<PathBuf>,
    /// Two folders of kernels (`embedded` for the program's own) to measure, or their labels in a run
    #[arg(long, num_args = 2, value_names = ["A", "B"])]
    kernels: Option<Vec<String>>,
    /// Folder for the records of --kernels [default: a temporary one]
    #[arg(long, value_name = "DIR", requires = "kernels")]
    out: Option<PathBuf>,
    /// Rounds of --kernels, and of both programs in turns [default: 105, and 8]
    #[arg(long, value_name = "N", value_parser = clap::value_parser!(u32).range(2..=1000))]
    rounds: Option<u32>,
    /// Program that measured the base: what looks slower is run with it and with this one in turns
    #[arg(long, value_name = "PROGRAM")]
    base_program: Option<PathBuf>,
    /// Measure nothing again
    #[arg(long, conflicts_with = "base_program")]
    no_confirm: bool,
    /// Whether times decide or are only shown
    #[arg(long, value_enum, default_value_t = Times::Decide)]
    times: Times,
    /// Other images from the same seeds are meant: their errors decide
    #[arg(long)]
    new_images: bool,
    /// Bound on the share of false alarms, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 5.0, value_parser = percent)]
    alpha: f64,
    /// Differences of times up to this do not count, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 2.0, value_parser = percent)]
    time_effect: f64,
    /// Differences of errors and discrepancies up to this do not count, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 0.5, value_parser = percent)]
    error_effect: f64,
    /// Differences of exact figures up to this do not count, percent
    #[arg(long, value_name = "PERCENT", default_value_t = 0.0, value_parser = percent)]
    exact: f64,
    /// Also write a comment for a pull request
    #[arg(long, value_name = "FILE")]
    markdown: Option<PathBuf>,
    /// Print JSON in the place of the table
    #[arg(long)]
    json: bool,
    /// Adapter for what is measured, by its number or a part of its name
    #[arg(long, value_name = "INDEX|NAME")]
    adapter: Option<String>,
    #[command(flatten)]
    values: ValueArguments,
}

#[derive(Debug, Clone, Copy, PartialEq, ValueEnum)]
enum Times {
    /// They decide.
    #[value(alias = "judge")]
    Decide,
    /// They are shown.
    Show,
}

fn percent(text: &str) -> Result<f64, String> {
    let value: f64 = text
        .parse()
        .map_err(|_| "a number of percent is wanted".to_owned())?;
    if (0.0..100.0).contains(&value) {
        Ok(value)
    } else {
        Err("a number from 0 to below 100 is wanted".into())
    }
}

impl Compare {
    pub fn execute(self) -> Result<ExitCode> {
        let work = Temporary::default();
        let [base, candidate] = self.sides(&work)?;
        let options = self.options();
        let none = Confirmed::new();
        let mut found = compare_sides(&base, &candidate, &options, &none);
        if found.suspects().next().is_some() && options.times_decide {
            let cells: Vec<Finding> = found.suspects().cloned().collect();
            match self.confirm([&base, &candidate], &cells, &work) {
                Ok(confirmed) => {
                    found = compare_sides(&base, &candidate, &options, &confirmed);
                    found.notes.push(match cells.len() {
                        1 => "1 time looked slower and was measured again, side by side.".into(),
                        n => format!(
                            "{n} times looked slower and were measured again, side by side."
                        ),
                    });
                    found.not_confirmed("the runs side by side have no times of it");
                }
                Err(why) => found.not_confirmed(&format!("{why:#}")),
            }
        }
        if let [base, candidate] = &self.paths[..]
            && let (Ok(a), Ok(b)) = (base.canonicalize(), candidate.canonicalize())
            && a == b
        {
            let note = "BASE and CANDIDATE are the same records: nothing can differ.";
            found.notes.insert(0, note.into());
        }
        self.write(&found)?;
        Ok(match found.verdict() {
            ChangeVerdict::Worse => ExitCode::from(FAILED),
            ChangeVerdict::Undecided => ExitCode::from(UNDECIDED),
            _ => ExitCode::SUCCESS,
        })
    }

    /// Reads or measures both sides.
    fn sides(&self, work: &Temporary) -> Result<[Side; 2]> {
        let labels = self
            .kernels
            .as_ref()
            .map(|k| [k[0].as_str(), k[1].as_str()]);
        let is_run = |path: &PathBuf| path.extension().is_none_or(|e| e != "toml");
        match (&self.paths[..], labels) {
            ([base, candidate], None) => {
                Ok([Side::read(base)?.alone(), Side::read(candidate)?.alone()])
            }
            ([_, _], Some(_)) => bail!("--kernels takes one experiment or one run, not two paths"),
            ([run], labels) if is_run(run) => Ok(Side::read(run)?.of_kernels(labels)?),
            ([_], None) => bail!("an experiment needs --kernels A B: which kernels are compared?"),
            ([], None) => {
                bail!("give two runs, one run with two sets of kernels, or --kernels A B")
            }
            (_, None) => bail!("give two runs, not more"),
            (file, Some(folders)) => self.measure(folders, file.first(), work),
        }
    }

    fn measure(
        &self,
        folders: [&str; 2],
        file: Option<&PathBuf>,
        work: &Temporary,
    ) -> Result<[Side; 2]> {
        let (text, name) = match file {
            Some(path) => read_text(path)?,
            None => (SMALL.0.to_owned(), SMALL.1.to_owned()),
        };
        let out = match &self.out {
            Some(out) => out.clone(),
            None => work.folder()?.join("run"),
        };
        let registries = raystone::registries();
        let options = self.run_options(out)?;
        let rounds = self.rounds.unwrap_or(LEAST_ROUNDS);
        let sides = measure_kernels(
            (&text, &name),
            &self.values.set,
            folders,
            rounds,
            None,
            &registries,
            &options,
        );
        Ok(sides?)
    }

    /// Options of a run, which SIGINT ends.
    fn run_options(&self, out: PathBuf) -> Result<RunOptions> {
        let adapter = self.adapter.as_deref().map(str::parse::<AdapterChoice>);
        let adapter = adapter.transpose().map_err(|e| anyhow!("--adapter: {e}"))?;
        let options = RunOptions {
            program: raystone::PROGRAM,
            out,
            existing: if self.out.is_some() {
                Existing::Refuse
            } else {
                Existing::Replace
            },
            adapter: adapter.unwrap_or_default(),
            allow_outside: self.values.allow_outside,
            warn: Some(super::output::warn),
            progress: std::io::stderr().is_terminal(),
            cache: user_folder(),
            ..RunOptions::default()
        };
        signals::watch(options.interrupt.clone())?;
        Ok(options)
    }

    /// Measures again the times that look worse.
    fn confirm(&self, sides: [&Side; 2], cells: &[Finding], work: &Temporary) -> Result<Confirmed> {
        if self.no_confirm {
            bail!("--no-confirm");
        }
        let cells: Vec<&Finding> = cells.iter().collect();
        if let Some(program) = &self.base_program {
            let worse = match cells.len() {
                1 => "1 time looks worse: measuring it".to_owned(),
                n => format!("{n} times look worse: measuring them"),
            };
            tell(&format!("{worse} again with both programs in turns"));
            let own = std::env::current_exe().context("cannot tell this program's own path")?;
            let programs: [&Path; 2] = [program, &own];
            let rounds = self.rounds.unwrap_or(8);
            let folder = work.folder()?;
            return Ok(in_turns(
                programs,
                sides,
                &cells,
                rounds,
                &folder,
                self.adapter.as_deref(),
            )?);
        }
        let options = self.run_options(work.folder()?.join("again"))?;
        Ok(in_this_process(
            sides,
            &cells,
            &raystone::registries(),
            &options,
        )?)
    }

    fn options(&self) -> Options {
        Options {
            alpha: 0.01 * self.alpha,
            effects: Effects {
                time: 0.01 * self.time_effect,
                error: 0.01 * self.error_effect,
                exact: 0.01 * self.exact,
                images: self.new_images,
                ..Effects::default()
            },
            times_decide: self.times == Times::Decide,
        }
    }

    fn write(&self, found: &Comparison) -> Result<()> {
        if let Some(path) = &self.markdown {
            let text = show::markdown(found);
            write_atomic(path, text.as_bytes())
                .with_context(|| format!("cannot write {}", path.display()))?;
        }
        if self.json {
            print_json("compare", show::json(found))
        } else {
            print(&show::terminal(found, screen()))
        }
    }
}

/// A folder that is removed with its owner; made on demand.
#[derive(Default)]
struct Temporary(std::cell::OnceCell<PathBuf>);

impl Temporary {
    fn folder(&self) -> Result<PathBuf> {
        if let Some(folder) = self.0.get() {
            return Ok(folder.clone());
        }
        let folder = std::env::temp_dir().join(format!("raystone-compare-{}", std::process::id()));
        std::fs::create_dir_all(&folder)
            .with_context(|| format!("cannot make {}", folder.display()))?;
        Ok(self.0.get_or_init(|| folder).clone())
    }
}

impl Drop for Temporary {
    fn drop(&mut self) {
        if let Some(folder) = self.0.get() {
            let _ = std::fs::remove_dir_all(folder);
        }
    }
}
