//! Every registered sampler: the kernel's stream is bit-identical to its twin's, the sequences
//! match the literature, and invalid combinations are refused.

mod decorrelations;
mod known;
mod nets;
mod pinned;
mod projections;
mod refusals;
mod stratified;
mod streams;

use crate::support;
use crate::support::param_variants;
use raystone::params::{Entry, ParamValue, Variant};
use raystone::sampling::{
    Coordinate, Demand, Sampler, SamplerError, SamplerRegistry, dimensions, to_unit,
};
use std::path::{Path, PathBuf};

const WIDTH: u32 = 192;

/// External tables for comparison; reports if they are missing.
fn shared_table(name: &str) -> Option<PathBuf> {
    let path = Path::new(env!("CARGO_MANIFEST_DIR"))
        .join("../shared/tables")
        .join(name);
    if !path.exists() {
        support::needs::skip("files", format!("{} is not there", path.display()));
    }
    Some(path).filter(|path| path.exists())
}

fn demand(samples: u32, dimensions: u32) -> Demand {
    Demand {
        samples: Some(samples),
        dimensions,
        width: Some(WIDTH),
    }
}

/// An entry with every parameter at its default and in turn at other values.
fn variants(entry: &Entry) -> Vec<Variant> {
    let variant = |params: raystone::params::Params| Variant {
        name: entry.name.clone(),
        label: format!("{} {params:?}", entry.name),
        params,
    };
    let params = param_variants(&entry.schema).into_iter();
    params.map(variant).collect()
}

/// The entry `name` with some parameters changed from their defaults.
fn variant(entries: &[Entry], name: &str, changes: &[(&str, ParamValue)]) -> Variant {
    let entry = entries.iter().find(|e| e.name == name);
    let mut variant = entry
        .unwrap_or_else(|| panic!("no {name}"))
        .default_variant();
    for (key, value) in changes {
        let slot = variant.params.0.get_mut(*key);
        *slot.unwrap_or_else(|| panic!("{name} has no {key}")) = value.clone();
    }
    variant
}

type Changes<'a> = &'a [(&'a str, ParamValue)];

fn try_sampler(
    (sequence, sequence_changes): (&str, Changes),
    (decorrelation, changes): (&str, Changes),
    demand: &Demand,
) -> Result<Sampler, SamplerError> {
    let registry = SamplerRegistry::default();
    let sequence = variant(&registry.sequence_entries(), sequence, sequence_changes);
    let decorrelation = variant(&registry.decorrelation_entries(), decorrelation, changes);
    registry.sampler(&sequence, &decorrelation, demand)
}

fn sampler(sequence: &str, decorrelation: &str, demand: &Demand) -> Sampler {
    try_sampler((sequence, &[]), (decorrelation, &[]), demand).unwrap_or_else(|e| panic!("{e}"))
}

fn name(value: &str) -> ParamValue {
    ParamValue::Name(value.to_owned())
}

fn at(sample: u32, dimension: u32) -> Coordinate {
    Coordinate {
        pixel: 0,
        sample,
        dimension,
        seed: 0,
    }
}

fn unit(x: u32) -> f64 {
    f64::from(x) * 2.0_f64.powi(-32)
}

fn points_of(sampler: &Sampler, count: u32, [x, y]: [u32; 2], pixel: u32) -> Vec<[u32; 2]> {
    let one = |sample, dimension| {
        sampler.sample_u32(Coordinate {
            pixel,
            ..at(sample, dimension)
        })
    };
    (0..count).map(|i| [x, y].map(|d| one(i, d))).collect()
}

fn points(sampler: &Sampler, count: u32, pair: [u32; 2]) -> Vec<[u32; 2]> {
    points_of(sampler, count, pair, 0)
}

#[test]
fn floats_are_below_one_and_kernels_scale_by_the_same_power_of_two() {
    assert_eq!(to_unit(u32::MAX), 1.0_f32.next_down());
    assert_eq!(to_unit(0xff), 0.0);
    assert_eq!(to_unit(0x8000_0000), 0.5);
    let kernels = raystone::gpu::KernelLibrary::default();
    let text = kernels.text("sampling/sampler").expect("the kernel");
    let scale = text
        .split("f32(x >> 8u) * ")
        .nth(1)
        .and_then(|rest| rest.split(';').next());
    let scale: f32 = scale.expect("to_unit scales").parse().expect("a number");
    assert_eq!(scale, 2.0_f32.powi(-24));
}

#[test]
fn every_draw_of_a_path_has_a_dimension_of_its_own() {
    use dimensions::{
        DIRECTION, LIGHT_CHOICE, LIGHT_POINT, PER_BOUNCE, PIXEL, ROULETTE, at_bounce,
    };
    let mut used = vec![PIXEL, PIXEL + 1];
    for bounce in 0..8 {
        for (purpose, width) in [
            (DIRECTION, 2),
            (LIGHT_POINT, 2),
            (LIGHT_CHOICE, 1),
            (ROULETTE, 1),
        ] {
            used.extend((0..width).map(|i| at_bounce(bounce, purpose) + i));
        }
    }
    let count = used.len() as u32;
    assert_eq!(count, 2 + 8 * PER_BOUNCE);
    used.sort_unstable();
    used.dedup();
    assert_eq!(used.len() as u32, count, "two draws share a dimension");
    assert_eq!(dimensions::needed(8), count);
}
