//! What passes over rays and triangles did.

use crate::run::Absent;
use raystone_accel::{
    Anatomy, DivideAndConquer, Division, DivisionLevel, RayHierarchy, StreamCounts, Tracer,
    TriangleSoup,
};
use raystone_core::params::Variant;
use raystone_gpu::Gpu;
use raystone_verify::rays::RaySet;

/// What passes over rays and triangles did, by the scalar twin and by the device.
pub(super) enum Descent {
    /// Triangles through a tree over rays.
    Tree {
        anatomy: Option<Anatomy>,
        streams: Vec<StreamCounts>,
    },
    /// Problems, of which the device had no room for the parts of some pairs.
    Division { host: Division, without_room: u64 },
}

impl Descent {
    pub(super) fn of_tree(
        gpu: &Gpu,
        (tracer, set): (&Tracer, &RaySet),
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let streams = RayHierarchy::streams(gpu, tracer, &set.rays)?;
        // There is none of sorted rays, and of parts.
        let anatomy = Anatomy::new(soup, &accel.params, &set.rays).ok();
        let is_whole = streams.iter().all(|level| level.walked == 0);
        if let Some(anatomy) = anatomy.as_ref().filter(|_| exact && is_whole) {
            let twin = anatomy.levels.iter().map(|level| level.pairs);
            // Nothing passes above the level that the descent begins at.
            let twin = twin.chain(std::iter::repeat(0));
            agree(twin, streams.iter().map(|level| u64::from(level.pairs)))?;
        }
        Ok(Self::Tree { anatomy, streams })
    }

    pub(super) fn of_division(
        gpu: &Gpu,
        (tracer, set): (&Tracer, &RaySet),
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let host = Division::new(soup, &accel.params, set.query(), &set.rays);
        let host = host.map_err(|error| Absent::Failed(error.to_string()))?;
        let levels = host.levels.len() as u32;
        let found = DivideAndConquer::division(gpu, tracer, &set.rays, levels)?;
        let without_room = found.iter().map(|level| level.without_room).sum();
        if exact && without_room == 0 {
            let pairs = |levels: &[DivisionLevel]| {
                levels.iter().map(|level| level.pairs).collect::<Vec<_>>()
            };
            agree(pairs(&host.levels), pairs(&found))?;
        }
        Ok(Self::Division { host, without_room })
    }
}

/// Compares pairs level by level.
fn agree(
    twin: impl IntoIterator<Item = u64>,
    device: impl IntoIterator<Item = u64>,
) -> Result<(), Absent> {
    for (level, (twin, device)) in twin.into_iter().zip(device).enumerate() {
        if twin != device {
            return Err(Absent::Failed(format!(
                "level {level} has {device} pairs on the device and {twin} in the scalar twin"
            )));
        }
    }
    Ok(())
}
