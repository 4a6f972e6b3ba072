//! Lock-step execution of a warp's lanes.
//!
//! All lanes of a warp run one loop, and an instruction is issued for all active ones. A turn of
//! the loop has two parts: a node visit, by the lanes whose next step is one, and triangle tests.
//! Each is a separate issue, so a turn in which some lanes visit and others test counts twice.
//! Lanes without work in an issue, finished ones, and those without a ray wait. The [`Rule`]
//! determines how long a turn tests.

use super::trace::{Kind, Trace};
use raystone_config::Rule;

/// A step executed together by lanes of a warp.
#[derive(Debug, Clone, PartialEq, Eq)]
pub(crate) struct Issue {
    /// Kind of step.
    pub kind: Kind,
    /// Number of active lanes, at least one.
    pub active: u32,
    /// Bytes requested, counted per lane even if shared.
    pub bytes: u64,
    /// Distinct cache line indices, ascending.
    pub lines: Vec<u64>,
}

struct Lanes<'a> {
    traces: &'a [Option<Trace>],
    at: Vec<usize>,
    line_bytes: u64,
}

impl Lanes<'_> {
    /// Lanes whose next step is of this kind.
    fn next_is(&self, kind: Kind) -> Vec<usize> {
        let is_next = |lane: &usize| {
            let trace = self.traces[*lane].as_ref();
            let step = trace.and_then(|trace| trace.steps.get(self.at[*lane]));
            step.is_some_and(|step| step.kind == kind)
        };
        (0..self.traces.len()).filter(is_next).collect()
    }

    /// Advances these lanes by a step; `None` if there are none.
    fn issue(&mut self, kind: Kind, lanes: &[usize]) -> Option<Issue> {
        let mut issue = Issue {
            kind,
            active: lanes.len() as u32,
            bytes: 0,
            lines: Vec::new(),
        };
        for &lane in lanes {
            let Some(trace) = &self.traces[lane] else {
                continue;
            };
            for fetch in trace.fetches_of(self.at[lane]) {
                issue.bytes += u64::from(fetch.bytes);
                issue.lines.extend(fetch.lines(self.line_bytes));
            }
            self.at[lane] += 1;
        }
        issue.lines.sort_unstable();
        issue.lines.dedup();
        (!lanes.is_empty()).then_some(issue)
    }
}

/// All issues of a warp in order; a lane without a ray has no trace.
pub(crate) fn issues(traces: &[Option<Trace>], rule: Rule, line_bytes: u64) -> Vec<Issue> {
    let mut lanes = Lanes {
        traces,
        at: vec![0; traces.len()],
        line_bytes,
    };
    let mut issues = Vec::new();
    loop {
        let begin = issues.len();
        let visiting = lanes.next_is(Kind::Node);
        issues.extend(lanes.issue(Kind::Node, &visiting));
        // The tests see what the visit found, as the second `if` of Aila and Laine (2009) does.
        loop {
            let testing = lanes.next_is(Kind::Triangle);
            let issue = lanes.issue(Kind::Triangle, &testing);
            let ends = issue.is_none() || rule == Rule::IfIf;
            issues.extend(issue);
            if ends {
                break;
            }
        }
        if issues.len() == begin {
            return issues;
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::coherence::Fetch;
    use Kind::{Node, Triangle};

    /// A lane that fetches 4 bytes at each of these addresses, step by step.
    fn lane(steps: &[(Kind, u64)]) -> Option<Trace> {
        let fetch = |first| vec![Fetch { first, bytes: 4 }];
        Some(Trace::of(
            steps.iter().map(|(kind, at)| (*kind, fetch(*at))),
        ))
    }

    fn told(issues: &[Issue]) -> Vec<(Kind, u32, u64, Vec<u64>)> {
        let tell = |i: &Issue| (i.kind, i.active, i.bytes, i.lines.clone());
        issues.iter().map(tell).collect()
    }

    #[test]
    fn lanes_visit_together_and_wait_for_those_that_test() {
        // Lane 0 tests two triangles after its first node, lane 1 none; 2 has no ray, 3 ends early.
        let warp = [
            lane(&[(Node, 0), (Triangle, 64), (Triangle, 80), (Node, 16)]),
            lane(&[(Node, 0), (Node, 36)]),
            None,
            lane(&[(Node, 4), (Triangle, 64)]),
        ];
        let expected = vec![
            // Bytes 0, 0 and 4: one line of 16 bytes, and 12 bytes requested.
            (Node, 3, 12, vec![0]),
            (Triangle, 2, 8, vec![4]),
            (Triangle, 1, 4, vec![5]),
            (Node, 2, 8, vec![1, 2]),
        ];
        assert_eq!(told(&issues(&warp, Rule::Loop, 16)), expected);
        let expected = vec![
            (Node, 3, 12, vec![0]),
            (Triangle, 2, 8, vec![4]),
            // Lane 1 visits before lane 0 tests again: a turn of two issues.
            (Node, 1, 4, vec![2]),
            (Triangle, 1, 4, vec![5]),
            (Node, 1, 4, vec![1]),
        ];
        assert_eq!(told(&issues(&warp, Rule::IfIf, 16)), expected);
    }

    #[test]
    fn rays_that_begin_with_a_test_come_to_an_end() {
        let warp = [
            lane(&[(Triangle, 0), (Triangle, 4)]),
            lane(&[(Triangle, 0)]),
        ];
        for rule in [Rule::Loop, Rule::IfIf] {
            let active: Vec<u32> = issues(&warp, rule, 8).iter().map(|i| i.active).collect();
            assert_eq!(active, [2, 1], "{rule:?}");
        }
        assert!(issues(&[None, None], Rule::Loop, 8).is_empty());
    }
}
