//! Media as measurements: names that begin with `media:` on the axis of integrators, which need no scene.

mod paths;
mod photons;
mod structures;

use raystone_bench::run::{Absent, Registries};
use raystone_config::{Axis, Cell, MEDIA};

/// Adds the measurements of media.
///
/// # Errors
/// One of them is there already.
pub fn register(registries: &mut Registries) -> Result<(), String> {
    registries.measurements.add(&structures::Structures)?;
    registries.measurements.add(&paths::Paths)?;
    registries.measurements.add(&photons::Photons)
}

/// The name of a cell's integrator without [`MEDIA`].
fn name_of(cell: &Cell) -> Option<&str> {
    cell[Axis::Integrator].name.strip_prefix(MEDIA)
}

impl From<crate::MediaError> for Absent {
    fn from(error: crate::MediaError) -> Self {
        Self::Failed(error.to_string())
    }
}
