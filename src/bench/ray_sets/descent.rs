//! What passes over rays and triangles did.

use crate::run::Absent;
use raystone_accel::{
    Anatomy, DivideAndConquer, Division, DivisionLevel, RayHierarchy, StreamCounts, Structure as _,
    Traced, Tracer, TriangleBuffers, TriangleSoup,
};
use raystone_core::params::Variant;
use raystone_gpu::{Gpu, GpuError};
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

/// Rays of which the gate counts what passes did.
const RAYS: usize = 512;

/// What is wrong with what the passes of a structure count of some rays, in the gate: nothing else depends on these counts. `None`
/// for structures without them.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub fn fault_of_passes(
    gpu: &Gpu,
    (triangles, traced): (&TriangleBuffers, &Traced),
    (soup, accel): (&TriangleSoup, &Variant),
    set: &RaySet,
    exact: bool,
) -> Result<Option<String>, GpuError> {
    let is_tree = accel.name == RayHierarchy::NAME;
    if !is_tree && accel.name != DivideAndConquer::NAME {
        return Ok(None);
    }
    let tracer = Tracer::new(gpu, triangles, traced, set.query())?;
    let step = set.rays.len().div_ceil(RAYS).max(1);
    let some = RaySet {
        rays: set.rays.iter().step_by(step).copied().collect(),
        truth: Vec::new(),
        shadow: Vec::new(),
        ..*set
    };
    let (of_set, of_scene) = ((&tracer, &some), (soup, accel));
    let found = if is_tree {
        Descent::of_tree(gpu, of_set, of_scene, exact)
    } else {
        Descent::of_division(gpu, of_set, of_scene, exact)
    };
    Ok(match found {
        Err(Absent::Failed(fault)) => Some(fault),
        _ => None,
    })
}

impl Descent {
    pub(super) fn of_tree(
        gpu: &Gpu,
        (tracer, set): (&Tracer, &RaySet),
        (soup, accel): (&TriangleSoup, &Variant),
        exact: bool,
    ) -> Result<Self, Absent> {
        let streams = RayHierarchy::streams(gpu, tracer, &set.rays)?;
        let order = RayHierarchy::order(gpu, tracer, &accel.params, &set.rays)?;
        let fault = RayHierarchy::fault_of_order(soup, &accel.params, (&set.rays, &order));
        if let Some(fault) = fault.map_err(|error| Absent::Failed(error.to_string()))? {
            return Err(Absent::Failed(fault));
        }
        let rays: Vec<_> = order.iter().map(|at| set.rays[*at as usize]).collect();
        // There is none of parts.
        let anatomy = Anatomy::new(soup, &accel.params, &rays).ok();
        let is_whole = streams.iter().all(|level| level.walked == 0);
        if let Some(anatomy) = anatomy.as_ref().filter(|_| exact && is_whole) {
            let twin = anatomy.levels.iter();
            let twin = twin.flat_map(|level| [level.pairs, level.longest]);
            // Nothing passes above the level that the descent begins at.
            let twin = twin.chain(std::iter::repeat(0));
            let device = streams.iter();
            agree(
                twin,
                device.flat_map(|level| [level.pairs, level.longest].map(u64::from)),
                ["pairs", "pairs in the longest stream"],
            )?;
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
            agree(pairs(&host.levels), pairs(&found), ["pairs"])?;
        }
        Ok(Self::Division { host, without_room })
    }
}

/// Compares these counts level by level.
fn agree<const N: usize>(
    twin: impl IntoIterator<Item = u64>,
    device: impl IntoIterator<Item = u64>,
    what: [&str; N],
) -> Result<(), Absent> {
    for (at, (twin, device)) in twin.into_iter().zip(device).enumerate() {
        let (level, what) = (at / N, what[at % N]);
        if twin != device {
            return Err(Absent::Failed(format!(
                "level {level} has {device} {what} on the device and {twin} in the scalar twin"
            )));
        }
    }
    Ok(())
}
