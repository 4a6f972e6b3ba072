//! `meta-bvh`: a BVH over the instances above the BVHs of their objects, traversed in one loop over
//! both levels. Twin of `kernels/accel/meta_bvh.wesl`.
//!
//! Sources: the meta-BVH of J. Dufay's thesis (2017, §4.1.5), parts of instances in the upper level by
//! C. Benthin et al. (HPG 2017), see [`super::top`].

use super::super::bounds::Bounds;
use super::super::bvh::pairs::Pair;
use super::super::leaf::{FIRST_MASK, LEAF, leaf_reference};
use super::super::ray::Hit;
use super::super::tree::TreeParameters;
use super::super::twin::{CpuTwin, Query, Traverse, Twin};
use super::super::{AccelError, AccelKind, BuildLog, BuiltAccel, GpuBuffers, Space, TriangleSoup};
use super::instance::{Entry, NOTHING, is_open, leaf, level, near_and_far};
use super::top::Top;
use super::world_box::BoxMap;
use super::{Base, Upper, clamped, meta_bvh_nested};
use crate::accel::StructureStats;
use crate::parameters;
use crate::params::{ParameterSchema, Parameters as _, Params};

/// Stands for the size of the stack when an object was entered, outside of any.
const OUTSIDE: u32 = u32::MAX;

parameters! {
    /// The objects' trees, and what is above them.
    struct Options {
        /// The objects' trees.
        tree: TreeParameters;
        /// most entries of the upper level per instance; 0 and 1 open none
        rebraid: usize = 0, in 0..=8;
        /// one loop over both levels, or one inside the other
        r#loop: Loop = Loop::One;
    }

    /// How both levels are walked.
    enum Loop {
        /// In one loop.
        One = "one",
        /// One loop inside the other.
        Nested = "nested",
    }
}

/// The registry entry.
pub struct MetaBvh;

impl AccelKind for MetaBvh {
    fn name(&self) -> &'static str {
        "meta-bvh"
    }

    fn description(&self) -> &'static str {
        "BVH over the instances above those of their objects (Dufay 2017; re-braiding: Benthin 2017)"
    }

    fn parameters(&self) -> ParameterSchema {
        Options::schema()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let options = Options::from_params(params)?;
        let base = Base::build(soup, &options.tree, log)?;
        let rebraid = options.rebraid;
        check_entries(base.instances.len(), rebraid)?;
        let top = log.phase("upper level", || {
            Top::build(&base.instances, &base.forest, rebraid)
        });
        Ok(Box::new(Built {
            base,
            top,
            rebraid,
            nested: options.r#loop == Loop::Nested,
        }))
    }
}

/// Refuses more entries than references can address: like triangles, by `FIRST_MASK`.
fn check_entries(instances: usize, rebraid: usize) -> Result<(), AccelError> {
    let needed = instances as u64 * rebraid.max(1) as u64;
    let what = "entries of the upper level of a meta-bvh";
    AccelError::check_limit(what, needed, FIRST_MASK)
}

pub(super) struct Built {
    pub(super) base: Base,
    pub(super) top: Top,
    rebraid: usize,
    nested: bool,
}

impl Built {
    /// The root of the upper level, behind the nodes of all objects.
    pub(super) fn root(&self) -> u32 {
        self.base.forest.nodes.len() as u32
    }

    /// A node of either level.
    pub(super) fn node(&self, index: u32) -> &Pair {
        let objects = &self.base.forest.nodes;
        let index = index as usize;
        objects
            .get(index)
            .unwrap_or_else(|| &self.top.nodes[index - objects.len()])
    }

    /// The entry behind a leaf reference of the upper level.
    pub(super) fn load_entry(&self, reference: u32) -> &Entry {
        &self.top.entries[(reference & FIRST_MASK) as usize]
    }

    /// Stack entries of the upper level: one for each level at most.
    fn top_stack_entries(&self) -> u32 {
        self.top.depth.max(1)
    }

    /// Visits that no ray exceeds: every upper node once, and below every entry all of its object.
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
        let ensure = |holds, what: &dyn Fn() -> String| {
            AccelError::ensure(holds, || format!("upper level: {}", what()))
        };
        let first = self.root();
        let mut nodes = vec![false; self.top.nodes.len()];
        let mut entries = vec![false; self.top.entries.len()];
        let mut stack = vec![(first, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = stack.pop() {
            let place = index.wrapping_sub(first) as usize;
            let fits = depth <= self.top_stack_entries();
            ensure(fits, &|| format!("node {place} is deeper than the stack"))?;
            let is_new = nodes.get(place) == Some(&false);
            ensure(is_new, &|| {
                format!("node {place} is missing or reached twice")
            })?;
            nodes[place] = true;
            for (reference, bounds) in self.top.nodes[place].children() {
                if reference == NOTHING {
                    continue;
                }
                let what = || format!("node {place}: a child's box leaves its own");
                ensure(around.contains(&bounds), &what)?;
                if reference < LEAF {
                    stack.push((reference, bounds, depth + 1));
                    continue;
                }
                let entry = (reference & FIRST_MASK) as usize;
                let is_new = reference == leaf_reference(entry as u32, 1)
                    && entries.get(entry) == Some(&false);
                ensure(is_new, &|| {
                    format!("entry {entry} is missing or reached twice")
                })?;
                entries[entry] = true;
                let part = &self.top.entries[entry];
                let object_box = self.base.forest.nodes[part.node as usize].bounds();
                let map = &maps[part.instance as usize];
                let inside = bounds.contains(&map.world_box(&object_box));
                ensure(inside, &|| format!("entry {entry} sticks out of its box"))?;
                let grown = map.growth() <= self.top.growth;
                ensure(grown, &|| {
                    format!("entry {entry} needs more growth of boxes")
                })?;
            }
        }
        let all_reached = nodes.iter().chain(&entries).all(|seen| *seen);
        ensure(all_reached, &|| {
            "a node or entry is never reached".to_owned()
        })
    }

    /// Checks that the entries of each instance make up its object, each part once.
    fn validate_parts(&self) -> Result<(), AccelError> {
        let instances = &self.base.instances;
        let mut parts: Vec<Vec<u32>> = vec![Vec::new(); instances.len()];
        for (index, entry) in self.top.entries.iter().enumerate() {
            let instance = instances.get(entry.instance as usize);
            let expected = instance.map(|i| Entry::new(entry.instance, i, entry.node));
            AccelError::ensure(expected == Some(*entry), || {
                format!(
                    "entry {index} is not instance {} as it stands",
                    entry.instance
                )
            })?;
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
                AccelError::ensure(children.iter().all(|(child, _)| *child < LEAF), || {
                    format!("instance {index}: triangles below node {node} are in no entry")
                })?;
                stack.extend(children.map(|(child, _)| child));
            }
            let all = parts.len();
            AccelError::ensure(found == all, || {
                format!("instance {index}: {all} entries, of which {found} are parts of their own")
            })?;
        }
        Ok(())
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.base.validate(soup)?;
        self.validate_parts()?;
        self.validate_top()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let nodes = self.base.forest.nodes.len();
        let (objects, upper) = (self.base.forest.stack_entries(), self.top_stack_entries());
        // Nested loops have a stack each, of the same size.
        let (kernel, stack_entries) = match self.nested {
            true => ("accel/meta_bvh_nested", objects.max(upper)),
            false => ("accel/meta_bvh", objects + upper),
        };
        self.base.buffers(&Upper {
            kernel,
            parts: [
                bytemuck::cast_slice(&self.top.nodes),
                bytemuck::cast_slice(&self.top.entries),
            ],
            step_fuse: self.step_fuse(),
            entries: self.top.entries.len(),
            root: nodes,
            first_entry: nodes + self.top.nodes.len(),
            growth: self.top.growth,
            stack_entries,
        })
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn stats(&self) -> StructureStats {
        let forest = &self.base.forest;
        let below = forest.stats.depth.unwrap_or(0);
        StructureStats {
            bytes: self.buffers().bytes(),
            nodes: forest.stats.nodes + self.top.nodes.len() as u64,
            depth: Some(self.top.depth + below),
            ..forest.stats.clone()
        }
    }

    fn space(&self) -> Space {
        self.base.space()
    }

    fn update(&mut self, soup: &TriangleSoup) -> Option<Result<(), AccelError>> {
        Some(self.base.update(soup).map(|()| {
            self.top = Top::build(&self.base.instances, &self.base.forest, self.rebraid);
        }))
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, _: &TriangleSoup, mut query: Query) -> Hit {
        if self.nested {
            return meta_bvh_nested::trace(self, query);
        }
        let triangles = &self.base.forest.triangles;
        let tests = self.base.forest.intersection;
        let world = level(&query.ray, self.top.growth, tests);
        let mut stack: Vec<u32> = Vec::new();
        // The level that is traversed: the world, or the object that was entered with `floor` entries
        // on the stack.
        let (mut here, mut floor, mut first_id) = (world, OUTSIDE, 0);
        let mut current = self.root();
        loop {
            let children = near_and_far((current, self.node(current)), &here, &mut query);
            let mut next = NOTHING;
            for (enter, reference) in children {
                if !is_open(enter, &here, &query.hit) {
                    continue;
                }
                if floor != OUTSIDE && reference >= LEAF {
                    leaf(triangles, reference, first_id, &here, &mut query);
                    if query.is_answered() {
                        return query.hit;
                    }
                } else if next == NOTHING {
                    next = reference;
                } else if reference != NOTHING {
                    stack.push(reference);
                    query.count_stack(stack.len());
                }
            }
            if next == NOTHING {
                if stack.len() as u32 == floor {
                    (here, floor) = (world, OUTSIDE);
                }
                match stack.pop() {
                    Some(reference) => next = reference,
                    None => return query.hit,
                }
            }
            if floor == OUTSIDE && next >= LEAF {
                let entry = self.load_entry(next);
                here = level(&entry.object_ray(&query.ray), 0.0, tests);
                (floor, first_id, next) = (stack.len() as u32, entry.first_id, entry.node);
            }
            current = next;
        }
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
