//! Atomic file writes.

use std::fs::{self, File};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU32, Ordering};

/// Writes a file atomically: temporary file in the same folder, sync, rename. On failure an
/// existing file keeps its content; an existing link is replaced, not followed. Targets that are
/// not files but accept bytes, such as `/dev/null` or a pipe, are written to.
///
/// # Errors
/// Those of the file system; the temporary file is removed.
pub fn write_atomic(path: &Path, bytes: &[u8]) -> io::Result<()> {
    let is_file = |meta: fs::Metadata| meta.is_file() || meta.is_dir();
    if !fs::metadata(path).map_or(true, is_file) {
        return File::options().write(true).open(path)?.write_all(bytes);
    }
    path.file_name().ok_or(io::ErrorKind::InvalidFilename)?;
    let (mut file, temporary) = new_file_beside(path)?;
    let mut write = || {
        file.write_all(bytes)?;
        file.sync_all()?;
        fs::rename(&temporary, path)
    };
    write().inspect_err(|_| {
        // Report the first error; a leftover file is only litter.
        let _ = fs::remove_file(&temporary);
    })
}

/// Creates a file in the folder of `path`, with a short name, as `path` may have maximum length.
fn new_file_beside(path: &Path) -> io::Result<(File, PathBuf)> {
    static COUNTER: AtomicU32 = AtomicU32::new(0);
    loop {
        let count = COUNTER.fetch_add(1, Ordering::Relaxed);
        let temporary = path.with_file_name(format!(".{}.{count}.tmp", std::process::id()));
        match File::create_new(&temporary) {
            Ok(file) => return Ok((file, temporary)),
            // Left by an earlier process of the same number.
            Err(error) if error.kind() == io::ErrorKind::AlreadyExists => {}
            Err(error) => return Err(error),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_is_replaced_whole_or_keeps_its_content() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("records.jsonl");
        write_atomic(&path, b"first, longer").unwrap();
        write_atomic(&path, b"second").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"second");
        // A file cannot replace a folder: the write fails after creating the temporary file.
        let occupied = folder.path().join("occupied");
        fs::create_dir(&occupied).unwrap();
        fs::write(occupied.join("kept"), b"kept").unwrap();
        assert!(write_atomic(&occupied, b"lost").is_err());
        assert_eq!(fs::read(occupied.join("kept")).unwrap(), b"kept");
        assert_eq!(fs::read_dir(folder.path()).unwrap().count(), 2, "litter");
        assert!(write_atomic(Path::new("/"), b"").is_err());
    }

    #[test]
    fn a_name_as_long_as_names_can_be_is_written() {
        let folder = tempfile::tempdir().unwrap();
        let path = folder.path().join("x".repeat(255));
        write_atomic(&path, b"long").unwrap();
        assert_eq!(fs::read(&path).unwrap(), b"long");
    }

    #[cfg(unix)]
    #[test]
    fn a_link_is_replaced_and_a_device_written_to() {
        use std::os::unix::fs::{FileTypeExt as _, symlink};
        let folder = tempfile::tempdir().unwrap();
        let (target, link) = (folder.path().join("target"), folder.path().join("link"));
        fs::write(&target, "kept").unwrap();
        symlink(&target, &link).unwrap();
        write_atomic(&link, b"new").unwrap();
        assert_eq!(fs::read(&target).unwrap(), b"kept");
        assert_eq!(fs::read(&link).unwrap(), b"new");
        let device = folder.path().join("device");
        symlink("/dev/null", &device).unwrap();
        write_atomic(&device, b"gone").unwrap();
        assert!(fs::metadata(&device).unwrap().file_type().is_char_device());
    }
}
