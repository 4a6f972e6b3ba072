//! Checks that a sampler's kernel draws the same words as its twin, and what is known of them, before
//! rendering with it.

use super::error::RunError;
use super::images::Estimator;
use super::kernels::Kernels;
use super::options::RunOptions;
use super::registries::Registries;
use super::session::Session;
use super::world::World;
use crate::words::{Used, check_words, kernel_hash};
use rayon::prelude::*;
use raystone_config::{Axis, Cell, Plan};
use raystone_core::params::{Entry, ParamRange, ParamValue, Variant};
use raystone_gpu::Gpu;
use raystone_record::PathsRecord;
use raystone_sampling::{Demand, Sampler};

/// Compares a sampler's kernel with its twin over all draws; once per kernel, table and seeds.
///
/// # Errors
/// A word differs, or the kernel does not run.
pub(super) fn check(
    session: &mut Session,
    gpu: &Gpu,
    sampler: &Sampler,
    seeds: &[u32],
) -> Result<(), String> {
    let used = Used {
        samples: sampler.demand.samples.unwrap_or(1),
        dimensions: sampler.demand.dimensions,
        size: session.experiment.run.resolution,
        seeds: seeds.to_vec(),
    };
    let kernel = kernel_hash(gpu, sampler)?;
    let table = blake3::hash(bytemuck::cast_slice(sampler.table.words()));
    let key = format!("{} {used:?} {kernel} {table}", sampler.label());
    if session.checked.words.contains(&key) {
        return Ok(());
    }
    session
        .clock
        .time("gate", || check_words(gpu, sampler, &used))?;
    session.checked.words.insert(key);
    Ok(())
}

/// Checks the samplers of a world for `verify`, once; those with a fault.
pub(super) fn verify(
    session: &mut Session,
    world: &World,
    structure: &Cell,
) -> Result<Vec<(Cell, PathsRecord)>, RunError> {
    let gpu = world.device.of(&structure[Axis::Kernels])?;
    let seeds = session.experiment.seeds().replicates;
    let samples = session.experiment.run.spp.max();
    let mut faulty = Vec::new();
    for cell in &session.plan.samplers {
        let is_its = cell.is_on(&world.cell) && cell[Axis::Kernels] == structure[Axis::Kernels];
        if !is_its || !session.checked.words.insert(format!("{cell}: verified")) {
            continue;
        }
        let made = Estimator::new(session, cell, samples);
        if let Err(fault) = made.and_then(|made| check(session, gpu, &made.sampler, &seeds)) {
            let fault = Some(fault);
            faulty.push((
                cell.clone(),
                PathsRecord {
                    fault,
                    ..PathsRecord::default()
                },
            ));
        }
    }
    Ok(faulty)
}

/// What is compared where no run says it: as much as a long run draws, from small seeds on. More samples than 16 bits hold, and no
/// power of two, so that strata are of unequal widths.
const SAMPLES: u32 = 70_000;
const DIMENSIONS: u32 = 122;
const SIZE: [u32; 2] = [192, 144];
const SEEDS: u32 = 4;
/// The sequence that decorrelations move.
const SEQUENCE: &str = "sobol";
const DECORRELATION: &str = "none";

/// Verdict on a sampler, for `raystone verify`.
#[derive(Debug, Clone)]
pub struct VerifiedSampler {
    /// Sequence and decorrelation, and the folder of kernels unless they are embedded.
    pub name: String,
    /// What is wrong.
    pub fault: Option<String>,
}

/// Checks every sequence without and one with every decorrelation, with each choice of their parameters and all kernels of a plan: words against
/// twins, and against what is known of them ([`crate::known_words`]).
///
/// # Errors
/// No adapter, or a lost device.
pub fn verify_samplers(
    plan: &Plan,
    registries: &Registries,
    options: &RunOptions,
) -> Result<Vec<VerifiedSampler>, RunError> {
    let device = Kernels::load(&plan.kernels, registries)?.open(options)?;
    let samplers = &registries.samplers;
    let [sequences, decorrelations] = [
        samplers.sequence_entries(),
        samplers.decorrelation_entries(),
    ]
    .map(|entries| entries.iter().flat_map(variants).collect::<Vec<_>>());
    let is_plain = |d: &&Variant| d.name == DECORRELATION;
    let plain = sequences
        .iter()
        .flat_map(|s| decorrelations.iter().filter(is_plain).map(move |d| (s, d)));
    let moved = sequences.iter().filter(|s| s.label == SEQUENCE);
    let moved = moved.flat_map(|s| {
        decorrelations
            .iter()
            .filter(|d| !is_plain(d))
            .map(move |d| (s, d))
    });
    let pairs: Vec<_> = plain.chain(moved).collect();
    let all: Vec<_> = plan
        .kernels
        .iter()
        .flat_map(|k| pairs.iter().map(move |pair| (k, *pair)))
        .collect();
    // A driver compiles on one core.
    let verified = all.par_iter().map(|&(kernels, (sequence, decorrelation))| {
        let gpu = device.of(kernels)?;
        let fault = fault_of(registries, gpu, sequence, decorrelation).err();
        let folder = if kernels.name.is_empty() {
            String::new()
        } else {
            format!(" @{kernels}")
        };
        let name = format!("{} × {}{folder}", sequence.label, decorrelation.label);
        Ok(VerifiedSampler { name, fault })
    });
    verified.collect()
}

/// An entry with its defaults, and with each other choice of a parameter: they select other code of a kernel.
fn variants(entry: &Entry) -> Vec<Variant> {
    let others = entry.schema.iter().flat_map(|parameter| {
        let values = match &parameter.range {
            ParamRange::Choice(names) => names
                .iter()
                .map(|name| ParamValue::Name((*name).to_owned()))
                .collect(),
            ParamRange::Flag => vec![ParamValue::Flag(false), ParamValue::Flag(true)],
            _ => Vec::new(),
        };
        let others = values.into_iter().filter(|v| *v != parameter.default);
        others.map(|value| entry.variant(&[(parameter.name, value)]))
    });
    std::iter::once(entry.default_variant())
        .chain(others)
        .collect()
}

fn fault_of(
    registries: &Registries,
    gpu: &Gpu,
    sequence: &Variant,
    decorrelation: &Variant,
) -> Result<(), String> {
    let facts = registries
        .samplers
        .facts(sequence)
        .map_err(|e| e.to_string())?;
    let demand = Demand {
        samples: Some(facts.samples.unwrap_or(SAMPLES).min(SAMPLES)),
        dimensions: facts.dimensions.unwrap_or(DIMENSIONS).min(DIMENSIONS),
        width: Some(SIZE[0]),
    };
    let sampler = registries
        .samplers
        .sampler(sequence, decorrelation, &demand);
    let sampler = sampler.map_err(|e| e.to_string())?;
    let used = Used {
        samples: demand.samples.unwrap_or(1),
        dimensions: demand.dimensions,
        size: SIZE,
        seeds: (1..=SEEDS).collect(),
    };
    check_words(gpu, &sampler, &used).map(|_| ())
}
