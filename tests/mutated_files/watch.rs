//! Watches one read after another: panics, time, memory, and error messages.

use super::fuzz_entry::{FILE, Outcome, Target};
use raystone::measure::memory::peak_bytes;
use raystone::measure::record::RECORDS_FILE;
use std::cell::Cell;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::sync::{Mutex, MutexGuard, Once, PoisonError};
use std::time::{Duration, Instant};

/// CPU time after which a file counts as one that is never read to its end.
const LONGEST: Duration = Duration::from_secs(20);

/// Maximum bytes of memory of a read, the result included: `per_byte` × the file + `fixed`.
#[derive(Clone, Copy)]
pub struct MemoryBound {
    pub per_byte: usize,
    pub fixed: usize,
}

/// Reads files one at a time, all tests of the program together: allocations are counted for the
/// whole process.
pub struct Watch {
    bound: MemoryBound,
    largest: Cell<f64>,
    caught: Cell<usize>,
    _alone: MutexGuard<'static, ()>,
}

/// The name of the file being read, and the CPU time of its start.
static CURRENT: Mutex<Option<(String, Duration)>> = Mutex::new(None);

/// The last panic while a file was read.
static PANIC: Mutex<Option<String>> = Mutex::new(None);

fn lock<T>(mutex: &'static Mutex<T>) -> MutexGuard<'static, T> {
    mutex.lock().unwrap_or_else(PoisonError::into_inner)
}

impl Watch {
    pub fn new(bound: MemoryBound) -> Self {
        static ALONE: Mutex<()> = Mutex::new(());
        static ONCE: Once = Once::new();
        ONCE.call_once(|| {
            watch_panics();
            std::thread::spawn(watch_time);
        });
        Self {
            bound,
            largest: Cell::new(0.0),
            caught: Cell::new(0),
            _alone: lock(&ALONE),
        }
    }

    /// Reads `bytes`, called `case` in messages, and examines the result: `true` if it was accepted.
    ///
    /// # Errors
    /// The fault of the reader.
    pub fn read(&self, case: &str, bytes: &[u8], read: Target) -> Result<bool, String> {
        *lock(&CURRENT) = Some((case.to_owned(), cpu_time()));
        let result = self.check(bytes, read);
        *lock(&CURRENT) = None;
        result.map_err(|fault| format!("{case}: {fault}"))
    }

    fn check(&self, bytes: &[u8], read: Target) -> Result<bool, String> {
        *lock(&PANIC) = None;
        let (outcome, peak) = peak_bytes(|| catch_unwind(|| read(bytes)));
        let peak = peak.expect("allocations are counted") as usize;
        let panic = lock(&PANIC).take().unwrap_or_default();
        let outcome = outcome.map_err(|_| format!("panics: {panic}"))?;
        // The reader caught it: that is as good as an error if it found the place nevertheless.
        self.caught
            .set(self.caught.get() + usize::from(!panic.is_empty()));
        let beyond = peak.saturating_sub(self.bound.fixed) as f64 / bytes.len().max(1) as f64;
        self.largest.set(self.largest.get().max(beyond));
        if beyond > self.bound.per_byte as f64 {
            return Err(format!(
                "takes {peak} bytes of memory for a file of {}",
                bytes.len()
            ));
        }
        match outcome {
            Outcome::Refused(message) if says_where(&message) => Ok(false),
            Outcome::Refused(message) => Err(format!("does not say where: {message}")),
            accepted => match catch_unwind(AssertUnwindSafe(|| accepted.examine())) {
                Ok(()) => Ok(true),
                Err(_) => {
                    let panic = lock(&PANIC).take().unwrap_or_default();
                    Err(format!("accepts what is unsound: {panic}"))
                }
            },
        }
    }

    /// Files on which a parser panicked and the reader caught it.
    pub fn caught_panics(&self) -> usize {
        self.caught.get()
    }

    /// The same as [`Watch::largest_multiple`], and resets it.
    pub fn take_multiple(&self) -> f64 {
        self.largest.take()
    }

    /// The most memory beyond the fixed part, per byte of a file.
    pub fn largest_multiple(&self) -> f64 {
        self.largest.get()
    }
}

/// Returns `true` if a message names the file and a place in it, or is about the whole file.
pub fn says_where(message: &str) -> bool {
    const PLACES: [&str; 15] = [
        "line ",
        "face ",
        "vertex ",
        "edge ",
        "element `",
        "header",
        "buffer ",
        "mesh ",
        "node ",
        "image ",
        "triangle ",
        "s[",
        "byte ",
        "accessor",
        "asset",
    ];
    const WHOLE: [&str; 5] = [
        "the file is empty",
        "has no triangles",
        "holds no record",
        "empty point set",
        "nothing is left to run",
    ];
    let names_file = message.contains(FILE) || message.contains(RECORDS_FILE);
    let has_line = |name: &str| {
        message.split(name).skip(1).any(|after| {
            after
                .strip_prefix(':')
                .is_some_and(|a| a.starts_with(|c: char| c.is_ascii_digit()))
        })
    };
    let place = PLACES.iter().any(|place| message.contains(place))
        || has_line(&format!("{FILE}.toml"))
        || has_line(RECORDS_FILE);
    names_file && (place || WHOLE.iter().any(|whole| message.contains(whole)))
}

/// Keeps the message of a panic while a file is read, and prints all others.
fn watch_panics() {
    let usual = std::panic::take_hook();
    std::panic::set_hook(Box::new(move |info| {
        if lock(&CURRENT).is_some() {
            *lock(&PANIC) = Some(info.to_string())
        } else {
            usual(info)
        }
    }));
}

/// Ends the process if a file takes too long: a thread that never returns cannot be stopped.
fn watch_time() {
    loop {
        std::thread::sleep(Duration::from_millis(250));
        if let Some((case, began)) = &*lock(&CURRENT)
            && cpu_time().saturating_sub(*began) > LONGEST
        {
            eprintln!("{case}: not read after {LONGEST:?} of CPU time");
            std::process::abort();
        }
    }
}

/// CPU time of the process, which other processes hardly affect; wall time where the system does not report it.
fn cpu_time() -> Duration {
    static START: Mutex<Option<Instant>> = Mutex::new(None);
    let ticks = || {
        let text = std::fs::read_to_string("/proc/self/stat").ok()?;
        // After the name in brackets; user and system time are the 12th and 13th, in 1/100 s.
        let fields: Vec<&str> = text.rsplit_once(')')?.1.split_whitespace().collect();
        let time = |k: usize| fields.get(k)?.parse::<u64>().ok();
        Some(Duration::from_millis(10 * (time(11)? + time(12)?)))
    };
    ticks().unwrap_or_else(|| lock(&START).get_or_insert_with(Instant::now).elapsed())
}
