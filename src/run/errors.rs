//! Error: once per scene, integrator and sampler, through the fastest gated structure.

use super::session::Session;
use super::structures::{self, Gated};
use super::world::World;
use super::{REFERENCE_PARTS, RunError};
use crate::config::{SamplerCell, StructureCell, Variant, cell_hash};
use crate::integrator::{Frame, RenderJob, Renderer, Snapshot, Traced, integrator};
use crate::measure::bias::{BiasOptions, check_bias};
use crate::measure::image::{Image, Reference, measure};
use crate::measure::picture::{automatic_exposure, error_map, tone_map, write_png};
use crate::measure::record::{
    BiasRecord, ErrorAtSpp, ErrorRecord, Ran, Record, ReferenceRecord, SpectrumRecord,
};
use crate::measure::spectrum::{
    ErrorSpectrum, error_spectrum, luminance_error, mean_filtered, mean_power,
};
use crate::measure::statistics::bootstrap_mean;
use crate::report::color::viridis;
use crate::sampling::hash::pcg_hash;
use crate::sampling::{Demand, Sampler};
use std::time::Instant;

/// Relative error per pixel at the top of the colour scale of error maps.
const ERROR_MAP_FULL_SCALE: f32 = 1.0;
/// What references are rendered through where no structure ran with the embedded kernels.
const REFERENCE_STRUCTURE: &str = "bvh";

/// The reference of one integrator with its parts and the exposure of all its pictures.
struct Yardstick {
    reference: Reference,
    parts: Vec<Image>,
    exposure: f32,
}

/// The sampler that draws `samples` samples a pixel for an integrator.
///
/// # Errors
/// A name is not registered, or the sampler has too few dimensions or samples.
pub(super) fn sampler_for(
    session: &Session,
    (sequence, decorrelation): (&Variant, &Variant),
    variant: &Variant,
    samples: u32,
) -> Result<Sampler, String> {
    let integrator =
        integrator(&variant.name).ok_or_else(|| format!("no integrator is called {variant}"))?;
    let demand = Demand {
        samples: Some(samples),
        dimensions: integrator.dimensions(&variant.params),
        width: Some(session.experiment.resolution[0]),
    };
    let samplers = &session.registries.samplers;
    let made = samplers.sampler(sequence, decorrelation, &demand);
    made.map_err(|e| e.to_string())
}

/// A job for this world; an error if the integrator is not registered.
pub(super) fn job<'j>(
    session: &Session,
    world: &World,
    sampler: &'j Sampler,
    variant: &'j Variant,
    runtime_checks: bool,
) -> Result<RenderJob<'j>, String> {
    let integrator =
        integrator(&variant.name).ok_or_else(|| format!("no integrator is called {variant}"))?;
    let [width, height] = session.experiment.resolution;
    let diagonal = f64::from(2.0 * world.scene.bounds().radius());
    let ao_radius = (integrator.ao_radius(&variant.params).unwrap_or(0.0) * diagonal) as f32;
    let frame = Frame {
        width,
        height,
        camera: world.camera,
        ao_radius,
    };
    Ok(RenderJob {
        frame,
        sampler,
        integrator,
        params: &variant.params,
        runtime_checks,
    })
}

/// Renders; the error in words.
fn rendered(renderer: &Renderer, spps: &[u32], seed: u32) -> Result<Vec<Snapshot>, String> {
    renderer.render(spps, seed).map_err(|e| e.to_string())
}

/// The fastest gated structure with these kernels.
fn fastest<'a>(gated: &'a [Gated], kernels: &Variant) -> Option<&'a Gated> {
    let same = gated.iter().filter(|g| g.cell.kernels == *kernels);
    same.max_by(|a, b| a.speed.total_cmp(&b.speed))
}

/// What references are rendered through: the fastest structure that passed with the embedded kernels, so
/// that a fault of other kernels is not in both images. A run of other kernels alone gets a plain BVH.
fn reference_structure(
    session: &mut Session,
    world: &World,
    gated: &[Gated],
) -> Result<Result<Traced, String>, RunError> {
    let embedded = gated.iter().filter(|g| g.cell.kernels.name.is_empty());
    if let Some(fastest) = embedded.max_by(|a, b| a.speed.total_cmp(&b.speed)) {
        return Ok(Ok(fastest.traced.clone()));
    }
    let mut entries = session.registries.accel.entries().into_iter();
    let Some(plain) = entries.find(|entry| entry.name == REFERENCE_STRUCTURE) else {
        return Ok(Err(format!("no structure is called {REFERENCE_STRUCTURE}")));
    };
    let cell = StructureCell {
        scene: world.variant.clone(),
        accel: plain.default_variant(),
        kernels: Variant::default(),
    };
    session.say(format!("{cell}: build and gate, for the reference"));
    let gated = structures::build_and_gate(session, world, &cell)?;
    let gated = gated.map(|(traced, _)| traced);
    Ok(gated.map_err(|record| {
        let failure = record.failure.unwrap_or_default();
        format!("{} with the embedded kernels: {failure}", cell.accel)
    }))
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
            let Some(fastest) = fastest(gated, &cell.kernels) else {
                let reason = "no structure passed the gate with these kernels";
                session.write_failure(&cell.to_string(), reason.to_owned())?;
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

fn reference(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    variant: &Variant,
) -> Result<Result<Yardstick, String>, RunError> {
    session.say(format!("{}, {variant}: reference", world.variant));
    let known = integrator(&variant.name).and_then(|i| i.exact(&variant.params));
    if let Some(value) = known {
        return exact_reference(session, world, variant, value);
    }
    let settings = &session.experiment.reference;
    let start = Instant::now();
    let spp = (settings.spp / REFERENCE_PARTS).max(1);
    let pair = (&settings.sequence, &settings.decorrelation);
    let sampler = match sampler_for(session, pair, variant, spp) {
        Ok(sampler) => sampler,
        Err(reason) => return Ok(Err(reason)),
    };
    let seed = pcg_hash(settings.seed);
    let rendered = (|| {
        let job = job(session, world, &sampler, variant, true)?;
        let renderer = Renderer::new(world.gpu, &world.buffers, traced, &job, false)
            .map_err(|e| e.to_string())?;
        let mut parts = Vec::new();
        for part in 0..REFERENCE_PARTS {
            let shots = session.clock.time("gpu", || {
                rendered(&renderer, &[spp], seed.wrapping_add(part))
            });
            parts.extend(shots?.into_iter().map(|s| s.image));
            session.progress.inc(1);
        }
        let reference = Reference::from_parts(&parts).map_err(|e| e.to_string())?;
        Ok::<_, String>((reference, parts, renderer.kernel_hash()))
    })();
    let (reference, parts, kernel) = match rendered {
        Ok(rendered) => rendered,
        Err(reason) => return Ok(Err(reason)),
    };
    let record = ReferenceRecord {
        spp: spp * REFERENCE_PARTS,
        sampler: sampler.label(),
        seconds: start.elapsed().as_secs_f64(),
        ran: world.ran(&Variant::default(), kernel),
        ..reference_record(world, variant, &reference)
    };
    finish_reference(session, world, record, reference, parts).map(Ok)
}

/// The constant image of a known value: nothing is rendered.
fn exact_reference(
    session: &mut Session,
    world: &World,
    variant: &Variant,
    value: f64,
) -> Result<Result<Yardstick, String>, RunError> {
    let [width, height] = session.experiment.resolution;
    let pixels = vec![[value as f32; 3]; width as usize * height as usize];
    let made = Image::new(width, height, pixels).and_then(|image| {
        let parts = vec![image; REFERENCE_PARTS as usize];
        Ok((Reference::from_parts(&parts)?, parts))
    });
    let (reference, parts) = match made {
        Ok(made) => made,
        Err(error) => return Ok(Err(error.to_string())),
    };
    session.progress.inc(u64::from(REFERENCE_PARTS));
    let record = ReferenceRecord {
        exact: Some(value),
        ..reference_record(world, variant, &reference)
    };
    finish_reference(session, world, record, reference, parts).map(Ok)
}

/// The record of a reference that was not rendered; what was rendered sets more.
fn reference_record(world: &World, variant: &Variant, reference: &Reference) -> ReferenceRecord {
    ReferenceRecord {
        scene: world.variant.label.clone(),
        integrator: variant.clone(),
        ran: Ran::default(),
        spp: 0,
        exact: None,
        sampler: "exact".to_owned(),
        seconds: 0.0,
        mse: reference.own_mse().unwrap_or(f64::NAN),
        image: String::new(),
        mean: reference.image().mean(),
    }
}

/// Writes the picture and the record.
fn finish_reference(
    session: &mut Session,
    world: &World,
    mut record: ReferenceRecord,
    reference: Reference,
    parts: Vec<Image>,
) -> Result<Yardstick, RunError> {
    let exposure = automatic_exposure(reference.image());
    let labels = [&world.variant.label, &record.integrator.label].map(String::as_str);
    let (relative, path) = session.image_path(&[&["reference"], &labels[..]].concat());
    write_png(&path, &tone_map(reference.image(), exposure))
        .map_err(|e| RunError::Input(e.to_string()))?;
    record.image = relative;
    let cell = format!("reference {}, {}: done", world.variant, record.integrator);
    if !session.is_done(&cell) {
        let hash = cell_hash(&[
            ("scene", &world.scene.hash),
            (
                "integrator",
                &serde_json::to_string(&record.integrator).unwrap_or_default(),
            ),
            (
                "sampler",
                &format!("{}, {} spp", record.sampler, record.spp),
            ),
            ("kernel", &record.ran.kernel_hash),
            ("version", env!("CARGO_PKG_VERSION")),
        ]);
        session.write(&hash, Record::Reference(record))?;
        session.finish(cell);
    }
    Ok(Yardstick {
        reference,
        parts,
        exposure,
    })
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
    session: &Session,
    world: &'a World,
    fastest: &Gated,
    cell: &SamplerCell,
) -> Result<Vec<Pass<'a>>, String> {
    let pair = (&cell.sequence, &cell.decorrelation);
    let gpu = world.device.of(&cell.kernels);
    let gpu = gpu.map_err(|e| e.to_string())?;
    let pass = |spps: Vec<u32>, sampler: &Sampler| {
        let job = job(session, world, sampler, &cell.integrator, true)?;
        let renderer = Renderer::new(gpu, &world.buffers, &fastest.traced, &job, false);
        let words = bytemuck::cast_slice(sampler.table.words());
        Ok(Pass {
            renderer: renderer.map_err(|e| e.to_string())?,
            spps,
            table: blake3::hash(words).to_hex().to_string(),
        })
    };
    let spps: Vec<u32> = session.experiment.spp.counts().collect();
    let most = session.experiment.spp.max();
    let sampler = sampler_for(session, pair, &cell.integrator, most)?;
    if !sampler.by_count() {
        return Ok(vec![pass(spps, &sampler)?]);
    }
    let single = |spp| {
        pass(
            vec![spp],
            &sampler_for(session, pair, &cell.integrator, spp)?,
        )
    };
    spps.into_iter().map(single).collect()
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
        world.ran(&cell.kernels, hashes.join("+"))
    };
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
    let seeds: Vec<u32> = session
        .experiment
        .replicate_seeds()
        .take(cell.replicates as usize)
        .collect();
    let mut finals = Vec::new();
    for (replicate, seed) in seeds.into_iter().enumerate() {
        let mut snapshots = Vec::new();
        for pass in &passes {
            let render = || rendered(&pass.renderer, &pass.spps, seed);
            match session.clock.time("gpu", render) {
                Ok(rendered) => snapshots.extend(rendered),
                Err(reason) => return Ok(Err(reason)),
            }
        }
        let mut record = match error_record(
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
        record.ran = ran.clone();
        session.write(&hash, Record::Error(record))?;
        finals.extend(snapshots.into_iter().last().map(|s| s.image));
        session.progress.inc(1);
    }
    session.finish(cell.to_string());
    match bias_record(session, cell, world, &finals, yardstick) {
        Ok(mut record) => {
            record.ran = ran.clone();
            session.write(&hash, Record::Bias(record))?;
        }
        Err(reason) => return Ok(Err(reason)),
    }
    match spectrum_record(session, cell, world, &finals, yardstick) {
        Ok(mut record) => {
            record.ran = ran;
            session.write(&hash, Record::Spectrum(record)).map(Ok)
        }
        Err(reason) => Ok(Err(reason)),
    }
}

/// The spectra of all replicates, at the highest number of samples.
fn spectrum_record(
    session: &Session,
    cell: &SamplerCell,
    world: &World,
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
        bootstrap_mean(&values)
    };
    Ok(SpectrumRecord {
        scene: world.variant.label.clone(),
        integrator: cell.integrator.clone(),
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        ran: Ran::default(),
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
                });
            }
            Err(error) => return Ok(Err(error.to_string())),
        }
    }
    let Some(last) = snapshots.last() else {
        return Ok(Err("nothing was rendered".to_owned()));
    };
    let mut record = ErrorRecord {
        scene: world.variant.label.clone(),
        integrator: cell.integrator.clone(),
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        ran: Ran::default(),
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
        let name = |kind| {
            let labels = [
                &world.variant.label,
                &cell.integrator.label,
                &cell.sequence.label,
                &cell.decorrelation.label,
            ];
            session.image_path(&[&[kind], &labels.map(String::as_str)[..]].concat())
        };
        let (relative, path) = name("image");
        write_png(&path, &tone_map(&last.image, yardstick.exposure))
            .map_err(|e| RunError::Input(e.to_string()))?;
        record.image = Some(relative);
        let (relative, path) = name("error");
        match error_map(
            &last.image,
            &yardstick.reference,
            ERROR_MAP_FULL_SCALE,
            viridis,
        ) {
            Ok(picture) => {
                write_png(&path, &picture).map_err(|e| RunError::Input(e.to_string()))?
            }
            Err(error) => return Ok(Err(error.to_string())),
        }
        record.error_map = Some(relative);
    }
    Ok(Ok(record))
}

/// The false-discovery rate is shared out among all randomised samplers of the run, so that a run of
/// many sound samplers does not cry wolf.
fn bias_record(
    session: &Session,
    cell: &SamplerCell,
    world: &World,
    images: &[Image],
    yardstick: &Yardstick,
) -> Result<BiasRecord, String> {
    let tested = session
        .plan
        .samplers
        .iter()
        .filter(|s| s.randomised)
        .count()
        .max(1);
    let mut options = BiasOptions::default();
    options.alpha /= tested as f64;
    let check = check_bias(images, &yardstick.parts, options).map_err(|e| e.to_string())?;
    let verdict = if cell.randomised {
        check.verdict.to_string()
    } else {
        "not-testable: the sampler is deterministic, its error is not noise".to_owned()
    };
    Ok(BiasRecord {
        scene: world.variant.label.clone(),
        integrator: cell.integrator.clone(),
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        ran: Ran::default(),
        tiles: check.tiles,
        rejected: check.rejected.len(),
        alpha: check.alpha,
        min_p: check.min_p,
        p_histogram: check.p_histogram.to_vec(),
        z: check.z,
        verdict,
    })
}

/// BLAKE3 of the f32 pixels.
pub(super) fn image_hash(image: &Image) -> String {
    blake3::hash(bytemuck::cast_slice(&image.pixels))
        .to_hex()
        .to_string()
}
