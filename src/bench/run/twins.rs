//! Twins of structures on the host, and the coherence of the recorded rays through them.

use super::session::Session;
use super::world::World;
use crate::coherence::{Memory, of_rays, together};
use raystone_accel::{Access, BuildLog, CpuTwin, Space};
use raystone_config::{Axis, Cell, Coherence};
use raystone_record::{ClassCoherence, by_group};
use raystone_verify::rays::RaySet;

/// Something about the twin of a structure, which is built anew, and the memory that it reads.
pub(super) fn with_twin<T>(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    then: impl FnOnce(&mut Session, &dyn CpuTwin, &Memory) -> Result<T, String>,
) -> Result<T, String> {
    if !cell[Axis::Kernels].name.is_empty() {
        return Err("its twin is that of the embedded kernels".to_owned());
    }
    let accel = &cell[Axis::Accel];
    let kind = session.registries.accel.named("structure", &accel.name)?;
    let mut log = BuildLog::with_gpu(world.gpu);
    let built = (session.clock).time("build", || kind.build(&world.soup, &accel.params, &mut log));
    let built = built.map_err(|e| e.to_string())?;
    let twin = built.cpu_twin(&world.soup);
    let twin = twin.ok_or("it has no twin on the host")?;
    if matches!(built.access(), Access::Pipeline(passes) if !passes.counts_work()) {
        return Err("it answers rays together, and its twin one by one".to_owned());
    }
    let memory = Memory::new(&*built, &world.soup)?;
    then(session, &*twin, &memory)
}

/// Coherence of the recorded rays, in the order in which they are traced.
///
/// # Errors
/// The structure has no twin that tells what it reads, in words.
pub(super) fn of_recorded_rays(
    session: &mut Session,
    world: &World,
    (cell, space): (&Cell, Space),
    settings: &Coherence,
) -> Result<ClassCoherence, String> {
    let sets = &world.reference.of(space).sets;
    with_twin(session, world, cell, |session, twin, memory| {
        let timed: Vec<&RaySet> = sets.iter().filter(|set| set.is_timed()).collect();
        let of_set = |set: &&RaySet| of_rays(&set.rays, set.query(), (twin, memory), settings);
        let all = || timed.iter().map(of_set).collect::<Result<Vec<_>, _>>();
        let all = session.clock.time("coherence", all)?;
        let total = |groups: &Vec<_>| together(groups).into_values().next();
        let classes = timed.iter().zip(&all);
        Ok(ClassCoherence {
            settings: settings.clone(),
            classes: classes
                .map(|(set, groups)| (set.class, total(groups).unwrap_or_default()))
                .collect(),
            groups: all.iter().map(|groups| by_group(groups, 0)).collect(),
        })
    })
}
