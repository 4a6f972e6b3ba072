//! Files that a glTF model names by URI.

use super::LoadOptions;
use base64::Engine;
use std::path::{Component, Path, PathBuf};

/// Finds and reads a model's files, by default only inside its folder.
pub(super) struct Files {
    pub model: PathBuf,
    folder: PathBuf,
    allow_outside: bool,
}

impl Files {
    pub(crate) fn new(model: &Path, options: &LoadOptions) -> Self {
        let folder = match model.parent() {
            Some(folder) if folder != Path::new("") => folder,
            _ => Path::new("."),
        };
        Self {
            model: model.to_owned(),
            folder: folder.to_owned(),
            allow_outside: options.allow_outside,
        }
    }

    /// Reads a data URI or a file.
    ///
    /// # Errors
    /// The problem, with the name of the file.
    pub(crate) fn read(&self, uri: &str) -> Result<Vec<u8>, String> {
        if let Some(data) = uri.strip_prefix("data:") {
            let (_, encoded) = data
                .split_once(";base64,")
                .ok_or("the data URI is not base64")?;
            return base64::engine::general_purpose::STANDARD
                .decode(encoded)
                .map_err(|error| format!("the data URI cannot be decoded: {error}"));
        }
        let file = self.find(uri)?;
        raystone_core::files::read(&file).map_err(|error| format!("{}: {error}", file.display()))
    }

    /// Resolves a relative URI, decoding `%20` and the like.
    ///
    /// # Errors
    /// The file lies outside the model's folder, by name or by link, and that is not allowed.
    pub(crate) fn find(&self, uri: &str) -> Result<PathBuf, String> {
        let file = self
            .folder
            .join(decoded(uri.strip_prefix("file://").unwrap_or(uri)));
        if self.allow_outside {
            return Ok(file);
        }
        let outside = || {
            format!(
                "`{uri}` lies outside the model's folder; --allow-outside reads it all the same"
            )
        };
        // With links resolved. The reader reports missing files, unless the name leads outside.
        let real = |path: &Path| raystone_core::files::files().real(path);
        let inside = match (real(&file), real(&self.folder)) {
            (Ok(file), Ok(folder)) => file.starts_with(folder),
            _ => file.strip_prefix(&self.folder).is_ok_and(|rest| {
                let ordinary = |part| matches!(part, Component::Normal(_) | Component::CurDir);
                rest.components().all(ordinary)
            }),
        };
        inside.then_some(file).ok_or_else(outside)
    }
}

fn decoded(uri: &str) -> String {
    let mut decoded = Vec::with_capacity(uri.len());
    let mut rest = uri.as_bytes();
    while let Some((&byte, after)) = rest.split_first() {
        let hex = (byte == b'%').then(|| after.get(..2)).flatten();
        let value = hex.and_then(|h| u8::from_str_radix(std::str::from_utf8(h).ok()?, 16).ok());
        decoded.push(value.unwrap_or(byte));
        rest = &after[if value.is_some() { 2 } else { 0 }..];
    }
    String::from_utf8_lossy(&decoded).into_owned()
}
