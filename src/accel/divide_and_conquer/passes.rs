//! The passes: for each batch of rays all problems, level by level.

use super::Options;
use super::layout::Layout;
use crate::{TracePasses, TraceSteps};
use raystone_gpu::{Bindings, Composition, GpuError, Groups, Storage, UniformValues};

/// Kernels of `kernels/accel/divide_and_conquer/passes`.
pub(super) const NAMES: [&str; 9] = [
    "answer",
    "answers",
    "divide",
    "expand",
    "partition",
    "plan",
    "rays",
    "root",
    "triangles",
];

/// Bytes of a problem.
const PROBLEM_BYTES: u64 = 64;

pub(super) struct Passes {
    pub options: Options,
    pub triangles: u32,
}

impl TracePasses for Passes {
    fn scratch(&self, rays: u32) -> Vec<(&'static str, u64)> {
        let layout = Layout::new(rays, self.triangles, &self.options);
        let [problems, pairs] = [layout.problems, layout.capacity].map(u64::from);
        let slots = 8 * u64::from(self.triangles.max(2));
        let words = 4 * u64::from(self.options.levels) + u64::from(rays);
        vec![
            ("state", 4 * words),
            ("problems", PROBLEM_BYTES * problems),
            ("parts", PROBLEM_BYTES * problems),
            ("slots", slots),
            ("next_slots", slots),
            ("pairs", 8 * pairs),
            ("next_pairs", 8 * pairs),
            ("level_groups", 48),
        ]
    }

    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError> {
        let layout = Layout::new(steps.count, self.triangles, &self.options);
        let [now, next] = [
            ["problems", "slots", "pairs"],
            ["parts", "next_slots", "next_pairs"],
        ];
        let mut division = Division {
            levels: self.options.levels,
            triangles: self.triangles,
            layout,
            now: Level::new(steps, now)?,
            next: Level::new(steps, next)?,
            steps,
        };
        division.steps.clear("state")?;
        for first in (0..division.steps.count.max(1)).step_by(layout.batch as usize) {
            division.batch(first)?;
        }
        let groups = division.steps.groups(division.steps.count);
        let answers = kernel("answers");
        division
            .steps
            .run_counted("answers", answers, groups, &Bindings::new())
    }
}

fn kernel(pass: &str) -> Composition {
    Composition::new(&format!("accel/divide_and_conquer/passes/{pass}"))
}

/// The buffers of a level.
#[derive(Clone)]
struct Level {
    problems: Storage,
    slots: Storage,
    pairs: Storage,
}

impl Level {
    fn new(steps: &TraceSteps, [problems, slots, pairs]: [&str; 3]) -> Result<Self, GpuError> {
        Ok(Self {
            problems: steps.storage(problems)?,
            slots: steps.storage(slots)?,
            pairs: steps.storage(pairs)?,
        })
    }
}

/// The recorder of one trace.
struct Division<'a, 'b> {
    levels: u32,
    triangles: u32,
    layout: Layout,
    now: Level,
    next: Level,
    steps: &'a mut TraceSteps<'b>,
}

impl Division<'_, '_> {
    /// All levels for a batch of rays.
    fn batch(&mut self, first: u32) -> Result<(), GpuError> {
        let count = self
            .layout
            .batch
            .min(self.steps.count - first.min(self.steps.count));
        let part = [first, count];
        let over_triangles = self.steps.groups(self.triangles.max(1));
        let over_rays = self.steps.groups(count);
        self.run("root", [1, 1, 1], 0, part)?;
        self.run("triangles", over_triangles, 0, part)?;
        let rays = self.at_level(0, part);
        self.steps
            .run_counted("rays", kernel("rays"), over_rays, &rays)?;
        for level in 0..self.levels {
            std::mem::swap(&mut self.now, &mut self.next);
            self.run("plan", [1, 1, 1], level, part)?;
            let planned = self.steps.storage("level_groups")?;
            let [problems, slots, pairs] =
                [0, 12, 24].map(|at| Groups::Indirect(planned.clone(), at));
            self.run("divide", problems, level, part)?;
            self.run("answer", pairs.clone(), level, part)?;
            if level + 1 < self.levels {
                self.run("partition", slots, level, part)?;
                self.run("expand", pairs, level, part)?;
            }
        }
        Ok(())
    }

    fn run(
        &mut self,
        name: &str,
        groups: impl Into<Groups>,
        level: u32,
        part: [u32; 2],
    ) -> Result<(), GpuError> {
        let bindings = self.at_level(level, part);
        self.steps.run(name, kernel(name), groups, &bindings)
    }

    /// The uniform and the buffers of a level, for a batch of rays.
    fn at_level(&self, level: u32, [first, count]: [u32; 2]) -> Bindings {
        let [x, y, _] = self.steps.groups(self.triangles.max(1));
        let uniform = UniformValues::new()
            .u32("level", level)
            .u32("expands", self.layout.expands)
            .u32("first", first)
            .u32("count", count)
            .u32("groups_x", x)
            .u32("groups_y", y);
        let mut bindings = Bindings::new();
        bindings
            .uniform("level", uniform)
            .buffer("problems", &self.now.problems)
            .buffer("parts", &self.next.problems)
            .buffer("slots", &self.now.slots)
            .buffer("next_slots", &self.next.slots)
            .buffer("pairs", &self.now.pairs)
            .buffer("next_pairs", &self.next.pairs);
        bindings
    }
}
