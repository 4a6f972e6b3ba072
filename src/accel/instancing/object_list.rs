//! `object-list`: the instances one after the other, each with a world box and the BVH of its object.
//! Twin of `kernels/accel/object_list.wesl`.
//!
//! Source: the per-object BVHs in an array of student path tracers, as analysed in §4.1.5 of
//! J. Dufay's thesis (2017), where the meta-BVH replaces the list.

use super::super::bounds::Bounds;
use super::super::ray::{Hit, NO_HIT, Ray};
use super::super::tree::tree_parameters;
use super::super::{
    AccelError, AccelKind, BuildLog, BuiltAccel, Counters, CpuTwin, GpuBuffers, NamedWords, Space,
    TriangleSoup,
};
use super::Base;
use super::instance::{Entry, enter_grown, level, trace_object};
use super::world_box::BoxMap;
use crate::accel::StructureStats;
use crate::gpu::UniformValues;
use crate::params::{ParameterSchema, Params};
use bytemuck::{Pod, Zeroable};

/// The registry entry.
pub struct ObjectList;

impl AccelKind for ObjectList {
    fn name(&self) -> &'static str {
        "object-list"
    }

    fn description(&self) -> &'static str {
        "every instance in turn: world box, ray to object space, BVH of the object (Dufay 2017)"
    }

    fn parameters(&self) -> ParameterSchema {
        tree_parameters()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let params = &params.completed(&self.parameters())?;
        let base = Base::build(soup, params, log)?;
        let mut built = Built {
            base,
            entries: Vec::new(),
            boxes: Vec::new(),
            growth: 0.0,
        };
        log.phase("list", || built.list());
        Ok(Box::new(built))
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

struct Built {
    base: Base,
    entries: Vec<Entry>,
    /// World box of each entry.
    boxes: Vec<BoxWords>,
    growth: f32,
}

impl Built {
    /// Lists the instances as they stand.
    fn list(&mut self) {
        let instances = &self.base.instances;
        let roots = &self.base.forest.roots;
        let maps: Vec<BoxMap> = instances.iter().map(BoxMap::new).collect();
        let root = |index: usize| &roots[instances[index].object as usize];
        let entry = |i: usize| Entry::new(i as u32, &instances[i], root(i).nodes.start);
        let world_box = |i: usize| BoxWords::new(maps[i].world_box(&root(i).bounds));
        self.entries = (0..instances.len()).map(entry).collect();
        self.boxes = (0..instances.len()).map(world_box).collect();
        self.growth = maps.iter().map(BoxMap::growth).fold(0.0, f32::max);
    }
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.base.validate(soup)?;
        for (index, instance) in self.base.instances.iter().enumerate() {
            let root = &self.base.forest.roots[instance.object as usize];
            let expected = Entry::new(index as u32, instance, root.nodes.start);
            let map = BoxMap::new(instance);
            let listed = self.entries.get(index) == Some(&expected);
            let world_box = map.world_box(&root.bounds);
            let boxed = self.boxes.get(index).map(BoxWords::bounds);
            if !listed || !boxed.is_some_and(|b| b.contains(&world_box)) {
                return Err(AccelError::Invalid(format!(
                    "instance {index} is not listed as it stands"
                )));
            }
            if map.growth() > self.growth {
                return Err(AccelError::Invalid(format!(
                    "instance {index}: boxes grow by {}, its transform needs {}",
                    self.growth,
                    map.growth()
                )));
            }
        }
        Ok(())
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let forest = &self.base.forest;
        let nodes = bytemuck::cast_slice(&forest.nodes);
        let entries = bytemuck::cast_slice(&self.entries);
        let boxes = bytemuck::cast_slice(&self.boxes);
        GpuBuffers {
            kernel: "accel/object_list",
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: [nodes, entries, boxes].concat().into(),
                    element_bytes: 64,
                },
                NamedWords {
                    name: "leaf_triangles",
                    words: bytemuck::cast_slice(&forest.triangles).into(),
                    element_bytes: 48,
                },
            ],
            uniforms: vec![
                super::super::limits(forest.nodes.len() + 1, self.entries.len()),
                (
                    "instancing",
                    UniformValues::new()
                        .u32("root", 0)
                        .u32("first_entry", forest.nodes.len() as u32)
                        .f32("growth", self.growth),
                ),
            ],
            constants: vec![("STACK_ENTRIES", forest.stack_entries().next_multiple_of(8))],
            ..Default::default()
        }
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn stats(&self) -> StructureStats {
        let bytes = size_of_val(&self.base.forest.nodes[..])
            + size_of_val(&self.base.forest.triangles[..])
            + size_of_val(&self.entries[..])
            + size_of_val(&self.boxes[..]);
        StructureStats {
            bytes: bytes as u64,
            ..self.base.forest.stats.clone()
        }
    }

    fn space(&self) -> Space {
        self.base.space()
    }

    fn update(&mut self, soup: &TriangleSoup) -> Option<Result<(), AccelError>> {
        Some(self.base.update(soup).map(|()| self.list()))
    }

    fn cpu_twin<'a>(&'a self, _: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self)))
    }
}

struct Twin<'a>(&'a Built);

impl Twin<'_> {
    fn trace(&self, ray: &Ray, any: bool, counters: &mut Counters) -> Hit {
        let forest = &self.0.base.forest;
        let ray = &forest.intersection.raised(ray);
        let world = level(ray, self.0.growth, forest.intersection);
        let mut hit = Hit::miss(ray);
        for (entry, world_box) in self.0.entries.iter().zip(&self.0.boxes) {
            counters.box_tests += 1;
            if enter_grown(&world, &world_box.bounds(), hit.t).is_none() {
                continue;
            }
            trace_object(forest, entry, ray, any, &mut hit, counters);
            if any && hit.triangle != NO_HIT {
                break;
            }
        }
        hit
    }
}

impl CpuTwin for Twin<'_> {
    fn closest_hit(&self, ray: &Ray, counters: &mut Counters) -> Hit {
        self.trace(ray, false, counters)
    }

    fn any_hit(&self, ray: &Ray, counters: &mut Counters) -> bool {
        self.trace(ray, true, counters).triangle != NO_HIT
    }
}
