//! The passes: rays to their places, a tree over them, and for each batch of primitives a descent.

use super::layout::{LEVELS, Layout};
use super::start::Sample;
use super::{Options, Order};
use crate::{TracePasses, TraceSteps};
use raystone_gpu::compaction::{Stays, Stream};
use raystone_gpu::{Bindings, Composition, GpuError, Groups, Pairs, Storage, UniformValues};

pub(super) struct Passes {
    pub options: Options,
    pub primitives: usize,
}

fn kernel(pass: &str) -> Composition {
    Composition::new(&format!("accel/ray_hierarchy/passes/{pass}"))
}

impl TracePasses for Passes {
    fn scratch(&self, rays: u32) -> Vec<(&'static str, u64)> {
        let layout = Layout::new(rays, self.primitives, &self.options);
        let [rays, nodes] = [layout.rays, layout.nodes()].map(u64::from);
        let pairs = 8 * u64::from(layout.capacity);
        let mut all = vec![
            ("hierarchy", 32 * rays + 48 * nodes),
            ("state", 4 * (4 * u64::from(LEVELS) + rays)),
            ("pair_groups", 16),
            ("pairs", pairs),
            ("next_pairs", pairs),
        ];
        if self.options.order != Order::Natural {
            all.extend([("ray_keys", 4 * rays), ("ray_places", 4 * rays)]);
        }
        if self.options.chooses_start() {
            let levels = layout.beginnings().count() as u64;
            all.extend([("met", 4 * levels), ("begin_groups", 16 * levels)]);
        }
        if self.options.chunks > 1 {
            let words = 4 * (self.primitives as u64).max(4);
            all.extend([("depth_keys", words), ("depth_order", words)]);
        }
        if !self.options.fused {
            let flags = ("flags", pairs / 2);
            all.extend([flags, ("kept_count", 16), ("candidate_count", 16)]);
        }
        all
    }

    fn record(&self, steps: &mut TraceSteps) -> Result<(), GpuError> {
        let layout = Layout::new(steps.count, self.primitives, &self.options);
        Descent {
            options: &self.options,
            layout,
            steps,
        }
        .record()
    }
}

/// The recorder of one trace.
struct Descent<'a, 'b> {
    options: &'a Options,
    layout: Layout,
    steps: &'a mut TraceSteps<'b>,
}

impl Descent<'_, '_> {
    fn record(mut self) -> Result<(), GpuError> {
        self.steps.clear("state")?;
        self.gather()?;
        self.build()?;
        if self.options.chunks > 1 {
            self.order_primitives()?;
        }
        if self.options.chooses_start() {
            self.choose_start()?;
        }
        let batch = self.layout.batch;
        let [_, coming] = self.layout.primitives[self.layout.primitives.len() - 1];
        for first in (0..coming).step_by(batch as usize) {
            if first > 0 && self.options.chunks > 1 {
                // Rays end at what they have hit.
                self.build()?;
            }
            self.descend(first, batch.min(coming - first))?;
        }
        let answers = kernel("answers");
        let groups = self.steps.groups(self.layout.rays);
        self.counted("answers", answers, groups)
    }

    /// The uniform `tree` for a level.
    fn at_level(&self, level: usize) -> Bindings {
        let first = self.layout.levels.get(level).map_or(0, |[first, _]| *first);
        let height = self.layout.height(level);
        let [primitive, many] = self.layout.primitives[height];
        let [primitive_below, many_below] = self.layout.primitives[height.saturating_sub(1)];
        let mut bindings = Bindings::new();
        let tree = UniformValues::new()
            .u32("rays", self.layout.rays)
            .u32("bundles", self.layout.levels[0][1])
            .u32("level", level as u32)
            .u32("first", first)
            .u32("expands", self.layout.expands(level))
            .u32("height", height as u32)
            .u32("primitive", primitive)
            .u32("many", many)
            .u32("primitive_below", primitive_below)
            .u32("many_below", many_below);
        bindings.uniform("tree", tree);
        bindings
    }

    fn run(
        &mut self,
        name: &str,
        kernel: Composition,
        groups: impl Into<Groups>,
        bindings: &Bindings,
    ) -> Result<(), GpuError> {
        self.steps.run(name, kernel, groups, bindings)
    }

    /// Runs a kernel that has to know how many rays there are.
    fn counted(
        &mut self,
        name: &str,
        kernel: Composition,
        groups: [u32; 3],
    ) -> Result<(), GpuError> {
        let bindings = self.at_level(0);
        self.steps.run_counted(name, kernel, groups, &bindings)
    }

    /// Brings rays to their places, sorted if so wanted.
    fn gather(&mut self) -> Result<(), GpuError> {
        let groups = self.steps.groups(self.layout.rays);
        if self.options.order != Order::Natural {
            self.counted("keys", kernel("keys"), groups)?;
            self.sort("ray_keys", "ray_places", self.layout.rays)?;
        }
        let gather = kernel("gather").feature("builds_tree", true);
        self.counted("gather", gather, groups)
    }

    /// Sorts pairs of words where they lie.
    fn sort(&mut self, keys: &str, values: &str, count: u32) -> Result<(), GpuError> {
        let pairs = Pairs {
            keys: self.steps.storage(keys)?,
            values: self.steps.storage(values)?,
            count,
        };
        // An even number of digits ends where it began.
        self.steps.sort(&pairs, 32).map(|_| ())
    }

    /// Builds the tree from the leaves up.
    fn build(&mut self) -> Result<(), GpuError> {
        for level in 0..self.layout.levels.len() {
            let (name, children) = match level {
                0 => ("leaves", self.options.bundle),
                _ => ("unions", self.options.branching),
            };
            let made = kernel(name)
                .feature("builds_tree", true)
                .constant("CHILDREN", children);
            let groups = self.steps.groups(self.layout.levels[level][1]);
            self.run(name, made, groups, &self.at_level(level))?;
        }
        Ok(())
    }

    fn order_primitives(&mut self) -> Result<(), GpuError> {
        let root = self.at_level(self.layout.levels.len() - 1);
        let [_, coming] = self.layout.primitives[self.layout.primitives.len() - 1];
        let groups = self.steps.groups(coming);
        self.run("depths", kernel("depths"), groups, &root)?;
        self.sort("depth_keys", "depth_order", coming)
    }

    /// Determines on the device which level has the workgroups to begin.
    fn choose_start(&mut self) -> Result<(), GpuError> {
        let [_, primitives] = self.layout.primitives[0];
        let sample = Sample::of(primitives);
        self.steps.clear("met")?;
        for level in self.layout.beginnings().skip(1) {
            let mut bindings = self.at_level(level);
            let pilot = UniformValues::new()
                .u32("stride", sample.stride)
                .u32("count", sample.count)
                .u32("place", (level - self.layout.lowest) as u32);
            bindings.uniform("pilot", pilot);
            let groups = (self.steps).groups(self.layout.levels[level][1] * sample.count);
            self.run("pilot", kernel("pilot"), groups, &bindings)?;
        }
        let choice = UniformValues::new()
            .u32("lowest", self.layout.lowest as u32)
            .u32("levels", self.layout.beginnings().count() as u32)
            .u32("sampled", sample.count)
            .u32("batch", self.layout.batch);
        let mut bindings = self.at_level(self.layout.begin);
        bindings.uniform("choice", choice);
        self.run("choose", kernel("choose"), [1, 1, 1], &bindings)
    }

    /// Workgroups that begin at a level.
    fn groups_to_begin(&self, level: usize, count: u32) -> Result<Groups, GpuError> {
        if !self.options.chooses_start() {
            let pairs = self.layout.levels[level][1] * count;
            return Ok(self.steps.groups(pairs).into());
        }
        let place = 16 * (level - self.layout.lowest) as u64;
        Ok(Groups::Indirect(self.steps.storage("begin_groups")?, place))
    }

    /// Descends with some primitives, level by level.
    fn descend(&mut self, first: u32, count: u32) -> Result<(), GpuError> {
        let begin = self.layout.begin;
        self.plan(begin + 1, false)?;
        let part = UniformValues::new().u32("first", first).u32("count", count);
        let mut pairs = self.steps.storage("pairs")?;
        let mut next = self.steps.storage("next_pairs")?;
        for level in (0..=begin).rev() {
            if self.layout.beginnings().contains(&level) {
                let mut bindings = self.at_level(level);
                bindings.uniform("part", part.clone());
                bindings.buffer("next_pairs", &pairs);
                let groups = self.groups_to_begin(level, count)?;
                self.run("begin", kernel("begin"), groups, &bindings)?;
            }
            let compacted = level < begin && !self.options.fused;
            let groups = self.plan(level, compacted)?;
            let mut bindings = self.at_level(level);
            bindings.buffer("pairs", &pairs);
            if level == 0 {
                return self.run("candidates", kernel("candidates"), groups, &bindings);
            }
            bindings.buffer("next_pairs", &next);
            let is_dual = self.layout.is_dual(level);
            let name = if is_dual { "expand both" } else { "expand" };
            let expand = kernel("expand")
                .feature("dual", is_dual)
                .constant("CHILDREN", self.layout.children(level));
            self.run(name, expand, groups, &bindings)?;
            if self.options.fused {
                std::mem::swap(&mut pairs, &mut next);
            } else {
                self.compact(&pairs, &next)?;
            }
        }
        Ok(())
    }

    /// Determines the workgroups of a level on the device.
    fn plan(&mut self, level: usize, compacted: bool) -> Result<Groups, GpuError> {
        // A kernel is known by its name.
        let name = match (compacted, self.layout.is_dual(level)) {
            (false, false) => "plan",
            (false, true) => "plan both",
            (true, false) => "plan compacted",
            (true, true) => "plan compacted both",
        };
        let plan = kernel("plan")
            .feature("compacted", compacted)
            .constant("CHILDREN", self.layout.children(level));
        self.run(name, plan, [1, 1, 1], &self.at_level(level))?;
        Ok(Groups::Indirect(self.steps.storage("pair_groups")?, 0))
    }

    /// Brings the children that are met side by side.
    fn compact(&mut self, pairs: &Storage, candidates: &Storage) -> Result<(), GpuError> {
        let stream = Stream {
            capacity: self.layout.capacity,
            element_bytes: 8,
            length: self.steps.storage("candidate_count")?,
            flags: self.steps.storage("flags")?,
            stays: Stays::All,
            elements: candidates.clone(),
            kept: pairs.clone(),
            count: self.steps.storage("kept_count")?,
        };
        self.steps.compact(self.options.compaction, &stream)
    }
}
