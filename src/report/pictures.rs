//! Pictures of a run, embedded into the report.

use super::document::Picture;
use base64::Engine;
use std::io::ErrorKind;
use std::path::{Component, Path, PathBuf};

/// Loads a picture that a record names relative to the run's folder `dir`. A missing file, or a name
/// that leads out of the folder, gives a placeholder with the reason.
pub(crate) fn load(dir: &Path, path: &str, caption: impl Into<String>) -> Picture {
    let (data, missing) = match read(dir, path) {
        Ok(bytes) => {
            let text = base64::engine::general_purpose::STANDARD.encode(bytes);
            (Some(format!("data:image/png;base64,{text}")), String::new())
        }
        Err(reason) => (None, reason),
    };
    let caption = caption.into();
    Picture {
        alt: caption.clone(),
        caption,
        path: path.into(),
        data,
        missing,
    }
}

impl Picture {
    /// Returns the same picture with a description of its content.
    pub fn described(mut self, alt: impl Into<String>) -> Self {
        self.alt = alt.into();
        self
    }
}

/// Returns the place of a file that a record names; `None` where the name leads out of the folder.
pub(crate) fn inside(dir: &Path, path: &str) -> Option<PathBuf> {
    let mut parts = Path::new(path).components();
    let stays = parts.all(|part| matches!(part, Component::Normal(_) | Component::CurDir));
    stays.then(|| dir.join(path))
}

fn read(dir: &Path, path: &str) -> Result<Vec<u8>, String> {
    let Some(place) = inside(dir, path) else {
        return Err(format!("{path} lies outside the run's folder"));
    };
    let bytes = std::fs::read(place).map_err(|error| match error.kind() {
        ErrorKind::NotFound => format!("{path} is missing"),
        _ => format!("{path} cannot be read: {error}"),
    })?;
    if bytes.starts_with(b"\x89PNG\r\n\x1a\n") {
        Ok(bytes)
    } else {
        Err(format!("{path} is not a PNG file"))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_picture_is_embedded_and_a_missing_or_foreign_one_is_explained() {
        let dir = tempfile::tempdir().unwrap();
        std::fs::write(dir.path().join("a.png"), b"\x89PNG\r\n\x1a\nrest").unwrap();
        std::fs::write(dir.path().join("b.png"), b"text").unwrap();
        let data = load(dir.path(), "a.png", "a").data.unwrap();
        assert!(
            data.starts_with("data:image/png;base64,iVBORw0KGgp"),
            "{data}"
        );
        for (path, reason) in [
            ("c.png", "missing"),
            ("b.png", "not a PNG"),
            ("../a.png", "outside"),
        ] {
            let picture = load(dir.path(), path, "");
            assert!(
                picture.data.is_none() && picture.missing.contains(reason),
                "{picture:?}"
            );
        }
    }
}
