//! Structures on the device, with rays for them.

use super::descent::Descent;
use super::readings;
use super::refitted::Refitted;
use super::world::World;
use crate::coherence::{Memory, of_rays, together};
use crate::run::{Absent, At, Prepared};
use crate::timed_rays::TimedRays;
use crate::timing::{Measured, Samples};
use raystone_accel::{
    AccelError, Access, Ask, BuildLog, BuiltAccel, DivideAndConquer, Ray, RayHierarchy, Space,
    Structure as _, Traced, Tracer, TriangleBuffers, TriangleSoup,
};
use raystone_config::{Axis, Cell, Coherence};
use raystone_gpu::Gpu;
use raystone_record::Reading;
use raystone_verify::rays::RaySet;
use std::sync::Arc;
use std::time::Instant;

/// Builds, of which the fastest counts: the first touches pages for the first time.
pub(super) const BUILDS: usize = 3;

pub(super) fn tracer_of(
    at: &At,
    gpu: &Gpu,
    (built, soup): (&dyn BuiltAccel, &TriangleSoup),
    set: &RaySet,
) -> Result<Tracer, Absent> {
    let triangles = TriangleBuffers::upload(gpu, soup)?;
    let traced = Traced::upload(gpu, built)?;
    let ask = Ask {
        runtime_checks: at.experiment.run.runtime_checks,
        ..set.query().into()
    };
    Ok(Tracer::new(gpu, &triangles, &traced, ask)?)
}

/// A structure on the device, with rays for it.
pub(super) struct Ready {
    rays: TimedRays,
    refitted: Option<Refitted>,
    set: Arc<RaySet>,
    world: Arc<World>,
    space: Space,
    live: usize,
    error: Option<f64>,
    cycles: Option<f64>,
    build_ms: f64,
    bytes: u64,
    descent: Option<Descent>,
}

impl Ready {
    pub(super) fn new(
        at: &At,
        cell: &Cell,
        (world, set): (Arc<World>, Arc<RaySet>),
        error: Option<f64>,
    ) -> Result<Self, Absent> {
        let gpu = at.gpu(cell)?;
        let text = |error: AccelError| Absent::Failed(error.to_string());
        let accel = &cell[Axis::Accel];
        let structure = at.registries.accel.named("structure", &accel.name);
        let structure = structure.map_err(Absent::Failed)?;
        let soup = &world.soup;
        let build = || {
            let start = Instant::now();
            let built = structure.build(soup, &accel.params, &mut BuildLog::with_gpu(gpu));
            built.map(|built| (start.elapsed().as_secs_f64() * 1e3, built))
        };
        let (mut build_ms, built) = build().map_err(text)?;
        for _ in 1..BUILDS {
            build_ms = build_ms.min(build().map_err(text)?.0);
        }
        built.validate(soup).map_err(text)?;
        let tracer = tracer_of(at, gpu, (&*built, soup), &set)?;
        let exact = world.exact;
        let descent = match accel.name.as_str() {
            RayHierarchy::NAME => Some(Descent::of_tree(
                gpu,
                (&tracer, &set),
                (soup, accel),
                exact,
            )?),
            DivideAndConquer::NAME => Some(Descent::of_division(
                gpu,
                (&tracer, &set),
                (soup, accel),
                exact,
            )?),
            _ => None,
        };
        Ok(Self {
            rays: TimedRays::new(tracer.batch(&set.rays)?),
            refitted: Refitted::new(at, cell, &world, &set)?,
            live: readings::live(&set.rays),
            build_ms,
            bytes: built.stats().bytes,
            space: built.space(),
            error,
            cycles: match &at.experiment.coherence {
                Some(settings) => cycles(&*built, soup, &set, settings).map_err(Absent::Failed)?,
                None => None,
            },
            descent,
            set,
            world,
        })
    }
}

/// Predicted cycles per ray in warps of rays that follow each other; `None` for a structure that answers rays together.
fn cycles(
    built: &dyn BuiltAccel,
    soup: &TriangleSoup,
    set: &RaySet,
    settings: &Coherence,
) -> Result<Option<f64>, String> {
    let is_inline = matches!(built.access(), Access::Inline);
    let Some(twin) = built.cpu_twin(soup).filter(|_| is_inline) else {
        return Ok(None);
    };
    let memory = Memory::new(built, soup)?;
    let rays: Vec<Ray> = set
        .rays
        .iter()
        .filter(|ray| ray.is_ray())
        .copied()
        .collect();
    let groups = of_rays(&rays, set.query(), (&*twin, &memory), settings)?;
    let all = together(&groups).into_values().next().unwrap_or_default();
    Ok((all.rays > 0).then(|| all.cost() as f64 / all.rays as f64))
}

impl Prepared for Ready {
    fn timed(&self) -> Vec<&dyn Measured> {
        let refitted = self.refitted.iter().map(|tree| &tree.rays as &dyn Measured);
        std::iter::once(&self.rays as &dyn Measured)
            .chain(refitted)
            .collect()
    }

    fn readings(&self, samples: Vec<Samples>) -> Result<Vec<Reading>, String> {
        let soup = &self.world.soup;
        let exact = self.world.exact;
        let wrong = self.rays.fault(&self.set, soup, self.space, exact);
        if let Some(wrong) = wrong.map_err(|e| e.to_string())? {
            return Err(wrong);
        }
        let mut samples = samples.into_iter();
        let own = samples.next().unwrap_or_default();
        let mut found = readings::times(&own, self.live as f64, self.build_ms)?;
        if let Some((tree, samples)) = self.refitted.as_ref().zip(samples.next()) {
            let wrong = tree.rays.fault(&self.set, soup, tree.space, exact);
            if let Some(wrong) = wrong.map_err(|e| e.to_string())? {
                return Err(format!("refitted: {wrong}"));
            }
            found.extend(readings::refitted(&samples, self.live as f64, tree.ms)?);
        }
        let triangles = self.world.soup.records.len();
        found.extend(readings::counts(self.live, triangles, self.bytes));
        found.extend(readings::of_sampler(self.error, self.cycles));
        if let Some(descent) = &self.descent {
            let rays = self.live as f64;
            found.extend(readings::descent(descent, rays));
            found.extend(readings::passes(&self.rays.passes(), rays));
        }
        Ok(found)
    }
}
