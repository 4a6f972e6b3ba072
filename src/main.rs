//! The command line of Raystone; every command is a call into the library.

mod commands;

fn main() -> std::process::ExitCode {
    commands::main()
}
