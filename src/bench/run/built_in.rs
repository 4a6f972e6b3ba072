//! The program's measurements, and the loops of those not run cell by cell.

use super::animation;
use super::coherence;
use super::compactions;
use super::device::Device;
use super::error::RunError;
use super::errors;
use super::measurement::Measurement;
use super::peers;
use super::session::Session;
use super::streams;
use super::structures;
use super::structures::Gated;
use super::times;
use super::units::MeasurementRegistry;
use super::world::World;
use crate::ray_sets::RaySets;

/// How a measurement's cells are run.
#[derive(Clone, Copy)]
pub(super) enum Run {
    /// One by one, by the driver.
    CellByCell,
    /// Before all others of a world, which depend on them.
    First,
    /// All cells of a world, after its structures.
    OfWorld(fn(&mut Session, &World, &[Gated]) -> Result<(), RunError>),
    /// All cells of the plan, after the scenes.
    Alone(fn(&mut Session, &Device) -> Result<(), RunError>),
}

/// The program's measurements, in run order.
static BUILT_IN: [(&dyn Measurement, Run); 9] = [
    (&structures::Structures, Run::First),
    (&peers::Peers, Run::First),
    (&errors::Errors, Run::OfWorld(errors::run)),
    (&times::Times, Run::OfWorld(times::run)),
    (&coherence::Models, Run::OfWorld(coherence::run)),
    (&animation::Animations, Run::OfWorld(animation::run)),
    (&streams::Streams, Run::Alone(streams::run)),
    (&compactions::Compactions, Run::CellByCell),
    (&RaySets, Run::CellByCell),
];

impl Default for MeasurementRegistry {
    fn default() -> Self {
        Self(
            BUILT_IN
                .iter()
                .map(|(measurement, _)| *measurement)
                .collect(),
        )
    }
}

/// How a measurement's cells are run: external ones one by one.
pub(super) fn run_of(measurement: &dyn Measurement) -> Run {
    let mut known = BUILT_IN.iter();
    let known = known.find(|(known, _)| known.name() == measurement.name());
    known.map_or(Run::CellByCell, |(_, run)| *run)
}
