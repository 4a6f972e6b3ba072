//! The Cornell box against stored figures of Mitsuba 3: 64 × 64 pixels, 16 replicates of 1024
//! samples per pixel of its path tracer, `max_depth` 7. `scripts/validate store` renews them.

use super::agreement::Moments;
use super::{replicates, replicates_by};
use crate::support::{builtin, in_turn, sampler_of};
use raystone::image::luminance;
use raystone::scene::SceneData;

const EDGE: u32 = 64;
/// Tolerance of the ratio of the means, and the required share of accepted pixels.
const RATIO: f64 = 0.001;
const ACCEPTED: f64 = 0.9975;
const SPP: u32 = 128;
const REPLICATES: u32 = 8;
const STORED_REPLICATES: usize = 16;

/// The pixels of a portable float map of [`EDGE`] × [`EDGE`] pixels, from the top.
fn pixels(bytes: &[u8]) -> Vec<[f32; 3]> {
    let data = bytes.strip_prefix(b"PF\n64 64\n-1.0\n").expect("a header");
    let floats = data
        .as_chunks::<4>()
        .0
        .iter()
        .map(|b| f32::from_le_bytes(*b));
    let floats: Vec<f32> = floats.collect();
    let rows = floats.as_chunks::<3>().0.chunks(EDGE as usize).rev();
    rows.flatten().copied().collect()
}

/// Means and variances of the stored image's luminance. Channels vary together, so the standard
/// deviation of the luminance is the luminance of the channels' standard deviations.
fn stored() -> Moments {
    let mean = pixels(include_bytes!("../../data/mitsuba-cornell-box-mean.pfm"));
    let variance = pixels(include_bytes!(
        "../../data/mitsuba-cornell-box-variance.pfm"
    ));
    Moments {
        mean: mean.iter().map(luminance).collect(),
        variance: variance
            .iter()
            .map(|v| luminance(&v.map(f32::sqrt)).powi(2))
            .collect(),
        replicates: STORED_REPLICATES,
    }
}

/// Differences of the scene's image from Mitsuba's Cornell box; empty if there are none.
fn faults(scene: SceneData) -> Vec<String> {
    let (ours, theirs) = (
        replicates(scene, 6, [EDGE; 2], SPP, REPLICATES).moments(),
        stored(),
    );
    let (ratio, accepted) = (ours.total() / theirs.total(), ours.accepted(&theirs, 0.01));
    println!(
        "ratio of the means {ratio:.5}, {:.2} % of pixels accepted",
        100.0 * accepted
    );
    let mut faults = Vec::new();
    if (ratio - 1.0).abs() > RATIO {
        faults.push("mean".to_owned());
    }
    if accepted < ACCEPTED {
        faults.push("pixels".to_owned());
    }
    faults
}

#[test]
fn the_cornell_box_is_that_of_mitsuba() {
    assert_eq!(faults(builtin("cornell-box", &[])), Vec::<String>::new());
}

#[test]
fn a_wall_five_percent_too_dark_and_a_light_one_percent_too_bright_are_found() {
    let box_with = |change: fn(&mut SceneData)| {
        let mut scene = builtin("cornell-box", &[]);
        change(&mut scene);
        faults(scene)
    };
    let wall = box_with(|s| s.materials[0].base_color *= 0.95);
    assert_eq!(wall, ["mean", "pixels"]);
    let light = box_with(|s| s.materials[3].emission *= 1.01);
    assert!(light.contains(&"mean".to_owned()), "{light:?}");
}

/// Each sequence with one decorrelation, and each decorrelation with one sequence.
const SAMPLERS: [(&str, &str); 12] = [
    ("pixel-hash", "none"),
    ("pmj02", "cranley-patterson"),
    ("halton", "cranley-patterson"),
    ("hammersley", "cranley-patterson"),
    ("r2", "cranley-patterson"),
    ("rank1-lattice", "cranley-patterson"),
    ("sobol", "cranley-patterson"),
    ("sobol", "digital-shift"),
    ("sobol", "owen-hash"),
    ("sobol", "index-offset"),
    ("sobol", "blue-noise"),
    ("owen-sobol", "none"),
];
const TILE: u32 = 8;

#[test]
fn all_samplers_make_the_image_of_mitsuba() {
    const SPP: u32 = 16;
    let theirs = stored().tiled(EDGE as usize, TILE as usize);
    for (sequence, decorrelation) in in_turn("samplers against Mitsuba", SAMPLERS) {
        let sampler = sampler_of(sequence, decorrelation, SPP);
        let scene = builtin("cornell-box", &[]);
        let images = replicates_by(&sampler, scene, 6, [EDGE; 2], SPP, 8);
        let ours = images.tiled(TILE).moments();
        let (ratio, accepted) = (ours.total() / theirs.total(), ours.accepted(&theirs, 0.001));
        println!("{sequence} x {decorrelation}: {ratio:.5}, {accepted}");
        assert!(
            accepted == 1.0,
            "{sequence} x {decorrelation}: {accepted} of the tiles"
        );
        assert!(
            (ratio - 1.0).abs() < 0.01,
            "{sequence} x {decorrelation}: {ratio}"
        );
    }
}
