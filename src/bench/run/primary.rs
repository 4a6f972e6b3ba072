//! Rasterised primary visibility against rays: different pixels, effect on the image, times.

use super::images::Estimator;
use super::session::Session;
use super::structures::Gated;
use super::world::World;
use raystone_accel::{Ask, NO_HIT, Query, Tracer};
use raystone_config::{Axis, Cell};
use raystone_core::params::{ParamValue, Variant};
use raystone_gpu::{Gpu, GpuError};
use raystone_image::Image;
use raystone_record::PrimaryRecord;
use raystone_render::{Renderer, Visibility};
use raystone_stats::statistics::median_interval;
use raystone_verify::rays::{primary_pixels, primary_rays};

/// One pixel in this many may differ although it sees the same triangle as the host's ray, as
/// directions of host and kernels differ by rounding.
const UNEXPLAINED: u64 = 10_000;

/// Compares a cell with rasterised first hits, after its last timed image; `None` for others.
///
/// # Errors
/// A kernel does not compile, the device is lost, or pixels differ that see the same triangle.
pub(super) fn of_cell(
    session: &mut Session,
    world: &World,
    structure: &Gated,
    (cell, renderer): (&Cell, &Renderer),
) -> Result<Option<PrimaryRecord>, String> {
    let Some(visibility) = renderer.visibility() else {
        return Ok(None);
    };
    session.say(format!("{cell}: rasterised against traced"));
    let text = |e: GpuError| e.to_string();
    let gpu = world.device.of(&cell[Axis::Kernels]);
    let gpu = gpu.map_err(|e| e.to_string())?;
    let turns = Turns::taken(session, world, structure, gpu, visibility).map_err(text)?;
    let traced = centred(session, world, structure, cell)?;
    let rasterised = renderer.image().map_err(text)?;
    let record = turns.timed(compared(&rasterised, &traced, &turns.other_triangle));
    if world.probe.is_exact() && record.unexplained * UNEXPLAINED > record.pixels {
        return Err(format!(
            "{} of {} pixels have another value than by rays through their centres, although they see the same triangle",
            record.unexplained, record.pixels
        ));
    }
    Ok(Some(record))
}

/// Results and times of rasteriser and rays.
#[derive(Default)]
pub(super) struct Turns {
    pub(super) other_triangle: Vec<bool>,
    pub(super) raster_ms: Vec<f64>,
    pub(super) traced_ms: Vec<f64>,
}

impl Turns {
    /// A comparison with its times.
    pub(super) fn timed(&self, record: PrimaryRecord) -> PrimaryRecord {
        PrimaryRecord {
            raster_ms: median_interval(&self.raster_ms),
            traced_ms: median_interval(&self.traced_ms),
            ..record
        }
    }

    /// Runs both in turns by the wall clock; the first round warms up.
    fn taken(
        session: &mut Session,
        world: &World,
        structure: &Gated,
        gpu: &Gpu,
        visibility: &Visibility,
    ) -> Result<Self, GpuError> {
        let [width, height] = session.experiment.run.resolution;
        let rays = primary_rays(world.camera, width, height);
        let ask = Ask {
            coherent: true,
            runtime_checks: structure.runtime_checks,
            ..Query::Closest.into()
        };
        let tracer = Tracer::new(gpu, &world.buffers.triangles, &structure.traced, ask)?;
        let batch = tracer.batch(&rays)?;
        let (mut raster_ms, mut traced_ms) = (Vec::new(), Vec::new());
        for round in 0..=session.experiment.timing.rounds {
            let raster = session
                .clock
                .time("gpu", || visibility.draw(world.camera))?;
            let traced = session.clock.time("gpu", || batch.trace())?;
            if round > 0 {
                raster_ms.push(raster.wall_ms);
                traced_ms.push(traced.wall_ms);
            }
        }
        let mut found = vec![NO_HIT; rays.len()];
        for (pixel, hit) in primary_pixels(width, height).iter().zip(batch.hits()?) {
            found[*pixel as usize] = hit.triangle;
        }
        let seen = visibility.triangles()?;
        Ok(Self {
            other_triangle: found.iter().zip(&seen).map(|(a, b)| a != b).collect(),
            raster_ms,
            traced_ms,
        })
    }
}

/// The image of the same samples, traced through pixel centres.
fn centred(
    session: &mut Session,
    world: &World,
    structure: &Gated,
    cell: &Cell,
) -> Result<Image, String> {
    let mut integrator: Variant = cell[Axis::Integrator].clone();
    let centre = ParamValue::Name("centre".to_owned());
    integrator.params.0.insert("primary".to_owned(), centre);
    let cell = cell.clone().with(Axis::Integrator, &integrator);
    let estimator = Estimator::new(session, &cell, session.timed_samples())?;
    let seeds = session.experiment.seeds().replicates;
    let of_kernel = [structure.runtime_checks, false];
    let renderer = estimator.renderer(session, world, &structure.traced, &seeds, of_kernel)?;
    let (spp, seed) = (session.experiment.timing.spp, session.experiment.run.seed);
    let shots = session.clock.time("gpu", || renderer.render(&[spp], seed));
    let shots = shots.map_err(|e| e.to_string())?;
    let last = shots.into_iter().next_back();
    last.map(|shot| shot.image)
        .ok_or_else(|| "no image was taken".to_owned())
}

/// Difference of an image from a traced one, without times.
fn compared(rasterised: &Image, traced: &Image, other_triangle: &[bool]) -> PrimaryRecord {
    let mut record = PrimaryRecord {
        pixels: traced.pixels.len() as u64,
        ..PrimaryRecord::default()
    };
    let (mut sum, mut difference, mut squares) = (0.0, 0.0, 0.0);
    let pixels = rasterised
        .pixels
        .iter()
        .zip(&traced.pixels)
        .zip(other_triangle);
    for ((a, b), other) in pixels {
        record.other_triangle += u64::from(*other);
        let differs = a.map(f32::to_bits) != b.map(f32::to_bits);
        record.other_value += u64::from(differs);
        record.unexplained += u64::from(differs && !other);
        for (a, b) in a.iter().zip(b).map(|(a, b)| (f64::from(*a), f64::from(*b))) {
            sum += b;
            difference += a - b;
            squares += (a - b) * (a - b);
        }
    }
    let count = 3.0 * record.pixels as f64;
    let mean: f64 = sum / count;
    if mean > 0.0 {
        record.mean_difference = difference / count / mean;
        record.rms_difference = (squares / count).sqrt() / mean;
    }
    record
}

#[cfg(test)]
mod tests {
    use super::*;

    fn image(pixels: &[[f32; 3]]) -> Image {
        Image {
            width: pixels.len() as u32,
            height: 1,
            pixels: pixels.to_vec(),
        }
    }

    #[test]
    fn a_difference_is_explained_where_another_triangle_is_seen() {
        let traced = image(&[[1.0; 3], [1.0; 3], [2.0; 3], [0.0; 3]]);
        let rasterised = image(&[[1.0; 3], [3.0; 3], [2.0; 3], [1.0; 3]]);
        let record = compared(&rasterised, &traced, &[false, true, true, false]);
        let counts = [record.pixels, record.other_triangle, record.other_value];
        assert_eq!((counts, record.unexplained), ([4, 2, 2], 1));
        assert!((record.mean_difference - 0.75).abs() < 1e-12);
        assert!((record.rms_difference - (5.0f64 / 4.0).sqrt()).abs() < 1e-12);
        let same = compared(&traced, &traced, &[false; 4]);
        assert_eq!((same.other_value, same.rms_difference), (0, 0.0));
        let black = image(&[[0.0; 3]]);
        assert_eq!(compared(&black, &black, &[true]).mean_difference, 0.0);
    }
}
