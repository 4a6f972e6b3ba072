//! A set-associative LRU cache of lines.

use std::collections::{BTreeMap, HashMap};

/// Size and associativity of a cache.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct CacheShape {
    /// Number of lines.
    pub lines: u64,
    /// Lines per set; 0 for fully associative.
    pub ways: u64,
}

impl CacheShape {
    /// A cache of `bytes` bytes, at least one line.
    pub(crate) fn of_bytes(bytes: u64, line_bytes: u64, ways: u64) -> Self {
        let lines = (bytes / line_bytes).max(1);
        Self { lines, ways }
    }

    /// Number of sets and lines per set. Lines that do not fill a set are dropped.
    fn sets(self) -> (u64, usize) {
        match self.ways {
            0 => (1, self.lines as usize),
            ways => ((self.lines / ways).max(1), ways.min(self.lines) as usize),
        }
    }
}

/// Content of a cache. Line n belongs to set n modulo the number of sets.
#[derive(Debug, Clone)]
pub(crate) struct Cache {
    ways: usize,
    /// Time of last use of each cached line.
    used: HashMap<u64, u64>,
    /// Lines of each set by time of last use.
    sets: Vec<BTreeMap<u64, u64>>,
    time: u64,
}

impl Cache {
    pub(crate) fn new(shape: CacheShape) -> Self {
        let (sets, ways) = shape.sets();
        Self {
            ways,
            used: HashMap::new(),
            sets: vec![BTreeMap::new(); sets as usize],
            time: 0,
        }
    }

    /// Accesses a line; true for a hit. A miss replaces the least recently used line of the set.
    pub(crate) fn access(&mut self, line: u64) -> bool {
        self.time += 1;
        let set = (line % self.sets.len() as u64) as usize;
        let set = &mut self.sets[set];
        let before = self.used.insert(line, self.time);
        if let Some(before) = before {
            set.remove(&before);
        } else if set.len() == self.ways
            && let Some((_, oldest)) = set.pop_first()
        {
            self.used.remove(&oldest);
        }
        set.insert(self.time, line);
        before.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use raystone_core::random::Pcg32;

    /// Literal definition: each set a list, most recently used first.
    struct Naive(Vec<Vec<u64>>, usize);

    impl Naive {
        fn access(&mut self, line: u64) -> bool {
            let count = self.0.len() as u64;
            let set = &mut self.0[(line % count) as usize];
            let place = set.iter().position(|held| *held == line);
            place.map(|place| set.remove(place));
            set.insert(0, line);
            set.truncate(self.1);
            place.is_some()
        }
    }

    fn hits(shape: CacheShape, lines: &[u64]) -> Vec<bool> {
        let mut cache = Cache::new(shape);
        lines.iter().map(|line| cache.access(*line)).collect()
    }

    #[test]
    fn what_was_used_longest_ago_goes_and_not_what_came_first() {
        let two = CacheShape { lines: 2, ways: 0 };
        // 1 is reused, so 2 is evicted for 3; a FIFO would evict 1.
        let expected = [false, false, true, false, true, false];
        assert_eq!(hits(two, &[1, 2, 1, 3, 1, 2]), expected);
        // Two sets of one line: even and odd numbers.
        let direct = CacheShape { lines: 2, ways: 1 };
        let expected = [false, false, true, false, true, false];
        assert_eq!(hits(direct, &[2, 1, 2, 3, 2, 1]), expected);
    }

    #[test]
    fn it_is_the_naive_cache_for_any_size_and_associativity() {
        let mut random = Pcg32::new(5);
        // Near, far and sequential lines, to reach both ends of every cache.
        let lines: Vec<u64> = (0..4000_u64)
            .map(|i| match i % 3 {
                0 => random.below(12) as u64,
                1 => random.below(300) as u64,
                _ => i / 5,
            })
            .collect();
        for (lines_held, ways) in [
            (1, 0),
            (7, 0),
            (64, 0),
            (8, 1),
            (8, 2),
            (24, 3),
            (10, 4),
            (3, 8),
        ] {
            let shape = CacheShape {
                lines: lines_held,
                ways,
            };
            let (sets, of_set) = shape.sets();
            let mut naive = Naive(vec![Vec::new(); sets as usize], of_set);
            let expected: Vec<bool> = lines.iter().map(|line| naive.access(*line)).collect();
            assert_eq!(hits(shape, &lines), expected, "{shape:?}");
            let hits = expected.iter().filter(|hit| **hit).count();
            assert!(0 < hits && hits < lines.len(), "{shape:?}: {hits} hits");
        }
    }

    #[test]
    fn a_cache_that_holds_everything_misses_each_line_once() {
        let mut random = Pcg32::new(9);
        let lines: Vec<u64> = (0..1000).map(|_| random.below(200) as u64).collect();
        let unique: std::collections::BTreeSet<_> = lines.iter().collect();
        let all = hits(
            CacheShape {
                lines: 200,
                ways: 0,
            },
            &lines,
        );
        let hits = all.into_iter().filter(|hit| *hit).count();
        assert_eq!(hits, lines.len() - unique.len());
    }
}
