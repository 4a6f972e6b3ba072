//! Photometric files of luminaires: IES LM-63 of 1986, 1991, 1995, 2002 and 2019, photometry of the types A, B and C.

mod flux;
mod parse;

pub use parse::IesError;

use raystone_core::text::plain_text_or_latin1;
use std::path::Path;

/// How the two angles of a file make a direction. Axes are those of the luminaire, see [`IesProfile`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Photometry {
    /// Horizontal planes around the vertical axis z: (sin v cos h, sin v sin h, cos v). Most luminaires.
    C,
    /// Planes around the axis x, for floodlights: (sin h, cos h sin v, cos h cos v).
    B,
    /// Planes around the axis y, for headlights: (cos v sin h, sin v, cos v cos h).
    A,
}

/// Luminous intensities over directions, bilinear in the two angles, and 0 where none was measured.
///
/// The axis z of the luminaire is where both angles are 0 (the nadir of type C, the beam of A and B), x is
/// where the horizontal angle begins.
#[derive(Debug, Clone, PartialEq)]
pub struct IesProfile {
    /// The file.
    pub name: String,
    /// What the angles mean.
    pub photometry: Photometry,
    /// Ascending, degrees.
    pub vertical: Vec<f32>,
    /// Ascending, degrees, all around (0 to 360 for type C, −90 to 90 for A and B); a single one where the luminaire
    /// is symmetric about its axis.
    pub horizontal: Vec<f32>,
    /// Candela, the factors of the file in it (of the candela and of the ballast, and of ballast and lamp until 1991): for each horizontal angle those of all vertical ones.
    pub candela: Vec<f32>,
    /// Lamps' rated luminous flux, lumens; `None` for absolute photometry.
    pub rated_lumens: Option<f64>,
    /// Electrical power, watts.
    pub input_watts: f64,
    /// What deviates from the standard and was read all the same.
    pub warnings: Vec<String>,
}

impl IesProfile {
    /// Reads a file.
    ///
    /// # Errors
    /// It cannot be read, or breaks the standard: says in which line and how.
    pub fn read(path: &Path) -> Result<Self, IesError> {
        let name = path.display().to_string();
        let bytes = raystone_core::files::read(path).map_err(|source| IesError::Read {
            file: name.clone(),
            source,
        })?;
        // Names of makers and luminaires come in all kinds of codings; what counts is ASCII.
        Self::parse(&name, &plain_text_or_latin1(bytes))
    }
}
