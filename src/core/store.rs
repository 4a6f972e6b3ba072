//! Cache on disk of reproducible data for later runs, under a hash of all that it depends on, including the program to the
//! byte.
//!
//! A file that is damaged, or has another's name, is ignored. The least recently used files of each kind are removed first.

use crate::atomic::write_atomic;
use crate::text::cell_hash;
use std::env::var_os;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// Maximum bytes of all files of a kind together.
const MOST_BYTES: u64 = 1 << 30;
/// Bytes of the hash that ends a file.
const HASH: usize = blake3::OUT_LEN;

/// The folder of the user's caches: `$XDG_CACHE_HOME`, else `~/.cache`; absent where no home is known.
pub fn caches() -> Option<PathBuf> {
    let absolute = |name| {
        let folder = var_os(name).map(PathBuf::from);
        folder.filter(|folder| folder.is_absolute())
    };
    absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))
}

/// The user's folder of the cache: `$RAYSTONE_CACHE` (none if it is empty or `off`), else `raystone` among the [`caches`].
pub fn user_folder() -> Option<PathBuf> {
    match var_os("RAYSTONE_CACHE") {
        Some(folder) if folder.is_empty() || folder == "off" => None,
        Some(folder) => Some(folder.into()),
        None => Some(caches()?.join("raystone")),
    }
}

/// Hash of the program's file: host code makes tables that kernels read.
pub fn program() -> Option<&'static str> {
    static PROGRAM: OnceLock<Option<String>> = OnceLock::new();
    let hash = || {
        let bytes = fs::read(std::env::current_exe().ok()?).ok()?;
        Some(blake3::hash(&bytes).to_hex().to_string())
    };
    PROGRAM.get_or_init(hash).as_deref()
}

/// An entry of the cache, existing or not.
#[derive(Debug)]
pub struct Kept {
    key: String,
    path: PathBuf,
}

impl Kept {
    /// Returns the entry for data that depends on these parts and the program, among others of its kind; `None` if the
    /// program cannot be read.
    pub fn new(folder: &Path, kind: &str, depends_on: &[(&str, &str)]) -> Option<Self> {
        let key = cell_hash(&[depends_on, &[("program", program()?)]].concat());
        let path = folder.join(kind).join(&key);
        Some(Self { key, path })
    }

    /// Its file.
    pub fn path(&self) -> &Path {
        &self.path
    }

    fn hash(&self, bytes: &[u8]) -> blake3::Hash {
        let mut hasher = blake3::Hasher::new();
        hasher.update(self.key.as_bytes()).update(bytes);
        hasher.finalize()
    }

    /// The bytes, if they are there and whole.
    pub fn read(&self) -> Option<Vec<u8>> {
        let mut bytes = fs::read(&self.path).ok()?;
        let hash = bytes.split_off(bytes.len().checked_sub(HASH)?);
        if *self.hash(&bytes).as_bytes() != *hash {
            return None;
        }
        if let Ok(file) = File::options().append(true).open(&self.path) {
            // Recent use only suggests further use.
            let _ = file.set_modified(SystemTime::now());
        }
        Some(bytes)
    }

    /// Stores bytes, and removes the least recently used files.
    ///
    /// # Errors
    /// Those of the file system.
    pub fn write(&self, mut bytes: Vec<u8>) -> io::Result<()> {
        let hash = self.hash(&bytes);
        bytes.extend_from_slice(hash.as_bytes());
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        write_atomic(&self.path, &bytes)?;
        trim(folder, MOST_BYTES)
    }
}

/// Removes the least recently used files until the rest has at most so many bytes.
fn trim(folder: &Path, most: u64) -> io::Result<()> {
    let mut files = Vec::new();
    for entry in fs::read_dir(folder)? {
        let entry = entry?;
        let about = entry.metadata()?;
        files.push((about.modified()?, about.len(), entry.path()));
    }
    files.sort();
    let mut bytes: u64 = files.iter().map(|(_, bytes, _)| bytes).sum();
    for (_, size, path) in files {
        if bytes <= most {
            break;
        }
        // Another run may have removed it.
        match fs::remove_file(&path) {
            Err(e) if e.kind() != io::ErrorKind::NotFound => return Err(e),
            _ => bytes -= size,
        }
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(folder: &Path, name: &str) -> Kept {
        Kept::new(folder, "parts", &[("name", name)]).unwrap()
    }

    #[test]
    fn what_is_kept_comes_back_to_the_bit_and_what_is_damaged_or_foreign_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let place = kept(folder.path(), "a");
        assert!(place.read().is_none());
        let bytes: Vec<u8> = (0..100).collect();
        place.write(bytes.clone()).unwrap();
        assert_eq!(place.read().unwrap(), bytes);
        let whole = fs::read(place.path()).unwrap();
        for end in [0, 1, HASH, whole.len() - 1] {
            fs::write(place.path(), &whole[..end]).unwrap();
            assert!(place.read().is_none(), "{end} bytes");
        }
        for at in [0, 50, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            fs::write(place.path(), damaged).unwrap();
            assert!(place.read().is_none(), "byte {at}");
        }
        let other = kept(folder.path(), "b");
        fs::write(other.path(), &whole).unwrap();
        assert!(other.read().is_none());
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        let places = ["a", "b", "c"].map(|name| kept(folder.path(), name));
        for place in &places {
            place.write(vec![7; 100]).unwrap();
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(places[0].read().is_some());
        let one = fs::metadata(places[0].path()).unwrap().len();
        trim(&folder.path().join("parts"), 2 * one).unwrap();
        let there = places.each_ref().map(|p| p.path.exists());
        assert_eq!(there, [true, false, true]);
    }
}
