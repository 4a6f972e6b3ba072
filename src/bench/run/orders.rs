//! Full cells rendered in pixel orders: time per sample, and time to the first picture.

use super::images::Estimator;
use super::reference_file::image_hash;
use super::session::Session;
use super::structures::Gated;
use super::world::World;
use raystone_config::{Axis, Cell};
use raystone_core::params::Choice as _;
use raystone_core::random::Pcg32;
use raystone_gpu::GpuError;
use raystone_record::OrderTime;
use raystone_render::{InOrder, Order, PartRenderer};
use raystone_stats::statistics::median_interval;

/// Measures each order in interleaved rounds by the wall clock, including submissions and waits;
/// empty if the experiment does not request it. `hash` is that of the single-pass image.
///
/// # Errors
/// The kernel does not compile, the device is lost, or an image differs.
pub(super) fn of_cell(
    session: &mut Session,
    world: &World,
    structure: &Gated,
    (cell, hash): (&Cell, &str),
) -> Result<Vec<OrderTime>, String> {
    let timing = session.experiment.timing;
    if !timing.orders {
        return Ok(Vec::new());
    }
    session.say(format!("{cell}: orders of pixels"));
    let text = |e: GpuError| e.to_string();
    let estimator = Estimator::new(session, cell, session.timed_samples())?;
    let gpu = world.device.of(&cell[Axis::Kernels]);
    let gpu = gpu.map_err(|e| e.to_string())?;
    let job = estimator.job(session, world.camera, structure.runtime_checks);
    let renderer = PartRenderer::new(gpu, &world.buffers, &structure.traced, &job).map_err(text)?;
    let of_image = (timing.spp, session.experiment.run.seed);
    let mut random = Pcg32::new(u64::from(session.experiment.run.seed));
    let mut turns: Vec<(Order, Vec<InOrder>)> = Order::ALL
        .iter()
        .map(|order| (*order, Vec::new()))
        .collect();
    // The first round warms up and checks the images.
    for round in 0..=timing.rounds {
        for left in (1..turns.len()).rev() {
            turns.swap(left, random.below(left + 1));
        }
        for (order, spent) in &mut turns {
            let mut first = Vec::new();
            let look = |renderer: &PartRenderer| {
                if round == 0 {
                    first.push(
                        order.fault_of_first(&renderer.sums()?, session.experiment.run.resolution),
                    );
                }
                Ok::<_, GpuError>(())
            };
            let render = || renderer.render(*order, of_image, look);
            let turn = session.clock.time("gpu", render).map_err(text)?;
            if round == 0 {
                first_fault(&first, &turn)?;
            }
            if round > 0 {
                spent.push(turn);
            } else if image_hash(&renderer.image(timing.spp).map_err(text)?) != hash {
                return Err(format!(
                    "taken in the order {}, its image is another",
                    order.name()
                ));
            }
        }
    }
    turns.sort_by_key(|(order, _)| Order::ALL.iter().position(|known| known == order));
    let spp = f64::from(timing.spp);
    let times = turns
        .iter()
        .map(|(order, turns)| of_turns(*order, turns, spp));
    Ok(times.collect())
}

/// There is one first picture, without a gap, and it is there before the last.
fn first_fault(first: &[Option<String>], turn: &InOrder) -> Result<(), String> {
    match first {
        [Some(fault)] => Err(fault.clone()),
        [None] if turn.first_picture.wall_ms <= turn.total.wall_ms => Ok(()),
        _ => Err(format!(
            "there are {} first pictures, the last after {} of {} ms",
            first.len(),
            turn.first_picture.wall_ms,
            turn.total.wall_ms
        )),
    }
}

/// The times of an order, of images with `spp` samples.
pub(super) fn of_turns(order: Order, turns: &[InOrder], spp: f64) -> OrderTime {
    let median =
        |ms: &dyn Fn(&InOrder) -> f64| median_interval(&turns.iter().map(ms).collect::<Vec<_>>());
    OrderTime {
        order: order.name().to_owned(),
        passes: turns.first().map_or(0, |turn| turn.passes),
        ms_per_spp: median(&|turn| turn.total.wall_ms / spp),
        first_picture_ms: median(&|turn| turn.first_picture.wall_ms),
    }
}
