//! Kernels against their twins, bit by bit.

use super::*;
use crate::support::{self, Pcg, in_turn, is_full};
use raystone::measure::sampler_cost::sampler_cost;
use raystone::measure::words::{Used, check_words, compare};
use raystone::run::dump_stream;

/// Coordinates per sequence and decorrelation, with each of their parameters.
const MANY: usize = 1 << 20;
/// Coordinates per other pair.
const FEW: usize = 1 << 15;

fn name_of(variant: &Variant) -> &str {
    &variant.name
}

/// Every sequence without, and every decorrelation with one sequence, with every parameter; then every other valid
/// pair. Each with its number of coordinates.
fn samplers() -> Vec<(Sampler, usize)> {
    let registry = SamplerRegistry::default();
    let all = |entries: &[Entry]| -> Vec<Variant> { entries.iter().flat_map(variants).collect() };
    let sequences = all(&registry.sequence_entries());
    let decorrelations = all(&registry.decorrelation_entries());
    let [none, sobol] = [(&decorrelations, "none"), (&sequences, "sobol")]
        .map(|(list, name)| list.iter().find(|v| v.name == name).expect("registered"));
    let mut pairs: Vec<_> = sequences.iter().map(|s| (s, none, MANY)).collect();
    let moved = decorrelations.iter().filter(|d| name_of(d) != "none");
    pairs.extend(moved.map(|d| (sobol, d, MANY)));
    let firsts = |list: &[Variant]| -> Vec<Variant> {
        let mut list = list.to_vec();
        list.dedup_by(|b, a| a.name == b.name);
        list
    };
    let (first_sequences, first_decorrelations) = (firsts(&sequences), firsts(&decorrelations));
    for sequence in first_sequences.iter().filter(|s| name_of(s) != "sobol") {
        for decorrelation in first_decorrelations.iter().filter(|d| name_of(d) != "none") {
            pairs.push((sequence, decorrelation, FEW));
        }
    }
    let mut out = Vec::new();
    let mut refused = 0;
    for (sequence, decorrelation, count) in pairs {
        let facts = registry.facts(sequence).expect("registered");
        let most = if count == MANY && sequence.name == "sobol" && decorrelation.name == "none" {
            1100
        } else {
            256
        };
        let demand = demand(1000, facts.dimensions.unwrap_or(most).min(most));
        match registry.sampler(sequence, decorrelation, &demand) {
            Ok(sampler) => out.push((sampler, count)),
            Err(SamplerError::Pair { .. }) => refused += 1,
            Err(error) => panic!("{error}"),
        }
    }
    assert!(
        out.len() >= 60 && refused >= 15,
        "{} samplers, {refused} refused",
        out.len()
    );
    out
}

/// Random coordinates, small ones, and the largest.
fn coordinates(sampler: &Sampler, count: usize, seed: u64) -> Vec<Coordinate> {
    let mut rng = Pcg::new(seed);
    let coordinate = |i: usize| {
        let mut number = |largest: u32| match (i / 2, rng.below(16)) {
            (_, 0) => 0,
            (_, 1) => largest,
            (half, _) if half % 2 == 0 => rng.below(largest.min(4096)),
            _ => rng.below(largest),
        };
        Coordinate {
            pixel: number(u32::MAX),
            sample: number(u32::MAX),
            dimension: number(sampler.demand.dimensions - 1),
            seed: number(u32::MAX),
        }
    };
    (0..count).map(coordinate).collect()
}

fn dump(sampler: &Sampler, coordinates: &[Coordinate]) -> Vec<u32> {
    dump_stream(support::gpu(), sampler, coordinates)
        .unwrap_or_else(|e| panic!("{}: {e}", sampler.label()))
}

fn first_difference(
    sampler: &Sampler,
    coordinates: &[Coordinate],
    stream: &[u32],
) -> Option<String> {
    assert_eq!(coordinates.len(), stream.len());
    let mut pairs = coordinates.iter().zip(stream);
    let (at, found) = pairs.find(|(at, found)| sampler.sample_u32(**at) != **found)?;
    let expected = sampler.sample_u32(*at);
    Some(format!(
        "{}: {at:?}: twin {expected:#010x}, kernel {found:#010x}",
        sampler.label()
    ))
}

#[test]
fn streams_of_all_kernels_equal_their_twins_and_seeds_count_where_they_should() {
    for (sampler, count) in in_turn("streams of kernels", samplers()) {
        let coordinates = coordinates(&sampler, count, 11);
        let mut stream = dump(&sampler, &coordinates);
        assert_eq!(first_difference(&sampler, &coordinates, &stream), None);

        // A single wrong bit must be detected.
        let wrong = count - count / 3;
        stream[wrong] ^= 1;
        assert!(first_difference(&sampler, &coordinates[wrong..], &stream[wrong..]).is_some());

        let differs = coordinates.iter().take(4096).any(|&c| {
            let seed = c.seed.wrapping_add(1);
            sampler.sample_u32(Coordinate { seed, ..c }) != sampler.sample_u32(c)
        });
        assert_eq!(differs, sampler.is_random(), "{}", sampler.label());
    }
}

#[test]
fn kernels_equal_their_twins_in_all_that_a_long_run_uses() {
    let registry = SamplerRegistry::default();
    let mut compared = 0;
    let sequences = registry.sequence_entries();
    let sequences = sequences.iter().map(Entry::default_variant);
    for sequence in in_turn("sequences of a long run", sequences) {
        let facts = registry.facts(&sequence).expect("registered");
        let at_most = |wanted: u32, limit: Option<u32>| limit.map_or(wanted, |l| wanted.min(l));
        let demand = demand(
            at_most(1 << 17, facts.samples),
            at_most(122, facts.dimensions),
        );
        for decorrelation in registry
            .decorrelation_entries()
            .iter()
            .map(Entry::default_variant)
        {
            let Ok(sampler) = registry.sampler(&sequence, &decorrelation, &demand) else {
                continue;
            };
            let used = Used {
                samples: demand.samples.unwrap_or(1),
                dimensions: demand.dimensions,
                size: [WIDTH, 144],
                seeds: vec![0, 1, 8, 9001, 0x8000_0001, u32::MAX],
            };
            let words = check_words(support::gpu(), &sampler, &used);
            compared += words.unwrap_or_else(|e| panic!("{e}"));
            // A single wrong bit must be detected, and the message names the word.
            let coordinates = used.coordinates();
            let mut words: Vec<u32> = coordinates.iter().map(|c| sampler.sample_u32(*c)).collect();
            words[40_000] ^= 1;
            let error = compare(&sampler, &coordinates, &words).expect_err("a wrong bit");
            assert!(
                error.starts_with("1 of ") && error.contains("dimension: "),
                "{error}"
            );
        }
    }
    let least = if is_full() { 40 } else { 8 };
    assert!(compared > least << 16, "{compared} words");
}

#[test]
fn the_tables_of_heitz_are_read_by_kernel_and_twin_alike() {
    let Some(folder) = shared_table("heitz2019") else {
        return;
    };
    let file = |name: &str| std::fs::read(folder.join(name)).expect("a readable table");
    let points = file("sobol_256spp_256d.u8");
    let ranking = file("ranking_tile_128x128x8_016spp.u8");
    let scrambling = file("scrambling_tile_128x128x8_016spp.u8");
    let tables = [("tables", name(folder.to_str().expect("a path in UTF-8")))];
    let sampler = try_sampler(("sobol", &[]), ("blue-noise", &tables), &demand(16, 20));
    let sampler = sampler.unwrap_or_else(|e| panic!("{e}"));
    let coordinates = coordinates(&sampler, FEW, 3);
    let stream = dump(&sampler, &coordinates);
    assert_eq!(first_difference(&sampler, &coordinates, &stream), None);

    // A seed moves the tile, consistently for all pixels and dimensions.
    let value = |x: usize, y: usize, sample: usize, dimension: usize| {
        let key = dimension % 8 + (x + y * 128) * 8;
        let ranked = sample ^ ranking[key] as usize;
        points[dimension + ranked * 256] ^ scrambling[key]
    };
    let draw = |pixel: usize, sample: usize, dimension: usize| {
        let at = Coordinate {
            pixel: pixel as u32,
            seed: 5,
            ..at(sample as u32, dimension as u32)
        };
        (sampler.sample_u32(at) >> 24) as u8
    };
    let agrees = |x: usize, y: usize| {
        (0..2000).all(|i| {
            let (pixel, sample, dimension) = (i * 7, i % 16, i % 20);
            let [px, py] = [pixel % WIDTH as usize + x, pixel / WIDTH as usize + y];
            draw(pixel, sample, dimension) == value(px % 128, py % 128, sample, dimension)
        })
    };
    let places = (0..128 * 128).filter(|i| agrees(i % 128, i / 128)).count();
    assert_eq!(places, 1);
}

#[test]
fn the_cost_of_a_sampler_is_measured_without_its_loop() {
    let cost = |sequence, decorrelation| {
        let sampler = sampler(sequence, decorrelation, &demand(256, 8));
        let (cost, _) = sampler_cost(support::gpu(), &sampler).unwrap_or_else(|e| panic!("{e}"));
        println!("{}: {cost:?}", sampler.label());
        cost[0].value
    };
    let registry = SamplerRegistry::default();
    let mut costs: Vec<_> = registry
        .sequences
        .iter()
        .filter(|s| !["van-der-corput", "r2"].contains(&s.name()))
        .map(|s| cost(s.name(), "none"))
        .collect();
    let moved = registry
        .decorrelations
        .iter()
        .filter(|d| d.name() != "none");
    costs.extend(moved.map(|d| cost("sobol", d.name())));
    assert!(costs.len() >= 14);
    // Divisions in a loop cost more than one product on any adapter. Other load hides that only
    // sometimes.
    let is_dearer = |_| cost("halton", "none").low > cost("rank1-lattice", "none").value;
    assert!((0..10).any(is_dearer), "halton is never dearer");
    let flat = sampler("van-der-corput", "none", &demand(256, 1));
    assert!(sampler_cost(support::gpu(), &flat).is_err());
}
