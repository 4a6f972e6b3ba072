//! The order into which a wavefront brings its paths, against one computed from what their rays and hits are: where a sort only
//! brings like rays together, wrong keys change times, and neither hits nor images.

use super::queued::{Queues, Wavefront, begin_and_bounce};
use super::sorting;
use crate::passes::{ImageSteps, Passes};
use crate::slice::{Slice, job_uniform};
use crate::{RenderJob, Stage, Traced};
use raystone_accel::NO_HIT;
use raystone_gpu::{Gpu, GpuError, Played, Recording};

/// Rows of a path in `paths`, and those that hold its origin, its direction, and whether it is alive, in their last word:
/// `kernels/organisation/paths.wesl`.
const ROWS: usize = 7;
const ORIGIN: usize = 0;
const DIRECTION: usize = 1;
const ALIVE: usize = 5;
/// Cells of the scene's box along an axis, as a power of two.
const CELL_BITS: u32 = 7;
/// Part of a cell by which a place may round into the next.
const ROUNDING: f64 = 1e-3;
/// Paths of a dispatch, at most.
const PATHS: u32 = 4096;

/// What is wrong with the order of the paths of this job after a bounce: by octant and place before rays are traced, and by material
/// before they are shaded. `None` if nothing is.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub fn fault_of_order(
    gpu: &Gpu,
    stage: &Stage,
    traced: &Traced,
    job: &RenderJob,
) -> Result<Option<String>, GpuError> {
    let (played, live) = sorted(gpu, stage, traced, job)?;
    let queue: Vec<u32> = played.download("queue")?;
    let paths: Vec<[f32; 4]> = played.download("paths")?;
    let bounds = stage.buffers.bounds;
    if let Some(fault) = fault_of_rays(&queue[..live], &paths, bounds) {
        return Ok(Some(fault));
    }
    let order: Vec<u32> = played.download("order")?;
    let answers: Vec<[u32; 4]> = played.download("answers")?;
    let material = |triangle: u32| stage.scene.material_ids.get(triangle as usize).copied();
    let met: Vec<Option<u32>> = (answers[..live].iter())
        .map(|[_, triangle, ..]| {
            (*triangle != NO_HIT)
                .then_some(*triangle)
                .and_then(material)
        })
        .collect();
    Ok(fault_of_materials(&order[..live], &met))
}

/// One bounce, then both sorts; and how many paths are left.
fn sorted(
    gpu: &Gpu,
    stage: &Stage,
    traced: &Traced,
    job: &RenderJob,
) -> Result<(Played, usize), GpuError> {
    let [width, height] = job.size;
    let status = gpu.zeroed("status", 256)?;
    let sums = gpu.zeroed("accumulation", 16 * u64::from(width) * u64::from(height))?;
    let passes = Passes::new(gpu, &stage.buffers, traced, job, &status, [false; 2])?;
    let slice = Slice {
        rows: (PATHS / width).clamp(1, height),
        samples: 1,
        ..Slice::default()
    };
    let uniform = job_uniform(job, &stage.buffers);
    let mut recording = Recording::new();
    let (of_job, scratch) = ((width, &uniform), job.integrator.kind.scratch());
    let mut steps = ImageSteps::new(
        &passes,
        &mut recording,
        of_job,
        &slice,
        &sums,
        scratch,
        None,
    );
    let wavefront = Wavefront::default();
    let queues: Queues = begin_and_bounce(&mut steps, &wavefront, job.integrator.kind)?;
    sorting::by_ray(&mut steps, &queues)?;
    let download = |steps: &mut ImageSteps, name: &str| {
        let storage = queues.bindings.storage(name).cloned();
        storage.into_iter().for_each(|storage| {
            steps.recording().download(name, storage);
        });
    };
    for name in ["counts", "queue", "paths"] {
        download(&mut steps, name);
    }
    queues.trace_rays(&mut steps)?;
    let order = sorting::by_material(&mut steps, &queues)?;
    steps.recording().download("order", order);
    download(&mut steps, "answers");
    let played = gpu.play(&recording)?;
    let live = played.download::<u32>("counts")?[0] as usize;
    Ok((played, live))
}

/// Slots of live paths, each once, by the octants of their rays and the Morton codes of where these start in the scene.
fn fault_of_rays(queue: &[u32], paths: &[[f32; 4]], bounds: [[f32; 3]; 2]) -> Option<String> {
    let row = |slot: u32, row: usize| paths[ROWS * slot as usize + row];
    let alive = |slot: &u32| row(*slot, ALIVE)[3].to_bits() != 0;
    let mut slots = queue.to_vec();
    slots.sort_unstable();
    slots.dedup();
    let all = (0..(paths.len() / ROWS) as u32).filter(alive);
    if slots.len() != queue.len() || !slots.iter().copied().eq(all) {
        return Some("sorting by rays loses paths, or has some twice".to_owned());
    }
    let keys = queue.iter().map(|slot| {
        let [origin, direction] = [ORIGIN, DIRECTION].map(|at| row(*slot, at));
        key(origin, direction, bounds).map(|key| (*slot, key))
    });
    let keys: Vec<(u32, u32)> = keys.flatten().collect();
    let wrong = keys.windows(2).find(|pair| pair[0].1 > pair[1].1)?;
    Some(format!(
        "sorted by rays, the path in slot {} with the key {:#x} comes before that in slot {} with {:#x}: octant of the direction, \
         then Morton code of the origin",
        wrong[0].0, wrong[0].1, wrong[1].0, wrong[1].1
    ))
}

/// An octant, one bit for each negative component of the direction, x lowest; then, from the highest bits of the cells down, those
/// of z, y and x. `None` where rounding decides the cell.
fn key(origin: [f32; 4], direction: [f32; 4], [low, high]: [[f32; 3]; 2]) -> Option<u32> {
    let octant = (0..3).filter(|axis| direction[*axis] < 0.0);
    let octant: u32 = octant.map(|axis| 1 << axis).sum();
    let most = f64::from((1_u32 << CELL_BITS) - 1);
    let mut cells = [0_u32; 3];
    for (axis, cell) in cells.iter_mut().enumerate() {
        let [low, high, at] = [low[axis], high[axis], origin[axis]].map(f64::from);
        let place = (most + 1.0) * (at - low) / (high - low);
        if (place - place.round()).abs() < ROUNDING || place.is_nan() {
            return None;
        }
        *cell = place.clamp(0.0, most) as u32;
    }
    let mut key = octant;
    for bit in (0..CELL_BITS).rev() {
        for cell in cells.iter().rev() {
            key = 2 * key + (cell >> bit & 1);
        }
    }
    Some(key)
}

/// Places of answers, each once, by the materials that were met, and those of nothing last.
fn fault_of_materials(order: &[u32], met: &[Option<u32>]) -> Option<String> {
    let mut places = order.to_vec();
    places.sort_unstable();
    if !places.iter().copied().eq(0..met.len() as u32) {
        return Some("sorting by materials loses paths, or has some twice".to_owned());
    }
    let key = |place: u32| met[place as usize].unwrap_or(u32::MAX);
    let wrong = order.windows(2).find(|pair| key(pair[0]) > key(pair[1]))?;
    Some(format!(
        "sorted by materials, a path that met {:?} comes before one that met {:?}",
        met[wrong[0] as usize], met[wrong[1] as usize]
    ))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn orders_that_are_not_those_of_the_keys_are_told() {
        // Two paths: along (1, 1, 1) from the first cell, along (−1, 1, 1) from (3/4, 1/4, 0) of the box.
        let path = |origin: [f32; 3], x: f32| {
            let mut rows = [[0.0; 4]; ROWS];
            rows[ORIGIN][..3].copy_from_slice(&origin);
            rows[DIRECTION] = [x, 1.0, 1.0, 0.0];
            rows[ALIVE][3] = f32::from_bits(1);
            rows
        };
        let cell = 1.0 / 128.0;
        let paths = [
            path([0.5 * cell; 3], 1.0),
            path([96.5 * cell, 32.5 * cell, 0.5 * cell], -1.0),
            path([0.5 * cell, 0.5 * cell, 1.5 * cell], 1.0),
        ];
        let paths = paths.as_flattened();
        let bounds = [[0.0; 3], [1.0; 3]];
        let keys =
            [0, 1, 2].map(|slot: usize| key(paths[ROWS * slot], paths[ROWS * slot + 1], bounds));
        let (x, y) = (1 << 18 | 1 << 15, 1 << 16);
        assert_eq!(keys, [Some(0), Some(1 << 21 | x | y), Some(4)]);
        let fault = |queue: &[u32]| fault_of_rays(queue, paths, bounds);
        assert_eq!(fault(&[0, 2, 1]), None);
        for wrong in [&[2, 0, 1][..], &[0, 1, 2], &[0, 0, 1], &[0, 2]] {
            assert!(fault(wrong).is_some(), "{wrong:?}");
        }
        let met = [None, Some(3), Some(1)];
        assert_eq!(fault_of_materials(&[2, 1, 0], &met), None);
        for wrong in [[0, 2, 1], [1, 2, 0], [2, 2, 0]] {
            assert!(fault_of_materials(&wrong, &met).is_some(), "{wrong:?}");
        }
    }
}
