//! The command line of Raystone; every command is a call into the library.

mod commands;

/// Counts what is allocated, for the memory that a build needs.
#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

fn main() -> std::process::ExitCode {
    commands::main()
}
