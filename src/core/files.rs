//! Files that models, kernels and tables are read from. The crates below runs read them here, and nowhere else: a host
//! without a file system, as a browser is, hands in its own.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Where files are read from.
pub trait Files: Send + Sync {
    /// A regular file and its length in bytes. Folders are none, nor are devices and pipes, which may have no end.
    ///
    /// # Errors
    /// It is not there, no regular file, or cannot be read.
    fn open(&self, path: &Path) -> io::Result<(Box<dyn Read + Send>, u64)>;

    /// What lies in a folder.
    ///
    /// # Errors
    /// It is not there, no folder, or cannot be read.
    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>>;

    /// Whether there is a folder of this path.
    fn is_folder(&self, path: &Path) -> bool;

    /// The path without links and `..`.
    ///
    /// # Errors
    /// Nothing is there.
    fn real(&self, path: &Path) -> io::Result<PathBuf>;
}

/// The file system of the machine.
struct Disk;

impl Files for Disk {
    fn open(&self, path: &Path) -> io::Result<(Box<dyn Read + Send>, u64)> {
        let meta = std::fs::metadata(path)?;
        if meta.is_dir() {
            return Err(io::ErrorKind::IsADirectory.into());
        }
        if !meta.is_file() {
            return Err(io::Error::other("it is no regular file"));
        }
        Ok((Box::new(std::fs::File::open(path)?), meta.len()))
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        std::fs::read_dir(folder)?
            .map(|entry| Ok(entry?.path()))
            .collect()
    }

    fn is_folder(&self, path: &Path) -> bool {
        path.is_dir()
    }

    fn real(&self, path: &Path) -> io::Result<PathBuf> {
        path.canonicalize()
    }
}

static HOST: OnceLock<&'static dyn Files> = OnceLock::new();

/// Has all files be read from `files` in place of the machine's file system.
///
/// # Errors
/// Files were read already: hand them in before anything else.
pub fn read_from(files: &'static dyn Files) -> Result<(), &'static str> {
    HOST.set(files)
        .map_err(|_| "files were read already; hand them in before anything else")
}

/// Where files are read from.
pub fn files() -> &'static dyn Files {
    *HOST.get_or_init(|| &Disk)
}

/// The bytes of a regular file.
///
/// # Errors
/// As [`Files::open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (mut file, length) = files().open(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}
