//! Warps on a machine: issues, the cache lines they need, and where these come from.
//!
//! A group of warps shares an L1; all groups share the L2. Each group's next warp issues once,
//! round-robin over groups and over the warps of a group. A warp executes its passes in order. Each
//! line of an issue is one L1 access; a miss is one L2 access, and a miss there goes to memory.
//! Both caches begin empty. Counts and derived figures: [`raystone_record::Tally`].

use super::cache::{Cache, CacheShape};
use super::simt::{Issue, issues};
use super::trace::{Kind, Trace};
use rayon::prelude::*;
use raystone_config::{Coherence, Rule};
use raystone_record::Tallies;
use std::collections::VecDeque;

/// The machine that executes warps.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Machine {
    /// Rule of turns within a warp.
    pub rule: Rule,
    /// Bytes of a cache line.
    pub line_bytes: u64,
    /// L1, one per group of warps.
    pub l1: CacheShape,
    /// L2, shared by all groups.
    pub l2: CacheShape,
}

/// Rays that the lanes of a warp trace together.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Pass {
    /// Ray class, the key of tallies.
    pub class: u32,
    /// One trace per lane; `None` for a lane without a ray.
    pub lanes: Vec<Option<Trace>>,
}

/// The passes of a warp.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Warp {
    /// Passes in order.
    pub passes: Vec<Pass>,
}

struct Queue {
    lanes: u64,
    issues: VecDeque<(u32, Issue)>,
}

impl Machine {
    /// The machine of an experiment's settings.
    pub fn new(settings: &Coherence) -> Self {
        let line_bytes = u64::from(settings.line_bytes);
        let cache = |kib: u32, ways: u32| {
            CacheShape::of_bytes(1024 * u64::from(kib), line_bytes, ways.into())
        };
        Self {
            rule: settings.rule,
            line_bytes,
            l1: cache(settings.l1_kib, settings.l1_ways),
            l2: cache(settings.l2_kib, settings.l2_ways),
        }
    }
}

impl Queue {
    /// The issues of a warp, and the tallies known in advance.
    fn new(warp: &Warp, machine: &Machine) -> (Self, Tallies) {
        let mut tallies = Tallies::new();
        let mut all = VecDeque::new();
        for pass in &warp.passes {
            let tally = tallies.entry(pass.class).or_default();
            for trace in pass.lanes.iter().flatten() {
                tally.rays += 1;
                tally.nodes += u64::from(trace.count(Kind::Node));
                tally.triangles += u64::from(trace.count(Kind::Triangle));
            }
            let issues = issues(&pass.lanes, machine.rule, machine.line_bytes);
            all.extend(issues.into_iter().map(|issue| (pass.class, issue)));
        }
        let lanes = warp
            .passes
            .first()
            .map_or(0, |pass| pass.lanes.len() as u64);
        (Self { lanes, issues: all }, tallies)
    }
}

/// Runs groups of warps on a machine; returns the total tallies.
pub fn run(machine: &Machine, groups: &[Vec<Warp>]) -> Tallies {
    together(&run_groups(machine, groups))
}

/// Sum of the tallies of groups.
pub fn together(groups: &[Tallies]) -> Tallies {
    let mut all = Tallies::new();
    for (class, tally) in groups.iter().flatten() {
        *all.entry(*class).or_default() += *tally;
    }
    all
}

/// Runs all groups of warps on a machine; returns the tallies of each.
pub(crate) fn run_groups(machine: &Machine, groups: &[Vec<Warp>]) -> Vec<Tallies> {
    Running::new(machine).then(groups)
}

/// A machine that runs groups after groups, those of one call side by side: its L2 keeps what earlier ones left.
pub struct Running {
    machine: Machine,
    l2: Cache,
}

impl Running {
    /// A machine with an empty L2.
    pub fn new(machine: &Machine) -> Self {
        Self {
            machine: *machine,
            l2: Cache::new(machine.l2),
        }
    }

    /// Runs these groups of warps; returns the tallies of each.
    pub fn then(&mut self, groups: &[Vec<Warp>]) -> Vec<Tallies> {
        let queue = |warp: &Warp| Queue::new(warp, &self.machine);
        let of_group = |warps: &Vec<Warp>| warps.par_iter().map(queue).collect::<Vec<_>>();
        let queues: Vec<_> = groups.par_iter().map(of_group).collect();
        let mut groups: Vec<(Cache, VecDeque<Queue>, Tallies)> = Vec::new();
        for of_group in queues {
            let (queues, tallies): (VecDeque<_>, Vec<_>) = of_group.into_iter().unzip();
            groups.push((Cache::new(self.machine.l1), queues, together(&tallies)));
        }
        while groups.iter().any(|(_, warps, _)| !warps.is_empty()) {
            for (l1, warps, tallies) in &mut groups {
                let Some((warp, (class, issue))) = next(warps) else {
                    continue;
                };
                let tally = tallies.entry(class).or_default();
                tally.issues += 1;
                tally.active += u64::from(issue.active);
                tally.lanes += warp.lanes;
                tally.bytes += issue.bytes;
                tally.lines += issue.lines.len() as u64;
                for line in issue.lines {
                    let is_near = l1.access(line);
                    tally.l1_hits += u64::from(is_near);
                    tally.l2_hits += u64::from(!is_near && self.l2.access(line));
                }
                warps.push_back(warp);
            }
        }
        groups.into_iter().map(|(_, _, tallies)| tallies).collect()
    }
}

/// The next warp of a group and its issue; drops finished warps.
fn next(warps: &mut VecDeque<Queue>) -> Option<(Queue, (u32, Issue))> {
    loop {
        let mut warp = warps.pop_front()?;
        if let Some(issue) = warp.issues.pop_front() {
            return Some((warp, issue));
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coherence::Fetch;
    use crate::coherence::known::{self, lane, machine, pass};
    use Kind::{Node, Triangle};
    use raystone_core::random::Pcg32;
    use raystone_record::Tally;

    #[test]
    fn two_groups_of_four_lanes_are_what_paper_and_pencil_say() {
        assert_eq!(known::found(), known::by_hand());
    }

    #[test]
    fn warps_of_a_group_take_turns_at_their_cache() {
        let warp = |at| Warp {
            passes: vec![pass(0, vec![lane(&[(Node, at), (Node, at)])])],
        };
        // Lines 0, 1, 0, 1 through a one-line cache; warps run one after the other would hit twice.
        let hits = |l1| run(&machine(16, [l1, 8]), &[vec![warp(0), warp(16)]])[&0].l1_hits;
        assert_eq!((hits(1), hits(2)), (0, 2));
    }

    /// Rays of a few steps at random addresses, some lanes without one.
    fn random_groups(random: &mut Pcg32) -> Vec<Vec<Warp>> {
        let mut some_lane = |_| {
            let count = random.below(12);
            let mut step = |_| {
                let kind = if random.below(3) == 0 { Triangle } else { Node };
                let first = 16 * random.below(400) as u64;
                (kind, vec![Fetch { first, bytes: 48 }])
            };
            let steps: Vec<_> = (0..count).map(&mut step).collect();
            (count > 0).then(|| Trace::of(steps))
        };
        let mut warp = |class| Warp {
            passes: vec![pass(class, (0..32).map(&mut some_lane).collect())],
        };
        (0..3).map(|_| (0..4).map(&mut warp).collect()).collect()
    }

    #[test]
    fn what_must_hold_of_any_rays_holds() {
        let mut random = Pcg32::new(11);
        for _ in 0..20 {
            let groups = random_groups(&mut random);
            let tallies = run(&machine(128, [16, 40]), &groups);
            let boundless = run(&machine(128, [1 << 20, 1 << 20]), &groups);
            let traces = groups.iter().flatten().flat_map(|w| &w.passes);
            let traces: Vec<&Trace> = traces.flat_map(|p| p.lanes.iter().flatten()).collect();
            let sum = |f: fn(&Tally) -> u64| tallies.values().map(f).sum::<u64>();
            let steps: usize = traces.iter().map(|t| t.steps.len()).sum();
            assert_eq!(sum(|t| t.active), steps as u64);
            assert_eq!(sum(|t| t.nodes + t.triangles), steps as u64);
            assert_eq!(sum(|t| t.lanes), 32 * sum(|t| t.issues));
            let fetches = traces.iter().flat_map(|t| &t.fetches);
            let bytes: u64 = fetches.clone().map(|f| u64::from(f.bytes)).sum();
            assert_eq!(sum(|t| t.bytes), bytes);
            let unique: std::collections::BTreeSet<u64> =
                fetches.clone().flat_map(|f| f.lines(128)).collect();
            assert!(bytes >= 48 && sum(|t| t.lines) >= unique.len() as u64);
            // An infinite cache misses each line once, per group and overall.
            let misses: u64 = boundless.values().map(Tally::misses).sum();
            assert_eq!(misses, unique.len() as u64);
            let l1_hits = |t: &std::collections::BTreeMap<u32, Tally>| {
                t.values().map(|t| t.l1_hits).sum::<u64>()
            };
            assert!(l1_hits(&tallies) < l1_hits(&boundless));
            // Each group has its own warps' issues; together they are the total.
            let of_groups = run_groups(&machine(128, [16, 40]), &groups);
            assert_eq!(together(&of_groups), tallies);
            for (tally, warps) in of_groups.iter().zip(&groups) {
                let passes = warps.iter().flat_map(|w| &w.passes);
                let own = passes.flat_map(|p| p.lanes.iter().flatten());
                let steps: usize = own.map(|t| t.steps.len()).sum();
                assert_eq!(tally.values().map(|t| t.active).sum::<u64>(), steps as u64);
            }
            // Swapping lanes has no effect, as they step together.
            let mut turned = groups.clone();
            let lanes = turned.iter_mut().flatten().flat_map(|w| &mut w.passes);
            lanes.for_each(|p| p.lanes.reverse());
            assert_eq!(run(&machine(128, [16, 40]), &turned), tallies);
            // Swapping between warps has.
            let mut mixed = groups.clone();
            for group in &mut mixed {
                let (a, b) = (
                    group[0].passes[0].lanes[5].take(),
                    group[1].passes[0].lanes[9].take(),
                );
                group[0].passes[0].lanes[5] = b;
                group[1].passes[0].lanes[9] = a;
            }
            assert_eq!(
                run(&machine(128, [16, 40]), &mixed)
                    .values()
                    .map(|t| t.active)
                    .sum::<u64>(),
                steps as u64
            );
        }
    }

    #[test]
    fn equal_rays_are_wholly_efficient_and_a_lonely_one_is_a_thirty_second() {
        let ray = || lane(&[(Node, 0), (Triangle, 64), (Node, 128), (Node, 320)]);
        let tally = |lanes: Vec<Option<Trace>>| {
            let warp = Warp {
                passes: vec![pass(0, lanes)],
            };
            run(&machine(128, [8, 8]), &[vec![warp]])[&0]
        };
        let equal = tally((0..32).map(|_| ray()).collect());
        assert_eq!((equal.efficiency(), equal.lines), (Some(1.0), 4));
        let mut lanes = vec![None; 32];
        lanes[17] = ray();
        let lonely = tally(lanes);
        assert_eq!((lonely.efficiency(), lonely.issues), (Some(1.0 / 32.0), 4));
    }
}
