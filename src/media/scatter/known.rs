//! Known deposits on the device, with what has to be counted of them: a wrong count leaves every sum as it is.

use super::{Adding, Deposit, ScatterError, Strategy, Tallies, scatter_list, sums_in_f64};
use glam::Vec3;
use raystone_gpu::Gpu;

/// Voxels of the grid, and deposits of a list.
const CELLS: u32 = 4096;
const COUNT: u32 = 512;
/// Of a sum: units of whole numbers, and rounding.
const ROUNDING: f64 = 1e-3;
/// Invocations of a workgroup, and entries of the table that each has: `kernels/media/scatter/tiles.wesl`.
const LANES: usize = 64;
const ENTRIES: u32 = 256;

/// What is wrong with sums or counts of known deposits by a strategy. `None` if nothing is.
///
/// # Errors
/// As [`scatter_list`].
pub fn fault_of_strategy(gpu: &Gpu, strategy: Strategy) -> Result<Option<String>, ScatterError> {
    let deposit = |place: u32| Deposit {
        place,
        energy: Vec3::new(1.0, 0.5, 0.25),
        direction: Vec3::Z,
    };
    let apart: Vec<Deposit> = (0..COUNT).map(|k| deposit(k * 7)).collect();
    let together: Vec<Deposit> = (0..COUNT).map(|_| deposit(5)).collect();
    for (what, list, attempts) in [
        ("in voxels of their own", &apart, 0),
        ("in one voxel", &together, 0),
        ("in one voxel, each with two attempts", &together, 2),
    ] {
        let adding = Adding {
            attempts,
            ..Adding::new(strategy, COUNT)
        };
        let (sums, tallies, _) = scatter_list(gpu, adding, CELLS, list)?;
        let fault = fault_of_sums(&sums, list, &tallies).or_else(|| {
            let expected = retries(strategy, list, attempts, tallies.drops);
            let is_right =
                expected.contains(&tallies.retries) && tallies.deposits == u64::from(COUNT);
            (!is_right).then(|| format!("count {tallies:?}, and should retry {expected:?} times"))
        });
        if let Some(fault) = fault {
            return Ok(Some(format!(
                "{COUNT} deposits {what} by {strategy:?} {fault}"
            )));
        }
    }
    Ok(None)
}

/// Least and most retries. Numbers that are alone in their voxel swap at once; those that are given up have used all attempts. A
/// deposit to a table is one where its entry is another voxel's, of which there is one for each entry and workgroup.
fn retries(
    strategy: Strategy,
    list: &[Deposit],
    attempts: u32,
    drops: u64,
) -> std::ops::RangeInclusive<u64> {
    let is_alone = list.windows(2).all(|pair| pair[0].place != pair[1].place);
    let beyond_first = u64::from(attempts.max(1) - 1);
    let sums = 6 * u64::from(COUNT);
    match strategy {
        Strategy::Swap if is_alone => 0..=0,
        Strategy::Swap if attempts > 0 => drops * beyond_first..=sums * beyond_first,
        // Each can be beaten by every other one.
        Strategy::Swap => 0..=sums * u64::from(COUNT),
        Strategy::Tiles => {
            let beaten = list.chunks(LANES).map(|group| {
                let mut owners = vec![None; ENTRIES as usize];
                let mut is_beaten = |deposit: &Deposit| {
                    let hash = deposit.place.wrapping_mul(0x9e37_79b1) >> 16;
                    let owner = &mut owners[(hash % ENTRIES) as usize];
                    *owner.get_or_insert(deposit.place) != deposit.place
                };
                group
                    .iter()
                    .map(|deposit| u64::from(is_beaten(deposit)))
                    .sum::<u64>()
            });
            let beaten = beaten.sum();
            beaten..=beaten
        }
        _ => 0..=0,
    }
}

/// All energy is in its voxel or dropped.
fn fault_of_sums(sums: &[[f32; 6]], list: &[Deposit], tallies: &Tallies) -> Option<String> {
    let exact = sums_in_f64(CELLS, list);
    let energy = |sums: [f64; 6]| sums[..3].iter().sum::<f64>();
    let (mut kept, mut all) = (0.0, 0.0);
    for (place, (found, exact)) in sums.iter().zip(&exact).enumerate() {
        let found = found.map(f64::from);
        kept += energy(found);
        all += energy(*exact);
        let is_off = |k: usize| (found[k] - exact[k]).abs() > ROUNDING * exact[k].abs();
        if tallies.drops == 0 && (0..6).any(is_off) {
            return Some(format!(
                "leave {found:?} in voxel {place}, and should leave {exact:?}"
            ));
        }
    }
    let off = (kept + tallies.dropped - all).abs();
    (off > 2.0 * ROUNDING * all).then(|| {
        format!(
            "leave {kept} and drop {}, and should have {all} together",
            tallies.dropped
        )
    })
}
