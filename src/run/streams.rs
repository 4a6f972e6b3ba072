//! Figures of the streams that the path really consumes, dumped from the kernel, and what drawing costs.

use super::RunError;
use super::kernels::Device;
use super::session::Session;
use crate::config::{StreamCell, cell_hash};
use crate::gpu::{Bindings, Composition, Dispatch, Gpu, UniformValues, groups_for};
use crate::integrator::with_sampler;
use crate::measure::record::{PixelsAtCount, Ran, Record, SamplerCostRecord, StreamRecord};
use crate::measure::sampler_cost::sampler_cost;
use crate::measure::stream::{COPIES, SeedFigures, coverage, neighbour_angle, over_seeds};
use crate::sampling::dimensions::{DIRECTION, FIRST_BOUNCE, PER_BOUNCE, pair_purpose};
use crate::sampling::{Coordinate, Demand, Sampler, to_unit};
use std::ops::Range;

/// Fewest points whose discrepancy is taken.
const FEWEST_POINTS: u32 = 16;
/// Several pixels are looked at up to this many samples.
const MOST_SAMPLES: usize = 1024;
/// Neighbours are compared in a tile of this edge …
const TILE: u32 = 8;
/// … at this many samples at most.
const TILE_SAMPLES: u32 = 32;

/// All streams of the plan.
pub(super) fn run(session: &mut Session, device: &Device) -> Result<(), RunError> {
    for cell in session.plan.streams.clone() {
        if session.is_done(&cell.to_string()) {
            continue;
        }
        let gpu = device.of(&cell.kernels)?;
        session.say(format!("discrepancy of {cell}"));
        session.lose_device_on_request(gpu, &cell.to_string());
        for pair in session.experiment.discrepancy.pairs.clone() {
            match stream_record(session, gpu, &cell, pair) {
                Ok(record) => {
                    let hash = stream_hash(&cell, &record.ran, &format!("{pair:?}"));
                    session.write(&hash, Record::Stream(record))?;
                }
                Err(reason) => {
                    session.write_failure(&format!("stream {cell}, {pair:?}"), reason)?
                }
            }
        }
        if gpu.lost().is_none() {
            match cost_record(session, gpu, &cell) {
                Ok(record) => {
                    let hash = stream_hash(&cell, &record.ran, "cost");
                    session.write(&hash, Record::SamplerCost(record))?;
                }
                Err(reason) => session.write_failure(&format!("cost of {cell}"), reason)?,
            }
        }
        session.finish(cell.to_string());
        session.progress.inc(1);
        if gpu.lost().is_some() {
            return Ok(());
        }
    }
    Ok(())
}

/// What a stream ran with: no ray was traced.
fn ran(cell: &StreamCell, kernel_hash: String) -> Ran {
    Ran {
        kernels: cell.kernels.kernels_label().to_owned(),
        kernel_hash,
        ..Ran::default()
    }
}

fn stream_hash(cell: &StreamCell, ran: &Ran, what: &str) -> String {
    let sampler = serde_json::to_string(&(&cell.sequence, &cell.decorrelation));
    cell_hash(&[
        ("sampler", &sampler.unwrap_or_default()),
        ("what", what),
        ("kernel", &ran.kernel_hash),
        ("version", env!("CARGO_PKG_VERSION")),
    ])
}

fn stream_record(
    session: &mut Session,
    gpu: &Gpu,
    cell: &StreamCell,
    pair: [u32; 2],
) -> Result<StreamRecord, String> {
    let settings = session.experiment.discrepancy.clone();
    let first = session.experiment.seed;
    let count = if cell.randomised { settings.seeds } else { 1 };
    // The first ones are the seeds of the replicates; streams are cheap and may have more.
    let seeds: Vec<u32> = (0..count).map(|i| first.wrapping_add(i)).collect();
    let smallest = FEWEST_POINTS.min(settings.points).trailing_zeros();
    let counts: Vec<usize> = (smallest..=settings.points.trailing_zeros())
        .map(|k| 1 << k)
        .collect();
    let sets = point_sets(session, cell, pair, &counts)?;
    let mut per_seed = Vec::new();
    for &seed in &seeds {
        let mut figures = SeedFigures::default();
        for (sampler, counts) in &sets {
            let most = counts.last().map_or(0, |&n| n as u32);
            let points = session
                .clock
                .time("gpu", || dump_points(gpu, sampler, 0..1, most, pair, seed))?;
            let measured = session
                .clock
                .time("discrepancy", || figures.add(&points, counts));
            measured.map_err(|e| e.to_string())?;
        }
        per_seed.push(figures);
    }
    let (star, mut figures) = over_seeds(&counts, &per_seed);
    if is_direction(pair) {
        let counts = counts.iter().filter(|&&n| n <= MOST_SAMPLES);
        // Powers of four have whole roots.
        for &n in counts.filter(|n| n.trailing_zeros() % 2 == 0) {
            let set = sets.iter().find(|(_, counts)| counts.contains(&n));
            let (sampler, _) = set.unwrap_or(&sets[0]);
            let pixels = session
                .clock
                .time("gpu", || pixels_at(gpu, sampler, n, pair, seeds[0]))?;
            figures.pixels.push(pixels);
        }
    }
    let kernel = gpu.pipeline(&dump_kernel(&sets[0].0), true);
    let kernel = kernel.map_err(|e| e.to_string())?.kernel.hash();
    Ok(StreamRecord {
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        ran: ran(cell, kernel),
        dimensions: pair,
        purpose: pair_purpose(pair),
        randomised: cell.randomised,
        seeds: seeds.len(),
        star,
        figures,
    })
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
    let mut tile = Vec::new();
    for row in 0..TILE {
        let pixels = row * width..row * width + TILE;
        tile.extend(dump_points(gpu, sampler, pixels, samples, pair, seed)?);
    }
    let copies = dump_points(gpu, sampler, 0..COPIES, n as u32, pair, seed)?;
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
    cell: &StreamCell,
) -> Result<SamplerCostRecord, String> {
    let pairs = session.experiment.discrepancy.pairs.iter().flatten();
    let highest = pairs.max().copied().unwrap_or(1).max(1);
    let sampler = sampler_of(
        session,
        cell,
        session.experiment.discrepancy.points,
        highest,
    )?;
    let cost = session.clock.time("gpu", || sampler_cost(gpu, &sampler));
    let cost = cost.map_err(|e| e.to_string())?;
    Ok(SamplerCostRecord {
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        ran: ran(cell, cost.kernel_hash),
        ns_per_sample: cost.ns_per_sample,
        loop_ns_per_sample: cost.loop_ns_per_sample,
    })
}

/// The sampler of a stream for so many samples, with dimensions up to `highest`.
fn sampler_of(
    session: &Session,
    cell: &StreamCell,
    samples: u32,
    highest: u32,
) -> Result<Sampler, String> {
    let demand = Demand {
        samples: Some(samples),
        dimensions: highest + 1,
        width: Some(session.experiment.resolution[0]),
    };
    let samplers = &session.registries.samplers;
    let made = samplers.sampler(&cell.sequence, &cell.decorrelation, &demand);
    made.map_err(|e| e.to_string())
}

/// Samplers, and the numbers of their first points that are measured: one sampler, unless each number
/// has points of its own.
fn point_sets(
    session: &Session,
    cell: &StreamCell,
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

/// The first `count` points of each pixel, pixel by pixel, as the kernel draws them.
fn dump_points(
    gpu: &Gpu,
    sampler: &Sampler,
    pixels: Range<u32>,
    count: u32,
    pair: [u32; 2],
    seed: u32,
) -> Result<Vec<[f64; 2]>, String> {
    let of_pixel = |pixel: u32| {
        (0..count).flat_map(move |sample| {
            pair.map(|dimension| Coordinate {
                pixel,
                sample,
                dimension,
                seed,
            })
        })
    };
    let coordinates: Vec<Coordinate> = pixels.flat_map(of_pixel).collect();
    let words = dump_stream(gpu, sampler, &coordinates)?;
    Ok(words
        .chunks_exact(2)
        .map(|p| [f64::from(to_unit(p[0])), f64::from(to_unit(p[1]))])
        .collect())
}

fn dump_kernel(sampler: &Sampler) -> Composition {
    with_sampler(Composition::new("sampling/dump_stream"), sampler)
}

/// The u32 of every coordinate, as the kernel computes it.
///
/// # Errors
/// A dimension beyond those that the sampler was made for, or the kernel does not run.
pub fn dump_stream(
    gpu: &Gpu,
    sampler: &Sampler,
    coordinates: &[Coordinate],
) -> Result<Vec<u32>, String> {
    let highest = coordinates.iter().map(|c| c.dimension).max().unwrap_or(0);
    if highest >= sampler.demand.dimensions {
        return Err(format!(
            "dimension {highest} is asked for, {} was made for {}",
            sampler.label(),
            sampler.demand.dimensions
        ));
    }
    let composition = dump_kernel(sampler);
    let words: Vec<[u32; 4]> = coordinates
        .iter()
        .map(|c| [c.pixel, c.sample, c.dimension, c.seed])
        .collect();
    let run = || {
        let pipeline = gpu.pipeline(&composition, true)?;
        let stream = gpu.zeroed("stream", words.len() as u64 * 4)?;
        let mut bindings = Bindings::new();
        bindings
            .buffer("coordinates", &gpu.storage("coordinates", &words)?)
            .buffer(
                "sampler_table",
                &gpu.storage("sampler_table", sampler.table.words())?,
            )
            .buffer("stream", &stream)
            .uniform(
                "dump",
                UniformValues::new().u32("count", words.len() as u32),
            );
        gpu.run(&Dispatch {
            pipeline: &pipeline,
            bindings: &bindings,
            groups: groups_for(words.len() as u32),
        })?;
        let mut out: Vec<u32> = gpu.read(&stream)?;
        out.truncate(words.len());
        Ok::<_, crate::gpu::GpuError>(out)
    };
    run().map_err(|e| e.to_string())
}
