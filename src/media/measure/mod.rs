//! Media as measurements: names that begin with `media:` on the axis of integrators, which need no scene.

mod paths;
mod photons;
mod pipeline;
mod structures;

use raystone_bench::run::{Absent, Registries};
use raystone_config::{Axis, Catalogue, Cell, MEDIA, Plan};
use raystone_core::params::{Entry, Parameters};

/// Adds the measurements of media.
///
/// # Errors
/// One of them is there already.
pub fn register(registries: &mut Registries) -> Result<(), String> {
    registries.measurements.add(&structures::Structures)?;
    registries.measurements.add(&paths::Paths)?;
    registries.measurements.add(&photons::Photons)?;
    registries.measurements.add(&pipeline::Photons)
}

/// Figures of known ends and walks, by name, and what they should be.
pub(crate) fn known() -> Result<Vec<(&'static str, f64, f64)>, String> {
    let mut all = paths::known().to_vec();
    all.extend(paths::known_readings()?);
    all.extend(structures::known()?);
    all.extend(structures::known_steps()?);
    all.extend(pipeline::known()?);
    Ok(all)
}

/// Adds a name to the axis of integrators.
fn declare<P: Parameters>(catalogue: &mut Catalogue, name: &str, about: &str) {
    catalogue[Axis::Integrator].push(Entry {
        name: format!("{MEDIA}{name}"),
        description: about.to_owned(),
        schema: P::schema(),
    });
}

/// The cells of a plan, distinct on these axes, whose integrator has such a name.
fn cells_of(plan: &Plan, axes: &[Axis], is_wanted: impl Fn(&str) -> bool) -> Vec<Cell> {
    let mut cells = plan.benches_on(axes);
    cells.retain(|cell| name_of(cell).is_some_and(&is_wanted));
    cells
}

/// The name of a cell's integrator without [`MEDIA`].
fn name_of(cell: &Cell) -> Option<&str> {
    cell[Axis::Integrator].name.strip_prefix(MEDIA)
}

/// The failure of a cell whose volume cannot be made, or whose structure contradicts it.
// By value: it is what `map_err` hands over.
#[allow(clippy::needless_pass_by_value)]
fn failed(error: crate::MediaError) -> Absent {
    Absent::Failed(error.to_string())
}
