//! Shards of a plan.

use super::units::Unit;
use std::collections::BTreeMap;

/// Shard number of each unit, from 1. Units of the same rounds stay together; shards are contiguous
/// parts of the plan, so that each loads few scenes, with similar `cost` (any unit, not negative).
pub fn shards(units: &[Unit], of: usize, cost: impl Fn(&Unit) -> f64) -> Vec<usize> {
    let mut groups: BTreeMap<(&str, String), usize> = BTreeMap::new();
    let mut costs: Vec<f64> = Vec::new();
    let mut group_of = Vec::with_capacity(units.len());
    for unit in units {
        let (kind, cell) = unit.measurement.rounds_of(&unit.cell);
        let group = *groups.entry((kind, cell.identity())).or_insert(costs.len());
        if group == costs.len() {
            costs.push(0.0);
        }
        costs[group] += cost(unit).max(1e-9);
        group_of.push(group);
    }
    let all: f64 = costs.iter().sum();
    let mut before = 0.0;
    let shard = |cost: &f64| {
        let middle = before + cost / 2.0;
        before += cost;
        ((middle / all * of as f64) as usize).min(of.saturating_sub(1)) + 1
    };
    let shards: Vec<usize> = costs.iter().map(shard).collect();
    group_of.into_iter().map(|group| shards[group]).collect()
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::errors::Errors;
    use crate::run::measurement::Measurement;
    use raystone_config::{Axis, Cell};

    fn sampler(name: &str) -> Unit {
        let variant = raystone_core::params::Variant {
            name: name.to_owned(),
            label: name.to_owned(),
            ..Default::default()
        };
        let cell = Cell::default()
            .with(Axis::Scene, &variant)
            .with(Axis::Sequence, &variant);
        Unit {
            name: Errors.unit_name(&cell),
            measurement: &Errors,
            cell,
        }
    }

    #[test]
    fn every_unit_is_in_one_shard_and_costs_are_even() {
        let names: Vec<String> = (0..100).map(|i| format!("s{i}")).collect();
        let units: Vec<Unit> = names.iter().map(|name| sampler(name)).collect();
        let of = shards(&units, 8, |_| 1.0);
        assert!(of.is_sorted() && of.iter().all(|n| (1..=8).contains(n)));
        for number in 1..=8 {
            let count = of.iter().filter(|n| **n == number).count();
            assert!((12..=13).contains(&count), "{number}: {count}");
        }
        // A cost that outweighs all others gets its own shard.
        let heavy = |unit: &Unit| {
            if unit.name.starts_with("s0,") {
                300.0
            } else {
                1.0
            }
        };
        let heavy = shards(&units, 4, heavy);
        assert!(heavy.iter().all(|n| (1..=4).contains(n)));
        assert_eq!(shards(&units[..1], 8, |_| 1.0).len(), 1);
    }

    #[test]
    fn what_is_timed_in_the_same_rounds_stays_together() {
        let twice = [sampler("a"), sampler("b"), sampler("a")];
        let of = shards(&twice, 3, |_| 1.0);
        assert_eq!(of[0], of[2]);
    }
}
