//! The correctness check of integrators: single samples of single pixels from the image kernel,
//! compared with the image oracle ([`PathOracle`]). No error figure is printed for an integrator
//! that fails.
//!
//! Each path falls into one of four classes:
//!
//! * it *agrees*: every channel is within `TOLERANCE`, relative, or below a floor of `FLOOR` of the
//!   mean radiance;
//! * it is *ill-conditioned*: it differs by more, but by at most `SPREAD` times the change of the
//!   same path when a few f32 roundings are simulated in f64 ([`Rounding`]) with all decisions
//!   unchanged: texture coordinates on long triangles, grazing light;
//! * it is a *flip*: with that many roundings the oracle takes another decision somewhere and then
//!   gives the kernel's answer. That decision had a margin below `MOST_ROUNDINGS` roundings. The
//!   first differing decision gives its kind: *another surface* within rounding of the first
//!   (two-layer walls) or behind one that is there by chance, *an edge* of a hit or an occluder, or
//!   anything else, such as a random number against a probability. Among the last are paths with so
//!   many surfaces by chance that the kernel's choices are not found;
//! * otherwise it is *wrong*: a fault of the kernels or of the oracle.
//!
//! Means of a few samples summed in one dispatch are compared with those of single samples
//! ([`sums`]).
//!
//! One wrong path fails the check. So do more flips than `FLIPS` of the paths beyond chance (other
//! surfaces are counted separately, up to the number of paths that meet surfaces with another
//! within rounding), more ill-conditioned paths than `ILL_CONDITIONED`, and a median difference
//! above `MEDIAN`, which no single path shows. Often-repeated texture coordinates have few digits
//! left within a texel, so the last two have separate bounds for textures.

pub use crate::pixels::{Choice, Frame, Pixels};

use crate::path_oracle::{MOST_ROUNDINGS, Parting, Path, PathId, PathOracle, Rounding, View};
use glam::DVec3;
use rayon::prelude::*;
use raystone_gpu::GpuError;
use raystone_image::Image;
use raystone_record::PathsRecord;
use raystone_render::{BLOCK_SAMPLES, Renderer};
use std::ops::Range;
use std::sync::atomic::{AtomicUsize, Ordering};

/// Relative difference of a channel that counts as agreement.
pub(crate) const TOLERANCE: f64 = 1e-4;
/// Radiance below which differences are ignored, relative to the mean radiance of the paths.
pub(crate) const FLOOR: f64 = 1e-3;
/// Simulated f32 roundings, in this order.
pub(crate) const SCALES: [f64; 3] = [4.0, 16.0, MOST_ROUNDINGS];
/// Fraction of the paths that may be flips.
pub(crate) const FLIPS: f64 = 1e-3;
/// Fraction of the paths that may be ill-conditioned: without textures, with an environment map,
/// and with textured surfaces. Measured on Mesa's software driver: at most 0.07 % of 1,482 paths of
/// a trial scene (0.03 % of 3,952 of the Cornell box), 1.0 % with maps, and in the last case 0.2 %
/// of a trial scene but a third of those of a large building with often-repeated textures.
pub(crate) const ILL_CONDITIONED: [f64; 3] = [0.02, 0.05, 0.6];
/// Largest median of the relative differences; measured: 5 · 10⁻⁷, 4 · 10⁻⁶, 10⁻⁴.
pub(crate) const MEDIAN: [f64; 3] = [2e-5, 2e-5, 1e-3];
/// Trials per scale, and per surface with another within rounding twice as many; more while trials
/// take new branches (light passed on by many small facets), up to [`MOST_TRIALS`].
const TRIALS: u64 = 24;
const MOST_TRIALS: u64 = TRIALS << 5;
/// So many times as many, at the first scale, for paths that meet surfaces which are there by chance: the kernel's
/// choices are one of two for each of them.
const BY_CHANCE: u64 = 8;
/// Factor by which a kernel may differ more than the worst simulated path of its branch.
const SPREAD: f64 = 3.0;
/// A difference that the second of [`SCALES`] may excuse too: offsets add up in corners.
const SLIGHT: f64 = 1e-3;
/// Samples summed in one dispatch for comparison with single ones.
const SUMMED: u32 = 4;
/// Relative tolerance of their mean.
const SUM_TOLERANCE: f64 = 1e-6;
/// Checking stops after this many wrong paths.
const ENOUGH: usize = 16;

/// A path as computed by the kernel.
#[derive(Debug, Clone, Copy)]
pub struct Answer {
    /// The sample.
    pub id: PathId,
    /// Its radiance.
    pub radiance: DVec3,
}

/// The class of a kernel path that does not agree.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Class {
    IllConditioned,
    Flip(Parting),
    Wrong,
}

/// Renders single samples, each in dispatches of its own.
///
/// # Errors
/// A kernel raised its error word, or the device is lost or hangs.
pub fn answers(renderer: &Renderer, pixels: &Pixels) -> Result<Vec<Answer>, GpuError> {
    let mut out = Vec::new();
    for (turn, &sample) in (0u32..).zip(&pixels.samples) {
        let image = samples_of(renderer, pixels, sample..sample + 1)?;
        out.extend(answers_of(&image, pixels, (turn, sample)));
    }
    Ok(out)
}

/// The chosen pixels of the image of one sample, which is in this place of the list.
pub(crate) fn answers_of(
    image: &Image,
    pixels: &Pixels,
    (turn, sample): (u32, u32),
) -> impl Iterator<Item = Answer> {
    let (width, seed) = (pixels.size[0], pixels.seed);
    pixels.chosen(turn).into_iter().map(move |number| Answer {
        id: PathId {
            pixel: [number % width, number / width],
            sample,
            seed,
        },
        radiance: DVec3::from_array(image.pixels[number as usize].map(f64::from)),
    })
}

pub(crate) fn samples_of(
    renderer: &Renderer,
    pixels: &Pixels,
    samples: Range<u32>,
) -> Result<Image, GpuError> {
    renderer.reset()?;
    renderer.add_samples(samples.start, samples.end - samples.start, pixels.seed)?;
    renderer.image()
}

/// Checks, in every pixel, that several samples rendered together equal the same samples rendered
/// singly: the first ones, and the last below `limit` on both sides of a border of blocks, which
/// the host adds. Returns a description of the fault, or `None`.
///
/// # Errors
/// A kernel raised its error word, or the device is lost or hangs.
pub fn sums(renderer: &Renderer, pixels: &Pixels, limit: u32) -> Result<Option<String>, GpuError> {
    let first = 0..SUMMED.min(limit.max(1));
    let border = BLOCK_SAMPLES - SUMMED / 2..BLOCK_SAMPLES + SUMMED / 2;
    let across = Some(border).filter(|samples| samples.end <= limit);
    for samples in [first].into_iter().chain(across) {
        // The first dispatches of a renderer are the smallest, and cut the image into slices.
        let all = || samples_of(renderer, pixels, samples.clone());
        let in_slices = all()?;
        let single = |sample| samples_of(renderer, pixels, sample..sample + 1);
        let singles: Vec<Image> = samples.clone().map(single).collect::<Result<_, _>>()?;
        let differs = |together: &Image| differing_sum(together, &singles);
        let found = differs(&in_slices).or(differs(&all()?)).map(|fault| {
            let (first, last) = (samples.start, samples.end - 1);
            format!("seed {}, samples {first} to {last}: {fault}", pixels.seed)
        });
        if found.is_some() {
            return Ok(found);
        }
    }
    Ok(None)
}

/// The first pixel whose mean is not that of the single samples.
pub(crate) fn differing_sum(together: &Image, singles: &[Image]) -> Option<String> {
    let count = singles.len() as f64;
    for (place, mean) in together.pixels.iter().enumerate() {
        for (channel, mean) in mean.iter().map(|x| f64::from(*x)).enumerate() {
            let own = |image: &Image| f64::from(image.pixels[place][channel]);
            let expected = singles.iter().map(own).sum::<f64>() / count;
            // NaN differs.
            let agrees = (mean - expected).abs() <= SUM_TOLERANCE * expected.abs();
            if !agrees {
                let width = together.width as usize;
                let [x, y] = [place % width, place / width];
                return Some(format!(
                    "the mean of pixel ({x}, {y}) is {mean:.7e} in one dispatch, {expected:.7e} by single samples"
                ));
            }
        }
    }
    None
}

/// Classifies the answers of a kernel.
pub fn judge(oracle: &PathOracle, view: &View, answers: &[Answer]) -> PathsRecord {
    let truth: Vec<Path> = (answers.par_iter())
        .map(|answer| oracle.trace(view, answer.id, Rounding::none()))
        .collect();
    let floor = floor_of(&truth);
    let differences: Vec<f64> = (answers.iter().zip(&truth))
        .map(|(answer, path)| difference(answer.radiance, path.radiance, floor))
        .collect();
    // NaN differs.
    let mut differing: Vec<usize> = (0..answers.len()).collect();
    differing.retain(|&i| differences[i].is_nan() || differences[i] > TOLERANCE);
    let wrong = AtomicUsize::new(0);
    let class = |&i: &usize| {
        if wrong.load(Ordering::Relaxed) >= ENOUGH {
            return Class::Wrong;
        }
        let class = classify(oracle, view, &answers[i], &truth[i], floor);
        wrong.fetch_add(usize::from(class == Class::Wrong), Ordering::Relaxed);
        class
    };
    let classes: Vec<Class> = differing.par_iter().map(class).collect();
    let of = |class: Class| classes.iter().filter(|c| **c == class).count();
    let first_wrong = (differing.iter().zip(&classes)).find(|(_, c)| **c == Class::Wrong);
    let agreeing = differences.iter().filter(|d| **d <= TOLERANCE);
    let mut record = PathsRecord {
        paths: answers.len(),
        ill_conditioned: of(Class::IllConditioned),
        flips: [Parting::Surfaces, Parting::Edge, Parting::Decision]
            .map(|parting| of(Class::Flip(parting)))
            .iter()
            .sum(),
        surfaces: of(Class::Flip(Parting::Surfaces)),
        edges: of(Class::Flip(Parting::Edge)),
        layered: truth.iter().filter(|path| path.layers > 0).count(),
        wrong: of(Class::Wrong),
        median: median(&truth, &differences, floor),
        worst: agreeing.copied().fold(0.0, f64::max),
        ..PathsRecord::default()
    };
    record.fault = match first_wrong {
        Some((&i, _)) => {
            let played = spread_of(oracle, view, &answers[i], &truth[i], floor);
            let share = 100.0 * parting_share(oracle, view, answers, &truth);
            let all = format!("; of all paths rounding makes {share:.1} % take another branch");
            Some(describe(&answers[i], &truth[i]) + &played + &all)
        }
        None => out_of_bounds(&record, FLIPS, oracle.texturing()).and_then(|_| {
            // Far from the origin f32 has few steps between edges, at which more paths part.
            let share = parting_share(oracle, view, answers, &truth);
            out_of_bounds(&record, share.max(FLIPS), oracle.texturing())
        }),
    };
    record
}

/// The share of paths that take another branch, but for other surfaces, where each is played once with the roundings of f32.
fn parting_share(oracle: &PathOracle, view: &View, answers: &[Answer], truth: &[Path]) -> f64 {
    let parts = |(answer, path): &(&Answer, &Path)| {
        let played = oracle.trace(view, answer.id, Rounding::played(SCALES[0], 0));
        (played.parting(path)).is_some_and(|parting| parting != Parting::Surfaces)
    };
    let parted = answers.par_iter().zip(truth).filter(parts).count();
    parted as f64 / answers.len().max(1) as f64
}

/// The radiance below which differences of these paths are ignored.
pub(crate) fn floor_of(truth: &[Path]) -> f64 {
    let mean = |c: DVec3| c.element_sum() / 3.0;
    let sum: f64 = truth.iter().map(|path| mean(path.radiance)).sum();
    FLOOR * sum / truth.len().max(1) as f64
}

/// True if a kernel's path does not agree with the oracle's, whatever the reason.
pub(crate) fn differs(answer: &Answer, truth: &Path, floor: f64) -> bool {
    let off = difference(answer.radiance, truth.radiance, floor);
    off.is_nan() || off > TOLERANCE
}

/// The largest difference of a channel, relative to the oracle's value or to the floor.
fn difference(kernel: DVec3, oracle: DVec3, floor: f64) -> f64 {
    let off = (kernel - oracle).abs();
    let relative = off / oracle.abs().max(DVec3::splat(floor));
    // Without light the floor is 0 too, and equal is equal. This keeps NaN, unlike `max_element`.
    let [r, g, b] = DVec3::select(off.cmpeq(DVec3::ZERO), DVec3::ZERO, relative).to_array();
    if r.is_nan() || g.is_nan() || b.is_nan() {
        f64::NAN
    } else {
        r.max(g).max(b)
    }
}

/// Median difference of the paths that found light. NaN and infinity become the largest finite
/// number, since records cannot represent them.
fn median(truth: &[Path], differences: &[f64], floor: f64) -> f64 {
    let lit = truth.iter().zip(differences);
    let lit = lit.filter(|(path, _)| path.radiance.max_element() > floor);
    let known = |d: f64| if d.is_finite() { d } else { f64::MAX };
    let mut lit: Vec<f64> = lit.map(|(_, d)| known(*d)).collect();
    lit.sort_by(f64::total_cmp);
    lit.get(lit.len() / 2).copied().unwrap_or_default()
}

/// Simulates roundings until a path of the oracle explains the kernel's.
fn classify(oracle: &PathOracle, view: &View, answer: &Answer, truth: &Path, floor: f64) -> Class {
    let mut spread = 0.0_f64;
    let mut near = TOLERANCE;
    let mut others: Vec<Path> = Vec::new();
    let mut is_ever_taken = false;
    let off = difference(answer.radiance, truth.radiance, floor);
    let least = (TRIALS << truth.layers.min(8)).min(MOST_TRIALS);
    for (index, scale) in (0..).zip(SCALES) {
        // Many roundings would excuse anything of a path that stays on its branch.
        let is_excused = scale == SCALES[0] || off <= SLIGHT && scale == SCALES[1];
        let is_first_by_chance = truth.by_chance > 0 && index == 0;
        let most = MOST_TRIALS * if is_first_by_chance { BY_CHANCE } else { 1 };
        let (mut trial, mut since_new) = (0, 0);
        while since_new < least && trial < most {
            let rounding = Rounding::played(scale, MOST_TRIALS * index + trial);
            let played = oracle.trace(view, answer.id, rounding);
            trial += 1;
            since_new += 1;
            if played.parting(truth).is_none() {
                is_ever_taken = true;
                spread = spread.max(difference(played.radiance, truth.radiance, floor));
            } else {
                if others.iter().all(|other| other.parting(&played).is_some()) {
                    since_new = 0;
                }
                others.push(played);
            }
            if off <= SPREAD * spread && is_excused {
                return Class::IllConditioned;
            }
        }
        if is_excused {
            // A path on a boundary may have no trial of its own branch; others then give a spread.
            near = TOLERANCE + SPREAD * spread.max(spread_of_branches(&others, floor));
        }
        let explains = |other: &Path| difference(answer.radiance, other.radiance, floor) <= near;
        let parting = others.iter().filter(|other| explains(other));
        if let Some(parting) = parting.filter_map(|other| other.parting(truth)).min() {
            return Class::Flip(parting);
        }
    }
    // Too many choices to find all of the kernel's; so few as flips are allowed.
    if truth.by_chance > 0 || !is_ever_taken {
        return Class::Flip(Parting::Decision);
    }
    Class::Wrong
}

/// Classifies a path by the fewest simulated roundings, for reports.
fn spread_of(
    oracle: &PathOracle,
    view: &View,
    answer: &Answer,
    truth: &Path,
    floor: f64,
) -> String {
    let plays =
        (0..TRIALS).map(|trial| oracle.trace(view, answer.id, Rounding::played(SCALES[0], trial)));
    let (same, others): (Vec<Path>, Vec<Path>) = plays.partition(|p| p.parting(truth).is_none());
    let off = |path: &Path| difference(path.radiance, truth.radiance, floor);
    let spread = same.iter().map(off).fold(0.0, f64::max);
    let from_kernel = |path: &Path| difference(answer.radiance, path.radiance, floor);
    let nearest = others
        .iter()
        .min_by(|a, b| from_kernel(a).total_cmp(&from_kernel(b)));
    let nearest = nearest.map_or(String::new(), |path| {
        let apart = spread_of_branches(&others, floor);
        format!(
            ", the nearest of which is {} and off by {:.1e} (up to {apart:.1e} within a branch)",
            show(path.radiance),
            from_kernel(path)
        )
    });
    let others = others.len();
    format!(
        "; rounding moves it by {spread:.1e}, {others} of {TRIALS} plays take other branches{nearest}"
    )
}

/// The largest difference of a path from the first one of its branch.
fn spread_of_branches(paths: &[Path], floor: f64) -> f64 {
    let from_first = |path: &Path| {
        let first = paths.iter().find(|first| first.parting(path).is_none());
        first.map_or(0.0, |first| {
            difference(path.radiance, first.radiance, floor)
        })
    };
    paths.iter().map(from_first).fold(0.0, f64::max)
}

/// The most of `paths` that may be in a class with this share: mean plus six deviations.
fn most(paths: usize, share: f64) -> usize {
    let mean = share * paths as f64;
    (mean + 6.0 * mean.sqrt()).ceil() as usize + 1
}

/// Checks the totals of a record against their bounds: `parting` is the share of paths that may take another branch, `texturing`
/// comes from the oracle.
pub fn out_of_bounds(record: &PathsRecord, parting: f64, texturing: usize) -> Option<String> {
    let [share, median] = [ILL_CONDITIONED, MEDIAN].map(|bounds| bounds[texturing]);
    let PathsRecord {
        paths,
        flips,
        surfaces,
        layered,
        ill_conditioned,
        ..
    } = *record;
    let over = |what: &str, found: usize, share: f64| {
        let most = most(paths, share);
        (found > most).then(|| {
            format!("{found} of {paths} paths {what}, at most {most} are explained by rounding")
        })
    };
    let off = record.median > median;
    let strange = surfaces > layered + most(paths, FLIPS);
    let strange = strange.then(|| {
        format!("{surfaces} of {paths} paths meet another surface, but {layered} have one within rounding")
    });
    over("take another branch", flips - surfaces, parting)
        .or(strange)
        .or_else(|| over("are ill-conditioned", ill_conditioned, share))
        .or_else(|| {
            off.then(|| format!("half of the paths differ by {:.1e} or more", record.median))
        })
}

/// Both answers, and the path, one line per vertex.
fn describe(answer: &Answer, truth: &Path) -> String {
    let mut text = format!(
        "{}: kernel {}, oracle {}",
        answer.id,
        show(answer.radiance),
        show(truth.radiance)
    );
    for (number, vertex) in truth.vertices.iter().enumerate() {
        text += &format!("; vertex {number}: {vertex}");
    }
    text
}

fn show(c: DVec3) -> String {
    format!("({:.7e}, {:.7e}, {:.7e})", c.x, c.y, c.z)
}
