//! Linear images as NumPy arrays: all that the records name, including those of resumed, replaced or merged runs.

use super::{ExportError, Files, Source};
use crate::pictures::inside;
use raystone_image::{FileFormat, read_linear};
use raystone_record::Pictures;
use std::collections::BTreeMap;
use std::path::{Path, PathBuf};

/// Writes every linear image of the run into `out` as `.npy`, one at a time.
///
/// # Errors
/// If there are no images, a folder cannot be made, or an image cannot be read or written.
pub(super) fn write(source: &Source, out: &Path) -> Result<Files, ExportError> {
    let (mut named, mut spread) = (BTreeMap::new(), BTreeMap::new());
    for line in source.lines {
        let of_line = Pictures::of(line);
        // Of two lines on the same image the later one wins.
        for (all, stems) in [(&mut named, of_line.linear), (&mut spread, of_line.spread)] {
            all.extend(stems.into_iter().map(|stem| {
                let file = stem.rsplit('/').next().unwrap_or(&stem).to_owned();
                (file, linear(source.dir, &stem))
            }));
        }
    }
    // Means and variances are stored only on request: if there are none, none is missing.
    if spread.values().any(Option::is_some) {
        named.append(&mut spread);
    }
    let found = || {
        named
            .iter()
            .filter_map(|(stem, at)| Some((stem, at.as_ref()?)))
    };
    if found().next().is_none() {
        let (dir, named) = (source.dir.to_owned(), named.len());
        return Err(ExportError::NoImages { dir, named });
    }
    std::fs::create_dir_all(out).map_err(|source| ExportError::Folder {
        path: out.to_owned(),
        source,
    })?;
    for (stem, path) in found() {
        let target = out.join(stem).with_added_extension("npy");
        FileFormat::of(&target)?.write(&target, &read_linear(path)?, &[])?;
    }
    let absent: Vec<&str> = (named.iter().filter(|(_, at)| at.is_none()))
        .map(|(stem, _)| stem.as_str())
        .collect();
    let told = (!absent.is_empty()).then(|| {
        format!(
            "{} of {} linear images that the records name are not there: {}",
            absent.len(),
            named.len(),
            absent.join(", ")
        )
    });
    Ok(Files {
        count: found().count(),
        left_out: told.into_iter().collect(),
    })
}

/// Returns the file of a linear image of this name.
pub(crate) fn linear(dir: &Path, stem: &str) -> Option<PathBuf> {
    let place = |format: &FileFormat| inside(dir, &format!("{stem}.{}", format.ending));
    FileFormat::linear()
        .filter_map(place)
        .find(|path| path.is_file())
}
