//! Error: once per scene, integrator and sampler, through the fastest gated structure.

use super::adaptive;
use super::cost::{Cost, Work};
use super::error::{Fault, RunError};
use super::images::{self, Estimator, write_spread};
use super::measurement::{Measurement, Through};
use super::paths;
use super::reference::{ReferenceImage, reference, reference_structure};
use super::reference_file::image_hash;
use super::replicates::{Pass, all_samples, check_distinct, until_met};
use super::session::Session;
use super::structures::{Gated, image_settings};
use super::world::World;
use crate::spectrum::{ErrorSpectrum, mean_filtered, mean_power, spectrum_of};
use raystone_config::{Axis, Cell, Experiment, Plan, REFERENCE_PARTS};
use raystone_image::Image;
use raystone_record::{BiasRecord, Body, Key, Line, Outcome, Ran, SpectrumRecord};
use raystone_render::rounding_bound;
use raystone_stats::bias::{BiasOptions, BiasVerdict, check_bias};
use raystone_stats::statistics::mean_interval;

/// Errors of samplers against a reference.
pub(super) struct Errors;

impl Measurement for Errors {
    fn name(&self) -> &'static str {
        "sampler"
    }

    fn plural(&self) -> &'static str {
        "errors of samplers"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.samplers.clone()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        (self.name(), cell.clone())
    }

    fn is_timed(&self) -> bool {
        false
    }

    fn settings(&self, experiment: &Experiment, reference_file: &str) -> String {
        let e = experiment;
        let reference = (&e.reference, reference_file);
        format!(
            "{:?}",
            (
                image_settings(e),
                e.run.replicates,
                &e.run.spp,
                &e.stop,
                reference
            )
        )
    }

    fn cost(&self, cell: &Cell, cost: &Cost) -> Work {
        let image = cost.image(&cell[Axis::Integrator], cost.experiment.run.spp.max());
        image * f64::from(cost.plan.renders(cell))
    }

    fn shared_cost(&self, cell: &Cell, cost: &Cost) -> Option<(Cell, Work)> {
        let of = [&Cell::WORLD[..], &[Axis::Integrator]].concat();
        let whole = cost.reference_part(cell) * f64::from(REFERENCE_PARTS);
        Some((cell.on(&of), whole))
    }

    fn through(&self) -> Through {
        Through::Any
    }
}

/// The fastest gated structure with the kernels of a cell that its integrator can use, or why there is none:
/// a refusal, or a failure.
fn fastest<'a>(
    session: &Session,
    gated: &'a [Gated],
    cell: &Cell,
) -> Result<&'a Gated, Option<String>> {
    let same = gated
        .iter()
        .filter(|g| g.cell[Axis::Kernels] == cell[Axis::Kernels]);
    let unfit = |g: &Gated| images::unfit(session, cell, &g.traced);
    let fitting = same.clone().filter(|g| unfit(g).is_none());
    let fastest = fitting.max_by(|a, b| a.speed.total_cmp(&b.speed));
    fastest.ok_or_else(|| same.clone().find_map(unfit))
}

/// All samplers of a world.
pub(super) fn run(session: &mut Session, world: &World, gated: &[Gated]) -> Result<(), RunError> {
    if gated.is_empty() {
        return Ok(());
    }
    let mut traced = None;
    for integrator in &session.experiment.axes[Axis::Integrator] {
        let wanted = world.cell.clone().with(Axis::Integrator, integrator);
        let cells = session.plan.samplers.iter();
        let cells = cells.filter(|c| c.is_on(&wanted) && !session.ledger.is_done(&c.to_string()));
        let cells: Vec<Cell> = cells.cloned().collect();
        if cells.is_empty() {
            continue;
        }
        let traced = match &traced {
            Some(known) => known,
            None => traced.insert(match reference_structure(session, world, gated) {
                Ok(traced) => Ok(traced),
                Err(fault) => Err(fault.of_cell()?),
            }),
        };
        let made = match traced {
            Ok(traced) => reference(session, world, traced, &wanted),
            Err(reason) => Err(reason.clone().into()),
        };
        match made {
            Ok(reference_image) => all_errors(session, world, gated, &cells, &reference_image)?,
            Err(fault) => {
                let reason = fault.of_cell()?;
                for cell in cells {
                    session.write_failure(&cell.to_string(), format!("no reference: {reason}"))?;
                }
            }
        }
        if world.gpu.lost().is_some() {
            return Ok(());
        }
    }
    Ok(())
}

/// The samplers with one reference.
fn all_errors(
    session: &mut Session,
    world: &World,
    gated: &[Gated],
    cells: &[Cell],
    reference_image: &ReferenceImage,
) -> Result<(), RunError> {
    for cell in cells {
        session.go_on()?;
        let text = cell.to_string();
        let fastest = match fastest(session, gated, cell) {
            Ok(fastest) => fastest,
            Err(Some(refusal)) => {
                session.write_refused(text, refusal)?;
                continue;
            }
            Err(None) => {
                let reason = "no structure passed the gate with these kernels";
                session.write_failure(&text, reason.to_owned())?;
                continue;
            }
        };
        session.lose_device_on_request(world.gpu, &text);
        if let Err(fault) = sampler_error(session, world, fastest, cell, reference_image) {
            session.write_failure(&text, fault.of_cell()?)?;
        }
        if world.gpu.lost().is_some() {
            return Ok(());
        }
    }
    Ok(())
}

/// What a replicate is rendered in: one pass, unless each number of samples has points of its own,
/// which makes a pass each.
fn passes<'a>(
    session: &mut Session,
    world: &'a World,
    fastest: &Gated,
    cell: &Cell,
) -> Result<Vec<Pass<'a>>, String> {
    let spps: Vec<u32> = session.experiment.run.spp.counts().collect();
    let most = session.experiment.run.spp.max();
    let whole = Estimator::new(session, cell, most)?;
    let estimators = if whole.sampler.by_count() {
        let single = |spp| {
            let estimator = Estimator::new(session, cell, spp)?;
            Ok((vec![spp], estimator))
        };
        spps.into_iter()
            .map(single)
            .collect::<Result<_, String>>()?
    } else {
        vec![(spps, whole)]
    };
    let seeds = session.experiment.seeds().replicates;
    let is_by_tile = session
        .experiment
        .stop
        .is_some_and(|rule| rule.tile.is_some());
    let by_blocks = is_by_tile && cell.randomised;
    let pass = |(spps, estimator): (Vec<u32>, Estimator)| {
        let words = bytemuck::cast_slice(estimator.sampler.table.words());
        Ok(Pass {
            renderer: if by_blocks {
                estimator.by_blocks(session, world, &fastest.traced, &seeds)?
            } else {
                estimator.renderer(session, world, &fastest.traced, &seeds, [true, false])?
            },
            spps,
            table: blake3::hash(words).to_hex().to_string(),
        })
    };
    estimators.into_iter().map(pass).collect()
}

/// All replicates of one sampler.
fn sampler_error(
    session: &mut Session,
    world: &World,
    fastest: &Gated,
    cell: &Cell,
    reference_image: &ReferenceImage,
) -> Result<(), Fault> {
    session.say(cell.to_string());
    let passes = passes(session, world, fastest, cell)?;
    paths::check(session, world, &fastest.traced, cell)?;
    let mut kernels: Vec<_> = passes.iter().map(|p| p.renderer.kernel_hash()).collect();
    kernels.dedup();
    let tables: String = passes.iter().map(|pass| pass.table.as_str()).collect();
    let blank = Line::new(Key::from(cell), Ran::kernel(kernels.join("+")), ());
    let reference = image_hash(reference_image.reference.image());
    let [drawn, camera] = [
        format!(
            "{:?}",
            (
                &session.experiment.run.spp,
                session.experiment.seeds().replicates
            )
        ),
        format!("{:?}", (world.camera, session.experiment.run.resolution)),
    ];
    let rule = session.experiment.stop;
    let stop = rule.map(|rule| format!("{rule:?}")).unwrap_or_default();
    let made_of = [
        ("sampler table", tables.as_str()),
        ("stop", &stop),
        ("reference", &reference),
        ("spp and seeds", &drawn),
        ("camera and size", &camera),
    ];
    let hash = blank.content_hash(&world.scene.hash, &made_of);
    let line = |body| blank.clone().hashed(&hash).with_body(|()| body);
    let by_tile = rule.and_then(|rule| Some((rule, rule.tile?)));
    let replicates = match (rule, by_tile.filter(|_| cell.randomised)) {
        (_, Some(by_tile)) => adaptive::by_tile(
            session,
            cell,
            reference_image,
            single(&passes)?,
            &line,
            by_tile,
        )?,
        (None, _) => all_samples(session, cell, reference_image, &passes, &line)?,
        (Some(rule), _) => until_met(session, cell, reference_image, &passes, &line, rule)?,
    };
    let spp = replicates.spp;
    let finals = replicates.images;
    if cell.randomised {
        check_distinct(&finals, reference_image)?;
    }
    write_spread(session, cell, spp, &finals)?;
    let bias = bias_record(session, cell, &finals, reference_image)?;
    session.recorder.write(&line(Body::Bias(bias)))?;
    let spectrum = spectrum_record(spp, &finals, reference_image)?;
    session.recorder.write(&line(Body::Spectrum(spectrum)))?;
    let judged = session
        .checked
        .integrator_lines
        .get(&paths::key(world, cell))
        .cloned();
    let mut lines = vec![hash.clone(), reference_image.line.clone()];
    lines.extend(judged);
    let name = cell.to_string();
    session.close(&name, (Outcome::Done, ""), lines, &[&reference_image.name])?;
    Ok(())
}

/// The one pass of a sampler whose points do not depend on how many there are.
fn single<'p, 'a>(passes: &'p [Pass<'a>]) -> Result<&'p Pass<'a>, Fault> {
    match passes {
        [only] => Ok(only),
        _ => Err(Fault::Cell(
            "its points are others for each number of samples: tiles cannot take different numbers"
                .to_owned(),
        )),
    }
}

/// The spectra of all replicates, at the highest number of samples.
fn spectrum_record(
    spp: u32,
    images: &[Image],
    reference_image: &ReferenceImage,
) -> Result<SpectrumRecord, String> {
    let spectrum = |image: &Image| spectrum_of(image, reference_image.reference.image());
    let spectra: Result<Vec<_>, _> = images.iter().map(spectrum).collect();
    let spectra = spectra.map_err(|e| e.to_string())?;
    let mean = |figure: fn(&ErrorSpectrum) -> Option<f64>| {
        let values: Vec<f64> = spectra.iter().filter_map(figure).collect();
        mean_interval(&values)
    };
    Ok(SpectrumRecord {
        spp,
        replicates: spectra.len(),
        power: mean_power(&spectra),
        low_frequency: mean(|s| s.low_frequency),
        loudest: mean(|s| s.loudest),
        autocorrelation: mean(|s| s.autocorrelation),
        filtered: mean_filtered(&spectra),
    })
}

/// The probability of a false alarm is shared out among all samplers of the run that claim to have no
/// bias, so that a run of many sound samplers does not cry wolf.
pub(super) fn bias_options(tested: usize, spp: u32, of_reference: f64) -> BiasOptions {
    let defaults = BiasOptions::default();
    BiasOptions {
        alpha: defaults.alpha / tested.max(1) as f64,
        rounding: rounding_bound(spp) + of_reference,
        ..defaults
    }
}

fn bias_record(
    session: &Session,
    cell: &Cell,
    images: &[Image],
    reference_image: &ReferenceImage,
) -> Result<BiasRecord, String> {
    let claims = |s: &Cell| s.randomised && session.registries.is_unbiased(s);
    let tested = session.plan.samplers.iter().filter(|s| claims(s)).count();
    let defaults = BiasOptions::default();
    let options = bias_options(
        tested,
        session.experiment.run.spp.max(),
        reference_image.rounding,
    );
    let check = check_bias(images, reference_image.reference.parts(), options);
    let check = check.map_err(|e| e.to_string())?;
    let verdict = if cell.randomised {
        check.verdict
    } else {
        BiasVerdict::NotTestable("the sampler is deterministic, its error is not noise".to_owned())
    };
    let [whole, weighted] = [check.whole, check.weighted].map(|t| t.filter(|_| cell.randomised));
    Ok(BiasRecord {
        tiles: check.tiles,
        rejected: check.rejected.len(),
        alpha: check.alpha,
        alpha_of_run: Some(defaults.alpha),
        p_of_all: Some(check.p).filter(|_| cell.randomised),
        min_p: check.min_p,
        p_histogram: check.p_histogram.to_vec(),
        z: whole.map(|test| test.t).filter(|t| t.is_finite()),
        p: whole.map(|test| test.p),
        degrees_of_freedom: whole.map(|test| test.degrees_of_freedom),
        weighted_p: weighted.map(|test| test.p),
        weighted_degrees_of_freedom: weighted.map(|test| test.degrees_of_freedom),
        detectable: check.detectable.filter(|_| cell.randomised),
        by_design: cell.randomised && !session.registries.is_unbiased(cell),
        verdict,
    })
}
