//! Linear images as NumPy arrays.

use super::{ExportError, Source};
use raystone_image::{FileFormat, read_linear};
use std::path::{Path, PathBuf};

/// Folder of linear images below that of a run.
const IMAGES: &str = "images";

/// Writes every linear image of the run into `out` as `.npy`, one at a time.
///
/// # Errors
/// No images, a folder that cannot be made, an image that cannot be read or written.
pub(super) fn write(source: &Source, out: &Path) -> Result<usize, ExportError> {
    let images = linear_images(&source.dir.join(IMAGES))?;
    if images.is_empty() {
        return Err(ExportError::NoImages(source.dir.to_owned()));
    }
    std::fs::create_dir_all(out).map_err(|source| ExportError::Folder {
        path: out.to_owned(),
        source,
    })?;
    for path in &images {
        let stem = path.file_stem().unwrap_or_default();
        let target = out.join(stem).with_added_extension("npy");
        FileFormat::of(&target)?.write(&target, &read_linear(path)?, &[])?;
    }
    Ok(images.len())
}

/// Images in a folder whose format keeps linear values, by name; none if there is no such folder.
fn linear_images(folder: &Path) -> Result<Vec<PathBuf>, ExportError> {
    let fault = |source| ExportError::Folder {
        path: folder.to_owned(),
        source,
    };
    if !folder.is_dir() {
        return Ok(Vec::new());
    }
    let mut images = Vec::new();
    for entry in std::fs::read_dir(folder).map_err(fault)? {
        let path = entry.map_err(fault)?.path();
        let is_linear = |format: &FileFormat| path.extension().is_some_and(|e| e == format.ending);
        if FileFormat::linear().any(is_linear) {
            images.push(path);
        }
    }
    images.sort();
    Ok(images)
}
