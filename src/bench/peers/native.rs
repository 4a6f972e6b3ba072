//! What casters on the host have in common: answers in memory, found by all threads of the machine.

use super::{BuiltPeer, PeerBatch};
use rayon::prelude::*;
use raystone_accel::{Hit, Query, Ray};
use raystone_gpu::{Elapsed, GpuError, Stopwatch};
use std::cell::RefCell;

/// Rays that a thread takes at a time.
const CHUNK: usize = 1024;

/// One ray after the other.
pub(crate) trait Caster: Sync {
    /// The nearest hit, or [`Hit::miss`]; any hit if only that is asked for.
    fn cast(&self, query: Query, ray: &Ray) -> Hit;

    /// Its version.
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

/// Rays that a caster answers.
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
            .map(|ray| match ray.is_ray() {
                true => caster.cast(query, ray),
                false => Hit::miss(ray),
            })
            .collect_into_vec(&mut hits);
        Ok(watch.elapsed())
    }

    fn hits(&self) -> Result<Vec<Hit>, GpuError> {
        Ok(self.hits.borrow().clone())
    }
}
