//! Strategies of scatter against sums of the same deposits in f64.

use super::segments::adapter;
use crate::scatter::{Adding, Deposit, ScatterError, Strategy, Tallies, scatter_list, sums_in_f64};
use glam::Vec3;
use raystone_core::params::Choice as _;
use raystone_core::random::Pcg32;
use raystone_gpu::Gpu;

pub(super) const CELLS: u32 = 70_000;
/// The last voxel.
pub(super) const MOST: u32 = CELLS - 1;

/// Deposits of energies over four decades, a quarter of them in few voxels, in runs as photons make them.
pub(super) fn deposits(count: u32) -> Vec<Deposit> {
    let mut random = Pcg32::new(9);
    let deposit = |i: u32| {
        let place = match i % 4 {
            0 => random.below(7) as u32 * 9999,
            _ => random.below(CELLS as usize) as u32,
        };
        let scale = 10_f64.powf(-4.0 * random.uniform());
        let energy = (random.in_cube() * 0.5 + 0.5).as_vec3() * scale as f32;
        let direction = random.in_cube().normalize().as_vec3();
        Deposit {
            place,
            energy,
            direction,
        }
    };
    (0..count).map(deposit).collect()
}

/// The stated bound of a voxel's sum: half a unit for each deposit that is a whole number, 2^-23 of the sum of what is
/// added for each one that is a float, and the rounding of the result.
pub(super) fn bound(adding: &Adding, count: f64, sum_of_sizes: f64, largest: f64) -> f64 {
    let unit = largest.log2().ceil().exp2() / f64::from(1_u32 << adding.bits);
    let whole = match adding.strategy {
        Strategy::Swap | Strategy::Sort => count * sum_of_sizes * 2_f64.powi(-23),
        _ => 0.5 * count * unit,
    };
    // Energies and directions are multiplied in f32.
    whole + sum_of_sizes * 2_f64.powi(-22)
}

/// The first sum that is beyond its bound.
pub(super) fn first_wrong(
    gpu: &Gpu,
    adding: Adding,
    deposits: &[Deposit],
) -> Result<(Option<String>, Tallies), ScatterError> {
    let (found, tallies, _) = scatter_list(gpu, adding, CELLS, deposits)?;
    let exact = sums_in_f64(CELLS, deposits);
    let mut counts = vec![[0.0_f64; 2]; CELLS as usize];
    let mut largest = 0.0_f64;
    for deposit in deposits {
        let [count, size] = &mut counts[deposit.place as usize];
        *count += 1.0;
        *size += f64::from(deposit.energy.max_element());
        largest = largest.max(f64::from(deposit.energy.max_element()));
    }
    let wrong = (0..CELLS as usize).find_map(|cell| {
        let [count, size] = counts[cell];
        let bound = bound(&adding, count, size, largest);
        (0..6).find_map(|k| {
            let off = (f64::from(found[cell][k]) - exact[cell][k]).abs();
            (off > bound).then(|| {
                format!(
                    "{:?}: sum {k} of voxel {cell} is {} where f64 has {}, beyond {bound}",
                    adding.strategy, found[cell][k], exact[cell][k]
                )
            })
        })
    });
    Ok((wrong, tallies))
}

#[test]
fn sums_of_all_strategies_are_those_of_f64() {
    let Some(gpu) = adapter() else { return };
    let deposits = deposits(100_000);
    for strategy in Strategy::ALL.iter().copied() {
        let adding = Adding::new(strategy, 100_001);
        let (wrong, tallies) = first_wrong(&gpu, adding, &deposits).unwrap();
        println!("{strategy:?}: {tallies:?}");
        assert_eq!(wrong, None);
        assert_eq!((tallies.deposits, tallies.drops), (100_000, 0));
        assert_eq!((tallies.wraps, tallies.dropped), (0, 0.0));
    }
}

#[test]
fn attempts_that_are_used_up_drop_what_is_missing() {
    let Some(gpu) = adapter() else { return };
    // All in one voxel.
    let mut deposits = deposits(4096);
    for deposit in &mut deposits {
        deposit.place = 5;
    }
    let all: f64 = deposits
        .iter()
        .map(|d| f64::from(d.energy.element_sum()))
        .sum();
    let mut last = f64::INFINITY;
    for attempts in [1, 2, 4, 0] {
        let adding = Adding {
            attempts,
            ..Adding::new(Strategy::Swap, 0)
        };
        let (found, tallies, _) = scatter_list(&gpu, adding, CELLS, &deposits).unwrap();
        let kept: f64 = found[5][..3].iter().map(|v| f64::from(*v)).sum();
        println!("{attempts} attempts: {tallies:?}, kept {}", kept / all);
        // Nothing is lost that is not counted.
        assert!(
            (kept + tallies.dropped - all).abs() < 1e-4 * all,
            "{kept} and {tallies:?} of {all}"
        );
        assert!(tallies.dropped <= last);
        last = tallies.dropped;
        assert_eq!(tallies.drops > 0, tallies.dropped > 0.0);
        if attempts > 0 {
            assert!(tallies.retries <= 6 * 4096 * u64::from(attempts - 1));
        }
    }
    assert_eq!(last, 0.0);
}

#[test]
fn what_is_dropped_is_counted_beyond_a_word() {
    let Some(gpu) = adapter() else { return };
    let deposit = Deposit {
        place: 3,
        energy: Vec3::ONE,
        direction: Vec3::X,
    };
    // Each is 3 · 2¹⁶ units of what is dropped: a word holds 21,845 of them.
    let adding = Adding {
        bits: 24,
        ..Adding::new(Strategy::Sort, 1)
    };
    let (_, tallies, _) = scatter_list(&gpu, adding, CELLS, &vec![deposit; 50_001]).unwrap();
    assert_eq!((tallies.drops, tallies.dropped), (50_000, 150_000.0));
}

#[test]
fn numbers_that_go_round_are_counted_to_the_last() {
    let Some(gpu) = adapter() else { return };
    let deposit = Deposit {
        place: 3,
        energy: Vec3::new(1.0, 0.5, 0.25),
        direction: Vec3::new(-1.0, 0.0, 0.0),
    };
    let deposits = vec![deposit; 3000];
    let adding = Adding {
        bits: 24,
        ..Adding::new(Strategy::Fixed32, 0)
    };
    let (found, tallies, _) = scatter_list(&gpu, adding, CELLS, &deposits).unwrap();
    // 3,000, 1,500 and 750 of 256 times; of the direction 3,000 · 7/12 = 1,750 below zero: 7 times a span of 256.
    assert_eq!(tallies.wraps, 11 + 5 + 2 + 7, "{found:?}", found = found[3]);
    assert_eq!(found[3][0], 3000.0 - 11.0 * 256.0);
    // What is told can be undone, and two words need no such thing.
    let wide = Adding::new(Strategy::Fixed64, 0);
    let (found, tallies, _) = scatter_list(&gpu, wide, CELLS, &deposits).unwrap();
    assert_eq!(
        (found[3][..3].to_vec(), tallies.wraps),
        (vec![3000.0, 1500.0, 750.0], 0)
    );
    assert!((found[3][3] + 1750.0).abs() < 1e-3, "{:?}", found[3]);
}

#[test]
fn sums_below_zero_are_read_back_where_their_lower_word_is_zero() {
    let Some(gpu) = adapter() else { return };
    // 2²⁴ units each: 256 of them are the upper word alone.
    let deposit = Deposit {
        place: 3,
        energy: Vec3::ONE,
        direction: Vec3::NEG_X,
    };
    let adding = Adding::new(Strategy::Fixed64, 0);
    let (found, _, _) = scatter_list(&gpu, adding, CELLS, &vec![deposit; 256]).unwrap();
    assert_eq!(found[3], [256.0, 256.0, 256.0, -256.0, 0.0, 0.0]);
}

#[test]
fn what_cannot_be_added_is_refused_by_name() {
    let Some(gpu) = adapter() else { return };
    let some = deposits(8);
    let refused = |adding: Adding, deposits: &[Deposit]| {
        scatter_list(&gpu, adding, CELLS, deposits)
            .unwrap_err()
            .to_string()
    };
    let sound = Adding::new(Strategy::Fixed64, 0);
    let bits = Adding { bits: 25, ..sound };
    assert!(refused(bits, &some).contains("bits of a strategy is 25"));
    assert!(refused(Adding::new(Strategy::Sort, 0), &some).contains("capacity"));
    let changed = |change: fn(&mut Deposit)| {
        let mut list = some.clone();
        change(&mut list[2]);
        refused(sound, &list)
    };
    assert!(changed(|d| d.place = CELLS).contains("deposit 2 is for voxel 70000"));
    assert!(changed(|d| d.energy.y = f32::NAN).contains("finite"));
    assert!(changed(|d| d.energy.z = -1.0).contains("not negative"));
    assert!(changed(|d| d.direction *= 2.0).contains("length"));
    // A list that is too short says so, and what it dropped.
    let (_, tallies, _) = scatter_list(&gpu, Adding::new(Strategy::Sort, 5), CELLS, &some).unwrap();
    assert_eq!((tallies.deposits, tallies.drops), (8, 3));
    let scatter = crate::scatter::Scatter::new(&gpu, Adding::new(Strategy::Sort, 5), CELLS, 1.0);
    let full = scatter.unwrap().checked(tallies).unwrap_err().to_string();
    assert!(full.contains("5 deposits cannot take 8"), "{full}");
}
