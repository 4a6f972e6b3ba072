//! References: what images are compared with, and the exposure of their pictures.

use super::error::{Fault, RunError};
use super::images::{Estimator, attributes};
use super::session::Session;
use super::structures::{self, Gated};
use super::uniform;
use super::world::World;
use raystone_config::{Axis, Cell, REFERENCE_PARTS};
use raystone_core::params::{Entry, Variant};
use raystone_core::store::Kept;
use raystone_image::{Image, automatic_exposure, tone_map};
use raystone_record::{Body, Key, Line, Ran, ReferenceRecord};
use raystone_render::{Renderer, Traced, rounding_bound};
use raystone_stats::metrics::Reference;
use std::time::Instant;

/// What references are rendered through where no structure ran with the embedded kernels.
const REFERENCE_STRUCTURE: &str = "bvh";

/// What the host's exact values of integrands and their samples in f32 may differ by, relative: some
/// functions of the device's library, a few units of the last place each.
const EVALUATION: f64 = 32.0 * f32::EPSILON as f64;

/// The reference of one integrator and the exposure of all its pictures.
pub(super) struct ReferenceImage {
    pub reference: Reference,
    /// Samples per pixel of each of its parts; 0 where they are not rendered.
    pub part_spp: u32,
    /// How far rounding alone may move it, relative.
    pub rounding: f64,
    pub exposure: f32,
    /// Content hash of its record.
    pub line: String,
    /// What the kernels that it was rendered with are noted for.
    pub name: String,
}

/// What references are rendered through: the fastest structure that passed with the embedded kernels, so
/// that a fault of other kernels is not in both images, and that all integrators can use. A run without one
/// gets a plain BVH.
pub(super) fn reference_structure(
    session: &mut Session,
    world: &World,
    gated: &[Gated],
) -> Result<Traced, Fault> {
    let embedded = |g: &&Gated| g.cell[Axis::Kernels].name.is_empty() && g.traced.is_inline();
    let embedded = gated.iter().filter(embedded);
    if let Some(fastest) = embedded.max_by(|a, b| a.speed.total_cmp(&b.speed)) {
        return Ok(fastest.traced.clone());
    }
    let kinds = &session.registries.accel;
    kinds.named("structure", REFERENCE_STRUCTURE)?;
    let entries = kinds.entries();
    let plain = entries.iter().find(|e| e.name == REFERENCE_STRUCTURE);
    let plain = plain.map(Entry::default_variant).unwrap_or_default();
    let cell =
        (world.cell.clone().with(Axis::Accel, &plain)).with(Axis::Kernels, &Variant::default());
    session.say(format!("{cell}: build and gate, for the reference"));
    let candidate = structures::build_and_gate(session, world, &cell)?;
    candidate.traced.ok_or_else(|| {
        let failure = candidate.record.body.failure.unwrap_or_default();
        format!("{plain} with the embedded kernels: {failure}").into()
    })
}

/// The reference of a world and an integrator, known or rendered: with the sampler that the experiment names,
/// the embedded kernels, and rays that leave surfaces by the default offset, so that the error of other
/// offsets is seen.
pub(super) fn reference(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
) -> Result<ReferenceImage, Fault> {
    session.say(format!("{cell}: reference"));
    let start = Instant::now();
    let cell = at_default_offset(cell);
    let key = Key::from(&cell);
    if let Some(file) = &session.reference_file {
        let reference = file.reference.clone();
        let record = ReferenceRecord {
            file: Some(file.name.clone()),
            sampler: "file".to_owned(),
            ..reference_record(&reference)
        };
        // Nothing is known of its rounding but that it was written in f32.
        let half_ulp = f64::from(f32::EPSILON) / 2.0;
        return known_reference(session, world, &cell, (reference, record, half_ulp));
    }
    if let Some(value) = exact_value(session, &cell) {
        let reference = constant(value, session.experiment.run.resolution)?;
        let record = ReferenceRecord {
            exact: Some(value),
            ..reference_record(&reference)
        };
        return known_reference(session, world, &cell, (reference, record, EVALUATION));
    }
    let rendered = rendered(session, world, traced, &cell, 0..REFERENCE_PARTS as usize)?;
    let cached = rendered.parts.iter().all(|part| part.cached);
    let parts = rendered.parts.into_iter().map(|part| part.image).collect();
    let reference = Reference::from_parts(parts).map_err(|e| e.to_string())?;
    let record = ReferenceRecord {
        spp: rendered.spp * REFERENCE_PARTS,
        cached,
        sampler: rendered.sampler,
        seconds: start.elapsed().as_secs_f64(),
        ..reference_record(&reference)
    };
    let line = Line::new(key, Ran::kernel(rendered.kernel), record);
    Ok(finish_reference(
        session,
        world,
        &cell,
        line,
        reference,
        rounding_bound(rendered.spp),
    )?)
}

/// Renders those of the parts of a reference that are not kept yet, of every so many one, and keeps them: how many were rendered. References
/// that are known or read from a file have no parts.
pub(super) fn keep_parts(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    wanted: impl Iterator<Item = usize>,
) -> Result<usize, Fault> {
    let cell = at_default_offset(cell);
    if session.reference_file.is_some() || exact_value(session, &cell).is_some() {
        return Ok(0);
    }
    let rendered = rendered(session, world, traced, &cell, wanted)?;
    Ok(rendered.parts.iter().filter(|part| !part.cached).count())
}

fn at_default_offset(cell: &Cell) -> Cell {
    let offset = Axis::Offset.default_name().unwrap_or_default();
    let offset = Variant {
        name: offset.to_owned(),
        label: offset.to_owned(),
        ..Variant::default()
    };
    cell.clone().with(Axis::Offset, &offset)
}

/// The value of every pixel, if the integrator knows it.
fn exact_value(session: &Session, cell: &Cell) -> Option<f64> {
    let integrators = &session.registries.integrators;
    let integrator = integrators.configured(&cell[Axis::Integrator]).ok()?;
    integrator.facts.exact
}

/// Parts of a reference, and what they were rendered with.
struct Rendered {
    parts: Vec<Part>,
    /// Samples per pixel of a part.
    spp: u32,
    sampler: String,
    /// Hash of the kernel.
    kernel: String,
}

fn rendered(
    session: &mut Session,
    world: &World,
    traced: &Traced,
    cell: &Cell,
    wanted: impl Iterator<Item = usize>,
) -> Result<Rendered, Fault> {
    let settings = &session.experiment.reference;
    let key = Key::from(cell);
    let cell = (cell.clone().with(Axis::Sequence, &settings.sequence))
        .with(Axis::Decorrelation, &settings.decorrelation);
    let spp = (settings.spp / REFERENCE_PARTS).max(1);
    let estimator = Estimator::new(session, &cell, spp)?;
    let seeds = session.experiment.seeds().reference_parts;
    let renderer = estimator.renderer(session, world, traced, &seeds, [true, false])?;
    let sampler = estimator.sampler.label();
    let words = bytemuck::cast_slice(estimator.sampler.table.words());
    let points = format!("{sampler}, {spp} spp, {}", blake3::hash(words).to_hex());
    // Whatever structure the rays go through, the image is the same to the bit; the kernels are the program's, whose bytes are part of the
    // place.
    let hash = reference_hash(session, world, &Line::new(key, Ran::default(), ()), &points);
    let expected_s = session.cost.reference_part(&cell).seconds();
    let each = (spp, &seeds[..], &*hash, expected_s);
    Ok(Rendered {
        parts: parts(session, world, &renderer, each, wanted)?,
        spp,
        sampler,
        kernel: renderer.kernel_hash(),
    })
}

/// An independent part of a reference: so many samples with a seed of its own.
pub(super) struct Part {
    pub image: Image,
    /// Whether an earlier run rendered it.
    pub cached: bool,
}

/// Those of the parts of a reference that are asked for, each kept on its own: runs that share a folder of kept references share the work,
/// and the reference is the same to the bit whoever rendered which part.
fn parts(
    session: &mut Session,
    world: &World,
    renderer: &Renderer,
    (spp, seeds, hash, expected_s): (u32, &[u32], &str, f64),
    wanted: impl Iterator<Item = usize>,
) -> Result<Vec<Part>, Fault> {
    let size = session.experiment.run.resolution;
    let mut parts = Vec::new();
    for number in wanted {
        let place = kept_part(session, world, &format!("{hash}, part {number}"));
        let kept = place.as_ref().and_then(Kept::read);
        // Stands in the file, too: a name that forgets one of them would hand out another image.
        let (seed, camera) = (seeds[number], world.camera);
        let made_of = format!("{spp} spp, seed {seed}, {size:?}, {camera:?}\n");
        let kept = kept.and_then(|bytes| image_of(bytes.strip_prefix(made_of.as_bytes())?, size));
        let cached = kept.is_some();
        let image = match kept {
            Some(image) => image,
            None => {
                let render = || renderer.render(&[spp], seeds[number]);
                let shots = session.clock.time("gpu", render);
                let shots = shots.map_err(|e| e.to_string())?;
                let last = shots.into_iter().last();
                last.ok_or("nothing was rendered".to_owned())?.image
            }
        };
        if let Some(Err(error)) = place.filter(|_| !cached).map(|place| {
            let pixels: &[u8] = bytemuck::cast_slice(&image.pixels);
            place.write([made_of.as_bytes(), pixels].concat())
        }) {
            session.warn("reference", format!("is not kept for later runs: {error}"))?;
        }
        parts.push(Part { image, cached });
        session.progress.add(expected_s);
    }
    Ok(parts)
}

/// Where a part of a reference is kept for later runs, if any are: whoever edits a kernel and measures again need not render it
/// again. The program's kernels, which alone render it, are part of its file.
fn kept_part(session: &Session, world: &World, name: &str) -> Option<Kept> {
    let about = &world.gpu.info;
    let machine = format!("{:?}", (&about.name, &about.driver, &about.driver_info));
    let depends_on = [("cell", name), ("machine", &machine)];
    let folder = session.options.cache.as_ref()?;
    Kept::new(folder, "references", &depends_on)
}

/// The image of the bytes of its pixels, if they are so many.
fn image_of(bytes: &[u8], [width, height]: [u32; 2]) -> Option<Image> {
    let pixels = bytes.chunks_exact(size_of::<[f32; 3]>());
    let pixels = pixels.map(bytemuck::pod_read_unaligned).collect();
    Image::new(width, height, pixels).ok()
}

/// Content hash of a reference, made of these `points`.
fn reference_hash<B>(session: &Session, world: &World, line: &Line<B>, points: &str) -> String {
    let file = session.reference_file.as_ref();
    let seeds = &session.experiment.seeds().reference_parts;
    let [seeds, camera, size] = [
        format!("{seeds:?}"),
        format!("{:?}", world.camera),
        format!("{:?}", session.experiment.run.resolution),
    ];
    let made_of = [
        ("sampler", points),
        ("file", file.map_or("", |file| &file.hash)),
        ("seeds", &seeds),
        ("camera", &camera),
        ("resolution", &size),
    ];
    line.content_hash(&world.scene.hash, &made_of)
}

/// The image of one value.
fn constant(value: f64, [width, height]: [u32; 2]) -> Result<Reference, String> {
    let pixels = vec![[value as f32; 3]; width as usize * height as usize];
    Image::new(width, height, pixels)
        .and_then(|image| Reference::from_parts(vec![image; REFERENCE_PARTS as usize]))
        .map_err(|e| e.to_string())
}

/// A reference that is not rendered, with its record and how far rounding may move it.
fn known_reference(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    (reference, record, rounding): (Reference, ReferenceRecord, f64),
) -> Result<ReferenceImage, Fault> {
    let part = session.cost.reference_part(cell);
    let parts_s = f64::from(REFERENCE_PARTS) * part.seconds();
    session.progress.add(parts_s);
    let line = Line::new(Key::from(cell), Ran::default(), record);
    Ok(finish_reference(
        session, world, cell, line, reference, rounding,
    )?)
}

/// The record of a reference that was not rendered; what was rendered sets more.
fn reference_record(reference: &Reference) -> ReferenceRecord {
    ReferenceRecord {
        spp: 0,
        exact: None,
        cached: false,
        file: None,
        sampler: "exact".to_owned(),
        seconds: 0.0,
        mse: reference.own_mse(),
        relmse: reference.own_relmse(),
        image: String::new(),
        mean: reference.image().mean(),
    }
}

/// Writes the picture and the record.
fn finish_reference(
    session: &mut Session,
    world: &World,
    cell: &Cell,
    mut line: Line<ReferenceRecord>,
    reference: Reference,
    rounding: f64,
) -> Result<ReferenceImage, RunError> {
    let exposure = automatic_exposure(reference.image());
    let labels = cell.labels(&[Axis::Scene, Axis::Integrator]);
    let picture = tone_map(reference.image(), exposure);
    let image = session.picture("reference", &labels, &picture)?;
    let about = attributes(
        &session.options.program,
        cell,
        &line.body.sampler,
        line.body.spp,
        session.experiment.reference.seed,
    );
    session.compared("reference", &labels, reference.image(), &about)?;
    line.body.image = image.unwrap_or_default();
    let part_spp = line.body.spp / REFERENCE_PARTS;
    // What a part foretells of fewer samples depends on its own.
    let together = part_spp * reference.parts().len() as u32;
    if together != line.body.spp {
        return Err(RunError::Wrong(format!(
            "the parts of a reference have {part_spp} samples per pixel each, {together} together, and it has {}",
            line.body.spp
        )));
    }
    let done = format!("reference {}: done", labels.join(", "));
    session.recorder.note_kernels(&done);
    let sampler = format!("{}, {} spp", line.body.sampler, line.body.spp);
    let hash = reference_hash(session, world, &line, &sampler);
    if !session.ledger.is_done(&done) {
        if line.body.exact.is_none() {
            let triangles = || &world.soup;
            let remark = uniform::remark(reference.image(), &world.scene, triangles, world.camera);
            remark.map_or(Ok(()), |remark| session.warn(&done, remark))?;
        }
        let file = session.reference_file.as_ref();
        let note = file.and_then(|file| file.note.clone());
        note.map_or(Ok(()), |note| session.warn(&done, note))?;
        session
            .recorder
            .write(&line.hashed(&hash).with_body(Body::Reference))?;
        session.ledger.finish(done.clone());
    }
    Ok(ReferenceImage {
        line: hash,
        name: done,
        part_spp,
        reference,
        rounding,
        exposure,
    })
}
