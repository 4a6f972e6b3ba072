//! Figures of the words that samplers draw, dumped from a kernel that imports the renderer's modules
//! ([`crate::words`]) and equal to the twin's, and what drawing costs.

use super::cost::{Cost, Work};
use super::device::Device;
use super::error::RunError;
use super::measurement::Measurement;
use super::session::Session;
use crate::sampler_cost::sampler_cost;
use crate::stream::{COPIES, SeedFigures, coverage, neighbour_angle, over_seeds};
use crate::words::{compare, dump_stream, kernel_hash};
use rayon::prelude::*;
use raystone_config::{Axis, Cell, Experiment, Plan, is_bench};
use raystone_discrepancy::{Budget, PointSet, radial_spectrum, star_2d};
use raystone_gpu::Gpu;
use raystone_record::{
    Body, Key, Line, MeasuredRecord, Outcome, PixelsAtCount, Ran, Reading, RecordedPoints,
    StreamRecord,
};
use raystone_sampling::dimensions::{DIRECTION, FIRST_BOUNCE, PER_BOUNCE, pair_purpose};
use raystone_sampling::hash::pcg_hash;
use raystone_sampling::{Coordinate, Demand, Sampler, to_unit};
use std::collections::BTreeSet;

/// Fewest points whose discrepancy is taken.
const FEWEST_POINTS: u32 = 16;
/// Several pixels are looked at up to this many samples.
const MOST_SAMPLES: usize = 1024;
/// Neighbours are compared in a tile of this edge …
const TILE: u32 = 8;
/// … at this many samples at most.
const TILE_SAMPLES: u32 = 32;
/// Points at which the worst pair of dimensions is looked for, at most.
const WORST_POINTS: u32 = 1024;
/// Pixels in which all seeds' points have to be the same where no seed changes them.
const SHARED_PIXELS: u32 = 4;
/// Points of each pixel that are recorded for pictures, and the number of pixels.
const RECORDED: u32 = 64;
const RECORDED_PIXELS: u32 = 8;
/// Points and frequencies of the recorded spectrum, and the seconds that it may take.
const SPECTRUM_POINTS: u32 = 1024;
const FREQUENCIES: usize = 64;
const SPECTRUM_SECONDS: f64 = 10.0;

/// Seconds to measure a stream.
const STREAM_SECONDS: f64 = 0.6;

/// Words of samplers, and what drawing them costs.
pub(super) struct Streams;

impl Measurement for Streams {
    fn name(&self) -> &'static str {
        "stream"
    }

    fn plural(&self) -> &'static str {
        "streams of samplers"
    }

    fn cells(&self, _: &Experiment, plan: &Plan) -> Vec<Cell> {
        plan.streams.clone()
    }

    fn unit_name(&self, cell: &Cell) -> String {
        cell.to_string()
    }

    fn rounds_of(&self, cell: &Cell) -> (&'static str, Cell) {
        (self.name(), cell.clone())
    }

    fn settings(&self, experiment: &Experiment, _: &str) -> String {
        let e = experiment;
        // The worst pair of dimensions is looked for among those of all integrators.
        let drawn = e.axes[Axis::Integrator].iter().filter(|i| !is_bench(i));
        let drawn: Vec<&str> = drawn.map(|integrator| integrator.label.as_str()).collect();
        format!(
            "{:?}",
            (e.run.seed, e.run.resolution, &e.discrepancy, drawn)
        )
    }

    fn cost(&self, _: &Cell, _: &Cost) -> Work {
        Work::other(STREAM_SECONDS)
    }
}

/// A pair of dimensions to be measured.
#[derive(Clone, Copy)]
struct Pair {
    dimensions: [u32; 2],
    /// Whether the experiment names it.
    named: bool,
    /// Among how many pairs of the integrators it is the sampler's worst.
    worst_of: Option<usize>,
}

/// All streams of the plan.
pub(super) fn run(session: &mut Session, device: &Device) -> Result<(), RunError> {
    for cell in session.plan.streams.clone() {
        if session.ledger.is_done(&cell.to_string()) {
            continue;
        }
        session.go_on()?;
        let gpu = device.of(&cell[Axis::Kernels])?;
        session.say(format!("discrepancy of {cell}"));
        session.lose_device_on_request(gpu, &cell.to_string());
        let mut written = Written::default();
        for pair in pairs(session, gpu, &cell, &mut written)? {
            let what = format!("{:?}", pair.dimensions);
            match stream_record(session, gpu, &cell, pair) {
                Ok((kernel, record)) => {
                    let line = line(&cell, kernel, &what, Body::Stream(record));
                    written.line(session, &line)?;
                }
                Err(reason) => {
                    written.failure(session, format!("stream {cell}, {what}"), reason)?
                }
            }
        }
        if gpu.lost().is_none() {
            match cost_record(session, gpu, &cell) {
                Ok((readings, kernel)) => {
                    let cost = MeasuredRecord {
                        measurement: "sampler-cost".to_owned(),
                        ..MeasuredRecord::default()
                    };
                    let line = line(&cell, kernel, "cost", Body::Measured(cost));
                    written.line(session, &line.with_readings(readings.into()))?;
                }
                Err(reason) => written.failure(session, format!("cost of {cell}"), reason)?,
            }
        }
        let ended = match &written.failure {
            Some(reason) => (Outcome::Failed, reason.as_str()),
            None => (Outcome::Done, ""),
        };
        session.close(&cell.to_string(), ended, written.hashes, &[])?;
        session.progress.add(STREAM_SECONDS);
        if gpu.lost().is_some() {
            return Ok(());
        }
    }
    Ok(())
}

/// What was written of a stream.
#[derive(Default)]
struct Written {
    hashes: Vec<String>,
    failure: Option<String>,
}

impl Written {
    fn line(&mut self, session: &Session, line: &Line) -> Result<(), RunError> {
        self.hashes.push(line.hash.clone());
        session.recorder.write(line)
    }

    fn failure(
        &mut self,
        session: &mut Session,
        what: String,
        reason: String,
    ) -> Result<(), RunError> {
        self.failure.get_or_insert_with(|| reason.clone());
        session.write_failure(&what, reason)
    }
}

/// The pairs of the experiment and the worst of those that its integrators draw.
fn pairs(
    session: &mut Session,
    gpu: &Gpu,
    cell: &Cell,
    written: &mut Written,
) -> Result<Vec<Pair>, RunError> {
    let named = |&dimensions: &[u32; 2]| Pair {
        dimensions,
        named: true,
        worst_of: None,
    };
    let settings = &session.experiment.discrepancy;
    let mut pairs: Vec<Pair> = settings.pairs.iter().map(named).collect();
    let worst = match worst_pair(session, gpu, cell) {
        Ok(worst) => worst,
        // The named pairs fail for the same reason.
        Err(_) if gpu.lost().is_some() => None,
        Err(reason) => {
            written.failure(session, format!("worst pair of {cell}"), reason)?;
            None
        }
    };
    if let Some((dimensions, of)) = worst {
        let known = pairs.iter_mut().find(|p| p.dimensions == dimensions);
        match known {
            Some(pair) => pair.worst_of = Some(of),
            None => pairs.push(Pair {
                dimensions,
                named: false,
                worst_of: Some(of),
            }),
        }
    }
    Ok(pairs)
}

/// The pair of dimensions with the greatest D* among all that an integrator of the experiment draws, in one
/// pixel and with one seed, and how many there are; `None` where there is but one.
fn worst_pair(
    session: &mut Session,
    gpu: &Gpu,
    cell: &Cell,
) -> Result<Option<([u32; 2], usize)>, String> {
    let mut drawn = BTreeSet::new();
    let integrators = session.experiment.axes[Axis::Integrator].iter();
    for variant in integrators.filter(|variant| !is_bench(variant)) {
        let integrator = session.registries.integrators.configured(variant);
        let integrator = integrator.map_err(|e| e.to_string())?;
        drawn.extend(integrator.facts.dimension_pairs());
    }
    let candidates: Vec<[u32; 2]> = drawn.into_iter().collect();
    let highest = candidates.iter().flatten().max().copied().unwrap_or(0);
    if candidates.len() < 2 {
        return Ok(None);
    }
    let samples = session.experiment.discrepancy.points.min(WORST_POINTS);
    let sampler = sampler_of(session, cell, samples, highest)?;
    let (pixel, seed) = tapped(session, 1)[0];
    let column = |dimension| {
        (0..samples).map(move |sample| Coordinate {
            pixel,
            sample,
            dimension,
            seed,
        })
    };
    let at: Vec<Coordinate> = (0..=highest).flat_map(column).collect();
    let numbers = session
        .clock
        .time("gpu", || dump_numbers(gpu, &sampler, &at))?;
    let columns: Vec<&[f64]> = numbers.chunks_exact(samples as usize).collect();
    let star = |&[a, b]: &[u32; 2]| {
        let both = columns[a as usize].iter().zip(columns[b as usize]);
        let points: Vec<[f64; 2]> = both.map(|(x, y)| [*x, *y]).collect();
        star_2d(&points).map_err(|e| e.to_string())
    };
    let stars = session.clock.time("discrepancy", || {
        candidates
            .par_iter()
            .map(star)
            .collect::<Result<Vec<f64>, _>>()
    })?;
    let worst = candidates
        .iter()
        .zip(&stars)
        .max_by(|a, b| a.1.total_cmp(b.1));
    // By its words: there is none worse.
    if let Some((pair, worst)) = worst
        && stars.iter().any(|star| star > worst)
    {
        return Err(format!(
            "dimensions {pair:?} are said to be the worst, and are not"
        ));
    }
    Ok(worst.map(|(pair, _)| (*pair, candidates.len())))
}

/// Pixels that are tapped, one for each seed: the first one, the last one, and others in between. The seeds
/// begin with those of the replicates; streams are cheap and may have more.
fn tapped(session: &Session, count: u32) -> Vec<(u32, u32)> {
    let [width, height] = session.experiment.run.resolution;
    let pixels = width * height;
    let pixel = |k: u32| match k {
        0 => 0,
        1 => pixels - 1,
        _ => pcg_hash(k) % pixels,
    };
    let first = session.experiment.run.seed;
    (0..count)
        .map(|k| (pixel(k), first.wrapping_add(k)))
        .collect()
}

/// What was found of a stream, with the hash of the kernel that drew it.
fn line(cell: &Cell, kernel_hash: String, what: &str, body: Body) -> Line {
    let line = Line::new(Key::from(cell), Ran::kernel(kernel_hash), body);
    let hash = line.content_hash("", &[("what", what)]);
    line.hashed(hash)
}

fn stream_record(
    session: &mut Session,
    gpu: &Gpu,
    cell: &Cell,
    pair: Pair,
) -> Result<(String, StreamRecord), String> {
    let settings = session.experiment.discrepancy.clone();
    let dimensions = pair.dimensions;
    let places = tapped(session, if cell.randomised { settings.seeds } else { 1 });
    let smallest = FEWEST_POINTS.min(settings.points).trailing_zeros();
    let counts: Vec<usize> = (smallest..=settings.points.trailing_zeros())
        .map(|k| 1 << k)
        .collect();
    let sets = point_sets(session, cell, dimensions, &counts)?;
    let mut per_seed = Vec::new();
    for &(pixel, seed) in &places {
        let mut figures = SeedFigures::default();
        for (sampler, counts) in &sets {
            let most = counts.last().map_or(0, |&n| n as u32);
            let points = session.clock.time("gpu", || {
                dump_points(gpu, sampler, &[pixel], most, dimensions, seed)
            })?;
            let measured = session
                .clock
                .time("discrepancy", || figures.add(&points, counts));
            measured.map_err(|e| e.to_string())?;
        }
        per_seed.push(figures);
    }
    if !cell.randomised {
        check_shared(session, gpu, &sets, dimensions)?;
    } else if is_one_draw(dimensions) {
        check_seeds(&per_seed)?;
    }
    let (star, mut figures) = over_seeds(&counts, &per_seed);
    let (_, seed) = places[0];
    if is_direction(dimensions) {
        let counts = counts.iter().filter(|&&n| n <= MOST_SAMPLES);
        // Powers of four have whole roots.
        for &n in counts.filter(|n| n.trailing_zeros() % 2 == 0) {
            let set = sets.iter().find(|(_, counts)| counts.contains(&n));
            let (sampler, _) = set.unwrap_or(&sets[0]);
            let pixels = session
                .clock
                .time("gpu", || pixels_at(gpu, sampler, n, dimensions, seed))?;
            figures.pixels.push(pixels);
        }
    }
    let drawn = settings.pairs.iter().find(|p| is_direction(**p));
    let is_drawn = drawn.or(settings.pairs.first()) == Some(&dimensions);
    let points = if is_drawn {
        Some(recorded_points(session, gpu, cell, dimensions, seed)?)
    } else {
        None
    };
    let record = StreamRecord {
        dimensions,
        purpose: pair_purpose(dimensions),
        named: pair.named,
        worst_of: pair.worst_of,
        randomised: cell.randomised,
        seeds: places.len(),
        pixels: places.iter().map(|(pixel, _)| *pixel).collect(),
        star,
        figures,
        points,
    };
    Ok((kernel_hash(gpu, &sets[0].0)?, record))
}

/// Whether both numbers are of one draw: a turn of the disc changes the second of each draw alone.
fn is_one_draw([first, second]: [u32; 2]) -> bool {
    first.is_multiple_of(2) && second == first + 1
}

/// Seeds whose points have the same figures to the bit are one, and intervals over them are too short.
fn check_seeds(seeds: &[SeedFigures]) -> Result<(), String> {
    for (number, seed) in seeds.iter().enumerate() {
        if let Some(other) = seeds[..number].iter().position(|other| other == seed) {
            return Err(format!("seeds {other} and {number} draw the same points"));
        }
    }
    Ok(())
}

/// That pixels draw the same where no seed changes anything: one of them stands for all.
fn check_shared(
    session: &mut Session,
    gpu: &Gpu,
    sets: &[(Sampler, Vec<usize>)],
    pair: [u32; 2],
) -> Result<(), String> {
    let pixels: Vec<u32> = tapped(session, SHARED_PIXELS)
        .iter()
        .map(|(p, _)| *p)
        .collect();
    for (sampler, counts) in sets {
        let most = counts.last().map_or(0, |&n| n as u32);
        let seed = session.experiment.run.seed;
        let points = session.clock.time("gpu", || {
            dump_points(gpu, sampler, &pixels, most, pair, seed)
        })?;
        let (first, others) = points.split_at(most as usize);
        if others
            .chunks_exact(first.len().max(1))
            .any(|other| other != first)
        {
            let label = sampler.label();
            return Err(format!(
                "{label} has no seed, and yet pixels {pixels:?} draw different points"
            ));
        }
    }
    Ok(())
}

/// What pictures of a sampler's points need.
fn recorded_points(
    session: &mut Session,
    gpu: &Gpu,
    cell: &Cell,
    pair: [u32; 2],
    seed: u32,
) -> Result<RecordedPoints, String> {
    let [few, many] = [RECORDED, SPECTRUM_POINTS]
        .map(|samples| sampler_of(session, cell, samples, pair[0].max(pair[1])));
    let (few, many) = (few?, many?);
    let pixels: Vec<u32> = (0..RECORDED_PIXELS).collect();
    let at = coordinates(&pixels, RECORDED, pair, seed);
    let words = session.clock.time("gpu", || dump_checked(gpu, &few, &at))?;
    let points = session.clock.time("gpu", || {
        dump_points(gpu, &many, &pixels[..1], SPECTRUM_POINTS, pair, seed)
    })?;
    let spectrum = session.clock.time("discrepancy", || {
        let set = PointSet::from_points(&points)?;
        radial_spectrum(&set, FREQUENCIES, &Budget::seconds(SPECTRUM_SECONDS))
    });
    Ok(RecordedPoints::new(
        [RECORDED, RECORDED_PIXELS],
        seed,
        &words,
        // Left out where it takes too long: a picture is no reason to fail.
        spectrum.unwrap_or_default(),
    ))
}

/// Whether the path makes a direction of these dimensions.
fn is_direction([a, b]: [u32; 2]) -> bool {
    a >= FIRST_BOUNCE && (a - FIRST_BOUNCE) % PER_BOUNCE == DIRECTION && b == a + 1
}

/// What neighbouring and superposed pixels draw for `n` samples each.
fn pixels_at(
    gpu: &Gpu,
    sampler: &Sampler,
    n: usize,
    pair: [u32; 2],
    seed: u32,
) -> Result<PixelsAtCount, String> {
    let width = sampler.demand.width.unwrap_or(TILE).max(TILE);
    let samples = TILE_SAMPLES.min(n as u32);
    let tile: Vec<u32> = (0..TILE)
        .flat_map(|row| row * width..row * width + TILE)
        .collect();
    let tile = dump_points(gpu, sampler, &tile, samples, pair, seed)?;
    let pixels: Vec<u32> = (0..COPIES).collect();
    let copies = dump_points(gpu, sampler, &pixels, n as u32, pair, seed)?;
    let angle = neighbour_angle(&tile, TILE as usize, samples as usize);
    Ok(PixelsAtCount {
        n,
        neighbour_angle: angle.ok_or("a direction that is not finite")?,
        coverage: coverage(&copies, n),
    })
}

/// What drawing costs, with as many dimensions as the pairs of the experiment need.
fn cost_record(
    session: &mut Session,
    gpu: &Gpu,
    cell: &Cell,
) -> Result<([Reading; 2], String), String> {
    let pairs = session.experiment.discrepancy.pairs.iter().flatten();
    let highest = pairs.max().copied().unwrap_or(1).max(1);
    let sampler = sampler_of(
        session,
        cell,
        session.experiment.discrepancy.points,
        highest,
    )?;
    let cost = session.clock.time("gpu", || sampler_cost(gpu, &sampler));
    cost.map_err(|e| e.to_string())
}

/// The sampler of a stream for so many samples, with dimensions up to `highest`.
fn sampler_of(
    session: &Session,
    cell: &Cell,
    samples: u32,
    highest: u32,
) -> Result<Sampler, String> {
    let demand = Demand {
        samples: Some(samples),
        dimensions: highest + 1,
        width: Some(session.experiment.run.resolution[0]),
    };
    let samplers = &session.registries.samplers;
    let made = samplers.sampler(&cell[Axis::Sequence], &cell[Axis::Decorrelation], &demand);
    made.map_err(|e| e.to_string())
}

/// Samplers, and the numbers of their first points that are measured: one sampler, unless each number
/// has points of its own.
fn point_sets(
    session: &Session,
    cell: &Cell,
    pair: [u32; 2],
    counts: &[usize],
) -> Result<Vec<(Sampler, Vec<usize>)>, String> {
    let sampler = |count: usize| sampler_of(session, cell, count as u32, pair[0].max(pair[1]));
    let most = sampler(counts.last().copied().unwrap_or(1))?;
    if !most.by_count() {
        return Ok(vec![(most, counts.to_vec())]);
    }
    counts
        .iter()
        .map(|&count| Ok((sampler(count)?, vec![count])))
        .collect()
}

/// Both dimensions of the first `count` samples of each pixel, pixel by pixel.
fn coordinates(pixels: &[u32], count: u32, pair: [u32; 2], seed: u32) -> Vec<Coordinate> {
    let of_pixel = |&pixel: &u32| {
        (0..count).flat_map(move |sample| {
            pair.map(|dimension| Coordinate {
                pixel,
                sample,
                dimension,
                seed,
            })
        })
    };
    pixels.iter().flat_map(of_pixel).collect()
}

/// The kernel's words; an error if one of them is not the twin's.
fn dump_checked(gpu: &Gpu, sampler: &Sampler, at: &[Coordinate]) -> Result<Vec<u32>, String> {
    let words = dump_stream(gpu, sampler, at)?;
    compare(sampler, at, &words)?;
    Ok(words)
}

/// The kernel's numbers, as the renderer makes them of words.
fn dump_numbers(gpu: &Gpu, sampler: &Sampler, at: &[Coordinate]) -> Result<Vec<f64>, String> {
    let words = dump_checked(gpu, sampler, at)?;
    Ok(words.into_iter().map(|x| f64::from(to_unit(x))).collect())
}

/// The first `count` points of each pixel, pixel by pixel, as the kernel draws them.
fn dump_points(
    gpu: &Gpu,
    sampler: &Sampler,
    pixels: &[u32],
    count: u32,
    pair: [u32; 2],
    seed: u32,
) -> Result<Vec<[f64; 2]>, String> {
    let numbers = dump_numbers(gpu, sampler, &coordinates(pixels, count, pair, seed))?;
    let points: Vec<[f64; 2]> = numbers.chunks_exact(2).map(|p| [p[0], p[1]]).collect();
    // The ends by themselves: points of other dimensions or samples would be as good to look at.
    let ends = [
        (pixels.first(), 0, points.first()),
        (pixels.last(), count - 1, points.last()),
    ];
    for (pixel, sample, point) in ends {
        let at = |dimension| Coordinate {
            pixel: pixel.copied().unwrap_or_default(),
            sample,
            dimension,
            seed,
        };
        let asked = pair.map(|dimension| f64::from(to_unit(sampler.sample_u32(at(dimension)))));
        if point != Some(&asked) {
            return Err(format!(
                "sample {sample} of dimensions {pair:?} is {point:?}, not {asked:?}"
            ));
        }
    }
    Ok(points)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn seeds_that_draw_the_same_points_are_told() {
        let of = |points: &[[f64; 2]]| {
            let mut seed = SeedFigures::default();
            seed.add(points, &[2]).expect("figures");
            seed
        };
        let (one, other) = ([[0.25, 0.5], [0.75, 0.0]], [[0.25, 0.5], [0.75, 0.125]]);
        assert_eq!(check_seeds(&[of(&one), of(&other)]), Ok(()));
        let fault = check_seeds(&[of(&one), of(&other), of(&one)]).expect_err("a fault");
        assert!(fault.contains("seeds 0 and 2"), "{fault}");
    }
}
