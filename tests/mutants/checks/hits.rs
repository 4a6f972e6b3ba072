//! Checks of structures: hits and counted work.

use super::{Bench, Finding};
use crate::plant::Faulty;
use crate::subject::{Changes, build, of_kind};
use crate::world::Case;
use raystone::accel::tracer::count_work;
use raystone::accel::{Counters, Intersection, Query, Ray, Traced, TriangleBuffers};
use raystone::gpu::ArithmeticProbe;
use raystone::measure::full_stacks::FullStack;
use raystone::measure::gate::gate;
use raystone::measure::ray_sets::fault_of_passes;
use raystone::measure::record::GateVerdict;
use raystone::params::Variant;

/// Rays whose work is counted, of each scene.
const COUNTED_RAYS: usize = 2048;

/// Runs the gate on these cases, each against its own reference tracer.
pub fn same_hits(bench: &Bench, name: &str, changes: Changes, cases: &[Case]) -> Finding {
    let probe = probe(bench.exact);
    for Case { stage, reference } in cases {
        let built = build(name, changes, &stage.soup)?;
        let traced = Traced::upload(bench.gpu, &Faulty::new(&*built, bench.plant)?)?;
        let triangles = TriangleBuffers::upload(bench.gpu, &stage.soup)?;
        let soup = &stage.soup;
        let verdict = gate(
            bench.gpu, &triangles, soup, &traced, reference, &probe, true,
        )?;
        if !verdict.passed {
            let what = evidence(&verdict);
            return Ok(Some(format!("{}: {what}", stage.scene.name)));
        }
    }
    Ok(None)
}

/// An adapter that computes like the host in every respect, or in none.
fn probe(exact: bool) -> ArithmeticProbe {
    ArithmeticProbe {
        unfused: exact,
        exact_division: exact,
        exact_sqrt: exact,
        exact_products: exact,
        denormals: exact,
    }
}

/// Hits where the stack of a structure is full.
pub fn full_stack(bench: &Bench, name: &str, changes: Changes) -> Finding {
    let filled = of_kind(name, changes, |kind, params| {
        Ok(FullStack::of(kind, params, Intersection::default()))
    })?;
    let Some(full) = filled else {
        return Ok(None);
    };
    let traced = Traced::upload(bench.gpu, &Faulty::new(&*full.built, bench.plant)?)?;
    Ok(full.fault(bench.gpu, &traced, &probe(bench.exact))?)
}

fn evidence(verdict: &GateVerdict) -> String {
    if let Some(error) = verdict.kernel_errors.first() {
        return error.clone();
    }
    let wrong: usize = verdict.classes.iter().map(|c| c.wrong).sum();
    let rays: usize = verdict.classes.iter().map(|c| c.rays).sum();
    let first = verdict.classes.iter().find_map(|c| c.first_wrong.clone());
    format!(
        "{wrong} of {rays} rays differ; first: {}",
        first.unwrap_or_default()
    )
}

/// Counted work of closest-hit and any-hit queries against the twin's, ray by ray, and what passes over many rays count, on one soup
/// and one scene.
pub fn same_work(bench: &Bench, name: &str, changes: Changes) -> Finding {
    let soups = bench.world.soups.iter().take(1);
    for Case { stage, reference } in soups.chain(bench.world.scenes.iter().skip(2).take(1)) {
        let built = build(name, changes, &stage.soup)?;
        let Some(twin) = built.cpu_twin(&stage.soup) else {
            continue;
        };
        let traced = Traced::upload(bench.gpu, &Faulty::new(&*built, bench.plant)?)?;
        let triangles = TriangleBuffers::upload(bench.gpu, &stage.soup)?;
        let all = reference.sets.iter().flat_map(|set| &set.rays);
        let count = all.clone().count();
        let rays: Vec<Ray> = all
            .step_by((count / COUNTED_RAYS).max(1))
            .copied()
            .collect();
        let accel = Variant {
            name: name.to_owned(),
            params: of_kind(name, changes, |_, params| Ok(params.clone()))?,
            ..Variant::default()
        };
        let sets = reference.sets.iter();
        if let Some(set) = sets.max_by_key(|set| set.rays.len()) {
            let on_device = (&triangles, &traced);
            let soup = &stage.soup;
            let fault = fault_of_passes(bench.gpu, on_device, (soup, &accel), set, bench.exact)?;
            if let Some(fault) = fault {
                return Ok(Some(format!("{}: {fault}", stage.scene.name)));
            }
        }
        for query in [Query::Closest, Query::Any] {
            let found =
                count_work(bench.gpu, &triangles, &traced, query, &rays)?.unwrap_or_default();
            for (index, (ray, found)) in rays.iter().zip(&found).enumerate() {
                let mut expected = Counters::default();
                if query == Query::Any {
                    twin.any_hit(ray, &mut expected);
                } else {
                    twin.closest_hit(ray, &mut expected);
                }
                if *found != expected {
                    return Ok(Some(format!(
                        "{}: ray {index}, {query:?}: {found:?}, twin {expected:?}",
                        stage.scene.name
                    )));
                }
            }
        }
    }
    Ok(None)
}
