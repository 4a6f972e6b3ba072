//! The duration of work, by three clocks.

use super::GpuError;
use raystone_core::clock::Instant;

/// Times of passes on the device, which may overlap, over the wall time around all, at most.
const OVERLAP: f64 = 1.5;
/// Milliseconds by which timestamps may be too coarse.
const TICK_MS: f64 = 0.5;

/// A duration.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Elapsed {
    /// Milliseconds between the GPU timestamps; `None` without timestamps.
    pub gpu_ms: Option<f64>,
    /// Wall-clock milliseconds from submission to completion.
    pub wall_ms: f64,
    /// CPU milliseconds of this process, all threads together: on a software adapter the cost of
    /// the work, regardless of other load on the machine. `None` without such a clock.
    pub cpu_ms: Option<f64>,
    /// True if a clock ran backwards, as some drivers' do: the measurement is invalid.
    pub backwards: bool,
}

impl Elapsed {
    /// The zero of a sum; `gpu` is true if there are timestamps.
    pub fn nothing(gpu: bool) -> Self {
        Self {
            gpu_ms: gpu.then_some(0.0),
            wall_ms: 0.0,
            cpu_ms: cpu_ms().map(|_| 0.0),
            backwards: false,
        }
    }

    /// Returns the duration if valid; falling back to another clock would mix incomparable times.
    ///
    /// # Errors
    /// A clock ran backwards.
    pub fn measured(self) -> Result<Self, GpuError> {
        if self.backwards {
            Err(GpuError::Clock)
        } else {
            Ok(self)
        }
    }

    /// Returns the duration if it lies within another one that began before and ended after it.
    ///
    /// # Errors
    /// It is longer, by more than passes that overlap on the device explain.
    pub fn within(self, around: &Self) -> Result<Self, GpuError> {
        let most = OVERLAP * around.wall_ms + TICK_MS;
        if self.wall_ms > around.wall_ms || self.gpu_ms.is_some_and(|ms| ms > most) {
            Err(GpuError::Clock)
        } else {
            Ok(self)
        }
    }

    /// GPU time if available, otherwise wall time.
    pub fn ms(&self) -> f64 {
        self.gpu_ms.unwrap_or(self.wall_ms)
    }
}

impl std::ops::AddAssign for Elapsed {
    fn add_assign(&mut self, other: Self) {
        let add = |a: Option<f64>, b: Option<f64>| a.zip(b).map(|(a, b)| a + b);
        self.gpu_ms = add(self.gpu_ms, other.gpu_ms);
        self.cpu_ms = add(self.cpu_ms, other.cpu_ms);
        self.wall_ms += other.wall_ms;
        self.backwards |= other.backwards;
    }
}

/// The clocks of the host, from its creation on.
pub struct Stopwatch {
    start: Instant,
    cpu_ms: Option<f64>,
}

impl Stopwatch {
    /// Starts now.
    pub fn start() -> Self {
        let cpu_ms = cpu_ms();
        let start = Instant::now();
        Self { start, cpu_ms }
    }

    /// The time since the start.
    pub fn elapsed(&self) -> Elapsed {
        let cpu_ms = cpu_ms().zip(self.cpu_ms).map(|(now, then)| now - then);
        Elapsed {
            gpu_ms: None,
            wall_ms: self.start.elapsed().as_secs_f64() * 1e3,
            cpu_ms,
            backwards: cpu_ms.is_some_and(|ms| ms < 0.0),
        }
    }
}

#[cfg(unix)]
fn cpu_ms() -> Option<f64> {
    let time = rustix::time::clock_gettime(rustix::time::ClockId::ProcessCPUTime);
    Some(time.tv_sec as f64 * 1e3 + time.tv_nsec as f64 * 1e-6)
}

#[cfg(not(unix))]
fn cpu_ms() -> Option<f64> {
    None
}

#[cfg(all(test, unix))]
mod tests {
    use super::*;

    #[test]
    fn sleep_costs_time_on_the_wall_and_work_costs_both() {
        let watch = Stopwatch::start();
        std::thread::sleep(std::time::Duration::from_millis(30));
        let slept = watch.elapsed();
        assert!(slept.wall_ms >= 30.0);
        let watch = Stopwatch::start();
        // Independent of the load of the machine; other tests of this process only help.
        let is_idle = || watch.elapsed().cpu_ms.is_some_and(|ms| ms <= 20.0);
        while is_idle() && watch.start.elapsed().as_secs() < 600 {}
        let worked = watch.elapsed();
        assert!(worked.cpu_ms.is_some_and(|ms| ms > 20.0), "{worked:?}");
        let mut sum = Elapsed::nothing(false);
        sum += worked;
        assert_eq!(sum, worked);
        assert_eq!(sum.measured().ok(), Some(worked));
        let timed = Elapsed {
            gpu_ms: Some(worked.wall_ms),
            ..worked
        };
        assert!(timed.within(&worked).is_ok());
        for wrong in [
            Elapsed {
                gpu_ms: Some(2.0 * worked.wall_ms + 1.0),
                ..worked
            },
            Elapsed {
                wall_ms: 1.01 * worked.wall_ms,
                ..worked
            },
        ] {
            assert!(matches!(wrong.within(&worked), Err(GpuError::Clock)));
        }
        // A part without a time leaves the sum without one.
        sum += Elapsed {
            backwards: true,
            ..worked
        };
        assert!(matches!(sum.measured(), Err(GpuError::Clock)));
    }
}
