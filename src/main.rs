//! The command line of Raystone; every command is a call into the library.

mod commands;

/// Counts what is allocated, for the memory that a build needs.
#[global_allocator]
static ALLOCATOR: peak_alloc::PeakAlloc = peak_alloc::PeakAlloc;

/// The variable that names the folder of the user's session (XDG Base Directory Specification).
#[cfg(unix)]
const RUNTIME_FOLDER: &str = "XDG_RUNTIME_DIR";

/// Names a private folder where the system names none: drivers of Vulkan look there for a display, and complain on standard error
/// at every start if there is no such variable. Nothing is written into it.
#[cfg(unix)]
fn name_runtime_folder() {
    use std::os::unix::fs::DirBuilderExt as _;
    if std::env::var_os(RUNTIME_FOLDER).is_some() {
        return;
    }
    let Some(folder) = raystone::store::caches().map(|caches| caches.join("raystone/runtime"))
    else {
        return;
    };
    let mut private = std::fs::DirBuilder::new();
    if private.recursive(true).mode(0o700).create(&folder).is_ok() {
        // SAFETY: no other thread runs yet.
        unsafe { std::env::set_var(RUNTIME_FOLDER, folder) };
    }
}

#[cfg(not(unix))]
fn name_runtime_folder() {}

fn main() -> std::process::ExitCode {
    name_runtime_folder();
    commands::main()
}
