//! `object-list`: the instances one after the other, each with a world box and the BVH of its object.
//! Twin of `kernels/accel/object_list.wesl`.
//!
//! Source: the per-object BVHs in an array of student path tracers, as analysed in §4.1.5 of
//! J. Dufay's thesis (2017), where the meta-BVH replaces the list.

use super::super::bounds::Bounds;
use super::super::ray::Hit;
use super::super::tree::TreeParameters;
use super::super::twin::{CpuTwin, Query, Traverse, Twin};
use super::super::{AccelError, AccelKind, BuildLog, BuiltAccel, GpuBuffers, Space, TriangleSoup};
use super::instance::{Entry, enter_grown, level, trace_object};
use super::world_box::BoxMap;
use super::{Base, Upper};
use crate::accel::StructureStats;
use crate::params::{ParameterSchema, Parameters as _, Params};
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
        TreeParameters::schema()
    }

    fn build(
        &self,
        soup: &TriangleSoup,
        params: &Params,
        log: &mut BuildLog,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let tree = TreeParameters::from_params(params)?;
        let base = Base::build(soup, &tree, log)?;
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
            AccelError::ensure(
                listed && boxed.is_some_and(|b| b.contains(&world_box)),
                || format!("instance {index} is not listed as it stands"),
            )?;
            AccelError::ensure(map.growth() <= self.growth, || {
                let (growth, needed) = (self.growth, map.growth());
                format!("instance {index}: boxes grow by {growth}, its transform needs {needed}")
            })?;
        }
        Ok(())
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let nodes = self.base.forest.nodes.len();
        self.base.buffers(&Upper {
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
            stack_entries: self.base.forest.stack_entries(),
        })
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            bytes: self.buffers().bytes(),
            ..self.base.forest.stats.clone()
        }
    }

    fn space(&self) -> Space {
        self.base.space()
    }

    fn update(&mut self, soup: &TriangleSoup) -> Option<Result<(), AccelError>> {
        Some(self.base.update(soup).map(|()| self.list()))
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl Traverse for Built {
    fn trace(&self, _: &TriangleSoup, mut query: Query) -> Hit {
        let forest = &self.base.forest;
        let world = level(&query.ray, self.growth, forest.intersection);
        for (entry, world_box) in self.entries.iter().zip(&self.boxes) {
            query.counters.box_tests += 1;
            if enter_grown(&world, &world_box.bounds(), query.hit.t).is_none() {
                continue;
            }
            trace_object(forest, entry, &mut query);
            if query.is_answered() {
                break;
            }
        }
        query.hit
    }
}
