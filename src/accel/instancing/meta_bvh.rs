//! `meta-bvh`: a BVH over the instances above the BVHs of their objects, traversed in one loop over
//! both levels. Twin of `kernels/accel/meta_bvh.wesl`.
//!
//! Sources: the meta-BVH of J. Dufay's thesis (2017, §4.1.5), parts of instances in the upper level by
//! C. Benthin et al. (HPG 2017), see [`super::top`].

use super::super::bounds::Bounds;
use super::super::leaf::{FIRST_MASK, LEAF, leaf_reference};
use super::super::ray::{Hit, NO_HIT, Ray};
use super::super::tree::tree_parameters;
use super::super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords, Space,
    TriangleSoup,
};
use super::forest::Node;
use super::instance::{Entry, NOTHING, is_open, leaf, level, near_and_far};
use super::meta_bvh_nested::NestedTwin;
use super::top::Top;
use super::world_box::BoxMap;
use super::{Base, clamped};
use crate::accel::StructureStats;
use crate::gpu::UniformValues;
use crate::params::{ParamRange, ParamValue, Parameter, ParameterSchema, Params};

/// Stands for the size of the stack when an object was entered, outside of any.
const OUTSIDE: u32 = u32::MAX;

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
        let mut parameters = tree_parameters();
        parameters.extend([
            Parameter {
                name: "rebraid",
                description: "most entries of the upper level per instance; 0 and 1 open none",
                default: ParamValue::Integer(0),
                range: ParamRange::Integer { min: 0, max: 8 },
            },
            Parameter {
                name: "loop",
                description: "one loop over both levels, or one inside the other",
                default: ParamValue::Name("one".to_owned()),
                range: ParamRange::Choice(&["one", "nested"]),
            },
        ]);
        parameters
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let params = &params.completed(&self.parameters())?;
        let base = Base::build(soup, params, log)?;
        let rebraid = params.integer("rebraid") as usize;
        check_entries(base.instances.len(), rebraid)?;
        let top = log.phase("upper level", || {
            Top::build(&base.instances, &base.forest, rebraid)
        });
        Ok(Box::new(MetaBvhTwin {
            base,
            top,
            rebraid,
            nested: params.name("loop") == "nested",
        }))
    }
}

/// Refuses more entries than references can address: like triangles, by `FIRST_MASK`.
fn check_entries(instances: usize, rebraid: usize) -> Result<(), AccelError> {
    let needed = instances as u64 * rebraid.max(1) as u64;
    if needed <= u64::from(FIRST_MASK) {
        return Ok(());
    }
    Err(AccelError::Limit {
        what: "entries of the upper level of a meta-bvh".into(),
        needed,
        limit: FIRST_MASK.into(),
    })
}

/// The built structure; it is its own CPU twin.
pub(super) struct MetaBvhTwin {
    pub(super) base: Base,
    pub(super) top: Top,
    rebraid: usize,
    nested: bool,
}

impl MetaBvhTwin {
    /// The root of the upper level, behind the nodes of all objects.
    pub(super) fn root(&self) -> u32 {
        self.base.forest.nodes.len() as u32
    }

    /// A node of either level.
    pub(super) fn node(&self, index: u32) -> &Node {
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

    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let triangles = &self.base.forest.triangles;
        let tests = self.base.forest.intersection;
        let ray = &tests.raised(ray);
        let world = level(ray, self.top.growth, tests);
        let mut hit = Hit::miss(ray);
        let mut stack: Vec<u32> = Vec::new();
        // The level that is traversed: the world, or the object that was entered with `floor` entries
        // on the stack.
        let (mut here, mut floor, mut first_id) = (world, OUTSIDE, 0);
        let mut current = self.root();
        loop {
            let children = near_and_far((current, self.node(current)), &here, hit.t, counters);
            let mut next = NOTHING;
            for (enter, reference) in children {
                if !is_open(enter, &here, &hit) {
                    continue;
                }
                if floor != OUTSIDE && reference >= LEAF {
                    leaf(triangles, reference, first_id, &here, &mut hit, counters);
                    if any && hit.triangle != NO_HIT {
                        return hit;
                    }
                } else if next == NOTHING {
                    next = reference;
                } else if reference != NOTHING {
                    stack.push(reference);
                    counters.stack_high_water = counters.stack_high_water.max(stack.len() as u32);
                }
            }
            if next == NOTHING {
                if stack.len() as u32 == floor {
                    (here, floor) = (world, OUTSIDE);
                }
                match stack.pop() {
                    Some(reference) => next = reference,
                    None => return hit,
                }
            }
            if floor == OUTSIDE && next >= LEAF {
                let entry = self.load_entry(next);
                here = level(&entry.object_ray(ray), 0.0, tests);
                (floor, first_id, next) = (stack.len() as u32, entry.first_id, entry.node);
            }
            current = next;
        }
    }

    /// Checks the tree of the upper level: boxes, and that every entry is reached once.
    fn validate_top(&self) -> Result<(), AccelError> {
        let maps: Vec<BoxMap> = self.base.instances.iter().map(BoxMap::new).collect();
        let invalid = |text: String| Err(AccelError::Invalid(format!("upper level: {text}")));
        let first = self.root();
        let mut nodes = vec![false; self.top.nodes.len()];
        let mut entries = vec![false; self.top.entries.len()];
        let mut stack = vec![(first, Bounds::EVERYTHING, 1)];
        while let Some((index, around, depth)) = stack.pop() {
            let place = index.wrapping_sub(first) as usize;
            if depth > self.top_stack_entries() {
                return invalid(format!("node {place} is deeper than the stack"));
            }
            if nodes.get(place) != Some(&false) {
                return invalid(format!("node {place} is missing or reached twice"));
            }
            nodes[place] = true;
            for (reference, bounds) in self.top.nodes[place].children() {
                if reference == NOTHING {
                    continue;
                }
                if !around.contains(&bounds) {
                    return invalid(format!("node {place}: a child's box leaves its own"));
                }
                if reference < LEAF {
                    stack.push((reference, bounds, depth + 1));
                    continue;
                }
                let entry = (reference & FIRST_MASK) as usize;
                if reference != leaf_reference(entry as u32, 1)
                    || entries.get(entry) != Some(&false)
                {
                    return invalid(format!("entry {entry} is missing or reached twice"));
                }
                entries[entry] = true;
                let part = &self.top.entries[entry];
                let object_box = self.base.forest.nodes[part.node as usize].bounds();
                let map = &maps[part.instance as usize];
                if !bounds.contains(&map.world_box(&object_box)) {
                    return invalid(format!("entry {entry} sticks out of its box"));
                }
                if map.growth() > self.top.growth {
                    return invalid(format!("entry {entry} needs more growth of boxes"));
                }
            }
        }
        match (nodes.iter().chain(&entries)).position(|seen| !seen) {
            Some(_) => invalid("a node or entry is never reached".to_owned()),
            None => Ok(()),
        }
    }

    /// Checks that the entries of each instance make up its object, each part once.
    fn validate_parts(&self) -> Result<(), AccelError> {
        let instances = &self.base.instances;
        let mut parts: Vec<Vec<u32>> = vec![Vec::new(); instances.len()];
        for (index, entry) in self.top.entries.iter().enumerate() {
            let instance = instances.get(entry.instance as usize);
            if instance.map(|i| Entry::new(entry.instance, i, entry.node)) != Some(*entry) {
                return Err(AccelError::Invalid(format!(
                    "entry {index} is not instance {} as it stands",
                    entry.instance
                )));
            }
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
                if children.iter().any(|(child, _)| *child >= LEAF) {
                    return Err(AccelError::Invalid(format!(
                        "instance {index}: triangles below node {node} are in no entry"
                    )));
                }
                stack.extend(children.map(|(child, _)| child));
            }
            if found != parts.len() {
                return Err(AccelError::Invalid(format!(
                    "instance {index}: {} entries, of which {found} are parts of their own",
                    parts.len()
                )));
            }
        }
        Ok(())
    }
}

impl BuiltAccel for MetaBvhTwin {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.base.validate(soup)?;
        self.validate_parts()?;
        self.validate_top()
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let forest = &self.base.forest;
        let nodes = bytemuck::cast_slice(&forest.nodes);
        let top = bytemuck::cast_slice(&self.top.nodes);
        let entries = bytemuck::cast_slice(&self.top.entries);
        let first_entry = forest.nodes.len() + self.top.nodes.len();
        let (objects, top_entries) = (forest.stack_entries(), self.top_stack_entries());
        // Nested loops have a stack each, of the same size.
        let (kernel, stack_entries) = match self.nested {
            true => ("accel/meta_bvh_nested", objects.max(top_entries)),
            false => ("accel/meta_bvh", objects + top_entries),
        };
        GpuBuffers {
            kernel,
            features: Vec::new(),
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: [nodes, top, entries].concat().into(),
                    element_bytes: 64,
                },
                NamedWords {
                    name: "leaf_triangles",
                    words: bytemuck::cast_slice(&forest.triangles).into(),
                    element_bytes: 48,
                },
            ],
            uniforms: vec![
                super::super::limits(self.step_fuse(), self.top.entries.len()),
                (
                    "instancing",
                    UniformValues::new()
                        .u32("root", self.root())
                        .u32("first_entry", first_entry as u32)
                        .f32("growth", self.top.growth),
                ),
            ],
            // Rounded up, so that scenes of like depth share a kernel.
            constants: vec![("STACK_ENTRIES", stack_entries.next_multiple_of(8))],
        }
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn stats(&self) -> StructureStats {
        let forest = &self.base.forest;
        let bytes = size_of_val(&forest.nodes[..])
            + size_of_val(&forest.triangles[..])
            + size_of_val(&self.top.nodes[..])
            + size_of_val(&self.top.entries[..]);
        let below = forest.stats.depth.unwrap_or(0);
        StructureStats {
            bytes: bytes as u64,
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

    fn cpu_twin<'a>(&'a self, _: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        if self.nested {
            Some(Box::new(NestedTwin(self)))
        } else {
            Some(Box::new(self))
        }
    }
}

impl CpuTwin for &MetaBvhTwin {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
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
