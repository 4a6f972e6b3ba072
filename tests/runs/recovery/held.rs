//! A run that waits at a place chosen by a test: the file that it reads from its cache is a pipe, to which nobody has
//! written yet.

use super::{program, records, stderr};
use std::fs::File;
use std::io::{BufRead as _, BufReader, Write as _};
use std::path::{Path, PathBuf};
use std::process::{Child, Command};
use std::sync::OnceLock;
use std::sync::mpsc::{Receiver, RecvTimeoutError, channel};
use std::time::{Duration, Instant};
use tempfile::TempDir;

/// Longer than any wait on a busy machine: a last guard against waiting for ever.
const PATIENCE: Duration = Duration::from_secs(600);

/// The place where a run is held.
#[derive(Clone, Copy)]
pub enum Place {
    /// Before all measurements: it looks up whether its reference tracer was checked before.
    ReferenceTracer,
    /// After its structures: it looks up its reference.
    Reference,
}

impl Place {
    /// The files of a cache that it reads there.
    fn files(self, cache: &Path) -> Vec<PathBuf> {
        let folder = match self {
            Self::ReferenceTracer => cache.join("checks"),
            Self::Reference => cache.join("references"),
        };
        let entries = std::fs::read_dir(&folder).expect("a folder of the cache");
        let paths = entries.map(|entry| entry.expect("an entry").path());
        let found: Vec<_> = paths.filter(|path| path.is_file()).collect();
        assert!(!found.is_empty(), "{}: nothing is kept", folder.display());
        found
    }
}

/// Returns the cache left by a whole run.
fn kept() -> &'static Path {
    static KEPT: OnceLock<TempDir> = OnceLock::new();
    let whole = || {
        let [cache, out] = [(); 2].map(|()| tempfile::tempdir().expect("a temporary folder"));
        let mut run = program(out.path(), &[]);
        let output = run.env("RAYSTONE_CACHE", cache.path()).output();
        let output = output.expect("the program starts");
        assert_eq!(output.status.code(), Some(0), "{}", stderr(&output));
        assert!(!records(out.path()).is_empty());
        cache
    };
    KEPT.get_or_init(whole).path()
}

/// Files of a cache that are replaced by pipes.
struct Gate {
    cache: TempDir,
    files: Vec<(PathBuf, Vec<u8>)>,
    /// The file that the run reads, by its number, as soon as it does.
    came: Receiver<(usize, File)>,
    reached: Option<(usize, File)>,
}

impl Gate {
    fn new(place: Place) -> Self {
        let cache = tempfile::tempdir().expect("a temporary folder");
        for kind in ["checks", "references"] {
            std::fs::create_dir(cache.path().join(kind)).expect("a folder");
        }
        for other in [Place::ReferenceTracer, Place::Reference] {
            for file in other.files(kept()) {
                let path = cache
                    .path()
                    .join(file.strip_prefix(kept()).expect("a kept file"));
                std::fs::copy(&file, path).expect("a copy");
            }
        }
        let (tell, came) = channel();
        let mut files = Vec::new();
        for (number, path) in place.files(cache.path()).into_iter().enumerate() {
            files.push((path.clone(), std::fs::read(&path).expect("a kept file")));
            std::fs::remove_file(&path).expect("it was there");
            let made = Command::new("mkfifo").arg(&path).status();
            assert!(made.is_ok_and(|status| status.success()), "no pipe");
            let tell = tell.clone();
            // A pipe opens when its reader comes; the threads of those that nobody reads end with the program.
            std::thread::spawn(move || {
                // It may be gone by now, with its test.
                if let Ok(pipe) = File::options().write(true).open(path) {
                    drop(tell.send((number, pipe)));
                }
            });
        }
        Self {
            cache,
            files,
            came,
            reached: None,
        }
    }

    fn open(&mut self) {
        let (number, mut pipe) = self.reached.take().expect("the run is at the gate");
        for (path, bytes) in &self.files {
            let whole = path.with_extension("whole");
            std::fs::write(&whole, bytes).expect("a file");
            std::fs::rename(&whole, path).expect("the place of a pipe");
        }
        pipe.write_all(&self.files[number].1).expect("a reader");
    }
}

/// A run that is held. It ends with its test, however that ends.
pub struct Held {
    child: Child,
    gate: Gate,
    /// Lines of its standard error.
    lines: Receiver<String>,
    heard: String,
}

impl Held {
    /// Starts a run.
    pub fn start(out: &Path, more: &[&str], place: Place) -> Self {
        let gate = Gate::new(place);
        let mut command = program(out, more);
        let command = command.env("RAYSTONE_CACHE", gate.cache.path());
        let mut child = command.spawn().expect("the program starts");
        let pipe = BufReader::new(child.stderr.take().expect("a pipe"));
        let (tell, lines) = channel();
        std::thread::spawn(move || {
            for line in pipe.lines() {
                drop(tell.send(line.expect("text")));
            }
        });
        Self {
            child,
            gate,
            lines,
            heard: String::new(),
        }
    }

    /// Waits until it is at its gate.
    pub fn wait(&mut self) {
        match self.gate.came.recv_timeout(PATIENCE) {
            Ok(reached) => self.gate.reached = Some(reached),
            Err(_) => panic!("the run does not come to its gate: {}", self.heard),
        }
    }

    /// Waits until it has written so many records into `partial/`, and returns.
    pub fn wait_for_records(&self, out: &Path, number: usize) {
        let path = out.join("partial/records.jsonl");
        let start = Instant::now();
        while std::fs::read_to_string(&path).map_or(0, |text| text.lines().count()) < number {
            assert!(start.elapsed() < PATIENCE, "no {number} records");
            std::thread::sleep(Duration::from_millis(5));
        }
    }

    /// Lets it continue.
    pub fn let_go(&mut self) {
        self.gate.open();
    }

    /// Waits until it has printed this.
    pub fn hear(&mut self, words: &str) {
        while !self.heard.contains(words) {
            match self.next_line() {
                Ok(line) => self.heard += &line,
                Err(why) => panic!("`{words}` is not said ({why}): {}", self.heard),
            }
        }
    }

    fn next_line(&self) -> Result<String, RecvTimeoutError> {
        let line = self.lines.recv_timeout(PATIENCE)?;
        Ok(line + "\n")
    }

    /// Sends it a signal, as `INT`.
    pub fn send(&self, signal: &str) {
        let sent = Command::new("kill")
            .args([format!("-{signal}"), self.child.id().to_string()])
            .status();
        assert!(sent.is_ok_and(|status| status.success()), "no signal sent");
    }

    /// Ends it without a word.
    pub fn kill(&mut self) {
        self.child.kill().expect("a kill");
        let status = self.child.wait().expect("an end");
        assert_eq!(status.code(), None, "it ended by itself: {}", self.heard);
    }

    /// Waits for its end: its exit code, and all its output.
    pub fn end(mut self) -> (Option<i32>, String) {
        loop {
            match self.next_line() {
                Ok(line) => self.heard += &line,
                Err(RecvTimeoutError::Disconnected) => break,
                Err(RecvTimeoutError::Timeout) => panic!("the run does not end: {}", self.heard),
            }
        }
        let status = self.child.wait().expect("an end");
        (status.code(), std::mem::take(&mut self.heard))
    }
}

impl Drop for Held {
    fn drop(&mut self) {
        drop(self.child.kill());
        drop(self.child.wait());
    }
}
