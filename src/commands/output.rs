//! Standard output and standard error.

use anyhow::{Context as _, Result};
use clap::Args;
use raystone::export::OUTPUT_SCHEMA;
use raystone::report::terminal::Screen;
use raystone::text::escape::visible;
use serde_json::{Value, json};
use std::io::{ErrorKind, IsTerminal as _, Write as _};

/// How a command prints what it found.
#[derive(Args, Clone, Copy)]
pub struct OutputArguments {
    /// Print JSON instead of text, see docs/json.md
    #[arg(long)]
    pub json: bool,
}

impl OutputArguments {
    /// Prints the results of a command in the requested form: these fields, or this text.
    pub fn show(self, command: &str, fields: Value, text: &str) -> Result<()> {
        if self.json {
            print_json(command, fields)
        } else {
            print(text)
        }
    }
}

/// Writes `text` to standard output.
///
/// A reader that closes the pipe (`raystone list | head`) is no failure, and the exit code still reports how the
/// command ended.
pub fn print(text: &str) -> Result<()> {
    let mut output = std::io::stdout().lock();
    match output
        .write_all(text.as_bytes())
        .and_then(|()| output.flush())
    {
        Err(error) if error.kind() != ErrorKind::BrokenPipe => Err(error),
        _ => Ok(()),
    }
    .context("cannot write to standard output")
}

/// Writes the results of a command as one JSON object: version, command, and these fields.
pub fn print_json(command: &str, fields: Value) -> Result<()> {
    let mut object = json!({ "schema": OUTPUT_SCHEMA, "command": command });
    if let (Value::Object(object), Value::Object(fields)) = (&mut object, fields) {
        object.extend(fields);
    }
    print(&format!("{object:#}\n"))
}

/// Narrower screens are treated as this wide.
const NARROWEST_SCREEN: usize = 20;

/// Returns the width of standard output: COLUMNS, else that of the terminal, else unlimited; and its colours.
pub fn screen() -> Screen {
    let terminal = console::Term::stdout();
    let is_terminal = terminal.is_term();
    let said = std::env::var("COLUMNS").ok();
    let said = said.and_then(|text| text.trim().parse().ok());
    let found = || Some(usize::from(terminal.size_checked()?.1));
    let width = said.or_else(|| is_terminal.then(found).flatten());
    Screen {
        width: width.map(|width| width.max(NARROWEST_SCREEN)),
        colour: is_terminal && shows_colours(),
    }
}

/// Returns `true` if colours are wanted: see <https://no-color.org>.
fn shows_colours() -> bool {
    let is_set = |name| std::env::var_os(name).is_some_and(|value| !value.is_empty());
    !is_set("NO_COLOR") && std::env::var_os("TERM").is_none_or(|term| term != "dumb")
}

/// Writes a line to standard error. A closed terminal is no reason to end: the measurements count.
pub fn tell(text: &str) {
    let lines: Vec<String> = text.split('\n').map(visible).collect();
    let _ = writeln!(std::io::stderr().lock(), "{}", lines.join("\n"));
}

/// Writes `warning: …` to standard error.
pub fn warn(text: &str) {
    tell_marked("warning:", 33, text);
}

/// Writes a line after a mark, in colour where standard error is a terminal that shows it.
pub fn tell_marked(mark: &str, colour: u8, text: &str) {
    if std::io::stderr().is_terminal() && shows_colours() {
        let mut error = std::io::stderr().lock();
        let _ = write!(error, "\u{1b}[{colour}m{mark}\u{1b}[0m ");
        drop(error);
        tell(text);
    } else {
        tell(&format!("{mark} {text}"));
    }
}
