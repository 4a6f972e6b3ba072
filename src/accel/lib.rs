//! Acceleration structures: one trait, one file per structure, one registry line each.
//!
//! To add one, see `docs/adding-a-structure.md`.
#![warn(missing_docs)]

/// Returns [`AccelError::Invalid`] with this text unless the condition holds.
macro_rules! ensure {
    ($holds:expr, $($what:tt)+) => {
        let holds: bool = $holds;
        if !holds {
            return Err($crate::AccelError::Invalid(format!($($what)+)));
        }
    };
}

mod auto;
pub mod bounds;
mod brute_force;
mod bvh;
mod divide_and_conquer;
#[cfg(test)]
mod fixtures;
mod grid;
mod instancing;
mod intersection;
mod irregular_grid;
mod kd_tree;
mod known_cells;
pub mod known_figures;
mod known_parameters;
mod known_rows;
mod known_trees;
mod leaf;
pub mod mask;
mod octree;
pub mod oracle;
mod polygon;
pub mod ray;
mod ray_hierarchy;
mod registry;
#[cfg(test)]
mod scene_tests;
mod spatial;
mod stats;
mod structure;
pub mod tracer;
pub mod tree;
pub mod triangle;
pub mod twin;
mod two_level_grid;
mod uniform_grid;
pub mod watch;
mod wide;

pub(crate) use auto::Auto;
pub use brute_force::{BruteForce, brute_force_hits};
pub use bvh::{BuiltBvh, Bvh, BvhParameters, RopedBvh};
pub use divide_and_conquer::{DivideAndConquer, Division, DivisionLevel};
pub use instancing::{InstanceReference, MetaBvh, ObjectList, Placed, brute_force_instances};
pub use intersection::{BoxTest, Intersection};
pub(crate) use irregular_grid::IrregularGrid;
pub(crate) use kd_tree::KdTree;
pub use mask::Masks;
pub(crate) use octree::Octree;
pub use ray::{Hit, NO_HIT, Ray};
pub use ray_hierarchy::{Anatomy, LevelAnatomy, RayHierarchy, StreamCounts};
pub use raystone_core::structure::{Counters, Phase, Space, StructureStats};
pub use registry::{AccelRegistry, BoxRegistry, TriangleRegistry};
pub use stats::BuildLog;
pub use structure::{OverTree, Structure};
pub use tracer::{
    Answers, Ask, GroupShape, LiveRays, Load, LoadRegistry, Query, RayBatch, RefillParameters,
    TracePasses, TraceSteps, Traced, Tracer, TriangleBuffers, Workgroup, WorkgroupRegistry,
};
pub use twin::CpuTwin;
pub(crate) use two_level_grid::TwoLevelGrid;
pub(crate) use uniform_grid::UniformGrid;
pub use wide::{Bvh4, Cwbvh};

use bytemuck::NoUninit;
use raystone_core::params::{ParamError, ParameterSchema, Params, Sources};
use raystone_gpu::{Composition, UniformValues};
use raystone_scene::SceneData;
use std::borrow::Cow;
use std::sync::Arc;
use thiserror::Error;
use triangle::TriangleRecord;

/// The reason why a structure cannot be built.
#[derive(Debug, Clone, Error, PartialEq)]
pub enum AccelError {
    /// A hard limit of the structure, with both numbers.
    #[error("{what}: needs {needed}, the limit is {limit}; {remedy}")]
    Limit {
        /// The limit.
        what: String,
        /// The value the scene needs.
        needed: u64,
        /// The value the structure allows.
        limit: u64,
        /// What to do.
        remedy: &'static str,
    },
    /// An unknown parameter, or a value that is not allowed.
    #[error(transparent)]
    Parameter(#[from] ParamError),
    /// Contradicting parameters, with the reason.
    #[error("{0}")]
    Contradiction(String),
    /// An error of a build on the device.
    #[error("{0}")]
    Device(String),
    /// A structural invariant is violated.
    #[error("{0}")]
    Invalid(String),
}

impl AccelError {
    /// Checks `needed` against `limit`.
    ///
    /// # Errors
    /// [`AccelError::Limit`] with both numbers and the remedy.
    pub(crate) fn check_limit(
        what: impl Into<String>,
        needed: impl Into<u64>,
        limit: impl Into<u64>,
        remedy: &'static str,
    ) -> Result<(), Self> {
        let (what, needed, limit) = (what.into(), needed.into(), limit.into());
        if needed <= limit {
            return Ok(());
        }
        Err(Self::Limit {
            what,
            needed,
            limit,
            remedy,
        })
    }
}

/// What to do where a structure cannot hold so many triangles.
pub(crate) const FEWER: &str = "take fewer triangles (`most_triangles` of the scene)";

/// The triangles of a scene for structures: the canonical records.
#[derive(Debug, Clone, Default)]
pub struct TriangleSoup {
    /// Record `i` is triangle `i` of the scene.
    pub records: Vec<TriangleRecord>,
    /// The objects they are copies of, if the scene consists of instances.
    pub placed: Option<Placed>,
    /// The tests of rays against them: see [`TriangleSoup::intersecting`].
    pub intersection: Intersection,
    /// Masks that cut holes into them; the words of records refer to these.
    pub masks: Option<Arc<Masks>>,
}

impl From<Vec<TriangleRecord>> for TriangleSoup {
    /// Triangles that are not copies.
    fn from(records: Vec<TriangleRecord>) -> Self {
        Self {
            records,
            ..Self::default()
        }
    }
}

impl TriangleSoup {
    /// The records of a scene.
    pub fn new(scene: &SceneData) -> Self {
        let (masks, words) = match Masks::of(scene, 3 * scene.triangles.len() as u32) {
            Some((masks, words)) => (Some(Arc::new(masks)), Cow::Owned(words)),
            None => (None, Cow::Borrowed(&scene.material_ids)),
        };
        let records = scene
            .triangles
            .iter()
            .zip(&*words)
            .enumerate()
            .map(|(id, (triangle, material))| TriangleRecord::new(triangle, id as u32, *material))
            .collect();
        let mut placed = scene.assembly.as_ref().map(Placed::new);
        if let Some(masks) = &masks {
            placed = placed.and_then(|placed| placed.masked(masks, &words));
        }
        Self {
            records,
            placed,
            intersection: Intersection::default(),
            masks,
        }
    }

    /// The same triangles with these tests. Structures copy records, so choose before building.
    #[must_use]
    pub fn intersecting(mut self, intersection: Intersection) -> Self {
        // The words derived from records and masks follow them, then those of the objects.
        let mut place = 3 * self.records.len() as u32 + self.mask_rows().len() as u32;
        let objects = self.placed.iter_mut().flat_map(|p| &mut p.objects);
        let objects = objects.map(|object| {
            object.intersection = intersection;
            &mut object.records
        });
        for record in std::iter::once(&mut self.records).chain(objects).flatten() {
            record.transformed = 0;
            if intersection.triangle.transformed(record).is_some() {
                record.transformed = place;
                place += 3;
            }
        }
        self.intersection = intersection;
        self
    }

    fn mask_rows(&self) -> &[[u32; 4]] {
        self.masks.as_ref().map_or(&[], |masks| &masks.rows)
    }

    /// The buffer `triangles` of kernels: records, masks, and the test's precomputed data.
    pub fn words(&self) -> Cow<'_, [[u32; 4]]> {
        let records = bytemuck::cast_slice(&self.records);
        let objects = self.placed.iter().flat_map(|p| &p.objects);
        let objects = objects.flat_map(|object| &object.records);
        let transformed = |record| self.intersection.triangle.transformed(record);
        let made = self.records.iter().chain(objects).filter_map(transformed);
        let masks = self.mask_rows().iter().copied();
        let mut behind = masks.chain(made.flatten()).peekable();
        match behind.peek() {
            None => Cow::Borrowed(records),
            Some(_) => Cow::Owned(records.iter().copied().chain(behind).collect()),
        }
    }

    /// Box around all triangles; [`bounds::Bounds::EMPTY`] if there are none.
    pub fn bounds(&self) -> bounds::Bounds {
        self.records
            .iter()
            .fold(bounds::Bounds::EMPTY, |b, r| b.union(&r.bounds()))
    }
}

/// One array of words for the GPU.
#[derive(Debug, Clone)]
pub struct NamedWords<'a> {
    /// Name of the kernel variable that binds it.
    pub name: &'static str,
    /// Content, borrowed from the structure if its memory layout matches the GPU's.
    pub words: Cow<'a, [u32]>,
    /// Bytes per element, for the record.
    pub element_bytes: u32,
}

impl<'a> NamedWords<'a> {
    /// An array with the GPU's memory layout; the element size is recorded.
    pub fn new<T: NoUninit>(name: &'static str, elements: &'a [T]) -> Self {
        Self {
            name,
            words: bytemuck::cast_slice(elements).into(),
            element_bytes: size_of::<T>() as u32,
        }
    }
}

/// The GPU data of a structure.
#[derive(Debug, Clone, Default)]
pub struct GpuBuffers<'a> {
    /// Module of the kernel, relative to the kernel folder; empty for a pipeline that needs none.
    pub kernel: &'static str,
    /// Features (`@if(...)` in the kernel) enabled by its parameters.
    pub features: Vec<&'static str>,
    /// Storage arrays, at most two (a path-tracing kernel has eight in total).
    pub arrays: Vec<NamedWords<'a>>,
    /// Uniform structs by variable name.
    pub uniforms: Vec<(&'static str, UniformValues)>,
    /// Constants of `package::active::constants`. Each set of constants is a separate kernel, so
    /// numbers that differ between scenes belong in a uniform.
    pub constants: Vec<(&'static str, u32)>,
}

/// The uniform `limits` of `kernels/common/limits.wesl`: the maximum number of steps of a
/// traversal, and the number of nodes or triangles, whose last one bounds indices.
pub fn limits(step_fuse: usize, elements: usize) -> (&'static str, UniformValues) {
    (
        "limits",
        UniformValues::new()
            .u32("step_fuse", step_fuse as u32)
            .u32("elements", elements as u32),
    )
}

impl GpuBuffers<'_> {
    /// `composition` with this structure as the active one.
    #[must_use]
    pub fn activate(&self, composition: Composition) -> Composition {
        let active = match self.kernel {
            "" => composition,
            kernel => composition.with("accel", kernel),
        };
        let active = self
            .features
            .iter()
            .fold(active, |c, name| c.feature(name, true));
        self.constants
            .iter()
            .fold(active, |c, (name, value)| c.constant(name, *value))
    }

    /// Total bytes of all arrays.
    pub fn bytes(&self) -> u64 {
        self.arrays.iter().map(|a| a.words.len() as u64 * 4).sum()
    }
}

/// A kind of structure: one static per structure, one line in the registry. [`Structure`] is a
/// shorthand for structures with names known at compile time.
pub trait AccelKind: Sync {
    /// Name used in configurations.
    fn name(&self) -> &'static str;
    /// One-line description with source.
    fn description(&self) -> &'static str;
    /// Parameters.
    fn parameters(&self) -> ParameterSchema;
    /// Modules that a kernel folder may supply for it, in addition to the built-in ones.
    fn kernels(&self) -> Vec<String> {
        vec![format!("accel/{}", self.name().replace('-', "_"))]
    }
    /// Paths and texts of its own kernel modules, for structures that are not built in.
    fn sources(&self) -> Sources {
        &[]
    }
    /// Builds the structure.
    ///
    /// # Errors
    /// A limit of the structure is exceeded.
    fn build(&self, soup: &TriangleSoup, params: &Params, log: &mut BuildLog) -> BuildResult;
    /// The two halves of a build, if the structure is a layout of one binary tree.
    fn over_tree(&self) -> Option<&dyn OverTree> {
        None
    }
}

/// A built structure, or the reason for failure.
pub type BuildResult = Result<Box<dyn BuiltAccel>, AccelError>;

/// The way to trace a built structure.
#[derive(Clone)]
pub enum Access {
    /// Its kernel module exports `trace(ray, any)`, which other kernels call through `accel/query`.
    Inline,
    /// It answers buffers of rays in its own passes; kernels that embed a structure (those of
    /// tracing integrators) cannot use it.
    Pipeline(Arc<dyn TracePasses>),
}

/// A built structure.
pub trait BuiltAccel: Sync {
    /// Checks structural invariants: reachability, containment, depth, ranges.
    ///
    /// # Errors
    /// The first violated invariant, with the node.
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError>;
    /// The kernel with its arrays, uniforms, constants and features.
    fn buffers(&self) -> GpuBuffers<'_>;
    /// Arrays that a device build left on the device, by the variables that bind them: storage
    /// arrays in addition to those of [`BuiltAccel::buffers`].
    fn on_device(&self) -> Vec<(&'static str, wgpu::Buffer)> {
        Vec::new()
    }
    /// Returns the way to trace it.
    fn access(&self) -> Access {
        Access::Inline
    }
    /// Returns the refill rule of the batch kernel, for inline structures whose kernel exports `Traversal`, `begin`
    /// and `advance`.
    fn refill(&self) -> RefillParameters {
        RefillParameters::NONE
    }
    /// Rays at the margins of the structure's own tests, which other rays do not reach: kernels must do the work
    /// that the twin counts for them.
    fn marginal_rays(&self) -> Vec<Ray> {
        Vec::new()
    }
    /// Arrays that the kernel can read in several parts if the adapter's binding limit is smaller:
    /// see [`raystone_gpu::Bindings::parts`].
    fn divisible(&self) -> &'static [&'static str] {
        &[]
    }
    /// Static statistics.
    fn stats(&self) -> StructureStats;
    /// The space in which triangles are intersected.
    fn space(&self) -> Space {
        Space::World
    }
    /// Applies the transforms of the same instances from `soup`, rebuilding only dependent data;
    /// `None` if a full build is needed.
    ///
    /// # Errors
    /// `soup` has other instances or objects.
    fn update(&mut self, _soup: &TriangleSoup) -> Option<Result<(), AccelError>> {
        None
    }
    /// The arrays of [`BuiltAccel::buffers`] in the memory that the CPU version reads, part by part
    /// if an array has several.
    fn twin_arrays(&self) -> Vec<(&'static str, Vec<&[u32]>)> {
        let arrays = self.buffers().arrays.into_iter();
        let in_place = arrays.filter_map(|array| match array.words {
            Cow::Borrowed(words) => Some((array.name, vec![words])),
            Cow::Owned(_) => None,
        });
        in_place.collect()
    }
    /// The CPU version of the traversal, if there is one.
    fn cpu_twin<'a>(&'a self, _soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        None
    }
}
