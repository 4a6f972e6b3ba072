//! Checks of samplers: words, images of integrands, evenness, means.

use super::{Bench, Finding, projections};
use crate::CheckError;
use crate::subject::{Changes, DEMAND, LONG_DEMAND, build, sampler};
use crate::world::Stage;
use raystone::discrepancy::{Budget, PointSet, net_quality, star_2d};
use raystone::image::Image;
use raystone::integrator::RayOffset;
use raystone::integrator::integrand::functions;
use raystone::integrator::{
    ConfiguredIntegrator, IntegratorRegistry, RenderJob, Renderer, SceneBuffers, Traced,
};
use raystone::measure::known_words;
use raystone::measure::statistics::{mean, variance};
use raystone::measure::words::{Used, compare, dump_stream};
use raystone::params::Variant;
use raystone::random::Pcg32;
use raystone::sampling::{Coordinate, Demand, Sampler, to_unit};

type Names<'a> = (&'a str, Changes, &'a str);

/// Coordinates anywhere whose words are compared, besides those that a run would compare.
const WORDS: usize = 1 << 14;
/// Seeds of the latter: small ones and every part of a word.
const SEEDS: [u32; 8] = [
    0,
    1,
    2,
    9001,
    0x0001_0000,
    0x00ab_cdef,
    0x8000_0000,
    u32::MAX,
];
/// Points whose evenness is measured: all that the samplers are made for.
const POINTS: u32 = 1024;
/// Samples per pixel of the image that is compared with the twins', and its edge.
const SPP: u32 = 4;
const SIZE: u32 = 64;
/// Replicates and samples of the mean.
const REPLICATES: u32 = 16;
const STANDARD_ERRORS: f64 = 5.0;
/// Decorrelations that leave a net in base 2 a net …
const KEEP_NETS: [&str; 4] = ["none", "digital-shift", "linear-scramble", "owen-hash"];
/// … and those whose mean over seeds is right at any number of samples.
const UNBIASED: [&str; 5] = [
    "cranley-patterson",
    "cranley-patterson-micro-jitter",
    "digital-shift",
    "linear-scramble",
    "owen-hash",
];
/// A decorrelation that moves single points, so that they are less even than those of the sequence, though more than
/// random ones.
const JITTERS: &str = "cranley-patterson-micro-jitter";
/// The smooth function that images show.
const INTEGRAND: &str = "integrand:exponential";

fn make(bench: &Bench, names: Names, demand: &Demand) -> Result<Sampler, CheckError> {
    let (sequence, changes, decorrelation) = names;
    sampler((sequence, changes), decorrelation, demand, bench.plant)
}

/// Words that a long run would use and words at coordinates anywhere, against the twin.
pub fn same_words(bench: &Bench, names: Names) -> Finding {
    let sampler = make(bench, names, &LONG_DEMAND)?;
    let Demand {
        samples,
        dimensions,
        width,
    } = sampler.demand;
    let (samples, width) = (samples.unwrap_or(1), width.unwrap_or(1));
    let used = Used {
        samples,
        dimensions,
        size: [width, width],
        seeds: SEEDS.into(),
    };
    let mut random = Pcg32::new(11);
    let mut number = |most: u32| match random.below(8) {
        0 => 0,
        1 => most,
        _ => random.below(most as usize + 1) as u32,
    };
    let mut coordinates = used.coordinates();
    coordinates.extend((0..WORDS).map(|_| Coordinate {
        pixel: number(u32::MAX),
        sample: number(samples - 1),
        dimension: number(dimensions - 1),
        seed: number(u32::MAX),
    }));
    let words = dump(bench, &sampler, &coordinates)?;
    Ok(compare(&sampler, &coordinates, &words).err())
}

/// What is known of the words, as before a run.
pub fn known_words(bench: &Bench, names: Names) -> Finding {
    let sampler = make(bench, names, &DEMAND)?;
    let width = sampler.demand.width.unwrap_or(1);
    let used = Used {
        samples: sampler.demand.samples.unwrap_or(1),
        dimensions: sampler.demand.dimensions,
        size: [width, width],
        seeds: (1..=4).collect(),
    };
    Ok(known_words::check(bench.gpu, &sampler, &used).err())
}

fn dump(bench: &Bench, sampler: &Sampler, at: &[Coordinate]) -> Result<Vec<u32>, CheckError> {
    dump_stream(bench.gpu, sampler, at).map_err(CheckError::Other)
}

fn integrand() -> Result<ConfiguredIntegrator, CheckError> {
    let variant = Variant {
        name: INTEGRAND.to_owned(),
        ..Variant::default()
    };
    let integrator = IntegratorRegistry::default().configured(&variant);
    integrator.map_err(|e| CheckError::Stale(e.to_string()))
}

/// Images of the integrand, one for each seed.
fn images(bench: &Bench, sampler: &Sampler, seeds: &[u32]) -> Result<Vec<Image>, CheckError> {
    let integrator = integrand()?;
    // The kernel has a structure, though it traces nothing.
    let stage = Stage::builtin("single-triangle", &[])?;
    let built = build("bvh", &[], &stage.soup)?;
    let traced = Traced::upload(bench.gpu, &*built)?;
    let buffers = SceneBuffers::upload(bench.gpu, &stage.scene, &stage.soup)?;
    let job = RenderJob {
        size: [SIZE; 2],
        camera: stage.camera,
        sampler,
        integrator: &integrator,
        offset: RayOffset::default(),
        runtime_checks: true,
    };
    let renderer = Renderer::new(bench.gpu, &buffers, &traced, &job, false)?;
    let one = |&seed: &u32| Ok(renderer.render(&[SPP], seed)?.remove(0).image);
    seeds.iter().map(one).collect()
}

/// The image of the integrand against that of the twins: sums of floats in the same order.
pub fn same_image(bench: &Bench, names: Names) -> Finding {
    let sampler = make(bench, names, &DEMAND)?;
    let name = INTEGRAND.trim_start_matches("integrand:");
    let known = functions().into_iter().find(|(n, _)| *n == name);
    let unknown = || CheckError::Stale(format!("there is no integrand `{name}`"));
    let (_, function) = known.ok_or_else(unknown)?;
    let image = images(bench, &sampler, &[7])?.remove(0);
    for (pixel, found) in (0..).zip(&image.pixels) {
        let value = |sample| {
            let number = |dimension| {
                to_unit(sampler.sample_u32(Coordinate {
                    pixel,
                    sample,
                    dimension,
                    seed: 7,
                }))
            };
            function.evaluate([number(0), number(1)])
        };
        let expected = (0..SPP).map(value).fold(0.0, |sum, v| sum + v) / SPP as f32;
        if found[0].to_bits() != expected.to_bits() {
            return Ok(Some(format!(
                "pixel {pixel} is {:?}, by the twins {expected:?}",
                found[0]
            )));
        }
    }
    Ok(None)
}

/// D* of 1024 points of a pixel is at most 1.5 log2(N) / N where the sequence promises low discrepancy
/// (random points have 0.04, three times as much; half of that is allowed to jittered ones), digital points in base 2 are a (0, m, 2)-net, and the
/// projections of all dimensions are sound.
pub fn discrepancy(bench: &Bench, names: Names) -> Finding {
    let sampler = make(bench, names, &DEMAND)?;
    let facts = sampler.sequence.facts();
    if facts.independent && !facts.base_2 {
        return Ok(None);
    }
    let at = |k: u32| Coordinate {
        pixel: 0,
        sample: k / 2,
        dimension: k % 2,
        seed: 0,
    };
    let coordinates: Vec<Coordinate> = (0..2 * POINTS).map(at).collect();
    let words = dump(bench, &sampler, &coordinates)?;
    let points: Vec<[f64; 2]> = words
        .chunks_exact(2)
        .map(|pair| [pair[0], pair[1]].map(|x| f64::from(to_unit(x))))
        .collect();
    let other = |e: raystone::discrepancy::DiscrepancyError| CheckError::Other(e.to_string());
    let n = f64::from(POINTS);
    let jitters = sampler.decorrelation_variant.name == JITTERS;
    let factor = if jitters { 3.0 } else { 1.5 };
    let (found, most) = (star_2d(&points).map_err(other)?, factor * n.log2() / n);
    if found > most {
        return Ok(Some(format!(
            "D* of {POINTS} points is {found:.4} > {most:.4}"
        )));
    }
    if facts.base_2 && KEEP_NETS.contains(&&*sampler.decorrelation_variant.name) {
        let set = PointSet::from_points(&points).map_err(other)?;
        let net = net_quality(&set, &Budget::seconds(60.0)).map_err(other)?;
        if net.t > 0 {
            return Ok(Some(format!("a ({}, {}, 2)-net, not t = 0", net.t, net.m)));
        }
    }
    if let Some(fault) = projections::fault(&sampler, POINTS, jitters) {
        return Ok(Some(fault));
    }
    let long = make(bench, names, &LONG_DEMAND)?;
    let keeps = facts.base_2 && KEEP_NETS.contains(&&*long.decorrelation_variant.name);
    Ok(keeps.then(|| projections::fault_of_axes(&long)).flatten())
}

/// The mean of the integrand over replicates, where that must be the integral.
pub fn integral(bench: &Bench, names: Names) -> Finding {
    let sampler = make(bench, names, &DEMAND)?;
    let facts = sampler.sequence.facts();
    if !(facts.random || UNBIASED.contains(&&*sampler.decorrelation_variant.name)) {
        return Ok(None);
    }
    let exact = integrand()?.facts.exact;
    let exact = exact.ok_or_else(|| CheckError::Stale(format!("{INTEGRAND} has no integral")))?;
    let seeds: Vec<u32> = (0..REPLICATES).map(|k| 100 + 77 * k).collect();
    let images = images(bench, &sampler, &seeds)?;
    let means: Vec<f64> = images.iter().map(Image::mean).collect();
    let found = mean(&means).unwrap_or(f64::NAN);
    let error = (variance(&means).unwrap_or(f64::NAN) / means.len() as f64).sqrt();
    let agrees = (found - exact).abs() <= STANDARD_ERRORS * error + 1e-5 * exact;
    // NaN does not agree.
    Ok((!agrees).then(|| format!("mean {found:.6} ± {error:.6}, integral {exact:.6}")))
}
