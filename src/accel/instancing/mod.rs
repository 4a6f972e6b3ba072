//! Two-level structures: an object-space BVH per object, and above them either a list of the
//! instances (`object-list`) or a BVH over them (`meta-bvh`). Moving an instance changes the upper
//! level only.
//!
//! Rays are transformed to object space, so t, u and v are bit-identical to brute force *over the
//! same instances with the same transforms* ([`brute_force_instances`]); brute force over the flat
//! triangles rounds differently. The transformed direction is not normalised, so a hit's distance
//! is the same in both spaces.
//!
//! A scene without instances is treated as one untransformed object. All answers then equal those
//! of the flat list.

mod forest;
mod instance;
mod judge;
mod meta_bvh;
mod meta_bvh_nested;
mod object_list;
mod placed;
#[cfg(test)]
mod tests;
mod top;
mod world_box;

pub use judge::{InstanceReference, brute_force_instances};
pub use meta_bvh::MetaBvh;
pub use object_list::ObjectList;
pub use placed::Placed;
pub(crate) use top::check as check_room;
pub(crate) use world_box::BoxMap;

use super::bvh::pairs::Pair;
use super::structure::prelude::*;
use super::tree::TreeParameters;
use super::{Space, limits};
use forest::Forest;
use placed::View;
use raystone_gpu::UniformValues;
use raystone_scene::Instance;

/// The level above the objects' trees.
trait Upper: Send + Sync + 'static {
    /// Rebuilds it over the instances at their current transforms.
    fn place(&mut self, base: &Base);
    /// Checks it against the instances.
    ///
    /// # Errors
    /// The first violated invariant.
    fn validate(&self, base: &Base) -> Result<(), AccelError>;
    fn layout(&self, base: &Base) -> Layout<'_>;
    /// The boxes that grow for a ray.
    fn boxes(&self) -> Vec<Bounds>;
    /// Statistics of the whole structure, given those of the objects.
    fn figures(&self, objects: &StructureStats) -> StructureStats;
    fn trace(&self, base: &Base, walk: Walk) -> Hit;
}

/// Data of an upper level for kernel bindings.
struct Layout<'a> {
    kernel: &'static str,
    /// The data after the nodes of the objects.
    parts: [&'a [u32]; 2],
    step_fuse: usize,
    entries: usize,
    /// Index of its first node.
    root: usize,
    /// Index of the first entry, in nodes.
    first_entry: usize,
    growth: f32,
    stack_entries: u32,
}

/// Boxes that marginal rays pass.
const MARGINAL_BOXES: usize = 32;
/// Distances at which they pass, in growths of the box: well within it, next to its border, and beyond.
const MARGINS: [f32; 3] = [0.5, 0.99, 1.01];
/// Distance of their origins, in greatest coordinates of the box: a growth is then a thousand roundings of these.
const AWAY: f32 = 64.0;

/// Two rays along an axis that pass a box at a distance, below and above it on another axis.
fn beside(bounds: &Bounds, turn: usize, growth: f32, margin: f32) -> [Ray; 2] {
    let (along, across) = (turn % 3, (turn + 1) % 3);
    let coordinates = bounds.min.into_iter().chain(bounds.max);
    let greatest = coordinates.fold(f32::MIN_POSITIVE, |most, x| most.max(x.abs()));
    let mut origin = [0, 1, 2].map(|axis| 0.5 * (bounds.min[axis] + bounds.max[axis]));
    origin[along] = -AWAY * greatest;
    let mut direction = [0.0; 3];
    direction[along] = 1.0;
    let away = margin * (growth * AWAY * greatest);
    [bounds.min[across] - away, bounds.max[across] + away].map(|place| {
        let mut origin = origin;
        origin[across] = place;
        Ray {
            origin,
            t_min: 0.0,
            direction,
            t_max: 2.0 * AWAY * greatest,
        }
    })
}

struct TwoLevel<U> {
    base: Base,
    upper: U,
}

impl<U: Upper> TwoLevel<U> {
    /// An upper level over the objects' trees; its construction is a phase of this name.
    fn build(mut upper: U, base: Base, phase: &str, log: &mut BuildLog) -> BuildResult {
        log.phase(phase, || upper.place(&base));
        Ok(Box::new(Self { base, upper }))
    }
}

impl<U: Upper> BuiltAccel for TwoLevel<U> {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.base.validate(soup)?;
        self.upper.validate(&self.base)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        self.base.buffers(&self.upper.layout(&self.base))
    }

    fn twin_arrays(&self) -> Vec<(&'static str, Vec<&[u32]>)> {
        let forest = &self.base.forest;
        let [first, second] = self.upper.layout(&self.base).parts;
        let nodes = vec![bytemuck::cast_slice(&forest.nodes), first, second];
        let triangles = vec![bytemuck::cast_slice(&forest.triangles)];
        vec![("nodes", nodes), ("leaf_triangles", triangles)]
    }

    fn marginal_rays(&self) -> Vec<Ray> {
        let growth = self.upper.layout(&self.base).growth;
        if growth == 0.0 {
            return Vec::new();
        }
        let boxes = self.upper.boxes();
        let step = boxes.len().div_ceil(MARGINAL_BOXES).max(1);
        let some = boxes.iter().step_by(step).enumerate();
        some.flat_map(|(turn, b)| MARGINS.map(|margin| beside(b, turn, growth, margin)))
            .flatten()
            .collect()
    }

    fn divisible(&self) -> &'static [&'static str] {
        &["nodes", "leaf_triangles"]
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            bytes: self.buffers().bytes(),
            ..self.upper.figures(&self.base.forest.stats)
        }
    }

    fn space(&self) -> Space {
        if self.base.instances.iter().all(Instance::is_identity) {
            Space::World
        } else {
            Space::Instances
        }
    }

    fn update(&mut self, soup: &TriangleSoup) -> Option<Result<(), AccelError>> {
        let updated = self.base.update(soup);
        Some(updated.map(|()| self.upper.place(&self.base)))
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

impl<U: Upper> Traverse for TwoLevel<U> {
    fn trace(&self, _: &TriangleSoup, walk: Walk) -> Hit {
        self.upper.trace(&self.base, walk)
    }
}

/// Input of both structures: the BVHs of the objects, and the instances.
struct Base {
    instances: Vec<Instance>,
    forest: Forest,
}

impl Base {
    fn build(
        soup: &TriangleSoup,
        tree: &TreeParameters,
        log: &mut BuildLog,
    ) -> Result<Self, AccelError> {
        let view = View::of(soup);
        // Rays reach an object from as far as instances are apart, in units of any scale: no margin
        // around clipped triangles would suffice.
        let tree = TreeParameters {
            spatial_clip: tree.spatial_clip && soup.placed.is_none(),
            ..tree.clone()
        };
        Ok(Self {
            forest: Forest::build(&view.objects, &tree, log)?,
            instances: view.instances.into_owned(),
        })
    }

    /// Buffers of the objects, followed by an upper level.
    fn buffers(&self, top: &Layout) -> GpuBuffers<'_> {
        let forest = &self.forest;
        let nodes: &[u32] = bytemuck::cast_slice(&forest.nodes);
        let [first, second] = top.parts;
        GpuBuffers {
            kernel: top.kernel,
            arrays: vec![
                NamedWords {
                    name: "nodes",
                    words: [nodes, first, second].concat().into(),
                    element_bytes: size_of::<Pair>() as u32,
                },
                NamedWords::new("leaf_triangles", &forest.triangles),
            ],
            uniforms: vec![
                limits(top.step_fuse, top.entries),
                (
                    "instancing",
                    UniformValues::new()
                        .u32("root", top.root as u32)
                        .u32("first_entry", top.first_entry as u32)
                        .f32("growth", top.growth),
                ),
            ],
            // Rounded up, so that scenes of similar depth share a kernel.
            constants: vec![("STACK_ENTRIES", top.stack_entries.next_multiple_of(8))],
            ..Default::default()
        }
    }

    /// Applies the transforms of `soup`.
    fn update(&mut self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let moved = View::of(soup);
        self.has_instances_of(&moved)?;
        self.instances = moved.instances.into_owned();
        Ok(())
    }

    /// Checks that `view` has the same instances of objects of the same size, with any transforms.
    fn has_instances_of(&self, view: &View) -> Result<(), AccelError> {
        let key = |i: &Instance| (i.object, i.first);
        let same_instances = self
            .instances
            .iter()
            .map(key)
            .eq(view.instances.iter().map(key));
        let sizes = view.objects.iter().map(|object| object.records.len());
        let same_objects = self.forest.roots.iter().map(|r| r.object_size).eq(sizes);
        ensure!(
            same_instances && same_objects,
            "built for {} instances of {} objects, given {} of {}: other ones need a new build",
            self.instances.len(),
            self.forest.roots.len(),
            view.instances.len(),
            view.objects.len()
        );
        Ok(())
    }

    /// Checks objects and transforms against those of `soup`.
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let view = View::of(soup);
        self.has_instances_of(&view)?;
        for (index, (own, given)) in self.instances.iter().zip(&*view.instances).enumerate() {
            ensure!(own == given, "instance {index} was moved after the build");
        }
        self.forest.validate(&view.objects)
    }
}

/// The step fuse for the uniform, saturated so that sums of subtrees do not wrap.
fn clamped(steps: u64) -> usize {
    steps.min(u64::from(u32::MAX)) as usize
}
