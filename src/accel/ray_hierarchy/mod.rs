//! `ray-hierarchy`: a tree over the rays, through which all triangles are streamed; the scene has no
//! structure. CPU version of the leaves of `kernels/accel/ray_hierarchy`.
//!
//! Sources: D. Roger, U. Assarsson, N. Holzschuch, "Whitted ray-tracing for dynamic scenes using a
//! ray-space hierarchy on the GPU", EGSR 2007; D. Roger, "Réflexions spéculaires et glossy
//! interactives dans des scènes dynamiques", thesis, Grenoble 2008, chapter 3; V. Reis, J. Costa, J.
//! Pereira, "Coherent ray-space hierarchy via ray hashing and sorting", 2017 (order of rays).
//!
//! See docs/ray-hierarchies.md for what differs from the thesis.

mod anatomy;
mod enclosing;
mod keys;
mod layout;
mod node;
mod passes;
mod primitives;
mod start;
mod streams;
#[cfg(test)]
mod tests;

pub use anatomy::{Anatomy, LevelAnatomy};
pub(crate) use primitives::check_order;
pub use streams::StreamCounts;
pub(crate) use streams::trace_state;

use super::Access;
use super::structure::prelude::*;
use node::{Bounding, LEAST_INFLATION, node_of_ray};
use primitives::Primitives;
use raystone_gpu::UniformValues;
use raystone_gpu::compaction::CompactionMethod;
use std::sync::Arc;

parameters! {
    /// What bounds a primitive.
    pub enum Bound {
        /// The ball around its box.
        Sphere = "sphere",
        /// Its box.
        Box = "box",
        /// Both.
        Both = "both",
    }

    /// What lies behind the apex of a cone.
    pub enum Apex {
        /// A ball.
        Exact = "exact",
        /// The sides of the cone, prolonged.
        Linear = "linear",
    }

    /// How a node is put around its children.
    pub enum Union {
        /// Around the middle of all balls and the sum of all axes.
        AtOnce = "at-once",
        /// Two at a time, each as small as can be.
        Pairwise = "pairwise",
    }

    /// The order of rays in the tree.
    pub enum Order {
        /// As given.
        Natural = "natural",
        /// By origin along a Morton curve, then by direction.
        Morton = "morton",
        /// By a hash of the origin's cell, then by direction.
        Hash = "hash",
    }

    /// The tree over rays, and the descent through it.
    pub struct Options {
        /// children of a node of the tree over rays
        branching: u32 = 4, in 4..=64, where power_of_two();
        /// rays of a leaf, all of which are tested against what is left there
        bundle: u32 = 1, in 1..=32;
        /// triangles of a primitive, neighbours along a Morton curve
        cluster: u32 = 1, in 1..=128;
        /// what bounds a primitive: the ball around its box, the box, or both
        bound: Bound = Bound::Sphere;
        /// what is behind the apex of a node's cone: a ball, or the sides prolonged (Roger 2008, equation 3.1)
        apex: Apex = Apex::Exact;
        /// how a node is put around its children: at once, or two at a time (Roger 2008)
        union: Union = Union::AtOnce;
        /// levels of a tree over the primitives, of the same branching, that is descended together with that over rays
        dual: u32 = 0, in 0..=12;
        /// the order of rays in the tree: as given, by origin and direction, or by a hash of them
        order: Order = Order::Natural;
        /// whether a node ends where the farthest of its rays ends
        reach: bool = true;
        /// parts in which primitives come, front to back; between two of them rays are shortened to their hits
        chunks: u32 = 1, in 1..=16;
        /// the descent begins at the lowest level with at most this many nodes; 0: at the best of those of at most 64, by a sample of the triangles (16 with clusters, with `dual` or without `fused`)
        start: u32 = 0, in 0..=4096;
        /// pairs of a stream; a batch of primitives fills at most one, and pairs without room are answered at once
        capacity: u32 = 2_097_152, in 16_384..=4_194_240;
        /// whether a pass tests and compacts; else a compaction follows each
        fused: bool = true;
        /// the compaction, where it is not fused
        compaction: CompactionMethod = CompactionMethod::Auto;
        /// widening of every angle, ball and test; the least covers rounding
        inflation: f64 = LEAST_INFLATION, in LEAST_INFLATION..=1e-2;
    }
}

impl Options {
    fn bounding(&self) -> Bounding {
        Bounding {
            // Not rounded to less.
            inflation: (self.inflation as f32).next_up(),
            exact_apex: self.apex == Apex::Exact,
        }
    }

    /// Whether the level that the descent begins at is chosen for each set of rays.
    fn chooses_start(&self) -> bool {
        // Streams of both sides, and those that are compacted, have to come from the level above. Clusters are tested so
        // seldom that the choice costs more than it saves.
        self.start == 0 && self.cluster == 1 && self.dual == 0 && self.fused
    }

    /// Features of the kernels.
    fn features(&self) -> Vec<&'static str> {
        [
            ("exact_apex", self.apex == Apex::Exact),
            ("pairwise", self.union == Union::Pairwise),
            ("test_ball", self.bound != Bound::Box),
            ("test_box", self.bound != Bound::Sphere),
            ("reach", self.reach),
            ("ordered", self.order != Order::Natural),
            ("hashed", self.order == Order::Hash),
            ("shortened", self.chunks > 1),
            ("fused", self.fused),
        ]
        .into_iter()
        .filter_map(|(name, on)| on.then_some(name))
        .collect()
    }
}

/// The registry entry.
pub struct RayHierarchy;

impl Structure for RayHierarchy {
    const NAME: &'static str = "ray-hierarchy";
    const DESCRIPTION: &'static str = "no structure of the scene: all triangles are streamed through a tree over the rays (Roger, Assarsson, Holzschuch 2007)";
    type Parameters = Options;

    fn kernels() -> Vec<String> {
        let shared = ["enclosing", "node", "tree"].map(str::to_owned);
        let passes = [
            "answers",
            "begin",
            "candidates",
            "choose",
            "depths",
            "expand",
            "gather",
            "keys",
            "leaves",
            "pilot",
            "plan",
            "store",
            "unions",
        ];
        let passes = passes.map(|pass| format!("passes/{pass}"));
        let modules = shared.into_iter().chain(passes);
        modules
            .map(|module| format!("accel/ray_hierarchy/{module}"))
            .chain(["accel/found".to_owned()])
            .collect()
    }

    fn build(soup: &TriangleSoup, options: &Options, log: &mut BuildLog) -> BuildResult {
        if options.chunks > 1 && !options.reach {
            return Err(AccelError::Contradiction(
                "ray-hierarchy: chunks > 1 shorten rays to their hits, which reach = false ignores; set reach = true or chunks = 1".to_owned(),
            ));
        }
        if options.dual > 0 && options.branching > 8 {
            return Err(AccelError::Contradiction(format!(
                "ray-hierarchy: dual = {} has branching² = {} children of a pair, of which 64 are possible; set branching to 8 or less, or dual = 0",
                options.dual,
                options.branching.pow(2),
            )));
        }
        let primitives = log.phase("bounds", || Primitives::new(soup, options));
        Ok(Box::new(Built {
            options: options.clone(),
            primitives,
            bounds: soup.bounds(),
        }))
    }
}

struct Built {
    options: Options,
    primitives: Primitives,
    bounds: Bounds,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        self.primitives.validate(soup)
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        let (low, scale) = keys::extent(&self.bounds);
        let bounding = UniformValues::new()
            .f32("inflation", self.options.bounding().inflation)
            .u32("primitives", self.primitives.count as u32)
            .u32("rows", self.primitives.total as u32);
        let extent = UniformValues::new().vec("low", &low).f32("scale", scale);
        GpuBuffers {
            kernel: "",
            features: self.options.features(),
            arrays: vec![NamedWords::new("primitives", &self.primitives.rows)],
            // Each step of a walk tests a node; each turn of an offer has found a nearer hit.
            uniforms: vec![
                limits(1 << 30, self.primitives.count),
                ("bounding", bounding),
                ("extent", extent),
            ],
            constants: vec![
                ("BRANCHING_BITS", self.options.branching.trailing_zeros()),
                ("BUNDLE", self.options.bundle),
                ("LEVELS", layout::LEVELS),
            ],
        }
    }

    fn access(&self) -> Access {
        Access::Pipeline(Arc::new(passes::Passes {
            options: self.options.clone(),
            primitives: self.primitives.count,
        }))
    }

    fn stats(&self) -> StructureStats {
        let lists = self.primitives.all().iter();
        StructureStats {
            nodes: self.primitives.total as u64,
            bytes: self.buffers().bytes(),
            ..StructureStats::of_leaves(lists.map(|p| (p.end - p.first) as usize))
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

/// A ray alone is a tree of one node.
impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, mut walk: Walk) -> Hit {
        let (ray, bounding) = (walk.ray, self.options.bounding());
        let node = node_of_ray(ray.origin, ray.direction, ray.t_max, &bounding);
        for (index, primitive) in self.primitives.all().iter().enumerate() {
            walk.visit(index, primitive);
            if primitive.meets(&node, self.options.bound, &bounding) {
                walk.test_list(soup, self.primitives.triangles(primitive));
            }
            if walk.is_answered() {
                break;
            }
        }
        walk.hit
    }
}
