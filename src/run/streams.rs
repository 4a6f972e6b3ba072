//! Star discrepancy of the streams that the path really consumes, dumped from the kernel.

use super::RunError;
use super::session::Session;
use crate::config::StreamCell;
use crate::discrepancy::star_2d_prefixes;
use crate::gpu::{Bindings, Composition, Dispatch, Gpu, UniformValues, groups_for};
use crate::integrator::with_sampler;
use crate::measure::record::{Interval, Record, StarAtCount, StreamRecord};
use crate::measure::statistics::bootstrap_mean;
use crate::sampling::{Coordinate, Demand, Sampler, dimensions::pair_purpose, to_unit};

/// Fewest points whose discrepancy is taken.
const FEWEST_POINTS: u32 = 16;

/// All streams of the plan.
pub(super) fn run(session: &mut Session, gpu: &Gpu) -> Result<(), RunError> {
    for cell in session.plan.streams.clone() {
        if session.is_done(&cell.to_string()) {
            continue;
        }
        session.say(format!("discrepancy of {cell}"));
        session.lose_device_on_request(gpu, &cell.to_string());
        for pair in session.experiment.discrepancy.pairs.clone() {
            match stream_record(session, gpu, &cell, pair) {
                Ok(record) => session.write("", Record::Stream(record))?,
                Err(reason) => {
                    session.write_failure(&format!("stream {cell}, {pair:?}"), reason)?
                }
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

fn stream_record(
    session: &mut Session,
    gpu: &Gpu,
    cell: &StreamCell,
    pair: [u32; 2],
) -> Result<StreamRecord, String> {
    let settings = session.experiment.discrepancy.clone();
    let seeds: Vec<u32> = if cell.randomised {
        session
            .experiment
            .replicate_seeds()
            .take(settings.seeds as usize)
            .collect()
    } else {
        vec![session.experiment.seed]
    };
    let smallest = FEWEST_POINTS.min(settings.points).trailing_zeros();
    let counts: Vec<usize> = (smallest..=settings.points.trailing_zeros())
        .map(|k| 1 << k)
        .collect();
    let sets = point_sets(session, cell, pair, &counts)?;
    let mut per_seed = Vec::new();
    for &seed in &seeds {
        let mut stars = Vec::new();
        for (sampler, counts) in &sets {
            let most = counts.last().map_or(0, |&n| n as u32);
            let points = session
                .clock
                .time("gpu", || dump_points(gpu, sampler, most, pair, seed))?;
            let found = session
                .clock
                .time("discrepancy", || star_2d_prefixes(&points, counts));
            stars.extend(found.map_err(|e| e.to_string())?);
        }
        per_seed.push(stars);
    }
    let star = counts.iter().enumerate().filter_map(|(i, &n)| {
        let values: Vec<f64> = per_seed.iter().map(|stars| stars[i]).collect();
        let alone = Interval {
            value: values[0],
            low: values[0],
            high: values[0],
        };
        let star = if values.len() == 1 {
            alone
        } else {
            bootstrap_mean(&values)?
        };
        Some(StarAtCount { n, star })
    });
    Ok(StreamRecord {
        sequence: cell.sequence.clone(),
        decorrelation: cell.decorrelation.clone(),
        dimensions: pair,
        purpose: pair_purpose(pair),
        randomised: cell.randomised,
        seeds: seeds.len(),
        star: star.collect(),
    })
}

/// Samplers, and the numbers of their first points that are measured: one sampler, unless each number
/// has points of its own.
fn point_sets(
    session: &Session,
    cell: &StreamCell,
    pair: [u32; 2],
    counts: &[usize],
) -> Result<Vec<(Sampler, Vec<usize>)>, String> {
    let sampler = |count: usize| {
        let demand = Demand {
            samples: Some(count as u32),
            dimensions: pair[0].max(pair[1]) + 1,
            width: Some(session.experiment.resolution[0]),
        };
        let samplers = &session.registries.samplers;
        let made = samplers.sampler(&cell.sequence, &cell.decorrelation, &demand);
        made.map_err(|e| e.to_string())
    };
    let most = sampler(counts.last().copied().unwrap_or(1))?;
    if !most.by_count() {
        return Ok(vec![(most, counts.to_vec())]);
    }
    counts
        .iter()
        .map(|&count| Ok((sampler(count)?, vec![count])))
        .collect()
}

/// The first `count` points of one pixel, as the kernel draws them.
fn dump_points(
    gpu: &Gpu,
    sampler: &Sampler,
    count: u32,
    pair: [u32; 2],
    seed: u32,
) -> Result<Vec<[f64; 2]>, String> {
    let coordinates: Vec<Coordinate> = (0..count)
        .flat_map(|sample| {
            pair.map(|dimension| Coordinate {
                pixel: 0,
                sample,
                dimension,
                seed,
            })
        })
        .collect();
    let words = dump_stream(gpu, sampler, &coordinates)?;
    Ok(words
        .chunks_exact(2)
        .map(|p| [f64::from(to_unit(p[0])), f64::from(to_unit(p[1]))])
        .collect())
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
    let composition = with_sampler(Composition::new("sampling/dump_stream"), sampler);
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
