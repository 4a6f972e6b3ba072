//! The processor's time.

/// Milliseconds that all threads of this process have computed so far, a software adapter's among them; `None` where
/// the system does not tell. Unlike the wall clock it does not count what others do on the machine.
#[cfg(unix)]
pub fn processor_ms() -> Option<f64> {
    let now = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(now.tv_sec as f64 * 1e3 + now.tv_nsec as f64 * 1e-6)
}

/// Milliseconds that all threads of this process have computed so far; this system does not tell.
#[cfg(not(unix))]
pub fn processor_ms() -> Option<f64> {
    None
}
