//! The units of a plan: what is measured as one, kept as one when a run is resumed, and given to one shard.

use super::axis::Axis;
use super::cells::Cell;
use super::experiment::Experiment;
use super::plan::Plan;
use serde::Serialize;
use std::collections::BTreeMap;
use std::fmt;
use std::str::FromStr;

/// What is measured of a unit.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash, Serialize)]
#[serde(rename_all = "kebab-case")]
pub enum UnitKind {
    /// Build, gate and speed of a structure.
    Structure,
    /// Speed of a ray caster of others.
    Peer,
    /// Error of a sampler.
    Sampler,
    /// Time of a full cell.
    Time,
    /// Coherence of a full cell, by a model.
    Coherence,
    /// A structure from frame to frame.
    Animation,
    /// Words of a sampler, and what drawing them costs.
    Stream,
    /// A compaction of a stream.
    Compaction,
}

impl UnitKind {
    /// All kinds, in the order in which a run takes them.
    pub const ALL: [Self; 8] = [
        Self::Structure,
        Self::Peer,
        Self::Sampler,
        Self::Time,
        Self::Coherence,
        Self::Animation,
        Self::Stream,
        Self::Compaction,
    ];

    /// What several of the kind are called.
    pub fn plural(self) -> &'static str {
        match self {
            Self::Structure => "structures",
            Self::Peer => "ray casters of others",
            Self::Sampler => "errors of samplers",
            Self::Time => "times of full cells",
            Self::Coherence => "models of coherence",
            Self::Animation => "animations",
            Self::Stream => "streams of samplers",
            Self::Compaction => "compactions",
        }
    }

    /// Whether clocks speak, so that figures of different machines must not meet.
    pub fn is_timed(self) -> bool {
        !matches!(self, Self::Sampler | Self::Coherence)
    }
}

/// What is measured as one.
#[derive(Debug, Clone, PartialEq)]
pub struct Unit {
    /// Its name, unique in the plan.
    pub name: String,
    /// What is measured.
    pub kind: UnitKind,
    /// Of what.
    pub cell: Cell,
}

impl Unit {
    fn new(kind: UnitKind, cell: &Cell) -> Self {
        Self {
            name: unit_name(kind, cell),
            kind,
            cell: cell.clone(),
        }
    }

    /// What units have in common that are measured in the same rounds, and so must not be torn apart: the rays of a
    /// world through all structures, the full cells with one sampler, all compactions.
    fn group(&self) -> (UnitKind, Cell) {
        let cell = &self.cell;
        match self.kind {
            UnitKind::Structure | UnitKind::Peer | UnitKind::Animation => {
                (UnitKind::Structure, cell.on(&Cell::WORLD))
            }
            UnitKind::Time | UnitKind::Coherence => {
                let mut axes = Cell::SAMPLER.to_vec();
                axes.retain(|axis| *axis != Axis::Kernels);
                (UnitKind::Time, cell.on(&axes))
            }
            UnitKind::Compaction => (self.kind, Cell::default()),
            UnitKind::Sampler | UnitKind::Stream => (self.kind, cell.clone()),
        }
    }
}

/// The name of a unit in records.
pub fn unit_name(kind: UnitKind, cell: &Cell) -> String {
    match kind {
        UnitKind::Coherence => format!("coherence of {cell}"),
        UnitKind::Animation => format!("animation of {cell}"),
        _ => cell.to_string(),
    }
}

impl Plan {
    /// Everything that is measured, in the order in which a run of one shard takes it: scene by scene, then what has none.
    pub fn units(&self, experiment: &Experiment) -> Vec<Unit> {
        let mut units = Vec::new();
        for scene in &self.scenes {
            let on = |cell: &&Cell| cell[Axis::Scene] == *scene;
            let mut add = |kind, cells: &[Cell]| {
                units.extend(cells.iter().filter(on).map(|cell| Unit::new(kind, cell)));
            };
            add(UnitKind::Structure, &self.structures);
            add(UnitKind::Peer, &self.peers);
            add(UnitKind::Sampler, &self.samplers);
            add(UnitKind::Time, &self.times);
            if experiment.coherence.is_some() {
                add(UnitKind::Coherence, &self.modelled(experiment));
            }
            if experiment.animation.is_some() {
                add(UnitKind::Animation, &self.structures);
            }
        }
        let further = [
            (UnitKind::Stream, &self.streams),
            (UnitKind::Compaction, &self.compactions),
        ];
        for (kind, cells) in further {
            units.extend(cells.iter().map(|cell| Unit::new(kind, cell)));
        }
        units
    }

    /// Full cells whose coherence is modelled: the model has organisations of its own, and knows no workgroups.
    pub fn modelled(&self, experiment: &Experiment) -> Vec<Cell> {
        let is_first = |cell: &Cell, axis| cell.get(axis) == experiment.axes[axis].first();
        let cells = self.times.iter();
        let cells =
            cells.filter(|c| is_first(c, Axis::Organisation) && is_first(c, Axis::Workgroup));
        cells.cloned().collect()
    }
}

/// One of several parts that a plan is divided into.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    pub number: usize,
    /// How many there are.
    pub of: usize,
}

/// Parts that a plan may be divided into.
const MOST_SHARDS: usize = 10_000;

impl FromStr for Shard {
    type Err = String;

    /// `3/8`: the third of eight.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text
            .split_once('/')
            .and_then(|(number, of)| Some((number.trim().parse().ok()?, of.trim().parse().ok()?)));
        match numbers {
            Some((number, of)) if (1..=of).contains(&number) && of <= MOST_SHARDS => {
                Ok(Self { number, of })
            }
            _ => Err(format!(
                "`{text}` is no shard: write K/N with 1 ≤ K ≤ N ≤ {MOST_SHARDS}, as in 3/8"
            )),
        }
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

/// The number of the shard that each unit belongs to, from 1. What is measured in the same rounds stays together; shards are runs of neighbours
/// in the plan, so that each loads few scenes, of about the same `cost` (any unit, not negative).
pub fn shards(units: &[Unit], of: usize, cost: impl Fn(&Unit) -> f64) -> Vec<usize> {
    let mut groups: BTreeMap<(UnitKind, String), usize> = BTreeMap::new();
    let mut costs: Vec<f64> = Vec::new();
    let mut group_of = Vec::with_capacity(units.len());
    for unit in units {
        let (kind, cell) = unit.group();
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

    #[test]
    fn shards_are_read_and_refused() {
        let shard = |text: &str| text.parse::<Shard>();
        assert_eq!(shard("3/8"), Ok(Shard { number: 3, of: 8 }));
        assert_eq!(shard("1/1").unwrap().to_string(), "1/1");
        for wrong in ["0/8", "9/8", "3", "/", "3/0", "-1/2", "1/99999999", "a/b"] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }

    fn sampler(name: &str) -> Unit {
        let variant = raystone_core::params::Variant {
            name: name.to_owned(),
            label: name.to_owned(),
            ..Default::default()
        };
        let cell = Cell::default()
            .with(Axis::Scene, &variant)
            .with(Axis::Sequence, &variant);
        Unit::new(UnitKind::Sampler, &cell)
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
        // A cost that outweighs all others stays alone.
        let heavy = shards(&units, 4, |unit| match unit.name.starts_with("s0,") {
            true => 300.0,
            false => 1.0,
        });
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
