//! The steps of a ray through a structure, with the memory fetches of each.

use super::memory::{Fetch, Memory};
use raystone_accel::watch::{Event, watch};
use raystone_accel::{Counters, CpuTwin, Query, Ray};

/// Kind of step.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Kind {
    /// A visit of a node or cell.
    Node,
    /// A triangle test.
    Triangle,
}

/// A visit or a test.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Step {
    /// Kind of step.
    pub kind: Kind,
    /// End of its fetches within the trace; they begin where the previous step's end.
    pub end: u32,
}

/// The traversal of one ray.
#[derive(Debug, Clone, Default, PartialEq, Eq)]
pub struct Trace {
    /// Steps in order.
    pub steps: Vec<Step>,
    /// Fetches of all steps.
    pub fetches: Vec<Fetch>,
}

impl Trace {
    /// Builds a trace from steps.
    pub fn of(steps: impl IntoIterator<Item = (Kind, Vec<Fetch>)>) -> Self {
        let mut trace = Self::default();
        for (kind, fetches) in steps {
            trace.fetches.extend(fetches);
            trace.end_step(kind);
        }
        trace
    }

    fn end_step(&mut self, kind: Kind) {
        let end = self.fetches.len() as u32;
        self.steps.push(Step { kind, end });
    }

    /// Fetches of a step.
    pub fn fetches_of(&self, step: usize) -> &[Fetch] {
        let first = match step.checked_sub(1) {
            Some(before) => self.steps[before].end,
            None => 0,
        };
        &self.fetches[first as usize..self.steps[step].end as usize]
    }

    /// Number of steps of a kind.
    pub fn count(&self, kind: Kind) -> u32 {
        self.steps.iter().filter(|step| step.kind == kind).count() as u32
    }
}

/// Traces a ray through this twin's structure. Reads belong to the next visit or test, or the last.
///
/// # Errors
/// The twin reads memory that the device lacks, or reports fewer steps than it counts.
pub fn trace_of(
    twin: &dyn CpuTwin,
    memory: &Memory,
    ray: &Ray,
    query: Query,
) -> Result<Trace, String> {
    let mut counters = Counters::default();
    let ((), events) = watch(|| match query {
        Query::Closest => drop(twin.closest_hit(ray, &mut counters)),
        Query::Any => drop(twin.any_hit(ray, &mut counters)),
    });
    let mut trace = Trace::default();
    for event in events {
        match event {
            Event::Read(read) => trace.fetches.push(memory.fetch(read)?),
            Event::Node(_) => trace.end_step(Kind::Node),
            Event::Triangle(_) => trace.end_step(Kind::Triangle),
            Event::Nearest(_) => {}
        }
    }
    let end = trace.fetches.len() as u32;
    if let Some(last) = trace.steps.last_mut() {
        last.end = end;
    }
    let told = [Kind::Node, Kind::Triangle].map(|kind| trace.count(kind));
    let counted = [counters.nodes, counters.triangle_tests];
    if told == counted {
        Ok(trace)
    } else {
        Err(format!(
            "its twin counts {} visits and {} tests of one ray, and tells {} and {}",
            counted[0], counted[1], told[0], told[1]
        ))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_step_has_its_own_fetches() {
        let fetch = |first| Fetch { first, bytes: 4 };
        let trace = Trace::of([
            (Kind::Node, vec![fetch(0), fetch(8)]),
            (Kind::Node, vec![]),
            (Kind::Triangle, vec![fetch(16)]),
        ]);
        assert_eq!(trace.fetches_of(0), [fetch(0), fetch(8)]);
        assert_eq!(trace.fetches_of(1), []);
        assert_eq!(trace.fetches_of(2), [fetch(16)]);
        assert_eq!([Kind::Node, Kind::Triangle].map(|k| trace.count(k)), [2, 1]);
    }
}
