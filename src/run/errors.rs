//! Error: once per scene, integrator and sampler, through the fastest gated structure.

use super::RunError;
use super::images::{self, Estimator};
use super::reference::{Yardstick, reference, reference_structure};
use super::session::Session;
use super::structures::Gated;
use super::world::World;
use crate::config::SamplerCell;
use crate::image::{Image, Picture, tone_map, viridis};
use crate::integrator::{Renderer, Snapshot, rounding_bound};
use crate::measure::bias::{BiasOptions, BiasVerdict, check_bias};
use crate::measure::metrics::{error_map, measure};
use crate::measure::record::{
    BiasRecord, Body, ErrorAtSpp, ErrorRecord, Line, Ran, SpectrumRecord, axis,
};
use crate::measure::spectrum::{
    ErrorSpectrum, error_spectrum, luminance_error, mean_filtered, mean_power,
};
use crate::measure::statistics::mean_interval;
use crate::text::cell_hash;

/// Relative error per pixel at the top of the colour scale of error maps.
const ERROR_MAP_FULL_SCALE: f32 = 1.0;

/// Renders; the error in words.
fn rendered(renderer: &Renderer, spps: &[u32], seed: u32) -> Result<Vec<Snapshot>, String> {
    renderer.render(spps, seed).map_err(|e| e.to_string())
}

/// The fastest gated structure with the kernels of a cell that its integrator can use.
fn fastest<'a>(session: &Session, gated: &'a [Gated], cell: &SamplerCell) -> Option<&'a Gated> {
    let fits = |g: &&Gated| {
        g.cell.kernels == cell.kernels
            && images::unfit(session, &cell.integrator, &g.traced).is_none()
    };
    let fitting = gated.iter().filter(fits);
    fitting.max_by(|a, b| a.speed.total_cmp(&b.speed))
}

/// All samplers of a scene.
pub(super) fn run(session: &mut Session, world: &World, gated: &[Gated]) -> Result<(), RunError> {
    if gated.is_empty() {
        return Ok(());
    }
    let cells: Vec<SamplerCell> = session
        .plan
        .samplers
        .iter()
        .filter(|c| c.scene == *world.variant)
        .cloned()
        .collect();
    let mut traced = None;
    for variant in session.experiment.axes.integrator.clone() {
        let wanted = |c: &&SamplerCell| c.integrator == variant && !session.is_done(&c.to_string());
        let cells: Vec<SamplerCell> = cells.iter().filter(wanted).cloned().collect();
        if cells.is_empty() {
            continue;
        }
        let traced = match &traced {
            Some(known) => known,
            None => traced.insert(reference_structure(session, world, gated)?),
        };
        let made = match traced {
            Ok(traced) => reference(session, world, traced, &variant)?,
            Err(reason) => Err(reason.clone()),
        };
        let yardstick = match made {
            Ok(yardstick) => yardstick,
            Err(reason) => {
                for cell in cells {
                    session.write_failure(&cell.to_string(), format!("no reference: {reason}"))?;
                }
                if world.gpu.lost().is_some() {
                    return Ok(());
                }
                continue;
            }
        };
        for cell in cells {
            let Some(fastest) = fastest(session, gated, &cell) else {
                let mut same = gated.iter().filter(|g| g.cell.kernels == cell.kernels);
                let unfit = same.find_map(|g| images::unfit(session, &cell.integrator, &g.traced));
                match unfit {
                    Some(reason) => session.write_refused(cell.to_string(), reason)?,
                    None => {
                        let reason = "no structure passed the gate with these kernels";
                        session.write_failure(&cell.to_string(), reason.to_owned())?;
                    }
                }
                continue;
            };
            session.lose_device_on_request(world.gpu, &cell.to_string());
            if let Err(reason) = sampler_error(session, world, fastest, &cell, &yardstick)? {
                session.write_failure(&cell.to_string(), reason)?;
            }
            if world.gpu.lost().is_some() {
                return Ok(());
            }
        }
    }
    Ok(())
}

/// One render of a replicate, and the numbers of samples at which its image is kept.
struct Pass<'a> {
    renderer: Renderer<'a>,
    spps: Vec<u32>,
    /// Hash of the sampler's words.
    table: String,
}

/// What a replicate is rendered in: one pass, unless each number of samples has points of its own,
/// which makes a pass each.
fn passes<'a>(
    session: &mut Session,
    world: &'a World,
    fastest: &Gated,
    cell: &SamplerCell,
) -> Result<Vec<Pass<'a>>, String> {
    let pair = (&cell.sequence, &cell.decorrelation);
    let spps: Vec<u32> = session.experiment.spp.counts().collect();
    let most = session.experiment.spp.max();
    let whole = Estimator::new(session, pair, &cell.integrator, most)?;
    let estimators = if whole.sampler.by_count() {
        let single = |spp| {
            let estimator = Estimator::new(session, pair, &cell.integrator, spp)?;
            Ok((vec![spp], estimator))
        };
        spps.into_iter()
            .map(single)
            .collect::<Result<_, String>>()?
    } else {
        vec![(spps, whole)]
    };
    let seeds = session.experiment.seeds().replicates;
    let with = (&cell.kernels, &fastest.traced);
    let pass = |(spps, estimator): (Vec<u32>, Estimator)| {
        let words = bytemuck::cast_slice(estimator.sampler.table.words());
        Ok(Pass {
            renderer: estimator.renderer(session, world, with, &seeds, [true, false])?,
            spps,
            table: blake3::hash(words).to_hex().to_string(),
        })
    };
    estimators.into_iter().map(pass).collect()
}

/// All replicates of one sampler. The inner error concerns this cell alone.
fn sampler_error(
    session: &mut Session,
    world: &World,
    fastest: &Gated,
    cell: &SamplerCell,
    yardstick: &Yardstick,
) -> Result<Result<(), String>, RunError> {
    session.say(cell.to_string());
    let passes = match passes(session, world, fastest, cell) {
        Ok(passes) => passes,
        Err(reason) => return Ok(Err(reason)),
    };
    let ran = {
        let mut hashes: Vec<_> = passes
            .iter()
            .map(|pass| pass.renderer.kernel_hash())
            .collect();
        hashes.dedup();
        Ran::kernel(hashes.join("+"))
    };
    let key = (world.key(&cell.kernels))
        .with_variant(axis::INTEGRATOR, &cell.integrator)
        .with_variant(axis::SEQUENCE, &cell.sequence)
        .with_variant(axis::DECORRELATION, &cell.decorrelation);
    let tables: String = passes.iter().map(|pass| pass.table.as_str()).collect();
    let hash = cell_hash(&[
        ("scene", &world.scene.hash),
        (
            "sampler",
            &serde_json::to_string(&(&cell.sequence, &cell.decorrelation, &cell.integrator))
                .unwrap_or_default(),
        ),
        ("kernel", &ran.kernel_hash),
        ("sampler table", &tables),
        ("version", env!("CARGO_PKG_VERSION")),
    ]);
    let seeds = session.experiment.seeds().replicates;
    let seeds = seeds.into_iter().take(cell.replicates as usize);
    let line = |body| Line::new(key.clone(), ran.clone(), body).hashed(&hash);
    let mut finals = Vec::new();
    for (replicate, seed) in seeds.enumerate() {
        let mut snapshots = Vec::new();
        for pass in &passes {
            let render = || rendered(&pass.renderer, &pass.spps, seed);
            match session.clock.time("gpu", render) {
                Ok(rendered) => snapshots.extend(rendered),
                Err(reason) => return Ok(Err(reason)),
            }
        }
        let record = match error_record(
            session,
            world,
            cell,
            yardstick,
            &snapshots,
            (replicate as u32, seed),
        )? {
            Ok(record) => record,
            Err(reason) => return Ok(Err(reason)),
        };
        if record.non_finite_pixels > 0 {
            return Ok(Err(format!(
                "replicate {replicate} has {} pixels that are not finite",
                record.non_finite_pixels
            )));
        }
        session.write(&line(Body::Error(record)))?;
        finals.extend(snapshots.into_iter().last().map(|s| s.image));
        session.progress.inc(1);
    }
    session.finish(cell.to_string());
    match bias_record(session, cell, &finals, yardstick) {
        Ok(record) => session.write(&line(Body::Bias(record)))?,
        Err(reason) => return Ok(Err(reason)),
    }
    match spectrum_record(session, &finals, yardstick) {
        Ok(record) => session.write(&line(Body::Spectrum(record))).map(Ok),
        Err(reason) => Ok(Err(reason)),
    }
}

/// The spectra of all replicates, at the highest number of samples.
fn spectrum_record(
    session: &Session,
    images: &[Image],
    yardstick: &Yardstick,
) -> Result<SpectrumRecord, String> {
    let size = session.experiment.resolution.map(|edge| edge as usize);
    let spectrum = |image: &Image| {
        let error = luminance_error(image, yardstick.reference.image());
        error.map(|error| error_spectrum(&error, size))
    };
    let spectra: Result<Vec<_>, _> = images.iter().map(spectrum).collect();
    let spectra = spectra.map_err(|e| e.to_string())?;
    let mean = |figure: fn(&ErrorSpectrum) -> Option<f64>| {
        let values: Vec<f64> = spectra.iter().filter_map(figure).collect();
        mean_interval(&values)
    };
    Ok(SpectrumRecord {
        spp: session.experiment.spp.max(),
        replicates: spectra.len(),
        power: mean_power(&spectra),
        low_frequency: mean(|s| s.low_frequency),
        autocorrelation: mean(|s| s.autocorrelation),
        filtered: mean_filtered(&spectra),
    })
}

fn error_record(
    session: &Session,
    world: &World,
    cell: &SamplerCell,
    yardstick: &Yardstick,
    snapshots: &[Snapshot],
    (replicate, seed): (u32, u32),
) -> Result<Result<ErrorRecord, String>, RunError> {
    let mut errors = Vec::new();
    let mut non_finite_pixels = 0;
    for snapshot in snapshots {
        match measure(&snapshot.image, &yardstick.reference) {
            Ok(report) => {
                non_finite_pixels = non_finite_pixels.max(report.non_finite_pixels);
                errors.push(ErrorAtSpp {
                    spp: snapshot.spp,
                    metrics: report.metrics,
                    without_part: report.without_part,
                });
            }
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    let Some(last) = snapshots.last() else {
        return Ok(Err("nothing was rendered".to_owned()));
    };
    let mut record = ErrorRecord {
        randomised: cell.randomised,
        replicate,
        seed,
        resolution: session.experiment.resolution,
        errors,
        non_finite_pixels,
        image_hash: image_hash(&last.image),
        image: None,
        error_map: None,
    };
    if replicate == 0 {
        let labels = [
            &world.variant.label,
            &cell.integrator.label,
            &cell.sequence.label,
            &cell.decorrelation.label,
        ];
        let draw = |kind, picture: &Picture| {
            let names = [&[kind], &labels.map(String::as_str)[..]].concat();
            session.picture(&names, picture)
        };
        record.image = draw("image", &tone_map(&last.image, yardstick.exposure))?;
        let (reference, scale) = (&yardstick.reference, ERROR_MAP_FULL_SCALE);
        match error_map(&last.image, reference, scale, viridis) {
            Ok(picture) => record.error_map = draw("error", &picture)?,
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    Ok(Ok(record))
}

/// The probability of a false alarm is shared out among all samplers of the run that claim to have no
/// bias, so that a run of many sound samplers does not cry wolf.
fn bias_record(
    session: &Session,
    cell: &SamplerCell,
    images: &[Image],
    yardstick: &Yardstick,
) -> Result<BiasRecord, String> {
    let claims = |s: &SamplerCell| s.randomised && session.registries.is_unbiased(s);
    let tested = session.plan.samplers.iter().filter(|s| claims(s)).count();
    let defaults = BiasOptions::default();
    let options = BiasOptions {
        alpha: defaults.alpha / tested.max(1) as f64,
        rounding: rounding_bound(session.experiment.spp.max()) + yardstick.rounding,
        ..defaults
    };
    let check = check_bias(images, yardstick.reference.parts(), options);
    let check = check.map_err(|e| e.to_string())?;
    let verdict = if cell.randomised {
        check.verdict
    } else {
        BiasVerdict::NotTestable("the sampler is deterministic, its error is not noise".to_owned())
    };
    let whole = check.whole.filter(|_| cell.randomised);
    Ok(BiasRecord {
        tiles: check.tiles,
        rejected: check.rejected.len(),
        alpha: check.alpha,
        min_p: check.min_p,
        p_histogram: check.p_histogram.to_vec(),
        z: whole.map(|test| test.t).filter(|t| t.is_finite()),
        p: whole.map(|test| test.p),
        degrees_of_freedom: whole.map(|test| test.degrees_of_freedom),
        by_design: cell.randomised && !session.registries.is_unbiased(cell),
        verdict,
    })
}

/// BLAKE3 of the f32 pixels.
pub(super) fn image_hash(image: &Image) -> String {
    blake3::hash(bytemuck::cast_slice(&image.pixels))
        .to_hex()
        .to_string()
}
