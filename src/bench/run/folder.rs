//! The folder of a run. It is locked while it is written; results of an earlier run stay whole until
//! the new ones are; and what was measured is kept, however the run ends.
//!
//! While a run goes on, its records and images lie in `partial/` of the folder, where `raystone
//! report` can read them. At the end, images are moved first and then `records.jsonl`, in one step:
//! before it the folder holds the earlier results, after it the new ones. Links in the place of a
//! file that is written are replaced, never followed.

use super::error::RunError;
use raystone_core::atomic::write_atomic;
use raystone_core::text::slug;
use raystone_record::{
    Body, InterruptedRecord, Line, PARTIAL, RECORDS_FILE, RecordError, read_records, records_file,
    text_of,
};
use std::fs::{self, File, OpenOptions, TryLockError};
use std::io::{self, Read as _, Seek as _, Write as _};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::{Arc, Mutex, MutexGuard, PoisonError, Weak};
use std::time::{Duration, Instant};

/// Empty; an operating-system lock on it ends with the process that holds it.
const LOCK_FILE: &str = ".lock";
const IMAGES: &str = "images";
/// How often a run that waits for another looks whether that has ended.
const BETWEEN_LOOKS: Duration = Duration::from_millis(500);
/// What was done when, for people.
const LOG_FILE: &str = "run.log";

/// What to do with a folder that holds results.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub enum Existing {
    /// End with an error.
    #[default]
    Refuse,
    /// Replace them, as soon as the new ones are whole.
    Replace,
    /// Take the first of `DIR`, `DIR-2`, `DIR-3`, … that holds none and that no run writes.
    Number,
    /// Go on with them: what still holds is kept.
    Resume,
}

/// The folder that a run writes.
#[derive(Debug)]
pub(super) struct Folder {
    out: PathBuf,
    /// Name of the folder of images: one that the earlier results do not use.
    images: String,
    /// Lines of the run that is resumed.
    earlier: Mutex<Vec<Line>>,
    /// Whether there are results of an earlier run that are not part of this one.
    replaces: bool,
    start: Instant,
    records: Mutex<Records>,
    /// Held as long as the folder is written; `None` where the file system knows no locks.
    _lock: Option<File>,
}

#[derive(Debug)]
struct Records {
    file: File,
    /// Bytes of whole lines.
    bytes: u64,
    state: State,
}

#[derive(Debug, Clone, Copy, PartialEq)]
enum State {
    Open,
    Finished,
    Interrupted,
}

/// Why a folder is not written.
enum Refusal {
    /// It holds results, or another run writes it: the next number may do.
    Taken(String),
    /// Another run writes it now.
    Busy(String),
    Unwritable(RunError),
}

fn unwritable(path: &Path, error: &io::Error) -> RunError {
    RunError::Input(format!(
        "cannot write {}: {error}; choose another folder with --out",
        path.display()
    ))
}

impl Folder {
    /// Makes the folder, locks it and opens the records.
    ///
    /// # Errors
    /// A folder that cannot be written, that another run writes, or that holds results.
    pub(super) fn open(out: &Path, existing: Existing, wait: bool) -> Result<Self, RunError> {
        let mut number = 1;
        loop {
            let candidate = numbered(out, number);
            match Self::open_one(&candidate, existing) {
                Ok(folder) => return Ok(folder),
                Err(Refusal::Unwritable(error)) => return Err(error),
                Err(Refusal::Taken(_) | Refusal::Busy(_)) if existing == Existing::Number => {
                    number += 1;
                }
                Err(Refusal::Busy(_)) if wait => std::thread::sleep(BETWEEN_LOOKS),
                Err(Refusal::Taken(reason) | Refusal::Busy(reason)) => {
                    return Err(RunError::Input(reason));
                }
            }
        }
    }

    fn open_one(out: &Path, existing: Existing) -> Result<Self, Refusal> {
        let failed = |path: &Path| {
            let path = path.to_owned();
            move |error| Refusal::Unwritable(unwritable(&path, &error))
        };
        fs::create_dir_all(out).map_err(failed(out))?;
        let lock = lock(out)?;
        let partial = out.join(PARTIAL);
        let left_over = partial.join(RECORDS_FILE);
        let meta = fs::symlink_metadata;
        let is_left_over = meta(&partial).is_ok_and(|folder| folder.is_dir())
            && meta(&left_over).is_ok_and(|file| file.is_file() && file.len() > 0);
        let records = out.join(RECORDS_FILE);
        let results = [records_file(out)];
        let results = results.into_iter().filter(|path| is_there(path));
        let replaces = matches!(existing, Existing::Replace | Existing::Resume);
        if !replaces && let Some(found) = results.chain(is_left_over.then_some(left_over)).next() {
            return Err(Refusal::Taken(format!(
                "{} holds the results of another run; go on with them by --resume, choose another folder with \
                 --out, let --number number it, or replace them with --force",
                found.display()
            )));
        }
        if records.is_dir() {
            let error = io::ErrorKind::IsADirectory.into();
            return Err(Refusal::Unwritable(unwritable(&records, &error)));
        }
        let earlier = match existing {
            Existing::Resume => earlier_lines(out).map_err(Refusal::Unwritable)?,
            _ => Vec::new(),
        };
        if !earlier.is_empty() && is_left_over {
            // Both parts in one place before anything is removed: whenever this run ends, nothing is lost.
            keep(out, &earlier).map_err(failed(out))?;
        } else if is_left_over && !is_there(&records_file(out)) {
            // What a killed run measured is all there is: it is kept until the new results are whole.
            promote(out).map_err(failed(out))?;
        }
        remove(&partial).map_err(failed(&partial))?;
        let free = |name: &String| !is_there(&out.join(name));
        let mut names = (1..).map(|number| match number {
            1 => IMAGES.to_owned(),
            _ => format!("{IMAGES}-{number}"),
        });
        let images = names.find(free).unwrap_or_default();
        let folder = partial.join(&images);
        fs::create_dir_all(&folder).map_err(failed(&folder))?;
        let path = partial.join(RECORDS_FILE);
        let mut options = OpenOptions::new();
        let file = options.read(true).write(true).create_new(true).open(&path);
        Ok(Self {
            images,
            earlier: Mutex::new(earlier),
            replaces: existing != Existing::Resume && is_there(&records_file(out)),
            start: Instant::now(),
            records: Mutex::new(Records {
                file: file.map_err(failed(&path))?,
                bytes: 0,
                state: State::Open,
            }),
            _lock: lock,
            out: out.to_owned(),
        })
    }

    /// Where the results are, or will be.
    pub(super) fn out(&self) -> &Path {
        &self.out
    }

    /// The lines of the run that is resumed, once.
    pub(super) fn take_earlier(&self) -> Vec<Line> {
        let mut earlier = self.earlier.lock().unwrap_or_else(PoisonError::into_inner);
        std::mem::take(&mut earlier)
    }

    /// Leaves the folder as it was.
    pub(super) fn abandon(&self) {
        let mut records = self.records();
        records.state = State::Finished;
        // Nothing was written: what stays behind is litter that the next run removes.
        let _ = remove(&self.out.join(PARTIAL));
    }

    /// Name of an image as records have it, relative to the run's folder, and where to write it; the ending
    /// of the file without its dot.
    pub(super) fn image(&self, parts: &[&str], ending: &str) -> (String, PathBuf) {
        let relative = format!("{}/{}.{ending}", self.images, slug(parts));
        let path = self.out.join(PARTIAL).join(&relative);
        (relative, path)
    }

    /// Adds a line to `run.log`, with the seconds since the run began.
    pub(super) fn log(&self, text: &str) {
        let path = self.out.join(LOG_FILE);
        let is_link = fs::symlink_metadata(&path).is_ok_and(|meta| meta.is_symlink());
        if is_link && remove(&path).is_err() {
            return;
        }
        let plain = |c: char| if c.is_control() { ' ' } else { c };
        let text: String = text.chars().map(plain).collect();
        let line = format!("{:9.2} s  {text}\n", self.start.elapsed().as_secs_f64());
        let mut options = OpenOptions::new();
        let file = options.append(true).create(true).open(&path);
        let _ = file.and_then(|mut file| file.write_all(line.as_bytes()));
    }

    /// A panic elsewhere leaves whole lines, so the records can still be used.
    fn records(&self) -> MutexGuard<'_, Records> {
        self.records.lock().unwrap_or_else(PoisonError::into_inner)
    }

    /// Appends one line, its end included, and flushes it to the disk; all of it or nothing.
    ///
    /// # Errors
    /// [`RunError::Interrupted`], or a disk that takes no more.
    pub(super) fn append(&self, line: &str) -> Result<(), RunError> {
        let mut records = self.records();
        match records.state {
            State::Open => self.append_to(&mut records, line),
            _ => Err(RunError::Interrupted),
        }
    }

    fn append_to(&self, records: &mut Records, line: &str) -> Result<(), RunError> {
        let written = records
            .file
            .write_all(line.as_bytes())
            .and_then(|()| records.file.sync_data());
        written.map_err(|error| {
            // What was written of the line goes, so that whole lines remain; the error is the one to tell.
            let _ = records.file.set_len(records.bytes);
            let _ = records.file.seek(io::SeekFrom::Start(records.bytes));
            let path = self.out.join(PARTIAL).join(RECORDS_FILE);
            RunError::Input(format!(
                "cannot write {}: {error}; the records before this one are kept",
                path.display()
            ))
        })?;
        records.bytes += line.len() as u64;
        Ok(())
    }

    /// Puts the results in their place.
    ///
    /// # Errors
    /// A folder that cannot be written: the results are left in `partial/`.
    pub(super) fn finish(&self) -> Result<(), RunError> {
        let mut records = self.records();
        if records.state != State::Open {
            return Err(RunError::Interrupted);
        }
        self.commit(&mut records)
            .map_err(|error| unwritable(&self.out.join(RECORDS_FILE), &error))?;
        records.state = State::Finished;
        Ok(())
    }

    fn commit(&self, records: &mut Records) -> io::Result<()> {
        let target = self.out.join(RECORDS_FILE);
        let results = records_file(&self.out);
        let earlier = text_in(&results, &self.out)?;
        fs::create_dir_all(&self.out)?;
        let partial = self.out.join(PARTIAL);
        let moved = fs::rename(partial.join(&self.images), self.out.join(&self.images))
            .and_then(|()| fs::rename(partial.join(RECORDS_FILE), &target));
        if moved.is_err() {
            // Somebody took the folder away: the open file still has the lines.
            let mut lines = Vec::new();
            records.file.rewind()?;
            records.file.read_to_end(&mut lines)?;
            write_atomic(&target, &lines)?;
        }
        // The results are in their place; what is left over now is only litter, but for images that
        // could not be moved, which keep the folder.
        let _ = remove(&partial.join(RECORDS_FILE));
        let _ = fs::remove_dir(&partial);
        // Packed results were read, or are replaced.
        if results != target {
            let _ = remove(&results);
        }
        let now = text_in(&target, &self.out).unwrap_or_default();
        let _ = self.remove_images(&earlier, &now);
        Ok(())
    }

    /// Removes the images of the earlier results: the folders that their records name, and those of now do not.
    fn remove_images(&self, earlier: &str, now: &str) -> io::Result<()> {
        for entry in fs::read_dir(&self.out)? {
            let name = entry?.file_name().to_string_lossy().into_owned();
            let is_ours = name.starts_with(IMAGES) && name != self.images;
            let is_in = |records: &str| records.contains(&format!("\"{name}/"));
            if is_ours && is_in(earlier) && !is_in(now) {
                remove(&self.out.join(name))?;
            }
        }
        Ok(())
    }

    /// Ends the run early: what was measured so far becomes the result, unless there are earlier ones,
    /// beside which it stays in `partial/`.
    fn interrupt(&self, reason: &str) -> Interrupted {
        let mut records = self.records();
        if records.state != State::Open {
            return Interrupted::Finished;
        }
        records.state = State::Interrupted;
        let line = Line::about_all(Body::Interrupted(InterruptedRecord {
            reason: reason.to_owned(),
            wall_s: self.start.elapsed().as_secs_f64(),
        }));
        // Without this line (a full disk) the report says that the run did not end.
        if let Ok(text) = serde_json::to_string(&line) {
            let _ = self.append_to(&mut records, &format!("{text}\n"));
        }
        let folder = if self.replaces || self.commit(&mut records).is_err() {
            self.out.join(PARTIAL)
        } else {
            self.out.clone()
        };
        Interrupted::Kept(folder)
    }
}

/// What became of a run that was ended early.
#[derive(Debug, Clone, PartialEq)]
pub enum Interrupted {
    /// It had not begun: there is nothing to keep.
    NotBegun,
    /// It has ended already.
    Finished,
    /// Its records are kept in this folder.
    Kept(PathBuf),
}

/// Ends a run early, from any thread: behind the cell that is being measured ([`Interrupt::ask`]), or however long a step of the run takes
/// ([`Interrupt::now`]).
#[derive(Debug, Clone, Default)]
pub struct Interrupt {
    folder: Arc<Mutex<Weak<Folder>>>,
    asked: Arc<AtomicBool>,
}

impl Interrupt {
    /// Asks the run to end as soon as what is being measured has its record. Whether it has begun at all.
    pub fn ask(&self) -> bool {
        self.asked.store(true, Ordering::Relaxed);
        self.begun().upgrade().is_some()
    }

    /// Whether the run was asked to end.
    pub(super) fn is_asked(&self) -> bool {
        self.asked.load(Ordering::Relaxed)
    }

    /// Keeps the records so far with a line that says `reason`; the run itself ends with [`RunError::Interrupted`] at its next record.
    pub fn now(&self, reason: &str) -> Interrupted {
        let folder = self.begun().upgrade();
        folder.map_or(Interrupted::NotBegun, |folder| folder.interrupt(reason))
    }

    /// A run has begun: the one to end, if a handle serves several.
    pub(super) fn begin(&self, folder: &Arc<Folder>) {
        *self.begun() = Arc::downgrade(folder);
    }

    fn begun(&self) -> MutexGuard<'_, Weak<Folder>> {
        self.folder.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

/// `DIR`, `DIR-2`, `DIR-3`, ….
fn numbered(out: &Path, number: usize) -> PathBuf {
    // Without the slash that may end it.
    let mut name = out.components().as_path().as_os_str().to_owned();
    if number > 1 {
        name.push(format!("-{number}"));
    }
    name.into()
}

/// Whether there is a file, folder or link of this name.
fn is_there(path: &Path) -> bool {
    fs::symlink_metadata(path).is_ok()
}

/// The text of the results of `out`, empty where there are none. Packed ones that cannot be read have none.
fn text_in(results: &Path, out: &Path) -> io::Result<String> {
    let is_file = fs::symlink_metadata(results).is_ok_and(|meta| meta.is_file());
    Ok(match results.ends_with(RECORDS_FILE) {
        _ if !is_file => String::new(),
        true => String::from_utf8_lossy(&fs::read(results)?).into_owned(),
        false => {
            let records = read_records(out).map(|records| text_of(&records.lines));
            records.ok().and_then(Result::ok).unwrap_or_default()
        }
    })
}

/// Removes a file, a link or a whole folder, if there is one; links in it are not followed.
fn remove(path: &Path) -> io::Result<()> {
    let removed = match fs::symlink_metadata(path) {
        Ok(meta) if meta.is_dir() => fs::remove_dir_all(path),
        Ok(_) => fs::remove_file(path),
        Err(error) => Err(error),
    };
    match removed {
        Err(error) if error.kind() != io::ErrorKind::NotFound => Err(error),
        _ => Ok(()),
    }
}

/// Makes the records that a killed run left in `partial/` those of the folder.
fn promote(out: &Path) -> io::Result<()> {
    promote_images(out)?;
    fs::rename(out.join(PARTIAL).join(RECORDS_FILE), out.join(RECORDS_FILE))
}

fn promote_images(out: &Path) -> io::Result<()> {
    let partial = out.join(PARTIAL);
    for entry in fs::read_dir(&partial)? {
        let name = entry?.file_name();
        let is_images = name.to_string_lossy().starts_with(IMAGES);
        if is_images && !is_there(&out.join(&name)) {
            fs::rename(partial.join(&name), out.join(&name))?;
        }
    }
    Ok(())
}

/// The folder with the records of a run: those that it left in `partial/` where it goes on or was killed before it had results.
pub fn records_in(dir: &Path) -> PathBuf {
    let partial = dir.join(PARTIAL);
    if !is_there(&records_file(dir)) && partial.is_dir() {
        partial
    } else {
        dir.to_owned()
    }
}

/// The lines of the run that a folder holds, and behind them those that a killed run left.
///
/// # Errors
/// Records that cannot be read, or of another version.
fn earlier_lines(out: &Path) -> Result<Vec<Line>, RunError> {
    let mut lines = Vec::new();
    for folder in [out.to_owned(), out.join(PARTIAL)] {
        let path = records_file(&folder);
        if fs::symlink_metadata(&path).is_ok_and(|file| file.is_file() && file.len() > 0) {
            let records = read_records(&folder);
            let fault = |error: RecordError| RunError::Input(format!("cannot resume: {error}"));
            match records {
                // A run that was killed in its first line.
                Err(RecordError::NoRecords { .. }) => {}
                records => lines.extend(records.map_err(fault)?.lines),
            }
        }
    }
    Ok(lines)
}

/// Puts these lines in the place of the folder's records, and beside them the images of a killed run.
fn keep(out: &Path, lines: &[Line]) -> io::Result<()> {
    promote_images(out)?;
    let text = text_of(lines).map_err(io::Error::other)?;
    write_atomic(&out.join(RECORDS_FILE), text.as_bytes())
}

/// Makes and locks a folder that something else than a run writes: until the file is dropped, `None` where
/// the file system knows no locks.
///
/// # Errors
/// A folder that cannot be written, or that is being written.
pub fn lock_folder(out: &Path) -> Result<Option<File>, RunError> {
    fs::create_dir_all(out).map_err(|error| unwritable(out, &error))?;
    lock(out).map_err(|refusal| match refusal {
        Refusal::Taken(reason) | Refusal::Busy(reason) => RunError::Input(reason),
        Refusal::Unwritable(error) => error,
    })
}

fn lock(out: &Path) -> Result<Option<File>, Refusal> {
    let path = out.join(LOCK_FILE);
    let failed = |error| Refusal::Unwritable(unwritable(&path, &error));
    if fs::symlink_metadata(&path).is_ok_and(|meta| meta.is_symlink()) {
        remove(&path).map_err(failed)?;
    }
    let mut options = OpenOptions::new();
    let file = options.write(true).create(true).truncate(false).open(&path);
    let file = file.map_err(failed)?;
    match file.try_lock() {
        Ok(()) => Ok(Some(file)),
        Err(TryLockError::WouldBlock) => Err(Refusal::Busy(format!(
            "another run is writing to {}; wait until it ends, or choose another folder with --out",
            out.display()
        ))),
        // Some network file systems have no locks: a run alone is safe without.
        Err(TryLockError::Error(error)) if error.kind() == io::ErrorKind::Unsupported => Ok(None),
        Err(TryLockError::Error(error)) => Err(failed(error)),
    }
}

#[cfg(test)]
#[path = "folder_tests.rs"]
mod tests;
