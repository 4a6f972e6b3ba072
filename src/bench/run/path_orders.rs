//! Checks the order into which paths are sorted, before they are judged: wrong keys change times and nothing else.

use super::paths::Subject;
use super::session::Session;
use raystone_config::Axis;
use raystone_render::organisation::fault_of_order;
use raystone_render::{RenderJob, Traced};

/// The organisation that sorts.
const SORTS: &str = "wavefront";

/// What is wrong with the order of the paths of a job by an organisation that can sort them, once per kernels.
pub(super) fn fault(
    session: &mut Session,
    subject: &Subject,
    traced: &Traced,
    job: &RenderJob,
) -> Result<Option<String>, String> {
    if subject
        .cell
        .get(Axis::Organisation)
        .is_none_or(|by| by.name != SORTS)
    {
        return Ok(None);
    }
    let key = format!("order of paths, {}", subject.cell.on(&[Axis::Kernels]));
    if let Some(known) = session.checked.integrators.get(&key) {
        return Ok(known.clone());
    }
    let fault = || fault_of_order(subject.gpu, subject.stage, traced, job);
    let found = session.clock.time("gate", fault);
    let found = found.map_err(|e| e.to_string())?;
    session.checked.integrators.insert(key, found.clone());
    Ok(found)
}
