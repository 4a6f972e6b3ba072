//! SIGINT and SIGTERM during a run: the measurements so far are stored and get a report.

use raystone::run::Interrupt;

/// Handles signals: the first SIGINT lets the run finish the cell that is being measured; the next one, and SIGTERM, end the program after
/// the records so far have a report; and one more ends it at once. The exit code is 128 and the number of the signal.
///
/// # Errors
/// The system refuses the handlers.
#[cfg(unix)]
pub fn watch(interrupt: Interrupt) -> std::io::Result<()> {
    use super::output::tell;
    use signal_hook::consts::{SIGINT, SIGTERM};
    use signal_hook::{flag, iterator::Signals};
    use std::sync::Arc;
    use std::sync::atomic::{AtomicBool, Ordering};
    let pending = Arc::new(AtomicBool::new(false));
    for signal in [SIGINT, SIGTERM] {
        flag::register_conditional_shutdown(signal, 128 + signal, pending.clone())?;
    }
    let mut signals = Signals::new([SIGINT, SIGTERM])?;
    // The run may be in a step of minutes, so a thread of its own ends it.
    std::thread::Builder::new()
        .name("signals".to_owned())
        .spawn(move || {
            let mut asked = false;
            for signal in signals.forever() {
                if signal == SIGINT && !asked && interrupt.ask() {
                    asked = true;
                    tell(
                        "\nSIGINT: the run ends behind the cell that is being measured; a second one ends it now",
                    );
                    continue;
                }
                pending.store(true, Ordering::Relaxed);
                end(signal, &interrupt);
            }
        })?;
    Ok(())
}

/// Does nothing: other systems end the program at once; the records so far stay in `partial/`.
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
        "\n{name}: writing what was measured; one more ends at once"
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

/// Exit code of a run that was ended by SIGINT.
pub const INTERRUPTED: u8 = 130;

/// Leaves the end of the program to the thread of the signals.
pub fn wait_for_end() -> ! {
    loop {
        std::thread::park();
    }
}
