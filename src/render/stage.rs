//! A scene on the device, ready for structures: the complete setup from scene to answers.

use super::tables::SceneBuffers;
use raystone_accel::tracer::{count_work, count_work_async};
use raystone_accel::{
    AccelError, AccelKind, AccelRegistry, Answers, Ask, BuildLog, BuiltAccel, Counters, Hit,
    Intersection, Query, Ray, Traced, Tracer, TriangleSoup,
};
use raystone_core::params::Params;
use raystone_gpu::{Gpu, GpuError};
use raystone_scene::SceneData;
use std::sync::Arc;
use thiserror::Error;

/// The reason why a structure is not on the device.
#[derive(Debug, Error)]
pub enum StageError {
    /// An unknown name.
    #[error("no structure is called `{name}`; there are: {known}")]
    Unknown {
        /// The requested name.
        name: String,
        /// All names.
        known: String,
    },
    /// It cannot be built, or is invalid.
    #[error(transparent)]
    Accel(#[from] AccelError),
    /// An error of the device.
    #[error(transparent)]
    Gpu(#[from] GpuError),
}

/// A scene with its triangles and tables on the device.
pub struct Stage {
    /// The device.
    pub gpu: Gpu,
    /// The scene.
    pub scene: Arc<SceneData>,
    /// Its triangles for structures.
    pub soup: TriangleSoup,
    /// Its buffers for kernels.
    pub buffers: SceneBuffers,
}

impl Stage {
    /// Uploads a scene, with these intersection tests.
    ///
    /// # Errors
    /// A buffer exceeds the adapter's limit.
    pub fn new(
        gpu: &Gpu,
        scene: impl Into<Arc<SceneData>>,
        tests: Intersection,
    ) -> Result<Self, GpuError> {
        let scene = scene.into();
        let soup = TriangleSoup::new(&scene).intersecting(tests);
        Ok(Self {
            gpu: gpu.clone(),
            buffers: SceneBuffers::upload(gpu, &scene, &soup)?,
            soup,
            scene,
        })
    }

    /// Builds a structure over the scene, on the device if required, and checks its invariants.
    ///
    /// # Errors
    /// It cannot be built, or is invalid.
    pub fn build(
        &self,
        kind: &dyn AccelKind,
        params: &Params,
    ) -> Result<Box<dyn BuiltAccel>, AccelError> {
        let built = kind.build(&self.soup, params, &mut BuildLog::with_gpu(&self.gpu))?;
        built.validate(&self.soup)?;
        Ok(built)
    }

    /// [`Stage::build`] and upload.
    ///
    /// # Errors
    /// As [`Stage::build`], or an array exceeds the adapter's limits.
    pub fn traced(&self, kind: &dyn AccelKind, params: &Params) -> Result<Traced, StageError> {
        let built = self.build(kind, params)?;
        Ok(Traced::upload(&self.gpu, &*built)?)
    }

    /// A registered structure with its default parameters.
    ///
    /// # Errors
    /// As [`Stage::traced`], or an unknown name.
    pub fn structure(&self, registry: &AccelRegistry, name: &str) -> Result<Traced, StageError> {
        let kind = registry.get(name).ok_or_else(|| {
            let known: Vec<&str> = registry.iter().map(AccelKind::name).collect();
            StageError::Unknown {
                name: name.to_owned(),
                known: known.join(", "),
            }
        })?;
        self.traced(kind, &Params::default())
    }

    /// A tracer for buffers of rays through a structure of this scene.
    ///
    /// # Errors
    /// A kernel does not compose or compile.
    pub fn tracer(&self, traced: &Traced, ask: impl Into<Ask>) -> Result<Tracer, GpuError> {
        Tracer::new(&self.gpu, &self.buffers.triangles, traced, ask)
    }

    /// Nearest hits.
    ///
    /// # Errors
    /// A kernel does not compile, or the device is lost or hangs.
    pub fn closest(&self, traced: &Traced, rays: &[Ray]) -> Result<Answers<Hit>, GpuError> {
        let batch = self.tracer(traced, Query::Closest)?.batch(rays)?;
        batch.trace()?;
        Ok(Answers {
            answers: batch.hits()?,
            errors: batch.error_word()?,
        })
    }

    /// Returns `true` for each ray that hits anything; also `false` for a ray that a kernel omitted, which a
    /// closest-hit query reveals.
    ///
    /// # Errors
    /// As for [`Stage::closest`].
    pub fn any(&self, traced: &Traced, rays: &[Ray]) -> Result<Answers<bool>, GpuError> {
        let batch = self.tracer(traced, Query::Any)?.batch(rays)?;
        batch.trace()?;
        Ok(Answers {
            answers: batch.found()?.iter().map(|a| *a == Some(true)).collect(),
            errors: batch.error_word()?,
        })
    }

    /// Counted work of every ray; `None` if the structure does not count work.
    ///
    /// # Errors
    /// As for [`Stage::closest`].
    pub fn count_work(
        &self,
        traced: &Traced,
        query: Query,
        rays: &[Ray],
    ) -> Result<Option<Vec<Counters>>, GpuError> {
        count_work(&self.gpu, &self.buffers.triangles, traced, query, rays)
    }

    /// The same as a future: see [`raystone_gpu::Player::play_async`].
    ///
    /// # Errors
    /// As for [`Stage::closest`].
    pub async fn count_work_async(
        &self,
        traced: &Traced,
        query: Query,
        rays: &[Ray],
    ) -> Result<Option<Vec<Counters>>, GpuError> {
        count_work_async(&self.gpu, &self.buffers.triangles, traced, query, rays).await
    }

    /// Changes to other intersection tests that need no other precomputed words.
    pub fn set_tests(&mut self, tests: Intersection) {
        self.soup.intersection = tests;
        self.buffers.triangles.intersection = tests;
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::RayOffset;
    use raystone_accel::tracer::GroupShape;
    use raystone_gpu::Composition;

    #[test]
    fn what_kernels_get_where_nobody_chose_is_what_the_registries_call_default() {
        let chosen = Intersection::default().activate(Composition::new("x"));
        let chosen = RayOffset::default().activate(chosen);
        let chosen = GroupShape::default().activate(chosen);
        assert_eq!(Composition::new("x").completed(), chosen);
        assert_ne!(Composition::new("x"), chosen);
    }
}
