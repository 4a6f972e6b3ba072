//! Commands: their names, and their ends.

mod adapters;
mod advise;
mod arguments;
mod compare;
mod doctor;
mod export;
mod failure;
mod faults;
mod gallery;
mod help;
mod history;
mod inspect;
mod list;
mod merge;
mod mitsuba;
mod output;
mod points;
mod render;
mod report;
mod repro;
mod run;
mod signals;
mod stress;
mod system;
mod trace;
mod verify;
mod verify_images;
mod verify_others;
mod view;

use anyhow::Result;
use clap::{Parser, Subcommand};
use output::warn;
use raystone::program::Program;
use std::ffi::OsString;
use std::process::ExitCode;
use std::sync::LazyLock;

const EXIT_CODES: &str = "\
Exit codes:
  0  done
  1  done, but a gate or a cell failed, or something is worse
  2  bad usage or input
  3  no usable adapter
  4  a comparison is undecided
  130, 143  interrupted by SIGINT or SIGTERM; what was measured is kept";

const EXAMPLES: &str = "\
Examples:
  raystone doctor
  raystone run experiments/quick.toml
  raystone verify --accel bvh --scene path/to/model.obj
  raystone render --scene cornell-box --spp 256 -o box.png
  raystone points --sequence sobol --count 64 --measure star";

/// Version, commit, and a mark if the sources differed from it.
static VERSION: LazyLock<String> = LazyLock::new(|| {
    let Program {
        version,
        commit,
        dirty,
    } = raystone::PROGRAM;
    let dirty = dirty == Some(true);
    match commit {
        Some(commit) if dirty => format!("{version} (commit {commit} with changes)"),
        Some(commit) => format!("{version} (commit {commit})"),
        None => version.to_owned(),
    }
});

/// A proving ground for ray-tracing acceleration structures and samplers
#[derive(Parser)]
#[command(name = "raystone", version = VERSION.as_str())]
#[command(after_help = format!("{EXAMPLES}\n\n{EXIT_CODES}"))]
#[command(disable_help_subcommand = true)]
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

macro_rules! commands {
    ($($name:ident($arguments:ty),)+) => {
        #[derive(Subcommand)]
        enum Command {
            $(#[command(after_help = EXIT_CODES)] $name($arguments),)+
        }

        impl Command {
            fn execute(self) -> Result<ExitCode> {
                match self {
                    $(Self::$name(command) => command.execute(),)+
                }
            }
        }
    };
}

commands! {
    Run(run::Run),
    Inspect(inspect::Inspect),
    Merge(merge::Merge),
    Report(report::Report),
    Compare(compare::Compare),
    History(history::HistoryOf),
    Gallery(gallery::GalleryOf),
    Export(export::Export),
    Repro(repro::Repro),
    Render(render::Render),
    View(view::View),
    Advise(advise::Advise),
    Verify(verify::Verify),
    Trace(trace::Trace),
    Stress(stress::Stress),
    Points(points::Points),
    List(list::List),
    Doctor(doctor::Doctor),
    Help(help::Help),
}

/// Old names of commands, with the present words.
const OLD: [(&str, &[&str]); 9] = [
    ("plan", &["inspect"]),
    ("verify-run", &["inspect"]),
    ("explain", &["inspect"]),
    ("discrepancy", &["points"]),
    ("scenes", &["list", "model"]),
    ("export-mitsuba", &["export", "--to", "mitsuba"]),
    ("schema", &["help", "--schema"]),
    ("completions", &["help", "--completions"]),
    ("man", &["help", "--man"]),
];

/// Returns the words of the command line, an old name replaced by the present one.
fn words(mut words: Vec<OsString>) -> Vec<OsString> {
    let first = words.get(1);
    if let Some((old, now)) = first.and_then(|word| OLD.iter().find(|(old, _)| word == old)) {
        warn(&format!(
            "`raystone {old}` is `raystone {}` now",
            now.join(" ")
        ));
        words.splice(1..2, now.iter().map(OsString::from));
    }
    words
}

/// Reads the command line and executes it; clap itself ends the program with 2 on bad usage.
pub fn main() -> ExitCode {
    let command = CommandLine::parse_from(words(std::env::args_os().collect())).command;
    let checked = match command {
        Command::List(_) | Command::Doctor(_) | Command::Help(_) => Ok(()),
        Command::Compare(_)
        | Command::History(_)
        | Command::Export(_)
        | Command::Repro(_)
        | Command::Verify(_) => known_figures()
            .and_then(|()| raystone::report::check_texts().map_err(anyhow::Error::msg)),
        _ => known_figures(),
    };
    checked
        .and_then(|()| command.execute())
        .unwrap_or_else(failure::end)
}

/// Computes known figures anew, before any is shown.
fn known_figures() -> Result<()> {
    let checks = [
        raystone::measure::known_figures::check,
        raystone::discrepancy::known_figures::check,
        raystone::measure::record::known_readings::check,
        raystone::measure::stream::check,
        raystone::accel::known_figures::check,
        raystone::scene::known_figures::check,
        raystone::integrator::offset::check_known,
        raystone::integrator::check_known_lights,
        raystone::measure::known_pictures::check,
        raystone::media::known_figures::check,
        raystone::specular::known_figures::check,
        raystone::cones::known_figures::check,
        raystone::run::known_plan::check,
        raystone::report::plot::known::check,
        raystone::report::check_rulings,
        raystone::stress::tally::check,
    ];
    checks
        .into_iter()
        .try_for_each(|check| check().map_err(anyhow::Error::msg))
}

#[cfg(test)]
mod tests {
    use super::*;
    use clap::CommandFactory as _;

    #[test]
    fn the_documentation_names_every_command_and_flag() {
        let page = include_str!("../../docs/command-line.md");
        let command_line = CommandLine::command();
        assert!(command_line.get_subcommands().count() > 0);
        for command in command_line.get_subcommands() {
            let name = command.get_name();
            assert!(page.contains(&format!("## `raystone {name}")), "{name}");
            let flags: Vec<_> = command
                .get_arguments()
                .filter_map(|a| a.get_long())
                .collect();
            for flag in flags {
                assert!(page.contains(&format!("`--{flag}")), "{name} --{flag}");
            }
        }
        assert!(!page.contains("`--no-such-flag"));
    }

    #[test]
    fn the_commands_are_consistent() {
        CommandLine::command().debug_assert();
    }

    #[test]
    fn old_names_are_no_commands_and_lead_to_one() {
        let command_line = CommandLine::command();
        for (old, now) in OLD {
            assert!(command_line.find_subcommand(old).is_none(), "{old}");
            let found = words(["raystone", old, "more"].map(OsString::from).to_vec());
            let expected = [&["raystone"], now, &["more"]].concat();
            assert_eq!(found, expected);
            assert!(command_line.find_subcommand(&found[1]).is_some(), "{old}");
        }
        let now = ["raystone", "run", "plan"].map(OsString::from);
        assert_eq!(words(now.to_vec()), now);
    }
}
