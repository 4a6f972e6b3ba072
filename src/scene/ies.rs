//! Photometric files of luminaires: IES LM-63 of 1986, 1991, 1995, 2002 and 2019, types A, B and C.

mod flux;
mod parse;
mod unfold;

pub use parse::IesError;

use raystone_core::text::plain_text_or_latin1;
use std::path::Path;

/// How a file's two angles define a direction in the luminaire's axes, see [`IesProfile`].
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Photometry {
    /// Horizontal planes around the vertical axis z: (sin v cos h, sin v sin h, cos v). Most luminaires.
    C,
    /// Planes around the axis x, for floodlights: (sin h, cos h sin v, cos h cos v).
    B,
    /// Planes around the axis y, for headlights: (cos v sin h, sin v, cos v cos h).
    A,
}

/// Luminous intensity over directions, bilinear in the two angles, 0 where none was measured.
///
/// The luminaire's z axis is where both angles are 0 (the nadir of type C, the beam of A and B); x
/// is where the horizontal angle begins.
#[derive(Debug, Clone, PartialEq)]
pub struct IesProfile {
    /// File name.
    pub name: String,
    /// Meaning of the angles.
    pub photometry: Photometry,
    /// Ascending, degrees.
    pub vertical: Vec<f32>,
    /// Ascending, degrees, all around (0 to 360 for type C, −90 to 90 for A and B, or as far as a beam was measured); a
    /// single one if the luminaire is symmetric about its axis.
    pub horizontal: Vec<f32>,
    /// Candela, all vertical angles of the first horizontal angle, then of the next. The file's
    /// factors are applied (candela and ballast, and ballast-lamp until 1991).
    pub candela: Vec<f32>,
    /// Lamps' rated luminous flux, lumens; `None` for absolute photometry.
    pub rated_lumens: Option<f64>,
    /// Electrical power, watts.
    pub input_watts: f64,
    /// Tolerated deviations from the standard.
    pub warnings: Vec<String>,
}

impl IesProfile {
    /// Reads a file.
    ///
    /// # Errors
    /// The file cannot be read, or violates the standard: names the line and the problem.
    pub fn read(path: &Path) -> Result<Self, IesError> {
        let name = path.display().to_string();
        let bytes = raystone_core::files::read(path).map_err(|source| IesError::Read {
            file: name.clone(),
            source,
        })?;
        // Names of makers and luminaires come in many encodings; only ASCII matters. Zeros at the end are padding.
        let text = plain_text_or_latin1(bytes);
        Self::parse(&name, text.trim_end_matches('\0'))
    }
}
