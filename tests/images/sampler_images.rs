//! Rendered error of every structured sampler against plain hashing, at 256 samples per pixel.
//! Takes a minute: forty kernels are compiled, and the references have 8192 samples.

use crate::support::*;
use raystone::gpu::Gpu;
use raystone::image::Image;
use raystone::params::{ParamValue, Variant};
use raystone::sampling::Sampler;

const SIZE: [u32; 2] = [16, 12];
const SPP: u32 = 256;
/// Samples of each half of the reference.
const REFERENCE: u32 = 4096;
const SEEDS: u32 = 8;
/// A mean square over 8 replicates of 192 pixels is known to about 5 %; twice that is significant.
const MARGIN: f64 = 1.1;

const SAMPLERS: [(&str, &str); 10] = [
    ("hammersley", "none"),
    ("halton", "none"),
    ("halton", "cranley-patterson"),
    ("sobol", "none"),
    ("sobol", "owen-hash"),
    ("owen-sobol", "none"),
    ("pmj02", "none"),
    ("pmj02", "digital-shift"),
    ("rank1-lattice", "none"),
    ("r2", "none"),
];

/// A scene, its rendering, and two independent halves of the reference.
struct View<'a> {
    gpu: &'a Gpu,
    stage: &'a Stage,
    what: Variant,
    halves: Vec<Image>,
}

impl<'a> View<'a> {
    fn new(gpu: &'a Gpu, stage: &'a Stage, what: Variant) -> Self {
        let mut view = Self {
            gpu,
            stage,
            what,
            halves: Vec::new(),
        };
        let hash = sampler_of("pixel-hash", "none", REFERENCE);
        view.halves = view.images(gpu, &hash, REFERENCE, &[90_001, 90_002]);
        view
    }

    fn images(&self, gpu: &Gpu, sampler: &Sampler, spp: u32, seeds: &[u32]) -> Vec<Image> {
        // Buffers belong to a device.
        let own = (!std::ptr::eq(gpu, self.gpu)).then(|| Stage::new(gpu, self.stage.scene.clone()));
        let stage = own.as_ref().unwrap_or(self.stage);
        let traced = stage.traced(gpu, structure("bvh"));
        let renderer = stage.renderer(gpu, &traced, sampler, &self.what, SIZE, false);
        let image = |&seed: &u32| {
            renderer
                .render(&[spp], seed)
                .expect("an image")
                .remove(0)
                .image
        };
        seeds.iter().map(image).collect()
    }

    /// Mean squared error over seeds, pixels and channels, without the reference's noise: the
    /// product of the differences from its two halves.
    fn error(&self, gpu: &Gpu, (sequence, decorrelation): (&str, &str)) -> f64 {
        let sampler = sampler_of(sequence, decorrelation, SPP);
        let seeds: Vec<u32> = if sampler.is_random() {
            (1..=SEEDS).collect()
        } else {
            vec![1]
        };
        let images = self.images(gpu, &sampler, SPP, &seeds);
        let mut sum = 0.0;
        let mut count = 0.0;
        for image in &images {
            let halves = self.halves[0].pixels.iter().zip(&self.halves[1].pixels);
            for (x, (a, b)) in image.pixels.iter().zip(halves) {
                for k in 0..3 {
                    let [x, a, b] = [x[k], a[k], b[k]].map(f64::from);
                    sum += (x - a) * (x - b);
                    count += 1.0;
                }
            }
        }
        sum / count
    }
}

#[test]
fn no_structured_sampler_is_worse_than_hashing() {
    let gpu = gpu();
    let triangles = [("triangles", ParamValue::Integer(800))];
    // A closed box with a lamp, and an object under an open sky.
    let stages = [
        Stage::builtin(gpu, "cornell-box", &[]),
        Stage::builtin(gpu, "displaced-sphere", &triangles),
    ];
    let mut wrong = Vec::new();
    for stage in &stages {
        for what in [integrator_variant("ao", &[]), path(6)] {
            let view = View::new(gpu, stage, what);
            let random = view.error(gpu, ("pixel-hash", "none"));
            println!("{}: pixel-hash {random:.3e}", view.what);
            for pair in in_turn("samplers against hashing", SAMPLERS) {
                let ratio = view.error(gpu, pair) / random;
                println!("{}: {pair:?} {ratio:.3} of pixel-hash", view.what);
                if ratio > MARGIN {
                    wrong.push(format!(
                        "{}: {pair:?} has {ratio:.2} of the error",
                        view.what
                    ));
                }
            }
        }
    }
    assert!(wrong.is_empty(), "{wrong:?}");

    // A common point set for all pairs of dimensions must be detected.
    let faulty = open(kernels_with(
        "sampling/pmj02",
        &[("(s.dimension >> 1u) * (last + 1u)", "0u")],
    ));
    let view = View::new(gpu, &stages[0], integrator_variant("ao", &[]));
    let random = view.error(gpu, ("pixel-hash", "none"));
    let ratio = view.error(&faulty, ("pmj02", "none")) / random;
    assert!(ratio > MARGIN, "{ratio}");
}
