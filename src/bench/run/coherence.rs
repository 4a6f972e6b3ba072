//! Coherence of full cells: the rays of some pixels, through the twins of the structures, on the model's machine.

use super::cost::{Cost, Work};
use super::error::RunError;
use super::images::Estimator;
use super::measurement::Measurement;
use super::session::{End, Session};
use super::structures::Gated;
use super::times::Times;
use super::twins::with_twin;
use super::world::World;
use crate::coherence::{
    Machine, Memory, Organisation, RayClass, Rays, View, groups_of, run_groups, together,
};
use raystone_accel::CpuTwin;
use raystone_config::{Cell, Coherence, Experiment, Plan};
use raystone_record::{Body, CoherenceAt, CoherenceRecord, Key, Line, Ran, by_group};
use raystone_verify::path_oracle::{self, PathOracle};
use std::collections::BTreeMap;

/// Seconds to model a cell.
const MODEL_SECONDS: f64 = 1.0;

/// Coherence of full cells, by a model.
pub(super) struct Models;

impl Measurement for Models {
    fn name(&self) -> &'static str {
        "coherence"
    }

    fn plural(&self) -> &'static str {
        "models of coherence"
    }

    fn cells(&self, experiment: &Experiment, plan: &Plan) -> Vec<Cell> {
        if experiment.coherence.is_none() {
            return Vec::new();
        }
        plan.modelled(experiment)
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        Times.rounds_of(cell)
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        format!(
            "{:?}",
            (
                experiment.run.seed,
                &experiment.camera,
                &experiment.coherence
            )
        )
    }

    fn cost(&self, _: &Cell, _: &Cost) -> Work {
        Work::other(MODEL_SECONDS)
    }
}

/// What does not depend on the structure.
struct Known<'a> {
    oracle: Result<PathOracle<'a>, String>,
    /// Rays of a sampler's cell, for each number of samples per pixel.
    rays: BTreeMap<String, Vec<(u32, Rays)>>,
}

/// All full cells of a world, where the experiment asks for it.
pub(super) fn run(session: &mut Session, world: &World, gated: &[Gated]) -> Result<(), RunError> {
    let Some(settings) = session.experiment.coherence.clone() else {
        return Ok(());
    };
    let mut cells = session.plan.modelled(session.experiment);
    cells.retain(|cell| cell.is_on(&world.cell));
    if cells.is_empty() {
        return Ok(());
    }
    let mut known = Known {
        oracle: session.clock.time("coherence", || {
            PathOracle::knowing(&world.scene, &session.registries.kinds)
        }),
        rays: BTreeMap::new(),
    };
    for structure in gated {
        let own = cells.iter().filter(|cell| cell.is_on(&structure.cell));
        let own: Vec<&Cell> = own
            .filter(|cell| !session.ledger.is_done(&name(cell)))
            .collect();
        if own.is_empty() {
            continue;
        }
        let records = of_structure(session, world, structure, &own, (&settings, &mut known));
        for (cell, record) in own.into_iter().zip(records) {
            match record {
                Ok(record) => write(session, world, cell, record)?,
                Err(reason) => session.write_refused(name(cell), reason)?,
            }
        }
    }
    Ok(())
}

fn name(cell: &Cell) -> String {
    Models.unit_name(cell)
}

fn write(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    record: CoherenceRecord,
) -> Result<(), RunError> {
    session.progress.add(MODEL_SECONDS);
    let settings = format!("{:?}", record.settings);
    let end = End {
        scene: &world.scene.hash,
        of: &[("coherence", &settings)],
        ..End::default()
    };
    let line = Line::new(Key::from(cell), Ran::default(), Body::Coherence(record));
    session.conclude(&name(cell), line, end)
}

/// Each cell of a structure, or why there is nothing to say of it.
fn of_structure(
    session: &mut Session,
    world: &World,
    structure: &Gated,
    cells: &[&Cell],
    (settings, known): (&Coherence, &mut Known),
) -> Vec<Result<CoherenceRecord, String>> {
    let records = with_twin(session, world, &structure.cell, |session, twin, memory| {
        let of_cell =
            |cell: &&Cell| of_cell(session, world, cell, (twin, memory), (settings, known));
        Ok(cells.iter().map(of_cell).collect())
    });
    records.unwrap_or_else(|reason| vec![Err(reason); cells.len()])
}

fn of_cell(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    (twin, memory): (&dyn CpuTwin, &Memory),
    (settings, known): (&Coherence, &mut Known),
) -> Result<CoherenceRecord, String> {
    session.say(name(cell));
    let sampler = cell.on(&Cell::SAMPLER).to_string();
    if !known.rays.contains_key(&sampler) {
        let rays = rays(session, world, cell, (settings, known.oracle.as_ref()?))?;
        known.rays.insert(sampler.clone(), rays);
    }
    let rays = &known.rays[&sampler];
    let timed_spp = session.timed_samples();
    let modelled = || modelled(rays, twin, memory, settings);
    let at = session.clock.time("coherence", modelled)?;
    Ok(CoherenceRecord {
        settings: settings.clone(),
        timed_spp,
        at,
    })
}

/// The rays of a cell, for each number of samples per pixel.
fn rays(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    (settings, oracle): (&Coherence, &PathOracle),
) -> Result<Vec<(u32, Rays)>, String> {
    let size = settings.resolution;
    let seed = session.experiment.seeds().replicates.first().copied();
    let bounds = world.scene.bounds();
    let mut all = Vec::new();
    for &spp in &settings.spp {
        let estimator = Estimator::of(session.registries, cell, spp, size[0])?;
        let count = [settings.groups, settings.warps];
        let groups = groups_of(size, settings.warp, count, estimator.sampler.stride());
        let image = path_oracle::View {
            estimator: path_oracle::Estimator::of(&estimator.integrator).map_err(no_model)?,
            camera: world.camera,
            size,
            sampler: &estimator.sampler,
        };
        let view = View {
            oracle,
            image: &image,
            diagonal: 2.0 * f64::from(bounds.radius()),
            samples: &spread(spp, settings.samples),
            seed: seed.unwrap_or_default(),
        };
        let rays = (session.clock).time("coherence", || Rays::new(&view, &groups));
        all.push((spp, rays));
    }
    Ok(all)
}

/// Why nothing is modelled, of what the path oracle does not know.
fn no_model(unknown: String) -> String {
    format!("the model does not follow the rays of {unknown}")
}

/// So many of the indices below `spp`, evenly spread from the first on.
fn spread(spp: u32, count: u32) -> Vec<u32> {
    let count = count.min(spp).max(1);
    let index = |i| (u64::from(i) * u64::from(spp) / u64::from(count)) as u32;
    (0..count).map(index).collect()
}

/// What the model says of these rays.
fn modelled(
    rays: &[(u32, Rays)],
    twin: &dyn CpuTwin,
    memory: &Memory,
    settings: &Coherence,
) -> Result<Vec<CoherenceAt>, String> {
    let machine = Machine::new(settings);
    let mut at = Vec::new();
    for (spp, rays) in rays {
        let groups = rays.through(twin, memory)?;
        for organisation in Organisation::ALL {
            let warps = groups.iter().map(|warps| organisation.of(warps.clone()));
            let of_groups = run_groups(&machine, &warps.collect::<Vec<_>>());
            let mut known = CoherenceAt {
                spp: *spp,
                organisation: organisation.name().to_owned(),
                paths: rays.paths,
                classes: Vec::new(),
                groups: Vec::new(),
            };
            for (class, tally) in together(&of_groups) {
                known.groups.push(by_group(&of_groups, class));
                known
                    .classes
                    .push((RayClass::of_word(class).to_string(), tally));
            }
            at.push(known);
        }
    }
    Ok(at)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn samples_are_spread_over_all_and_none_stands_twice() {
        assert_eq!(spread(64, 4), [0, 16, 32, 48]);
        assert_eq!(spread(64, 1), [0]);
        assert_eq!(spread(3, 8), [0, 1, 2]);
        assert_eq!(spread(10, 4), [0, 2, 5, 7]);
    }

    #[test]
    fn what_the_model_does_not_know_of_makes_no_further_cells() {
        let text = "[axes]\nscene = [\"cornell-box\"]\naccel = [\"bvh\", \"cwbvh\"]\nsequence = [\"sobol\"]\n[coherence]\n";
        let registries = crate::run::Registries::default();
        let modelled = |overrides: &[&str]| {
            let overrides: Vec<String> = overrides.iter().map(ToString::to_string).collect();
            let experiment =
                Experiment::parse(text, "test", &overrides, &registries.catalogue()).unwrap();
            let plan = Plan::new(&experiment, &[], |s, d| registries.is_randomised(s, d)).unwrap();
            [plan.modelled(&experiment).len(), plan.times.len()]
        };
        assert_eq!(modelled(&[]), [2, 2]);
        for further in [
            "axes.load=buffer,texture",
            "axes.organisation=single-kernel,wavefront",
            "axes.workgroup=8x8,16x16",
        ] {
            assert_eq!(modelled(&[further]), [2, 4], "{further}");
        }
    }
}
