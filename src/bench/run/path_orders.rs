//! Checks the order into which paths are sorted, before they are judged: wrong keys change times and nothing else.

use super::paths::Subject;
use super::session::Session;
use raystone_config::Axis;
use raystone_render::organisation::fault_of_order;
use raystone_render::{RenderJob, Traced};
use raystone_scene::SceneData;

/// Copies of each material, and by how many the next two triangles are further; without a common divisor.
const COPIES: usize = 100;
const STRIDE: usize = 37;
/// Triangles of which a structure is built at once.
const MOST_TRIANGLES: usize = 10_000;

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
    let scene = with_many_materials(&subject.stage.scene);
    let own = scene.map(|scene| subject.stage_of(session.registries, &scene));
    let own = own.transpose()?;
    let (stage, traced) = match &own {
        Some((stage, traced)) => (stage, traced),
        None => (subject.stage, traced),
    };
    let fault = || fault_of_order(subject.gpu, stage, traced, job);
    let found = session.clock.time("gate", fault);
    let found = found.map_err(|e| e.to_string())?;
    session.checked.integrators.insert(key, found.clone());
    Ok(found)
}

/// The scene with each of its materials many times, so that their numbers have more than one digit of the sort; `None` for a scene
/// whose structure would take long to build anew.
fn with_many_materials(scene: &SceneData) -> Option<SceneData> {
    let mut scene = Some(scene)
        .filter(|s| s.triangles.len() < MOST_TRIANGLES)?
        .clone();
    let count = scene.materials.len();
    scene.materials = vec![scene.materials; COPIES].concat();
    // Both triangles of a quad have the same: lights stay what they are.
    for (place, id) in scene.material_ids.iter_mut().enumerate() {
        *id += (count * (place / 2 * STRIDE % COPIES)) as u32;
    }
    Some(scene)
}
