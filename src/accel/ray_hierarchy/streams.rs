//! What the device counts of the streams of a descent, and the order in which it has sorted the rays.

use super::layout::LEVELS;
use super::{Options, Order, RayHierarchy};
use crate::tracer::{RayBuffers, Tracer};
use crate::{AccelError, Ray, TriangleSoup};
use raystone_core::params::{Parameters as _, Params};
use raystone_gpu::{Gpu, GpuError, Recording, Storage};

/// Cells of the scene's longest side, and of the range of a component of a direction whose greatest is 1.
const CELLS: f64 = 64.0;
const DIRECTIONS: f64 = 8.0;
/// Part of a cell by which a place may round into the next.
const ROUNDING: f64 = 1e-3;

/// The streams of a level, counted by the device.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct StreamCounts {
    /// Pairs of a node and a primitive that met, of all batches of primitives.
    pub pairs: u32,
    /// Pairs of the longest stream.
    pub longest: u32,
    /// Pairs whose children had no room, which were answered at once.
    pub walked: u32,
}

impl RayHierarchy {
    /// Traces `rays` once, through one tree, and returns what the device counted of each level,
    /// leaves first; levels above the tree have zeros. `tracer` is that of a structure of this kind.
    ///
    /// # Errors
    /// The device is lost, hangs or has no room, or the structure is of another kind.
    pub fn streams(
        gpu: &Gpu,
        tracer: &Tracer,
        rays: &[Ray],
    ) -> Result<Vec<StreamCounts>, GpuError> {
        let words = trace_state(gpu, tracer, rays, LEVELS)?;
        let levels = words.as_chunks::<4>().0.iter().take(LEVELS as usize);
        let counts = levels.map(|[_, pairs, longest, walked]| StreamCounts {
            pairs: *pairs,
            longest: *longest,
            walked: *walked,
        });
        Ok(counts.collect())
    }

    /// Traces `rays` once and returns their places in the order of the tree over them; as they were given if they are not sorted.
    ///
    /// # Errors
    /// As [`RayHierarchy::streams`].
    pub fn order(
        gpu: &Gpu,
        tracer: &Tracer,
        params: &Params,
        rays: &[Ray],
    ) -> Result<Vec<u32>, GpuError> {
        let is_sorted = Options::from_params(params).is_ok_and(|o| o.order != Order::Natural);
        if !is_sorted {
            return Ok((0..rays.len() as u32).collect());
        }
        let mut places = trace_words(gpu, tracer, rays, ("ray_places", rays.len() as u64))?;
        places.truncate(rays.len());
        Ok(places)
    }

    /// What is wrong with the order of rays: they come by their places along a Morton curve or by a hash of these, and then by
    /// where they go, and each once. `None` if nothing is, or if they are not sorted.
    ///
    /// # Errors
    /// Unknown parameters.
    pub fn fault_of_order(
        soup: &TriangleSoup,
        params: &Params,
        (rays, order): (&[Ray], &[u32]),
    ) -> Result<Option<String>, AccelError> {
        let by = Options::from_params(params)?.order;
        let mut places = order.to_vec();
        places.sort_unstable();
        if !places.iter().copied().eq(0..rays.len() as u32) {
            return Ok(Some("sorting loses rays, or has some twice".to_owned()));
        }
        let key = |place: &u32| Some((*place, key(by, soup, &rays[*place as usize])?));
        let keys: Vec<(u32, u32)> = order.iter().filter_map(key).collect();
        let wrong = keys.windows(2).find(|pair| pair[0].1 > pair[1].1);
        Ok(wrong.filter(|_| by != Order::Natural).map(|pair| {
            format!(
                "in the order `{}` ray {} with the key {:#x} comes before ray {} with {:#x}",
                raystone_core::params::Choice::name(by),
                pair[0].0,
                pair[0].1,
                pair[1].0,
                pair[1].1
            )
        }))
    }
}

/// The key of a ray: the Morton code of its cell, x highest, or Teschner's hash of it modulo the greatest prime below 2¹⁶; then the
/// code of its direction in nine bits. `None` where rounding decides a cell, or for what is no ray.
fn key(by: Order, soup: &TriangleSoup, ray: &Ray) -> Option<u32> {
    if !ray.is_ray() {
        return None;
    }
    let bounds = soup.bounds();
    let longest = bounds.extent().into_iter().fold(0.0, f32::max);
    let cell = |at: f64, cells: f64| {
        let is_open = (at - at.round()).abs() < ROUNDING;
        (!is_open).then(|| at.clamp(0.0, cells - 1.0) as u32)
    };
    let most = ray
        .direction
        .into_iter()
        .fold(0.0, |a: f32, b| a.max(b.abs()));
    let (mut place, mut toward) = ([0; 3], [0; 3]);
    for axis in 0..3 {
        let off = f64::from(ray.origin[axis]) - f64::from(bounds.min[axis]);
        place[axis] = cell(CELLS * off / f64::from(longest), CELLS)?;
        let slope = f64::from(ray.direction[axis]) / f64::from(most);
        // The greatest component is 1 or −1.
        toward[axis] = match slope {
            1.0 => DIRECTIONS as u32 - 1,
            -1.0 => 0,
            slope => cell(0.5 * DIRECTIONS * (slope + 1.0), DIRECTIONS)?,
        };
    }
    let in_turn = |cells: [u32; 3], bits: u32| {
        let bits = (0..bits)
            .rev()
            .flat_map(|bit| cells.map(|cell| cell >> bit & 1));
        bits.fold(0, |key, bit| 2 * key + bit)
    };
    let first = match by {
        Order::Hash => {
            let primes = [73_856_093, 19_349_663, 83_492_791];
            let hash = |axis: usize| place[axis].wrapping_mul(primes[axis]);
            (hash(0) ^ hash(1) ^ hash(2)) % 65_521
        }
        _ => in_turn(place, 6),
    };
    Some(first << 9 | in_turn(toward, 3))
}

/// Traces `rays` once and returns the four words that the passes of a structure leave for each level: see `kernels/accel/found.wesl`.
pub(crate) fn trace_state(
    gpu: &Gpu,
    tracer: &Tracer,
    rays: &[Ray],
    levels: u32,
) -> Result<Vec<u32>, GpuError> {
    trace_words(gpu, tracer, rays, ("state", 4 * u64::from(levels)))
}

/// Traces `rays` once and returns so many words of a scratch buffer.
fn trace_words(
    gpu: &Gpu,
    tracer: &Tracer,
    rays: &[Ray],
    (name, words): (&str, u64),
) -> Result<Vec<u32>, GpuError> {
    let buffers = RayBuffers {
        rays: Storage::Own(gpu.storage("rays", rays)?),
        answers: Storage::Own(gpu.zeroed("answers", 16 * rays.len() as u64)?),
        status: Storage::Own(gpu.zeroed("status", 64)?),
    };
    let mut recording = Recording::new();
    tracer.record(&mut recording, &buffers, 0..rays.len() as u32)?;
    let state = Storage::scratch(&format!("trace {name}"), 4 * words);
    recording.download(name, state);
    gpu.play(&recording)?.download(name)
}
