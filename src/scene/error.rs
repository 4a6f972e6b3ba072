//! Errors of loading a scene.

use raystone_core::files::files;
use raystone_core::params::ParamError;
use std::any::Any;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// A scene could not be loaded: names the file, the place in it, and the remedy.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error("unknown scene `{name}`: not a built-in scene and no such file; {hint}")]
    Unknown {
        /// The name as typed.
        name: String,
        /// The nearest built-in name, or all of them.
        hint: String,
    },
    /// The file's extension is not a supported format.
    #[error("{}: unknown model format; give a .obj, .gltf, .glb, .ply or Nori .xml file", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The operating system could not read the file.
    #[error("{}: cannot read the file ({source}); check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// Instances that cannot be shifted so.
    #[error("{name}: `shifts` of the scene: {problem}")]
    Shifts {
        /// The scene, as typed.
        name: String,
        /// The reason.
        problem: String,
    },
    /// A medium that cannot be.
    #[error("{name}: the medium of the scene: {source}")]
    Medium {
        /// The scene, as typed.
        name: String,
        /// The reason.
        source: raystone_volume::MediaError,
    },
    /// Further media that cannot be.
    #[error("{name}: `more_media` of the scene{}: {problem}", .place.map_or(String::new(), |k| format!(", table {k}")))]
    MoreMedia {
        /// The scene, as typed.
        name: String,
        /// Which of its tables, from 1 on; all of them if none.
        place: Option<usize>,
        /// The reason.
        problem: String,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty; export or copy the model again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The content violates its format.
    #[error("{}{}: {problem}; repair the file or export it again", path.display(), at(place))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line or part of the file; empty if unknown.
        place: String,
        /// The problem.
        problem: String,
    },
    /// The content is valid, but not in a form that can be read.
    #[error("{}{}: {problem}, which is not read; {advice}", path.display(), at(place))]
    Unsupported {
        /// The file.
        path: PathBuf,
        /// Part of the file.
        place: String,
        /// The form.
        problem: String,
        /// The suggested fix.
        advice: &'static str,
    },
    /// The file is well formed but has no triangle to trace.
    #[error("{name}: the scene has no triangles ({reason}); give a model with at least one face")]
    NoTriangles {
        /// The scene, as typed.
        name: String,
        /// The reason.
        reason: String,
    },
    /// No grid of merged vertices gives so few triangles.
    #[error("{name}: `most_triangles = {most}` leaves none of {count} triangles; raise it")]
    TooFew {
        /// The scene, as typed.
        name: String,
        /// Triangles that it may have.
        most: usize,
        /// Triangles that it has.
        count: usize,
    },
    /// Coordinates so large that f32 arithmetic on them overflows.
    #[error(
        "{name}: triangle {triangle} has a coordinate of {magnitude:e}, beyond the limit of \
         {limit:e} of f32 tracing; scale the model down"
    )]
    TooLarge {
        /// The scene, as typed.
        name: String,
        /// The first such triangle, in the order of the file.
        triangle: usize,
        /// Its largest absolute coordinate.
        magnitude: f32,
        /// Largest allowed.
        limit: f32,
    },
    /// An object or instance cannot be placed.
    #[error("{name}: {source}")]
    Instance {
        /// The scene, as typed.
        name: String,
        /// The failing instance and the reason.
        source: super::InstanceError,
    },
    /// The copies exceed the triangle limit.
    #[error(
        "{name}: {copies} copies have {needed} triangles, the limit is {limit}; set `copies` lower, or \
         most_triangles = {most}"
    )]
    TooManyCopies {
        /// The scene, as typed.
        name: String,
        /// Number of copies requested.
        copies: usize,
        /// Their total number of triangles.
        needed: usize,
        /// Limit on the total number of triangles.
        limit: usize,
        /// Triangles allowed per copy at this number of copies.
        most: usize,
    },
    /// A luminaire's photometric file is invalid.
    #[error(transparent)]
    Photometry(#[from] super::IesError),
    /// A parameter is unknown to the built-in scene or has a disallowed value.
    #[error(transparent)]
    Parameter(#[from] ParamError),
    /// The camera sees nothing.
    #[error("camera: {problem}; {advice}")]
    Camera {
        /// The problem.
        problem: String,
        /// The suggested fix.
        advice: &'static str,
    },
}

fn at(place: &str) -> String {
    match place {
        "" => String::new(),
        place => format!(" ({place})"),
    }
}

impl SceneError {
    pub(super) fn unreadable(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    /// Returns a [`SceneError::Malformed`].
    pub fn malformed(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Malformed {
            path: path.to_owned(),
            place: place.into(),
            problem: problem.into(),
        }
    }
}

/// Opens a model and returns its length in bytes; missing and empty files are errors.
pub(super) fn open(path: &Path) -> Result<(Box<dyn Read + Send>, u64), SceneError> {
    let (file, bytes) = files().open(path).map_err(SceneError::unreadable(path))?;
    if bytes == 0 {
        return Err(SceneError::Empty {
            path: path.to_owned(),
        });
    }
    Ok((file, bytes))
}

pub(super) fn read(path: &Path) -> Result<Vec<u8>, SceneError> {
    let mut bytes = Vec::new();
    let read = open(path)?.0.read_to_end(&mut bytes);
    read.map(|_| bytes).map_err(SceneError::unreadable(path))
}

/// The message of a third-party parser's panic.
pub(super) fn panic_text(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    format!("the parser gave up: {text}")
}

/// Runs a loader that uses third-party parsers and turns their panics into errors.
pub(super) fn guarded<T>(
    path: &Path,
    load: impl FnOnce() -> Result<T, SceneError>,
) -> Result<T, SceneError> {
    catch_unwind(AssertUnwindSafe(load)).unwrap_or_else(|payload| {
        let problem = panic_text(payload.as_ref());
        Err(SceneError::malformed(path, "", problem))
    })
}
