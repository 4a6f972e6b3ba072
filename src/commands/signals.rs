//! SIGINT and SIGTERM during a run: what was measured is kept and gets its report.

use raystone::run::Interrupt;

/// Ends the program on the first signal, after the records so far have a report, and on the second one
/// at once; the exit code is 128 and the number of the signal.
///
/// # Errors
/// The system refuses the handlers.
#[cfg(unix)]
pub fn watch(interrupt: Interrupt) -> std::io::Result<()> {
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::{flag, iterator::Signals};
    use std::sync::{Arc, atomic::AtomicBool};
    let pending = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        // In this order: the first signal finds the flag down.
        flag::register_conditional_shutdown(signal, 128 + signal, pending.clone())?;
        flag::register(signal, pending.clone())?;
    }
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    // The run may be in a step of minutes, so a thread of its own ends it.
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            for signal in signals.forever() {
                end(signal, &interrupt);
            }
        })?;
    Ok(())
}

/// Other systems end the program at once; the records so far stay in `partial/`.
#[cfg(not(unix))]
pub fn watch(_: Interrupt) -> std::io::Result<()> {
    Ok(())
}

#[cfg(unix)]
fn end(signal: i32, interrupt: &Interrupt) {
    use super::output::tell;
    use raystone::report::write_report;
    use raystone::run::Interrupted;
    let name = match signal {
        signal_hook::consts::SIGINT => "SIGINT",
        _ => "SIGTERM",
    };
    tell(&format!(
        "\n{name}: writing what was measured; a second one ends at once"
    ));
    match interrupt.now(name) {
        // The report is being written already.
        Interrupted::Finished => return,
        Interrupted::NotBegun => {}
        Interrupted::Kept(folder) => tell(&match write_report(&folder) {
            Ok(paths) => format!("interrupted; report so far: {}", paths.html.display()),
            Err(reason) => format!(
                "interrupted; records so far: {}; no report: {reason}",
                folder.display()
            ),
        }),
    }
    signal_hook::low_level::exit(128 + signal);
}

/// Leaves the end of the program to the thread of the signals.
pub fn wait_for_end() -> ! {
    loop {
        std::thread::park();
    }
}
