//! References: what images are compared with, and the exposure of their pictures.

use super::RunError;
use super::images::Estimator;
use super::session::Session;
use super::structures::{self, Gated};
use super::world::World;
use crate::config::{REFERENCE_PARTS, StructureCell};
use crate::image::{Image, automatic_exposure, tone_map};
use crate::integrator::{Traced, rounding_bound};
use crate::measure::metrics::Reference;
use crate::measure::record::{Body, Key, Line, Ran, ReferenceRecord, axis};
use crate::params::Variant;
use crate::text::cell_hash;
use std::time::Instant;

/// What references are rendered through where no structure ran with the embedded kernels.
const REFERENCE_STRUCTURE: &str = "bvh";

/// What the host's exact values of integrands and their samples in f32 may differ by, relative: some
/// functions of the device's library, a few units of the last place each.
const EVALUATION: f64 = 32.0 * f32::EPSILON as f64;

/// The reference of one integrator and the exposure of all its pictures.
pub(super) struct Yardstick {
    pub reference: Reference,
    /// How far rounding alone may move it, relative.
    pub rounding: f64,
    pub exposure: f32,
}

/// What references are rendered through: the fastest structure that passed with the embedded kernels, so
/// that a fault of other kernels is not in both images, and that all integrators can use. A run without one
/// gets a plain BVH.
pub(super) fn reference_structure(
    session: &mut Session,
    world: &World,
    gated: &[Gated],
) -> Result<Result<Traced, String>, RunError> {
    let embedded = gated.iter();
    let embedded = embedded.filter(|g| g.cell.kernels.name.is_empty() && g.traced.is_inline());
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
        let failure = record.body.failure.unwrap_or_default();
        format!("{} with the embedded kernels: {failure}", cell.accel)
    }))
}

/// The reference of an integrator, known or rendered. The inner error concerns its cells alone.
pub(super) fn reference(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    variant: &Variant,
) -> Result<Result<Yardstick, String>, RunError> {
    session.say(format!("{}, {variant}: reference", world.variant));
    let settings = &session.experiment.reference;
    let start = Instant::now();
    let spp = (settings.spp / REFERENCE_PARTS).max(1);
    let pair = (&settings.sequence, &settings.decorrelation);
    let integrator = session.registries.integrators.configured(variant);
    if let Some(value) = integrator.ok().and_then(|i| i.facts.exact) {
        return exact_reference(session, world, variant, value);
    }
    let estimator = match Estimator::new(session, pair, variant, spp) {
        Ok(estimator) => estimator,
        Err(reason) => return Ok(Err(reason)),
    };
    let rendered = (|| {
        let seeds = session.experiment.seeds().reference_parts;
        let embedded = (&Variant::default(), traced);
        let renderer = estimator.renderer(session, world, embedded, &seeds, [true, false])?;
        let mut parts = Vec::new();
        for &seed in &seeds {
            let shots = session.clock.time("gpu", || renderer.render(&[spp], seed));
            let shots = shots.map_err(|e| e.to_string());
            parts.extend(shots?.into_iter().map(|s| s.image));
            session.progress.inc(1);
        }
        let reference = Reference::from_parts(parts).map_err(|e| e.to_string())?;
        Ok::<_, String>((reference, renderer.kernel_hash()))
    })();
    let (reference, kernel) = match rendered {
        Ok(rendered) => rendered,
        Err(reason) => return Ok(Err(reason)),
    };
    let record = ReferenceRecord {
        spp: spp * REFERENCE_PARTS,
        sampler: estimator.sampler.label(),
        seconds: start.elapsed().as_secs_f64(),
        ..reference_record(&reference)
    };
    let (key, ran) = (world.key(&Variant::default()), Ran::kernel(kernel));
    let line = Line::new(key.with_variant(axis::INTEGRATOR, variant), ran, record);
    finish_reference(session, world, line, reference, rounding_bound(spp)).map(Ok)
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
    let made = Image::new(width, height, pixels)
        .and_then(|image| Reference::from_parts(vec![image; REFERENCE_PARTS as usize]));
    let reference = match made {
        Ok(made) => made,
        Err(error) => return Ok(Err(error.to_string())),
    };
    session.progress.inc(u64::from(REFERENCE_PARTS));
    let record = ReferenceRecord {
        exact: Some(value),
        ..reference_record(&reference)
    };
    let key = Key::default().with_variant(axis::SCENE, world.variant);
    let key = key.with_variant(axis::INTEGRATOR, variant);
    let line = Line::new(key, Ran::default(), record);
    finish_reference(session, world, line, reference, EVALUATION).map(Ok)
}

/// The record of a reference that was not rendered; what was rendered sets more.
fn reference_record(reference: &Reference) -> ReferenceRecord {
    ReferenceRecord {
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
    mut line: Line<ReferenceRecord>,
    reference: Reference,
    rounding: f64,
) -> Result<Yardstick, RunError> {
    let exposure = automatic_exposure(reference.image());
    let integrator = line.key.get(axis::INTEGRATOR).cloned().unwrap_or_default();
    let labels = [&world.variant.label, &integrator.label].map(String::as_str);
    let picture = tone_map(reference.image(), exposure);
    let image = session.picture(&[&["reference"], &labels[..]].concat(), &picture)?;
    line.body.image = image.unwrap_or_default();
    let cell = format!("reference {}, {integrator}: done", world.variant);
    if !session.is_done(&cell) {
        let hash = cell_hash(&[
            ("scene", &world.scene.hash),
            (
                "integrator",
                &serde_json::to_string(&integrator).unwrap_or_default(),
            ),
            (
                "sampler",
                &format!("{}, {} spp", line.body.sampler, line.body.spp),
            ),
            ("kernel", &line.ran.kernel_hash),
            ("version", env!("CARGO_PKG_VERSION")),
        ]);
        session.write(&line.hashed(hash).with_body(Body::Reference))?;
        session.finish(cell);
    }
    Ok(Yardstick {
        reference,
        rounding,
        exposure,
    })
}
