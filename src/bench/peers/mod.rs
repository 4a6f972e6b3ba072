//! External tracers for comparison: the same rays, in the same rounds. Their hits differ from ours
//! by rounding, so they are checked in double precision, not bit by bit, and listed next to this
//! crate's structures, never among them: no verdict compares the two.

// A library of the system.
#[cfg(not(target_family = "wasm"))]
mod embree;
mod native;
mod obvhs;
mod ray_query;
mod registry;

pub use registry::PeerRegistry;

use raystone_accel::{Hit, Query, Ray, TriangleSoup};
use raystone_gpu::{Elapsed, Gpu, GpuError};

/// An external tracer.
pub trait Peer: Send + Sync {
    /// Name in experiments.
    fn name(&self) -> &'static str;

    /// One-line description.
    fn description(&self) -> &'static str;

    /// Builds its structure; `gpu` names the adapter for tracers that run in a driver.
    ///
    /// # Errors
    /// It cannot run here, or not with these triangles: the reason.
    fn build<'a>(
        &self,
        gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String>;
}

/// A built peer.
pub trait BuiltPeer {
    /// Version, and the hardware it runs on.
    fn about(&self) -> String;

    /// Wall time of the build in milliseconds.
    fn build_ms(&self) -> f64;

    /// Prepares rays to be traced repeatedly.
    ///
    /// # Errors
    /// They do not fit into its device's memory.
    fn batch<'a>(
        &'a self,
        query: Query,
        rays: &'a [Ray],
    ) -> Result<Box<dyn PeerBatch + 'a>, String>;
}

/// Rays with their answers.
pub trait PeerBatch {
    /// Traces all rays, discarding earlier answers.
    ///
    /// # Errors
    /// The device is lost or hangs.
    fn trace(&self) -> Result<Elapsed, GpuError>;

    /// The last answers by ray: distance and triangle, or [`Hit::miss`]. For any-hit queries, only
    /// the presence of a triangle is meaningful. Weights are 0.
    ///
    /// # Errors
    /// The device is lost or hangs.
    fn hits(&self) -> Result<Vec<Hit>, GpuError>;
}
