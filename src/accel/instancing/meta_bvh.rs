//! `meta-bvh`: a BVH over the instances above the BVHs of their objects, traversed in one loop over
//! both levels. CPU version of `kernels/accel/meta_bvh.wesl`.
//!
//! Sources: the meta-BVH of J. Dufay's thesis (2017, §4.1.5); parts of instances in the upper level
//! by C. Benthin et al. (HPG 2017), see [`super::top`].

use super::super::bvh::pairs::Pair;
use super::super::leaf::{FIRST_MASK, LEAF, leaf_reference};
use super::super::structure::prelude::*;
use super::super::tree::{Coverage, TreeParameters};
use super::instance::{Entry, NOTHING, is_open, leaf, level, near_and_far, object_level};
use super::top::Top;
use super::world_box::BoxMap;
use super::{Base, Layout, TwoLevel, Upper, clamped, meta_bvh_nested};

/// Replaces the stack size at object entry while outside any object.
const OUTSIDE: u32 = u32::MAX;

parameters! {
    /// The objects' trees, and what is above them.
    pub struct Options {
        /// The objects' trees.
        tree: TreeParameters;
        /// most entries of the upper level per instance; 0 and 1 open none
        rebraid: usize = 0, in 0..=8;
        /// one loop over both levels, or one inside the other
        r#loop: Loop = Loop::One;
    }

    /// How both levels are walked.
    pub enum Loop {
        /// In one loop.
        One = "one",
        /// One loop inside the other.
        Nested = "nested",
    }
}

/// The registry entry.
pub struct MetaBvh;

impl Structure for MetaBvh {
    const NAME: &'static str = "meta-bvh";
    const DESCRIPTION: &'static str = "BVH over the instances above those of their objects (Dufay 2017; re-braiding: Benthin 2017)";
    type Parameters = Options;

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        let base = Base::build(soup, &options.tree, log)?;
        let rebraid = options.rebraid;
        check_entries(base.instances.len(), rebraid)?;
        let upper = Instances {
            top: Top::default(),
            rebraid,
            nested: options.r#loop == Loop::Nested,
        };
        TwoLevel::build(upper, base, "upper level", log)
    }
}

/// Rejects more entries than references can address: as for triangles, by `FIRST_MASK`.
fn check_entries(instances: usize, rebraid: usize) -> Result<(), AccelError> {
    let needed = instances as u64 * rebraid.max(1) as u64;
    let what = "entries of the upper level of a meta-bvh";
    AccelError::check_limit(what, needed, FIRST_MASK, "set `rebraid` lower")
}

struct Instances {
    top: Top,
    rebraid: usize,
    nested: bool,
}

/// Both levels for the traversals.
#[derive(Clone, Copy)]
pub(super) struct Levels<'a> {
    pub base: &'a Base,
    pub top: &'a Top,
}

impl<'a> Levels<'a> {
    /// The root of the upper level, after the nodes of all objects.
    pub(super) fn root(&self) -> u32 {
        self.base.forest.nodes.len() as u32
    }

    pub(super) fn node(&self, index: u32) -> &'a Pair {
        let objects = &self.base.forest.nodes;
        let index = index as usize;
        objects
            .get(index)
            .unwrap_or_else(|| &self.top.nodes[index - objects.len()])
    }

    pub(super) fn load_entry(&self, reference: u32) -> &'a Entry {
        &self.top.entries[(reference & FIRST_MASK) as usize]
    }

    /// Upper bound on visits per ray: every upper node, and below every entry all of its object.
    fn step_fuse(&self) -> usize {
        let roots = &self.base.forest.roots;
        let below = self.top.entries.iter().map(|entry| {
            let instance = &self.base.instances[entry.instance as usize];
            roots[instance.object as usize].nodes.len() as u64
        });
        clamped(1 + self.top.nodes.len() as u64 + below.sum::<u64>())
    }

    /// Checks the tree of the upper level: boxes, and that every entry is reached once.
    fn validate_top(&self) -> Result<(), AccelError> {
        let maps: Vec<BoxMap> = self.base.instances.iter().map(BoxMap::new).collect();
        let (nothing, nodes) = (TriangleSoup::default(), self.top.nodes.len());
        // Entries are numbered after the nodes.
        let coverage = Coverage::new(&nothing, nodes + self.top.entries.len());
        coverage.descend(self.top.levels(), |coverage, index, around, below| {
            for (reference, bounds) in self.top.nodes[index].children() {
                if reference == NOTHING {
                    continue;
                }
                let inside = around.contains(&bounds);
                ensure!(inside, "a child's box leaves its own");
                if reference < LEAF {
                    let place = reference.wrapping_sub(self.root()) as usize;
                    ensure!(place < nodes, "there is no node {reference}");
                    below.push((place, bounds));
                    continue;
                }
                let entry = reference & FIRST_MASK;
                let is_one = reference == leaf_reference(entry, 1);
                ensure!(is_one, "the leaf of entry {entry} has others");
                coverage.node(nodes + entry as usize)?;
                let part = &self.top.entries[entry as usize];
                let object_box = self.base.forest.nodes[part.node as usize].bounds();
                let map = &maps[part.instance as usize];
                let inside = bounds.contains(&map.world_box(&object_box));
                ensure!(inside, "entry {entry} sticks out of its box");
                let grown = map.growth() <= self.top.growth;
                ensure!(grown, "entry {entry} needs more growth of boxes");
            }
            Ok(())
        })
    }

    /// Checks that the entries of each instance form its object, each part once.
    fn validate_parts(&self) -> Result<(), AccelError> {
        let instances = &self.base.instances;
        let mut parts: Vec<Vec<u32>> = vec![Vec::new(); instances.len()];
        for (index, entry) in self.top.entries.iter().enumerate() {
            let instance = instances.get(entry.instance as usize);
            let expected = instance.map(|i| Entry::new(entry.instance, i, entry.node));
            ensure!(
                expected == Some(*entry),
                "entry {index} is not instance {} as it stands",
                entry.instance
            );
            parts[entry.instance as usize].push(entry.node);
        }
        for (index, (instance, parts)) in instances.iter().zip(&mut parts).enumerate() {
            let root = &self.base.forest.roots[instance.object as usize];
            let mut stack = vec![root.nodes.start];
            let mut found = 0;
            parts.sort_unstable();
            while let Some(node) = stack.pop() {
                if parts.binary_search(&node).is_ok() {
                    found += 1;
                    continue;
                }
                let children = self.base.forest.nodes[node as usize].children();
                ensure!(
                    children.iter().all(|(child, _)| *child < LEAF),
                    "instance {index}: triangles below node {node} are in no entry"
                );
                stack.extend(children.map(|(child, _)| child));
            }
            let all = parts.len();
            ensure!(
                found == all,
                "instance {index}: {all} entries, of which {found} are parts of their own"
            );
        }
        Ok(())
    }
}

impl Upper for Instances {
    fn place(&mut self, base: &Base) {
        self.top = Top::build(&base.instances, &base.forest, self.rebraid);
    }

    fn validate(&self, base: &Base) -> Result<(), AccelError> {
        let top = &self.top;
        let levels = Levels { base, top };
        levels.validate_parts()?;
        let checked = levels.validate_top();
        checked.map_err(|e| AccelError::Invalid(format!("upper level: {e}")))
    }

    fn layout(&self, base: &Base) -> Layout<'_> {
        let top = &self.top;
        let (nodes, objects) = (base.forest.nodes.len(), base.forest.stack_entries());
        // Nested loops have a stack each, of the same size.
        let (kernel, stack_entries) = if self.nested {
            ("accel/meta_bvh_nested", objects.max(top.levels()))
        } else {
            ("accel/meta_bvh", objects + top.levels())
        };
        Layout {
            kernel,
            parts: [
                bytemuck::cast_slice(&top.nodes),
                bytemuck::cast_slice(&top.entries),
            ],
            step_fuse: Levels { base, top }.step_fuse(),
            entries: top.entries.len(),
            root: nodes,
            first_entry: nodes + top.nodes.len(),
            growth: top.growth,
            stack_entries,
        }
    }

    fn boxes(&self) -> Vec<Bounds> {
        let children = self.top.nodes.iter().flat_map(Pair::children);
        children.map(|(_, bounds)| bounds).collect()
    }

    fn figures(&self, objects: &StructureStats) -> StructureStats {
        StructureStats {
            nodes: objects.nodes + self.top.nodes.len() as u64,
            depth: Some(self.top.depth + objects.depth.unwrap_or(0)),
            ..objects.clone()
        }
    }

    fn trace(&self, base: &Base, walk: Walk) -> Hit {
        let top = &self.top;
        if self.nested {
            meta_bvh_nested::trace(Levels { base, top }, walk)
        } else {
            trace(Levels { base, top }, walk)
        }
    }
}

fn trace(levels: Levels, mut walk: Walk) -> Hit {
    let triangles = &levels.base.forest.triangles;
    let tests = levels.base.forest.intersection;
    let world = level(&walk.ray, levels.top.growth, tests);
    let mut stack: Vec<u32> = Vec::new();
    // The current level: the world, or the object entered with `floor` entries on the stack.
    let (mut here, mut floor, mut first_id) = (world, OUTSIDE, 0);
    let mut current = levels.root();
    loop {
        let children = near_and_far((current, levels.node(current)), &here, &mut walk);
        let mut next = NOTHING;
        for (enter, reference) in children {
            if !is_open(enter, &here, &walk.hit) {
                continue;
            }
            if floor != OUTSIDE && reference >= LEAF {
                leaf(triangles, reference, first_id, &here, &mut walk);
                if walk.is_answered() {
                    return walk.hit;
                }
            } else if next == NOTHING {
                next = reference;
            } else if reference != NOTHING {
                stack.push(reference);
                walk.count_stack(stack.len());
            }
        }
        if next == NOTHING {
            if stack.len() as u32 == floor {
                (here, floor) = (world, OUTSIDE);
            }
            match stack.pop() {
                Some(reference) => next = reference,
                None => return walk.hit,
            }
        }
        if floor == OUTSIDE && next >= LEAF {
            let entry = walk.read(levels.load_entry(next));
            here = object_level(entry, &walk.ray, tests);
            (floor, first_id, next) = (stack.len() as u32, entry.first_id, entry.node);
        }
        current = next;
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn more_entries_than_references_can_address_are_refused_with_both_numbers() {
        assert!(check_entries(1 << 23, 7).is_ok());
        let error = check_entries(1 << 23, 8).unwrap_err().to_string();
        assert!(
            error.contains("67108864") && error.contains("67108863"),
            "{error}"
        );
    }
}
