//! `object-list`: the instances one after the other, each with a world box and the BVH of its
//! object. CPU version of `kernels/accel/object_list.wesl`.
//!
//! Source: the per-object BVHs in an array of student path tracers, as analysed in §4.1.5 of J.
//! Dufay's thesis (2017), where the meta-BVH replaces the list.

use super::super::structure::prelude::*;
use super::super::tree::TreeParameters;
use super::instance::{Entry, enter_grown, level, trace_object};
use super::world_box::BoxMap;
use super::{Base, Layout, TwoLevel, Upper};
use bytemuck::{Pod, Zeroable};

/// The registry entry.
pub struct ObjectList;

impl Structure for ObjectList {
    const NAME: &'static str = "object-list";
    const DESCRIPTION: &'static str =
        "every instance in turn: world box, ray to object space, BVH of the object (Dufay 2017)";
    type Parameters = TreeParameters;

    fn build(soup: &TriangleSoup, tree: &TreeParameters, log: &mut BuildLog) -> BuildResult {
        let base = Base::build(soup, tree, log)?;
        TwoLevel::build(List::default(), base, "list", log)
    }
}

/// A world box: two `vec4<u32>`.
#[repr(C)]
#[derive(Debug, Clone, Copy, PartialEq, Pod, Zeroable)]
struct BoxWords {
    min: [f32; 3],
    unused_min: u32,
    max: [f32; 3],
    unused_max: u32,
}

impl BoxWords {
    fn new(Bounds { min, max }: Bounds) -> Self {
        Self {
            min,
            unused_min: 0,
            max,
            unused_max: 0,
        }
    }

    fn bounds(&self) -> Bounds {
        Bounds {
            min: self.min,
            max: self.max,
        }
    }
}

#[derive(Default)]
struct List {
    entries: Vec<Entry>,
    boxes: Vec<BoxWords>,
    growth: f32,
}

impl Upper for List {
    fn place(&mut self, base: &Base) {
        let (instances, roots) = (&base.instances, &base.forest.roots);
        let maps: Vec<BoxMap> = instances.iter().map(BoxMap::new).collect();
        let root = |index: usize| &roots[instances[index].object as usize];
        let entry = |i: usize| Entry::new(i as u32, &instances[i], root(i).nodes.start);
        let world_box = |i: usize| BoxWords::new(maps[i].world_box(&root(i).bounds));
        self.entries = (0..instances.len()).map(entry).collect();
        self.boxes = (0..instances.len()).map(world_box).collect();
        self.growth = maps.iter().map(BoxMap::growth).fold(0.0, f32::max);
    }

    fn validate(&self, base: &Base) -> Result<(), AccelError> {
        for (index, instance) in base.instances.iter().enumerate() {
            let root = &base.forest.roots[instance.object as usize];
            let expected = Entry::new(index as u32, instance, root.nodes.start);
            let map = BoxMap::new(instance);
            let listed = self.entries.get(index) == Some(&expected);
            let world_box = map.world_box(&root.bounds);
            let boxed = self.boxes.get(index).map(BoxWords::bounds);
            let boxed = boxed.is_some_and(|b| b.contains(&world_box));
            ensure!(
                listed && boxed,
                "instance {index} is not listed as it stands"
            );
            let (growth, needed) = (self.growth, map.growth());
            ensure!(
                needed <= growth,
                "instance {index}: boxes grow by {growth}, its transform needs {needed}"
            );
        }
        Ok(())
    }

    fn layout(&self, base: &Base) -> Layout<'_> {
        let nodes = base.forest.nodes.len();
        Layout {
            kernel: "accel/object_list",
            parts: [
                bytemuck::cast_slice(&self.entries),
                bytemuck::cast_slice(&self.boxes),
            ],
            step_fuse: nodes + 1,
            entries: self.entries.len(),
            root: 0,
            first_entry: nodes,
            growth: self.growth,
            stack_entries: base.forest.stack_entries(),
        }
    }

    fn boxes(&self) -> Vec<Bounds> {
        self.boxes.iter().map(BoxWords::bounds).collect()
    }

    fn figures(&self, objects: &StructureStats) -> StructureStats {
        objects.clone()
    }

    fn trace(&self, base: &Base, mut walk: Walk) -> Hit {
        let world = level(&walk.ray, self.growth, base.forest.intersection);
        for (entry, world_box) in self.entries.iter().zip(&self.boxes) {
            walk.counters.box_tests += 1;
            walk.read(world_box);
            if enter_grown(&world, &world_box.bounds(), walk.hit.t).is_none() {
                continue;
            }
            trace_object(&base.forest, entry, &mut walk);
            if walk.is_answered() {
                break;
            }
        }
        walk.hit
    }
}
