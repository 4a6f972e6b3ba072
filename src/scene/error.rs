//! What can go wrong between a scene's name and its triangles.

use raystone_core::files::files;
use raystone_core::params::ParamError;
use std::any::Any;
use std::io::Read;
use std::panic::{AssertUnwindSafe, catch_unwind};
use std::path::{Path, PathBuf};

/// A scene could not be loaded: says which file, where in it, and what to do.
#[derive(Debug, thiserror::Error)]
pub enum SceneError {
    /// Neither a built-in scene nor a file.
    #[error("unknown scene `{name}`: not a built-in scene and no such file; {hint}")]
    Unknown {
        /// What the user typed.
        name: String,
        /// The nearest built-in name, or all of them.
        hint: String,
    },
    /// The file's extension names no format that can be read.
    #[error("{}: unknown model format; give a .obj, .gltf, .glb, .ply or Nori .xml file", path.display())]
    UnknownFormat {
        /// The file.
        path: PathBuf,
    },
    /// The operating system refused the file.
    #[error("{}: cannot read the model ({source}); check the path and its permissions", path.display())]
    Read {
        /// The file.
        path: PathBuf,
        /// The reason.
        source: std::io::Error,
    },
    /// The file has no bytes.
    #[error("{}: the file is empty; export or copy the model again", path.display())]
    Empty {
        /// The file.
        path: PathBuf,
    },
    /// The content breaks the rules of its format.
    #[error("{}{}: {problem}; repair the file or export it again", path.display(), at(place))]
    Malformed {
        /// The file.
        path: PathBuf,
        /// Line or part of the file, empty if it is not known.
        place: String,
        /// What is wrong.
        problem: String,
    },
    /// The file is well formed and has no triangle to trace.
    #[error("{name}: the scene has no triangles ({reason}); give a model with at least one face")]
    NoTriangles {
        /// The scene, as typed.
        name: String,
        /// Why there are none.
        reason: String,
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
    /// An object or instance that cannot be placed.
    #[error("{name}: {source}")]
    Instance {
        /// The scene, as typed.
        name: String,
        /// Which, and why.
        source: super::InstanceError,
    },
    /// More triangles than a machine can be expected to hold.
    #[error(
        "{name}: {copies} copies have {needed} triangles, the limit is {limit}; set `copies` lower, or \
         most_triangles = {most}"
    )]
    TooManyCopies {
        /// The scene, as typed.
        name: String,
        /// Copies that were asked for.
        copies: usize,
        /// Their triangles.
        needed: usize,
        /// Most triangles of all copies.
        limit: usize,
        /// Most triangles of one of so many.
        most: usize,
    },
    /// The photometric file of a luminaire.
    #[error(transparent)]
    Photometry(#[from] super::IesError),
    /// A parameter that the built-in scene does not have, or a value that it does not allow.
    #[error(transparent)]
    Parameter(#[from] ParamError),
    /// A camera that sees nothing.
    #[error("camera: {problem}; {advice}")]
    Camera {
        /// What is wrong.
        problem: String,
        /// What to write instead.
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
    /// A [`SceneError::Read`] of this file.
    pub(super) fn unreadable(path: &Path) -> impl Fn(std::io::Error) -> Self + '_ {
        |source| Self::Read {
            path: path.to_owned(),
            source,
        }
    }

    /// A [`SceneError::Malformed`].
    pub fn malformed(path: &Path, place: impl Into<String>, problem: impl Into<String>) -> Self {
        Self::Malformed {
            path: path.to_owned(),
            place: place.into(),
            problem: problem.into(),
        }
    }
}

/// Opens a model, telling a missing or empty file from a readable one, and its length in bytes.
pub(super) fn open(path: &Path) -> Result<(Box<dyn Read + Send>, u64), SceneError> {
    let (file, bytes) = files().open(path).map_err(SceneError::unreadable(path))?;
    if bytes == 0 {
        return Err(SceneError::Empty {
            path: path.to_owned(),
        });
    }
    Ok((file, bytes))
}

/// The bytes of a model that is read whole.
pub(super) fn read(path: &Path) -> Result<Vec<u8>, SceneError> {
    let mut bytes = Vec::new();
    let read = open(path)?.0.read_to_end(&mut bytes);
    read.map(|_| bytes).map_err(SceneError::unreadable(path))
}

/// What a third-party parser said when it panicked.
pub(super) fn panic_text(payload: &(dyn Any + Send)) -> String {
    let text = payload
        .downcast_ref::<String>()
        .map(String::as_str)
        .or_else(|| payload.downcast_ref::<&str>().copied())
        .unwrap_or("no message");
    format!("the parser gave up: {text}")
}

/// Runs a loader built on third-party parsers, which may panic on malformed files, and turns a
/// panic into an error.
pub(super) fn guarded<T>(
    path: &Path,
    load: impl FnOnce() -> Result<T, SceneError>,
) -> Result<T, SceneError> {
    catch_unwind(AssertUnwindSafe(load)).unwrap_or_else(|payload| {
        let problem = panic_text(payload.as_ref());
        Err(SceneError::malformed(path, "", problem))
    })
}
