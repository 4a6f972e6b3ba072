//! The same seed twice, and in other slices: the same bits. The hashes distinguish adapters.

use super::rig::{self, Rig};
use super::{Gauge, NumericsError};
use raystone_bench::run::dump_stream;
use raystone_gpu::Gpu;
use raystone_image::Image;
use raystone_sampling::{Coordinate, dimensions};
use raystone_scene as scene;

const SIZE: u32 = 48;
const SPP: u32 = 8;
const SEED: u32 = 5;
/// Points of the stream.
const POINTS: u32 = 1 << 16;

/// Renders and draws everything twice.
pub(super) fn figures(gpu: &Gpu) -> Result<Vec<Gauge>, NumericsError> {
    let mut figures = image(gpu)?;
    figures.push(stream(gpu)?);
    Ok(figures)
}

fn image(gpu: &Gpu) -> Result<Vec<Gauge>, NumericsError> {
    let rig = Rig::new(gpu, scene::named("cornell-box")?)?;
    let path = rig::path(None)?;
    let sampler = rig::sampler("sobol", path.facts.dimensions)?;
    let render = |spps: &[u32], seed| -> Result<Image, NumericsError> {
        let renderer = rig.renderer(&path, &sampler, SIZE)?;
        let mut snapshots = renderer.render(spps, seed)?;
        // `render` returns as many as requested, at least one.
        Ok(snapshots.swap_remove(spps.len() - 1).image)
    };
    let first = render(&[SPP], SEED)?;
    let again = render(&[SPP], SEED)?;
    let in_slices = render(&[1, 3, SPP], SEED)?;
    let differing = |other: &Image| {
        let bits = |p: &[f32; 3]| p.map(f32::to_bits);
        let pairs = first.pixels.iter().zip(&other.pixels);
        pairs.filter(|(a, b)| bits(a) != bits(b)).count() as f64
    };
    let note = format!(
        "{SIZE} × {SIZE} pixels at {SPP} spp, hash {}",
        hash(bytemuck::cast_slice(&first.pixels))
    );
    Ok([
        ("pixels that differ when rendered again", &again, &*note),
        (
            "pixels that differ when rendered in slices",
            &in_slices,
            "1 + 2 + 5 samples in the place of 8",
        ),
    ]
    .map(|(name, image, note)| Gauge::new(name, differing(image), note).at_most(0.0))
    .map(|gauge| gauge.in_unit("pixels"))
    .to_vec())
}

fn stream(gpu: &Gpu) -> Result<Gauge, NumericsError> {
    let sampler = rig::sampler("pixel-hash", dimensions::needed(6))?;
    let coordinates: Vec<Coordinate> = (0..POINTS)
        .map(|k| Coordinate {
            pixel: k % 97,
            sample: k / 8,
            dimension: k % 8,
            seed: SEED,
        })
        .collect();
    let draw = || dump_stream(gpu, &sampler, &coordinates).map_err(NumericsError::Stream);
    let (first, again) = (draw()?, draw()?);
    let differing = first.iter().zip(&again).filter(|(a, b)| a != b).count();
    let note = format!(
        "{POINTS} words, hash {}",
        hash(bytemuck::cast_slice(&first))
    );
    let name = "drawn words that differ when drawn again";
    Ok(Gauge::new(name, differing as f64, note)
        .at_most(0.0)
        .in_unit("words"))
}

/// Returns the beginning of the BLAKE3 hash: the same on two adapters where all bits are.
fn hash(bytes: &[u8]) -> String {
    blake3::hash(bytes).to_hex()[..16].to_owned()
}
