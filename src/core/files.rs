//! Reads files of models, kernels and tables. The crates below runs read them only here, so that a
//! host without a file system, such as a browser, can supply its own.

use std::io::{self, Read};
use std::path::{Path, PathBuf};
use std::sync::OnceLock;

/// Endings of the files that hold a model: a scene of such a name is a path.
pub const MODEL_ENDINGS: [&str; 5] = ["obj", "gltf", "glb", "ply", "xml"];

/// A source of files.
pub trait Files: Send + Sync {
    /// Opens a regular file (no folder, device or pipe) and returns its length in bytes.
    ///
    /// # Errors
    /// The file does not exist, is not regular, or cannot be read.
    fn open(&self, path: &Path) -> io::Result<(Box<dyn Read + Send>, u64)>;

    /// Lists a folder.
    ///
    /// # Errors
    /// It does not exist, is not a folder, or cannot be read.
    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>>;

    /// True if this is a folder.
    fn is_folder(&self, path: &Path) -> bool;

    /// Resolves links and `..`.
    ///
    /// # Errors
    /// The path does not exist.
    fn real(&self, path: &Path) -> io::Result<PathBuf>;
}

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

/// Replaces the machine's file system by `files` for all reads.
///
/// # Errors
/// Files were already read: call this first.
pub fn read_from(files: &'static dyn Files) -> Result<(), &'static str> {
    HOST.set(files)
        .map_err(|_| "files were read already; hand them in before anything else")
}

/// A file of the program itself: where it stands, and its bytes.
pub type EmbeddedFile = (&'static str, &'static [u8]);

static EMBEDDED: OnceLock<&'static [EmbeddedFile]> = OnceLock::new();

/// Adds files of the program itself to those of the host; only the first call counts. They stand where no host has a
/// folder.
pub fn embed(files: &'static [EmbeddedFile]) {
    EMBEDDED.get_or_init(|| files);
}

/// The embedded files before those of the host.
struct WithEmbedded;

impl WithEmbedded {
    fn embedded(path: &Path) -> Option<&'static [u8]> {
        let mut all = EMBEDDED.get()?.iter();
        all.find_map(|(place, bytes)| (Path::new(place) == path).then_some(*bytes))
    }

    fn host() -> &'static dyn Files {
        *HOST.get_or_init(|| &Disk)
    }
}

impl Files for WithEmbedded {
    fn open(&self, path: &Path) -> io::Result<(Box<dyn Read + Send>, u64)> {
        match Self::embedded(path) {
            Some(bytes) => Ok((Box::new(bytes), bytes.len() as u64)),
            None => Self::host().open(path),
        }
    }

    fn list(&self, folder: &Path) -> io::Result<Vec<PathBuf>> {
        Self::host().list(folder)
    }

    fn is_folder(&self, path: &Path) -> bool {
        Self::host().is_folder(path)
    }

    fn real(&self, path: &Path) -> io::Result<PathBuf> {
        match Self::embedded(path) {
            Some(_) => Ok(path.to_owned()),
            None => Self::host().real(path),
        }
    }
}

/// The current source of files.
pub fn files() -> &'static dyn Files {
    &WithEmbedded
}

/// Reads a regular file.
///
/// # Errors
/// As [`Files::open`].
pub fn read(path: &Path) -> io::Result<Vec<u8>> {
    let (mut file, length) = files().open(path)?;
    let mut bytes = Vec::with_capacity(usize::try_from(length).unwrap_or(0));
    file.read_to_end(&mut bytes)?;
    Ok(bytes)
}
