//! Checks where rays begin that leave a surface, before paths are judged: a wrong bound shows on few surfaces.

use super::paths::Subject;
use super::session::Session;
use raystone_config::Axis;
use raystone_render::{RenderJob, offset};

/// What is wrong with the origins of rays on the scene of a subject, once per offset and kernels, with transforms and without.
pub(super) fn fault(
    session: &mut Session,
    subject: &Subject,
    job: &RenderJob,
) -> Result<Option<String>, String> {
    let scene = &subject.stage.buffers;
    let cell = subject.cell.on(&[Axis::Offset, Axis::Kernels]);
    let key = format!("offset, {cell}, {}", scene.features.transforms);
    if let Some(known) = session.checked.integrators.get(&key) {
        return Ok(known.clone());
    }
    let fault = || offset::fault_of_offset(subject.gpu, scene, job, subject.is_exact);
    let found = session.clock.time("gate", fault);
    let found = found.map_err(|e| e.to_string())?;
    session.checked.integrators.insert(key, found.clone());
    Ok(found)
}
