//! References of earlier runs: whoever edits a kernel and measures again need not render them again.
//!
//! A reference is kept under the hash of all that its pixels depend on (what a cell's content hash covers, the
//! adapter with its driver, and the program to the byte), and only those of embedded kernels are. A file that is
//! damaged or cannot be read is rendered anew.

use raystone_core::atomic::write_atomic;
use raystone_core::text::cell_hash;
use raystone_gpu::Gpu;
use raystone_image::Image;
use std::fs::{self, File};
use std::io;
use std::path::{Path, PathBuf};
use std::sync::OnceLock;
use std::time::SystemTime;

/// The files may take so many bytes together: those not used for longest go first.
const MOST_BYTES: u64 = 1 << 30;
/// Bytes of the hash that ends a file.
const HASH: usize = blake3::OUT_LEN;

/// The user's folder for what can be made again: `$RAYSTONE_CACHE` (none if it is empty), else
/// `$XDG_CACHE_HOME/raystone`, else `~/.cache/raystone`; absent where no home is known.
pub fn user_cache() -> Option<PathBuf> {
    if let Some(folder) = std::env::var_os("RAYSTONE_CACHE") {
        return Some(PathBuf::from(folder)).filter(|folder| !folder.as_os_str().is_empty());
    }
    let absolute = |name| {
        std::env::var_os(name)
            .map(PathBuf::from)
            .filter(|folder| folder.is_absolute())
    };
    let caches = absolute("XDG_CACHE_HOME").or_else(|| Some(absolute("HOME")?.join(".cache")))?;
    Some(caches.join("raystone"))
}

/// Where a part of a reference is, or will be, kept.
pub(super) struct Kept {
    path: PathBuf,
    size: [u32; 2],
}

impl Kept {
    /// The place of a part that is known by `hash` and rendered on `gpu`; absent where the program cannot be read.
    pub(super) fn new(folder: &Path, gpu: &Gpu, hash: &str, size: [u32; 2]) -> Option<Self> {
        let about = &gpu.info;
        let machine = format!("{:?}", (&about.name, &about.driver, &about.driver_info));
        let key = cell_hash(&[
            ("cell", hash),
            ("machine", &machine),
            ("program", program()?),
        ]);
        let path = folder.join("references").join(format!("{key}.part"));
        Some(Self { path, size })
    }

    /// The part, if it is there and whole.
    pub(super) fn read(&self) -> Option<Image> {
        let bytes = fs::read(&self.path).ok()?;
        let (pixels, hash) = bytes.split_at_checked(bytes.len().checked_sub(HASH)?)?;
        let [width, height] = self.size;
        let whole = width as usize * height as usize * size_of::<[f32; 3]>();
        if blake3::hash(pixels).as_bytes() != hash || pixels.len() != whole {
            return None;
        }
        let pixels = pixels.chunks_exact(size_of::<[f32; 3]>());
        let pixels = pixels.map(bytemuck::pod_read_unaligned).collect();
        if let Ok(file) = File::options().append(true).open(&self.path) {
            // Which were used last is only a guess at which will be wanted.
            let _ = file.set_modified(SystemTime::now());
        }
        Image::new(width, height, pixels).ok()
    }

    /// Keeps the part, and lets go of what was not used for longest.
    ///
    /// # Errors
    /// Those of the file system.
    pub(super) fn write(&self, part: &Image) -> io::Result<()> {
        let mut bytes = bytemuck::cast_slice(&part.pixels).to_vec();
        let hash = blake3::hash(&bytes);
        bytes.extend_from_slice(hash.as_bytes());
        let folder = self.path.parent().unwrap_or(Path::new("."));
        fs::create_dir_all(folder)?;
        write_atomic(&self.path, &bytes)?;
        trim(folder, MOST_BYTES)
    }
}

/// Removes the files not used for longest until the rest takes at most so many bytes.
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

/// Hash of the program's file: host code makes tables that kernels read.
pub(super) fn program() -> Option<&'static str> {
    static PROGRAM: OnceLock<Option<String>> = OnceLock::new();
    let hash = || {
        let bytes = fs::read(std::env::current_exe().ok()?).ok()?;
        Some(blake3::hash(&bytes).to_hex().to_string())
    };
    PROGRAM.get_or_init(hash).as_deref()
}

#[cfg(test)]
mod tests {
    use super::*;

    fn kept(folder: &Path, name: &str, size: [u32; 2]) -> Kept {
        Kept {
            path: folder.join("references").join(name),
            size,
        }
    }

    fn image() -> Image {
        Image::new(3, 2, vec![[1.5, 0.5, f32::MIN_POSITIVE]; 6]).unwrap()
    }

    #[test]
    fn what_is_kept_comes_back_to_the_bit_and_what_is_damaged_does_not() {
        let folder = tempfile::tempdir().unwrap();
        let place = kept(folder.path(), "a.part", [3, 2]);
        assert!(place.read().is_none());
        place.write(&image()).unwrap();
        assert_eq!(place.read().unwrap(), image());
        // Of another size.
        assert!(kept(folder.path(), "a.part", [3, 3]).read().is_none());
        let whole = fs::read(&place.path).unwrap();
        for end in [0, 1, HASH, whole.len() - 1] {
            fs::write(&place.path, &whole[..end]).unwrap();
            assert!(place.read().is_none(), "{end} bytes");
        }
        for at in [0, 50, whole.len() - 1] {
            let mut damaged = whole.clone();
            damaged[at] ^= 1;
            fs::write(&place.path, damaged).unwrap();
            assert!(place.read().is_none(), "byte {at}");
        }
    }

    #[test]
    fn what_was_not_used_for_longest_goes_first() {
        let folder = tempfile::tempdir().unwrap();
        let places = ["a", "b", "c"].map(|name| kept(folder.path(), name, [3, 2]));
        for place in &places {
            place.write(&image()).unwrap();
            std::thread::sleep(std::time::Duration::from_millis(20));
        }
        assert!(places[0].read().is_some());
        let one = fs::metadata(&places[0].path).unwrap().len();
        trim(&folder.path().join("references"), 2 * one).unwrap();
        assert_eq!(
            places.each_ref().map(|p| p.path.exists()),
            [true, false, true]
        );
    }
}
