//! Commands: what they are called, and how they end.

mod adapters;
mod arguments;
mod completions;
mod discrepancy;
mod doctor;
mod export;
mod exporting;
mod failure;
mod faults;
mod history;
mod inspect;
mod list;
mod list_json;
mod merge;
mod output;
mod points;
mod points_plot;
mod render;
mod report;
mod repro;
mod run;
mod scenes;
mod schema;
mod signals;
mod stress;
mod system;
mod trace;
mod verify;
mod verify_images;

mod compare;

use clap::{Parser, Subcommand};
use raystone::program::Program;
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
  raystone discrepancy --measure star,l2star points.txt";

/// Version, commit and whether the sources differed from it.
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
struct CommandLine {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    #[command(after_help = EXIT_CODES)]
    Run(run::Run),
    #[command(after_help = EXIT_CODES)]
    Render(render::Render),
    #[command(after_help = EXIT_CODES)]
    Verify(verify::Verify),
    #[command(after_help = EXIT_CODES)]
    Compare(compare::Compare),
    #[command(after_help = EXIT_CODES)]
    Points(points::Points),
    List(list::List),
    #[command(after_help = EXIT_CODES)]
    Doctor(doctor::Doctor),
    #[command(after_help = EXIT_CODES)]
    Discrepancy(discrepancy::Discrepancy),
    // The names that its parts once had.
    #[command(after_help = EXIT_CODES, aliases = ["plan", "verify-run", "explain"])]
    Inspect(inspect::Inspect),
    #[command(after_help = EXIT_CODES)]
    Merge(merge::Merge),
    #[command(after_help = EXIT_CODES)]
    Report(report::Report),
    #[command(after_help = EXIT_CODES)]
    Repro(repro::Repro),
    Scenes(scenes::Scenes),
    #[command(after_help = EXIT_CODES)]
    Stress(stress::Stress),
    #[command(after_help = EXIT_CODES)]
    Trace(trace::Trace),
    #[command(after_help = EXIT_CODES)]
    ExportMitsuba(export::ExportMitsuba),
    #[command(after_help = EXIT_CODES)]
    Export(exporting::Export),
    #[command(after_help = EXIT_CODES)]
    History(history::HistoryOf),
    Schema(schema::Schema),
    Completions(completions::Completions),
    Man(completions::Man),
}

/// Reads the command line and does what it says; clap itself ends the program with 2 on bad usage.
pub fn main() -> ExitCode {
    let done = match CommandLine::parse().command {
        Command::Run(command) => command.execute(),
        Command::Render(command) => command.execute(),
        Command::Verify(command) => command.execute(),
        Command::Compare(command) => command.execute(),
        Command::Points(command) => command.execute(),
        Command::List(command) => command.execute(),
        Command::Doctor(command) => command.execute(),
        Command::Discrepancy(command) => command.execute(),
        Command::Inspect(command) => command.execute(),
        Command::Merge(command) => command.execute(),
        Command::Report(command) => command.execute(),
        Command::Repro(command) => command.execute(),
        Command::Scenes(command) => command.execute(),
        Command::Stress(command) => command.execute(),
        Command::Trace(command) => command.execute(),
        Command::ExportMitsuba(command) => command.execute(),
        Command::Export(command) => command.execute(),
        Command::History(command) => command.execute(),
        Command::Schema(command) => command.execute(),
        Command::Completions(command) => command.execute(),
        Command::Man(command) => command.execute(),
    };
    done.unwrap_or_else(failure::end)
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
}
