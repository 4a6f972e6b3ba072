//! Parts of a plan.

use super::axis::Axis;
use super::cells::Cell;
use super::experiment::Experiment;
use super::plan::Plan;
use std::fmt;
use std::str::FromStr;

impl Plan {
    /// Full cells with modelled coherence; the model ignores organisations and workgroups.
    pub fn modelled(&self, experiment: &Experiment) -> Vec<Cell> {
        let is_first = |cell: &Cell, axis| cell.get(axis) == experiment.axes[axis].first();
        let cells = self.times.iter();
        let cells = cells.filter(|c| {
            is_first(c, Axis::Organisation)
                && is_first(c, Axis::Workgroup)
                && is_first(c, Axis::Load)
        });
        cells.cloned().collect()
    }
}

/// One of several parts of a plan.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Shard {
    /// Its number, from 1.
    pub number: usize,
    /// Number of parts.
    pub of: usize,
}

const MOST_SHARDS: usize = 10_000;

impl FromStr for Shard {
    type Err = String;

    /// Parses `3/8`: the third of eight.
    fn from_str(text: &str) -> Result<Self, String> {
        let numbers = text.split_once('/');
        let numbers = numbers.and_then(|(k, n)| Some((k.parse().ok()?, n.parse().ok()?)));
        let shard = numbers.map(|(number, of)| Self { number, of });
        // No sign, no blank and no leading zero.
        let is_sound = |shard: &Self| {
            (1..=shard.of).contains(&shard.number)
                && shard.of <= MOST_SHARDS
                && shard.to_string() == text
        };
        shard.filter(is_sound).ok_or_else(|| {
            format!(
                "`{text}` is no shard: write K/N with 1 ≤ K ≤ N ≤ {MOST_SHARDS}, as in 3/8 for the third of eight"
            )
        })
    }
}

impl fmt::Display for Shard {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "{}/{}", self.number, self.of)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn shards_are_read_and_refused() {
        let shard = |text: &str| text.parse::<Shard>();
        assert_eq!(shard("3/8"), Ok(Shard { number: 3, of: 8 }));
        assert_eq!(shard("1/1").unwrap().to_string(), "1/1");
        for wrong in [
            "0/8",
            "9/8",
            "3",
            "/",
            "3/0",
            "-1/2",
            "1/99999999",
            "a/b",
            "+1/2",
            " 1/2",
            "1 /2",
            "01/2",
            "1/2/3",
        ] {
            assert!(shard(wrong).is_err(), "{wrong}");
        }
    }
}
