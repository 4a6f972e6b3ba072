//! Ray casters of others, to measure against: the same rays, in the same rounds. Their hits differ from ours by rounding, so
//! they are judged in double precision and not by their bits, and they stand beside the structures of this crate, never among
//! them: no verdict compares the two.

mod embree;
mod native;
mod obvhs;
mod ray_query;
mod registry;

pub use registry::PeerRegistry;

use raystone_accel::{Hit, Query, Ray, TriangleSoup};
use raystone_gpu::{Elapsed, Gpu, GpuError};

/// A ray caster that this crate has not written.
pub trait Peer: Send + Sync {
    /// Name, as an experiment writes it.
    fn name(&self) -> &'static str;

    /// One line about it.
    fn description(&self) -> &'static str;

    /// Builds what it casts rays into; `gpu` says on which adapter casters of a driver are to run.
    ///
    /// # Errors
    /// It cannot run here, or not with these triangles: why not, in words.
    fn build<'a>(
        &self,
        gpu: &Gpu,
        soup: &'a TriangleSoup,
    ) -> Result<Box<dyn BuiltPeer + 'a>, String>;
}

/// A built peer.
pub trait BuiltPeer {
    /// Version, and on what it runs.
    fn about(&self) -> String;

    /// Milliseconds of wall time that building took.
    fn build_ms(&self) -> f64;

    /// Rays that it will be asked for again and again.
    ///
    /// # Errors
    /// They do not fit into the memory of its device.
    fn batch<'a>(
        &'a self,
        query: Query,
        rays: &'a [Ray],
    ) -> Result<Box<dyn PeerBatch + 'a>, String>;
}

/// Rays with their answers.
pub trait PeerBatch {
    /// Answers all rays anew; nothing of earlier answers is left.
    ///
    /// # Errors
    /// The device is lost or hangs.
    fn trace(&self) -> Result<Elapsed, GpuError>;

    /// The last answers, ray by ray: distance and triangle, or [`Hit::miss`]. Of an any-hit query
    /// only whether there is a triangle means something. Weights are 0.
    ///
    /// # Errors
    /// The device is lost or hangs.
    fn hits(&self) -> Result<Vec<Hit>, GpuError>;
}
