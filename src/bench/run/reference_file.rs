//! A reference that is not rendered: the image of another renderer, or of an earlier run.

use super::error::RunError;
use raystone_config::Experiment;
use raystone_image::{Image, primaries_note, read_linear};
use raystone_stats::metrics::Reference;

/// An image that was read, fit for the experiment.
pub(super) struct ReferenceFile {
    /// The file as the experiment names it.
    pub name: String,
    /// BLAKE3 of its pixels.
    pub hash: String,
    /// The image; its noise is not known.
    pub reference: Reference,
    /// A note on its colours, if they are not those of images of the run.
    pub note: Option<String>,
}

/// Reads the reference that an experiment names, if it names a file, and leaves it.
///
/// # Errors
/// A file that cannot be read, is of another size than the images of the run, or has pixels that are not
/// finite.
pub fn check_reference(experiment: &Experiment) -> Result<(), RunError> {
    ReferenceFile::load(experiment).map(drop)
}

impl ReferenceFile {
    /// The file that an experiment names, if it names one.
    ///
    /// # Errors
    /// A file that cannot be read, is of another size than the images of the run, or has pixels that are not
    /// finite.
    pub(super) fn load(experiment: &Experiment) -> Result<Option<Self>, RunError> {
        let Some(path) = &experiment.reference.file else {
            return Ok(None);
        };
        let name = path.display().to_string();
        let image = read_linear(path).map_err(|e| RunError::Input(format!("reference: {e}")))?;
        let [width, height] = experiment.run.resolution;
        if [image.width, image.height] != [width, height] {
            let [w, h] = [image.width, image.height];
            let or_else = if w.min(h) >= LEAST_SIDE {
                format!(", or set run.resolution=[{w}, {h}]")
            } else {
                String::new()
            };
            return Err(RunError::Input(format!(
                "reference {name} has {w}×{h} pixels, and run.resolution is {width}×{height}: render one \
                 of the size{or_else}"
            )));
        }
        let hash = image_hash(&image);
        let reference = Reference::single(image)
            .map_err(|e| RunError::Input(format!("reference {name}: {e}")))?;
        Ok(Some(Self {
            name,
            hash,
            reference,
            note: primaries_note(path),
        }))
    }
}

/// Least width and height of images of a run.
const LEAST_SIDE: u32 = 16;

/// BLAKE3 of the f32 pixels.
pub(super) fn image_hash(image: &Image) -> String {
    blake3::hash(bytemuck::cast_slice(&image.pixels))
        .to_hex()
        .to_string()
}
