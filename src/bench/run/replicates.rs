//! Replicates of a sampler: how they are rendered, measured against the reference and recorded.

use super::error::Fault;
use super::images::{attributes, sampler_label};
use super::reference::ReferenceImage;
use super::reference_file::image_hash;
use super::session::{Session, failure_hash};
use crate::stopping::is_met_by;
use raystone_config::{Axis, Cell, StopRule};
use raystone_gpu::GpuError;
use raystone_image::{Image, Picture, tone_map, viridis};
use raystone_record::{Body, ErrorAtSpp, ErrorRecord, IMAGE_AXES, Line};
use raystone_render::{Renderer, Snapshot};
use raystone_stats::heavy_tails::PixelErrors;
use raystone_stats::metrics::{error_map, measure};
use std::collections::BTreeMap;

/// Relative error per pixel at the top of the colour scale of error maps.
const ERROR_MAP_FULL_SCALE: f32 = 1.0;

/// Relative difference of a value that is noise and not rounding, and the values that must show noise before
/// images of two seeds cannot be equal by chance.
const NOISE: f32 = 1e-3;
const NOISY_VALUES: usize = 64;
/// Relative difference of a mean that is taken in steps.
const STEPS: f32 = 1e-5;

/// One render of a replicate, and the numbers of samples at which its image is kept.
pub(super) struct Pass<'a> {
    pub renderer: Renderer<'a>,
    pub spps: Vec<u32>,
    /// Hash of the sampler's words.
    pub table: String,
}

/// The images of all replicates at the most samples per pixel that they took.
pub(super) struct Replicates {
    pub spp: u32,
    pub images: Vec<Image>,
}

/// The seeds of a sampler's replicates, by their numbers.
pub(super) fn replicates(session: &Session, cell: &Cell) -> Vec<(u32, u32)> {
    let seeds = session.experiment.seeds().replicates;
    let count = session.plan.renders(cell) as usize;
    (0..).zip(seeds.into_iter().take(count)).collect()
}

/// Each replicate at all numbers of samples, written as soon as it is there.
pub(super) fn all_samples(
    session: &mut Session,
    cell: &Cell,
    reference_image: &ReferenceImage,
    passes: &[Pass],
    line: &impl Fn(Body) -> Line,
) -> Result<Replicates, Fault> {
    let mut images = Vec::new();
    let mut pixels: BTreeMap<u32, PixelErrors> = BTreeMap::new();
    for (replicate, seed) in replicates(session, cell) {
        let mut snapshots = Vec::new();
        for pass in passes {
            let render = || pass.renderer.render(&pass.spps, seed);
            let rendered = session.clock.time("gpu", render);
            let rendered = rendered.map_err(|e| e.to_string())?;
            if let (true, Some(second)) = (images.is_empty(), rendered.get(1)) {
                check_at_once(session, pass, second, seed)?;
            }
            snapshots.extend(rendered);
        }
        let mut record = blank_record(session, cell, (replicate, seed));
        for snapshot in &snapshots {
            let pixels = pixels.entry(snapshot.spp);
            let pixels = pixels.or_insert_with(|| PixelErrors::new(&reference_image.reference));
            add_error(
                session,
                cell,
                reference_image,
                &mut record,
                snapshot,
                Some(pixels),
            )?;
        }
        let last = snapshots.last().ok_or("nothing was rendered".to_owned())?;
        draw(session, cell, reference_image, &mut record, last)?;
        check_finite(session, cell, &record, line)?;
        session.recorder.write(&line(Body::Error(record)))?;
        images.extend(snapshots.into_iter().last().map(|s| s.image));
        session.progress.add(replicate_s(session, cell));
    }
    Ok(Replicates {
        spp: session.experiment.run.spp.max(),
        images,
    })
}

/// All replicates at one number of samples after the other, until the rule is met, or to the last. Their records are
/// written at the end.
pub(super) fn until_met(
    session: &mut Session,
    cell: &Cell,
    reference_image: &ReferenceImage,
    passes: &[Pass],
    line: &impl Fn(Body) -> Line,
    rule: StopRule,
) -> Result<Replicates, Fault> {
    let steps: Vec<(&Pass, u32)> = passes
        .iter()
        .flat_map(|pass| pass.spps.iter().map(move |spp| (pass, *spp)))
        .collect();
    let seeds = replicates(session, cell);
    let blank = |of: &(u32, u32)| blank_record(session, cell, *of);
    let mut records: Vec<ErrorRecord> = seeds.iter().map(blank).collect();
    let mut last: Vec<Snapshot> = Vec::new();
    for &(pass, spp) in &steps {
        let mut pixels = PixelErrors::new(&reference_image.reference);
        for (index, record) in records.iter_mut().enumerate() {
            let before = last.get(index).filter(|_| pass.spps.len() > 1);
            let further = || further_samples(pass, before, spp, record.seed);
            let snapshot = session.clock.time("gpu", further);
            let snapshot = snapshot.map_err(|e| e.to_string())?;
            if index == 0 && pass.spps.get(1) == Some(&spp) {
                check_at_once(session, pass, &snapshot, record.seed)?;
            }
            add_error(
                session,
                cell,
                reference_image,
                record,
                &snapshot,
                Some(&mut pixels),
            )?;
            check_finite(session, cell, record, line)?;
            match last.get_mut(index) {
                Some(place) => *place = snapshot,
                None => last.push(snapshot),
            }
        }
        let all: Vec<&ErrorRecord> = records.iter().collect();
        if is_met_by(&rule, &all, spp, steps.len()) {
            break;
        }
    }
    for (mut record, snapshot) in records.into_iter().zip(&last) {
        record.stop = Some(rule);
        draw(session, cell, reference_image, &mut record, snapshot)?;
        session.recorder.write(&line(Body::Error(record)))?;
        session.progress.add(replicate_s(session, cell));
    }
    Ok(Replicates {
        spp: last.first().map_or(0, |snapshot| snapshot.spp),
        images: last.into_iter().map(|snapshot| snapshot.image).collect(),
    })
}

/// The image at `spp` samples: those before, and the ones that are missing.
fn further_samples(
    pass: &Pass,
    before: Option<&Snapshot>,
    spp: u32,
    seed: u32,
) -> Result<Snapshot, GpuError> {
    let renderer = &pass.renderer;
    let done = before.map_or(0, |snapshot| snapshot.spp);
    renderer.reset()?;
    renderer.add_samples(done, spp - done, seed)?;
    let mut image = renderer.image()?;
    if let Some(before) = before {
        let share = f64::from(done) / f64::from(spp);
        let pairs = image.pixels.iter_mut().zip(&before.image.pixels);
        for (new, old) in pairs.flat_map(|(new, old)| new.iter_mut().zip(old)) {
            *new = (share * f64::from(*old) + (1.0 - share) * f64::from(*new)) as f32;
        }
    }
    Ok(Snapshot { spp, image })
}

/// Fails a cell of which an image that was made in two steps is not that of its samples at once: samples that are repeated
/// or left out make noise of another size, and bias nothing.
pub(super) fn check_at_once(
    session: &mut Session,
    pass: &Pass,
    snapshot: &Snapshot,
    seed: u32,
) -> Result<(), String> {
    let spp = snapshot.spp;
    let at_once = session
        .clock
        .time("gpu", || pass.renderer.render(&[spp], seed));
    let at_once = at_once.map_err(|e| e.to_string())?;
    let Some(image) = at_once.first().map(|other| &other.image) else {
        return Err("nothing was rendered".to_owned());
    };
    same_at_once([&snapshot.image, image], spp, |_| true)
}

/// Compares the pixels that were rendered in steps and at once, where they were.
///
/// # Errors
/// The first that differs.
pub(super) fn same_at_once(
    [in_steps, at_once]: [&Image; 2],
    spp: u32,
    is_compared: impl Fn(usize) -> bool,
) -> Result<(), String> {
    let differs = |pixel: &usize| {
        let [a, b] = [in_steps, at_once].map(|image| image.pixels[*pixel]);
        // What is not finite is said elsewhere.
        (0..3).any(|k| (a[k] - b[k]).abs() > STEPS * a[k].abs().max(b[k].abs()))
    };
    let mut pixels = (0..at_once.pixels.len()).filter(|pixel| is_compared(*pixel));
    match pixels.find(differs) {
        None => Ok(()),
        Some(pixel) => Err(format!(
            "pixel {pixel} after {spp} samples in two steps is {:?}, and after as many at once {:?}: samples are repeated \
             or left out",
            in_steps.pixels[pixel], at_once.pixels[pixel]
        )),
    }
}

/// Fails a cell of which two replicates are one image, or whose reference has two equal parts: other seeds must
/// give other images, wherever pixels are noisy.
pub(super) fn check_distinct(images: &[Image], reference: &ReferenceImage) -> Result<(), String> {
    let parts = reference.reference.parts();
    let is_noisy = |(a, b): &(&f32, &f32)| (*a - *b).abs() > NOISE * a.abs().max(b.abs());
    let noisy = images
        .first()
        .zip(parts.first())
        .map_or(0, |(image, part)| {
            let pairs = image
                .pixels
                .iter()
                .flatten()
                .zip(part.pixels.iter().flatten());
            pairs.filter(is_noisy).count()
        });
    if noisy < NOISY_VALUES {
        return Ok(());
    }
    // Those of a known reference, or of one from a file, are copies.
    let rendered = if reference.part_spp > 0 { parts } else { &[] };
    for (what, images) in [("replicates", images), ("parts of the reference", rendered)] {
        let mut known = BTreeMap::new();
        // Where few paths find a small light, two images may both be black.
        let is_lit = |image: &Image| image.pixels.iter().flatten().any(|value| *value != 0.0);
        for (i, image) in images.iter().enumerate().filter(|(_, image)| is_lit(image)) {
            if let Some(other) = known.insert(image_hash(image), i) {
                return Err(format!(
                    "{what} {other} and {i} are the same image, though their seeds differ"
                ));
            }
        }
    }
    Ok(())
}

/// Fails a cell with an image that is not finite everywhere. The replicate is recorded with it, without figures: the checks of a run are
/// made from records.
pub(super) fn check_finite(
    session: &Session,
    cell: &Cell,
    record: &ErrorRecord,
    line: &impl Fn(Body) -> Line,
) -> Result<(), Fault> {
    let (replicate, count) = (record.replicate, record.non_finite_pixels);
    if count == 0 {
        return Ok(());
    }
    let reason = format!("replicate {replicate} has {count} pixels that are not finite");
    let found = line(Body::Error(ErrorRecord {
        errors: Vec::new(),
        ..record.clone()
    }));
    session
        .recorder
        .write(&found.hashed(failure_hash(&cell.to_string(), &reason)))?;
    Err(reason.into())
}

/// The record of a replicate of which nothing was measured.
pub(super) fn blank_record(
    session: &Session,
    cell: &Cell,
    (replicate, seed): (u32, u32),
) -> ErrorRecord {
    ErrorRecord {
        randomised: cell.randomised,
        replicate,
        seed,
        resolution: session.experiment.run.resolution,
        errors: Vec::new(),
        stop: None,
        non_finite_pixels: 0,
        image_hash: String::new(),
        image: None,
        error_map: None,
    }
}

/// Adds what is measured of the next image of a replicate; `pixels` are those of the replicates before it at the same number of
/// samples, the same in all pixels.
pub(super) fn add_error(
    session: &Session,
    cell: &Cell,
    reference_image: &ReferenceImage,
    record: &mut ErrorRecord,
    snapshot: &Snapshot,
    pixels: Option<&mut PixelErrors>,
) -> Result<(), String> {
    let facts = session.registries.samplers.facts(&cell[Axis::Sequence]);
    let base_2 = facts.is_ok_and(|facts| facts.base_2);
    let report = measure(&snapshot.image, &reference_image.reference).map_err(|e| e.to_string())?;
    record.non_finite_pixels = record.non_finite_pixels.max(report.non_finite_pixels);
    let tail = match pixels {
        Some(pixels) => {
            let added = pixels.add(&snapshot.image, &reference_image.reference);
            added.map_err(|e| e.to_string())?;
            pixels.tail(snapshot.spp, reference_image.part_spp)
        }
        None => None,
    };
    record.image_hash = image_hash(&snapshot.image);
    record.errors.push(ErrorAtSpp {
        partial_net: base_2 && !snapshot.spp.is_power_of_two(),
        spp: snapshot.spp,
        metrics: report.metrics,
        without_part: report.without_part,
        tail,
    });
    Ok(())
}

/// Writes the pictures of the first replicate, and tells its record where.
pub(super) fn draw(
    session: &Session,
    cell: &Cell,
    reference_image: &ReferenceImage,
    record: &mut ErrorRecord,
    last: &Snapshot,
) -> Result<(), Fault> {
    if record.replicate > 0 {
        return Ok(());
    }
    let labels = cell.labels(&IMAGE_AXES);
    let draw = |kind, picture: &Picture| session.picture(kind, &labels, picture);
    record.image = draw("image", &tone_map(&last.image, reference_image.exposure))?;
    let about = attributes(
        &session.options.program,
        cell,
        &sampler_label(cell),
        last.spp,
        record.seed,
    );
    session.compared("image", &labels, &last.image, &about)?;
    let reference = &reference_image.reference;
    let map = error_map(&last.image, reference, ERROR_MAP_FULL_SCALE, viridis);
    record.error_map = draw("error", &map.map_err(|e| e.to_string())?)?;
    Ok(())
}

/// Seconds that a replicate of a sampler is expected to take.
pub(super) fn replicate_s(session: &Session, cell: &Cell) -> f64 {
    let image = (session.cost).image(&cell[Axis::Integrator], session.experiment.run.spp.max());
    image.seconds()
}
