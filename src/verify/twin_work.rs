//! Counted work of kernels against that of the twins: nodes and tests per ray have no other check.

use crate::gate::ReferenceTracer;
use crate::rays::RaySet;
use rayon::prelude::*;
use raystone_accel::tracer::count_work_async;
use raystone_accel::{
    BuiltAccel, Counters, CpuTwin, Query, Ray, Traced, TriangleBuffers, TriangleSoup,
};
use raystone_gpu::{Gpu, GpuError};
use raystone_record::RayClass;

/// Rays of each class whose work is compared, besides the last: so many that one dispatch of
/// them, behind two small ones, makes invocations answer several.
const RAYS: usize = 4096;

/// The work of some rays of a class as the twin of a structure counts it.
#[derive(Debug, Clone)]
pub struct TwinWork {
    /// The ray class.
    pub class: RayClass,
    /// The query of the class.
    pub query: Query,
    /// The rays: spread over the class, the last among them.
    pub rays: Vec<Ray>,
    counted: Vec<Counters>,
}

impl TwinWork {
    /// Counts on the host.
    pub fn of(set: &RaySet, twin: &dyn CpuTwin) -> Self {
        let step = set.rays.len().div_ceil(RAYS).max(1);
        let spread = set.rays.iter().step_by(step);
        let rays: Vec<Ray> = spread.chain(set.rays.last()).copied().collect();
        Self::of_rays((set.class, set.query()), rays, twin)
    }

    fn of_rays((class, query): (RayClass, Query), rays: Vec<Ray>, twin: &dyn CpuTwin) -> Self {
        let count = |ray: &Ray| {
            let mut counters = Counters::default();
            match query {
                Query::Closest => drop(twin.closest_hit(ray, &mut counters)),
                Query::Any => drop(twin.any_hit(ray, &mut counters)),
            }
            counters
        };
        Self {
            class,
            query,
            counted: rays.par_iter().map(count).collect(),
            rays,
        }
    }

    /// Counts for all classes that are timed, and for rays at the structure's own margins; empty without a twin, or on an adapter without the host's arithmetic.
    pub fn of_structure(
        built: &dyn BuiltAccel,
        soup: &TriangleSoup,
        reference: &ReferenceTracer,
        exact: bool,
    ) -> Vec<Self> {
        let Some(twin) = built.cpu_twin(soup).filter(|_| exact) else {
            return Vec::new();
        };
        let sets = reference.of(built.space()).sets.iter();
        let timed = sets.filter(|set| set.is_timed());
        let mut work: Vec<Self> = timed.map(|set| Self::of(set, &*twin)).collect();
        let marginal = built.marginal_rays();
        if !marginal.is_empty() {
            let hard = (RayClass::Hard, Query::Closest);
            work.push(Self::of_rays(hard, marginal, &*twin));
        }
        work
    }

    /// The first ray whose work kernels count otherwise; `None` if there is none.
    pub fn fault(&self, kernel: &[Counters]) -> Option<String> {
        let class = self.class.name();
        if kernel.len() != self.rays.len() {
            let (found, all) = (kernel.len(), self.rays.len());
            return Some(format!("work is counted of {found} of {all} {class} rays"));
        }
        let pairs = || kernel.iter().zip(&self.counted);
        let first = pairs().position(|(kernel, twin)| kernel != twin)?;
        let wrong = pairs().filter(|(kernel, twin)| kernel != twin).count();
        Some(format!(
            "the counted work of {wrong} of {} {class} rays is not that of the structure's twin; first: ray {} | kernel {} | twin {}",
            self.rays.len(),
            self.rays[first],
            show(&kernel[first]),
            show(&self.counted[first])
        ))
    }

    /// Adds one to each counter of the last ray, one at a time. Returns what was not seen, or `None`.
    fn unseen(&self) -> Option<String> {
        type Plant = (&'static str, fn(&mut Counters));
        let plants: [Plant; 4] = [
            ("node", |work| work.nodes += 1),
            ("box test", |work| work.box_tests += 1),
            ("triangle test", |work| work.triangle_tests += 1),
            ("entry of a stack", |work| work.stack_high_water += 1),
        ];
        let is_seen = |plant: fn(&mut Counters)| {
            let mut counted = self.counted.clone();
            counted.last_mut().is_none_or(|work| {
                plant(work);
                true
            }) && (counted.is_empty() || self.fault(&counted).is_some())
        };
        let unseen = plants.into_iter().find(|(_, plant)| !is_seen(*plant));
        unseen.map(|(what, _)| {
            format!("the comparison of counted work is blind: a {what} too many is not seen")
        })
    }
}

fn show(work: &Counters) -> String {
    let Counters {
        nodes,
        box_tests,
        triangle_tests,
        stack_high_water,
    } = work;
    format!(
        "{nodes} nodes, {box_tests} box tests, {triangle_tests} triangle tests, {stack_high_water} on the stack"
    )
}

/// What is wrong with the work that kernels count; `None` if nothing is.
///
/// # Errors
/// A kernel does not compile, or the device is lost or hangs.
pub async fn fault_of_kernels(
    gpu: &Gpu,
    triangles: &TriangleBuffers,
    traced: &Traced,
    expected: &[TwinWork],
) -> Result<Option<String>, GpuError> {
    let blind = expected.first().and_then(TwinWork::unseen);
    if blind.is_some() {
        return Ok(blind);
    }
    for twin in expected {
        let counted = count_work_async(gpu, triangles, traced, twin.query, &twin.rays).await?;
        let fault = counted.and_then(|counted| twin.fault(&counted));
        if fault.is_some() {
            return Ok(fault);
        }
    }
    Ok(None)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn each_counter_of_the_last_ray_counts() {
        let ray = Ray::new([0.0; 3], [0.0, 0.0, 1.0]);
        let of = |rays: usize| TwinWork {
            class: RayClass::Primary,
            query: Query::Closest,
            rays: vec![ray; rays],
            counted: vec![Counters::default(); rays],
        };
        assert_eq!(of(2).unseen(), None);
        assert_eq!(of(0).unseen(), None);
        let twin = of(2);
        assert_eq!(twin.fault(&twin.counted), None);
        let more = Counters {
            stack_high_water: 1,
            ..Counters::default()
        };
        let fault = twin.fault(&[Counters::default(), more]);
        assert!(fault.is_some_and(|fault| fault.contains("1 on the stack")));
    }
}
