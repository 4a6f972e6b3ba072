//! Common part of tracers on the host: answers in memory, computed by all threads of the machine.

use super::{BuiltPeer, PeerBatch};
use rayon::prelude::*;
use raystone_accel::{Hit, Query, Ray};
use raystone_gpu::{Elapsed, GpuError, Stopwatch};
use std::cell::RefCell;

/// Rays per work item of a thread.
const CHUNK: usize = 1024;

/// Traces single rays.
pub(crate) trait Caster: Sync {
    /// The nearest hit, any hit if only that is requested, or [`Hit::miss`].
    fn cast(&self, query: Query, ray: &Ray) -> Hit;

    /// Version of the tracer.
    fn version(&self) -> String;

    /// See [`BuiltPeer::build_ms`].
    fn build_ms(&self) -> f64;
}

impl<C: Caster> BuiltPeer for C {
    fn about(&self) -> String {
        let threads = match rayon::current_num_threads() {
            1 => "1 thread".into(),
            n => format!("{n} threads"),
        };
        format!("{}, {threads}", self.version())
    }

    fn build_ms(&self) -> f64 {
        Caster::build_ms(self)
    }

    fn batch<'a>(
        &'a self,
        query: Query,
        rays: &'a [Ray],
    ) -> Result<Box<dyn PeerBatch + 'a>, String> {
        Ok(Box::new(NativeBatch {
            caster: self,
            query,
            rays,
            hits: RefCell::default(),
        }))
    }
}

struct NativeBatch<'a, C> {
    caster: &'a C,
    query: Query,
    rays: &'a [Ray],
    hits: RefCell<Vec<Hit>>,
}

impl<C: Caster> PeerBatch for NativeBatch<'_, C> {
    fn trace(&self) -> Result<Elapsed, GpuError> {
        let (caster, query) = (self.caster, self.query);
        let mut hits = self.hits.borrow_mut();
        hits.clear();
        let watch = Stopwatch::start();
        let chunks = self.rays.par_iter().with_min_len(CHUNK);
        chunks
            .map(|ray| {
                if ray.is_ray() {
                    caster.cast(query, ray)
                } else {
                    Hit::miss(ray)
                }
            })
            .collect_into_vec(&mut hits);
        Ok(watch.elapsed())
    }

    fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        Ok(self.hits.borrow().clone())
    }
}
