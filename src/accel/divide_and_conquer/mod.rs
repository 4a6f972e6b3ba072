//! `divide-and-conquer`: triangles and rays are divided together, top down, for each set of rays anew; nothing
//! is built before and nothing stays.
//!
//! Sources: B. Mora, "Naive ray-tracing: a divide-and-conquer approach", ACM Transactions on Graphics 30(5), 2011;
//! A. Áfra, "Incoherent ray tracing without acceleration structures", Eurographics 2012 short papers. Both go
//! depth first and near parts first; here all problems of a level are divided at once, so that a ray is
//! shortened by hits of levels above only. See docs/ray-hierarchies.md.

mod layout;
mod passes;
mod problem;
#[cfg(test)]
mod tests;

pub use problem::{Division, DivisionLevel};

use super::Access;
use super::brute_force::test_all;
use super::ray_hierarchy::trace_state;
use super::structure::prelude::*;
use super::tracer::Tracer;
use crate::Ray;
use raystone_gpu::{Gpu, GpuError};
use std::sync::Arc;

parameters! {
    /// When problems are divided.
    pub struct Options {
        /// a problem with at most this many rays or triangles is answered by testing all of them
        naive: u32 = 8, in 1..=1024;
        /// levels of problems; those of the last are answered, whatever their size
        levels: u32 = 40, in 1..=64;
        /// pairs of a stream; a batch of rays fills at most an eighth, and pairs without room are answered at once
        capacity: u32 = 2_097_152, in 16_384..=4_194_240;
    }
}

/// The registry entry.
pub struct DivideAndConquer;

impl DivideAndConquer {
    /// Traces `rays` once and returns what the device counted of each level, the first problem first. Rays of all
    /// batches are summed, problems are those of the last batch. `tracer` is that of a structure of this kind with
    /// this many levels.
    ///
    /// # Errors
    /// The device is lost, hangs or has no room, or the structure is of another kind.
    pub fn division(
        gpu: &Gpu,
        tracer: &Tracer,
        rays: &[Ray],
        levels: u32,
    ) -> Result<Vec<DivisionLevel>, GpuError> {
        let words = trace_state(gpu, tracer, rays, levels)?;
        let levels = words.as_chunks::<4>().0.iter().take(levels as usize);
        let level = |[_, problems, pairs, beyond]: &[u32; 4]| DivisionLevel {
            problems: u64::from(*problems),
            pairs: u64::from(*pairs),
            without_room: u64::from(*beyond),
        };
        Ok(levels.map(level).collect())
    }
}

impl Structure for DivideAndConquer {
    const NAME: &'static str = "divide-and-conquer";
    const DESCRIPTION: &'static str = "no structure at all: rays and triangles are divided together, anew for each set of rays (Mora 2011)";
    type Parameters = Options;

    fn kernels() -> Vec<String> {
        let shared = [
            "found",
            "divide_and_conquer/enter",
            "divide_and_conquer/problem",
        ];
        let shared = shared.map(str::to_owned);
        let passes = passes::NAMES.map(|pass| format!("divide_and_conquer/passes/{pass}"));
        let modules = shared.into_iter().chain(passes);
        modules.map(|module| format!("accel/{module}")).collect()
    }

    fn build(soup: &TriangleSoup, options: &Options, _: &mut BuildLog) -> BuildResult {
        Ok(Box::new(Built {
            options: options.clone(),
            triangles: soup.records.len(),
        }))
    }
}

struct Built {
    options: Options,
    triangles: usize,
}

impl BuiltAccel for Built {
    fn validate(&self, soup: &TriangleSoup) -> Result<(), AccelError> {
        let (built, given) = (self.triangles, soup.records.len());
        ensure!(built == given, "made for {built} triangles, given {given}");
        Ok(())
    }

    fn buffers(&self) -> GpuBuffers<'_> {
        GpuBuffers {
            kernel: "",
            // Each turn of an offer has found a nearer hit.
            uniforms: vec![limits(self.triangles + 1, self.triangles)],
            constants: vec![
                ("LEVELS", self.options.levels),
                ("NAIVE", self.options.naive),
            ],
            ..Default::default()
        }
    }

    fn access(&self) -> Access {
        Access::Pipeline(Arc::new(passes::Passes {
            options: self.options.clone(),
            triangles: self.triangles as u32,
        }))
    }

    fn stats(&self) -> StructureStats {
        StructureStats {
            references: self.triangles as u64,
            ..Default::default()
        }
    }

    fn cpu_twin<'a>(&'a self, soup: &'a TriangleSoup) -> Option<Box<dyn CpuTwin + 'a>> {
        Some(Box::new(Twin(self, soup)))
    }
}

/// A ray alone is so few that all triangles are tested; [`Division`] is the twin of many.
impl Traverse for Built {
    fn trace(&self, soup: &TriangleSoup, walk: Walk) -> Hit {
        test_all(soup, walk)
    }
}
