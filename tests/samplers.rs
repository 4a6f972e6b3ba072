//! Every registered sampler: the kernel's stream equals its twin's to the bit, and the sequences are
//! what the literature says they are.

mod common;

use common::{Pcg, param_variants};
use raystone::config::Variant;
use raystone::discrepancy::star_2d;
use raystone::run::dump_stream;
use raystone::sampling::{
    Coordinate, Sampler, SamplerRegistry, TABLE_DIMENSIONS, dimensions, to_unit,
};
use std::path::Path;

const COORDINATES: usize = 100_000;

fn variants(entry: &raystone::config::Entry) -> Vec<Variant> {
    let variant = |params: raystone::config::Params| Variant {
        name: entry.name.clone(),
        label: format!("{} {params:?}", entry.name),
        params,
    };
    param_variants(&entry.schema)
        .into_iter()
        .map(variant)
        .collect()
}

/// Every sequence with every decorrelation, with every parameter.
fn samplers() -> Vec<Sampler> {
    let registry = SamplerRegistry::default();
    let mut out = Vec::new();
    for sequence in registry.sequence_entries().iter().flat_map(variants) {
        for decorrelation in registry.decorrelation_entries().iter().flat_map(variants) {
            let found = registry.sampler(&sequence, &decorrelation);
            out.push(found.expect("names come from the registry"));
        }
    }
    assert!(out.len() >= 8, "only {} samplers", out.len());
    out
}

fn sampler(sequence: &str, decorrelation: &str) -> Sampler {
    let named =
        |s: &Sampler| s.sequence.name() == sequence && s.decorrelation.name() == decorrelation;
    samplers()
        .into_iter()
        .find(named)
        .expect("a registered pair")
}

/// Random coordinates, small ones and the largest there are.
fn coordinates(sampler: &Sampler, seed: u64) -> Vec<Coordinate> {
    let mut rng = Pcg::new(seed);
    let dimensions = sampler.sequence.max_dimensions().unwrap_or(u32::MAX);
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
            dimension: number(dimensions - 1),
            seed: number(u32::MAX),
        }
    };
    (0..COORDINATES).map(coordinate).collect()
}

/// The kernel's words.
fn dump(sampler: &Sampler, coordinates: &[Coordinate]) -> Vec<u32> {
    dump_stream(common::gpu(), sampler, coordinates)
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
fn streams_of_all_kernels_equal_their_twins() {
    for sampler in samplers() {
        let coordinates = coordinates(&sampler, 11);
        let mut stream = dump(&sampler, &coordinates);
        assert_eq!(first_difference(&sampler, &coordinates, &stream), None);

        // One wrong bit must be seen.
        stream[COORDINATES / 3] ^= 1;
        assert!(first_difference(&sampler, &coordinates, &stream).is_some());
    }
}

#[test]
fn another_seed_gives_another_stream_exactly_where_a_sampler_is_random() {
    for sampler in samplers() {
        let coordinates = coordinates(&sampler, 12);
        let shifted: Vec<_> = coordinates
            .iter()
            .map(|c| Coordinate {
                seed: c.seed.wrapping_add(1),
                ..*c
            })
            .collect();
        let stream = dump(&sampler, &shifted);
        let differs = first_difference(&sampler, &coordinates, &stream).is_some();
        assert_eq!(differs, sampler.is_random(), "{}", sampler.label());
    }
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

fn at(sample: u32, dimension: u32) -> Coordinate {
    Coordinate {
        pixel: 0,
        sample,
        dimension,
        seed: 0,
    }
}

fn points(sampler: &Sampler, count: u32, [x, y]: [u32; 2]) -> Vec<[u32; 2]> {
    let point = |i| [x, y].map(|d| sampler.sample_u32(at(i, d)));
    (0..count).map(point).collect()
}

/// Whether each elementary interval of area 2^-m holds exactly one of 2^m points.
fn is_net(points: &[[u32; 2]], m: u32) -> bool {
    assert_eq!(points.len(), 1 << m);
    (0..=m).all(|columns| {
        let mut seen = vec![false; 1 << m];
        points.iter().all(|&[x, y]| {
            let leading = |x: u32, bits: u32| if bits == 0 { 0 } else { x >> (32 - bits) };
            let cell = leading(x, columns) << (m - columns) | leading(y, m - columns);
            !std::mem::replace(&mut seen[cell as usize], true)
        })
    })
}

#[test]
fn the_first_two_dimensions_of_sobol_are_nets() {
    let sobol = sampler("sobol", "none");
    for m in 0..=12 {
        let mut net = points(&sobol, 1 << m, [0, 1]);
        assert!(is_net(&net, m), "2^{m} points");
        if m > 1 {
            net[1] = net[2];
            assert!(!is_net(&net, m), "a point twice must be seen");
        }
    }
    // Not every pair is one: the test can tell.
    assert!(!is_net(&points(&sobol, 1 << 8, [4, 5]), 8));
}

#[test]
fn a_dimension_beyond_the_table_is_refused() {
    let beyond = [at(0, TABLE_DIMENSIONS)];
    assert!(dump_stream(common::gpu(), &sampler("sobol", "none"), &beyond).is_err());
    assert!(dump_stream(common::gpu(), &sampler("pixel-hash", "none"), &beyond).is_ok());
}

/// Direction numbers of one line "d s a m_1 … m_s" of Joe and Kuo's file, most significant first.
fn direction_numbers(line: &str) -> (usize, [u32; 32]) {
    let numbers: Vec<u32> = line
        .split_whitespace()
        .map(|n| n.parse().unwrap_or_else(|e| panic!("`{line}`: {e}")))
        .collect();
    let [d, s, a] = [numbers[0], numbers[1], numbers[2]];
    let s = s as usize;
    let mut v = [0_u32; 32];
    for i in 0..32 {
        v[i] = if i < s {
            numbers[3 + i] << (31 - i)
        } else {
            let tail = (1..s).filter(|k| a >> (s - 1 - k) & 1 == 1);
            tail.fold(v[i - s] ^ v[i - s] >> s, |x, k| x ^ v[i - k])
        };
    }
    (d as usize - 1, v)
}

#[test]
fn direction_numbers_are_those_of_joe_and_kuo() {
    let table = sampler("sobol", "none").table;
    assert_eq!(table.len(), TABLE_DIMENSIONS as usize * 32);
    let column = |d: usize| &table[32 * d..32 * (d + 1)];
    assert!((0..32).all(|i| column(0)[i] == 1 << (31 - i)));
    let file =
        Path::new(env!("CARGO_MANIFEST_DIR")).join("../shared/tables/joe-kuo/new-joe-kuo-6.21201");
    let Ok(text) = std::fs::read_to_string(&file) else {
        println!("skipped: {} is not there", file.display());
        return;
    };
    let mut checked = 0;
    for line in text.lines().skip(1).take(TABLE_DIMENSIONS as usize - 1) {
        let (dimension, expected) = direction_numbers(line);
        assert_eq!(column(dimension), expected, "dimension {dimension}");
        checked += 1;
    }
    assert_eq!(checked, TABLE_DIMENSIONS - 1);
}

#[test]
fn halton_is_the_radical_inverse_truncated_within_its_bound() {
    let halton = sampler("halton", "none");
    let bases = &halton.table;
    assert_eq!(bases[..5], [2, 3, 5, 7, 11]);
    assert_eq!(bases.len(), TABLE_DIMENSIONS as usize);
    let mut rng = Pcg::new(7);
    let mut samples: Vec<u32> = (0..2000).collect();
    samples.extend((0..2000).map(|_| rng.next_u32()));
    samples.push(u32::MAX);
    let mut truncated = 0;
    for (dimension, &base) in bases.iter().enumerate() {
        for &sample in &samples {
            let x = u128::from(halton.sample_u32(at(sample, dimension as u32)));
            // The exact value is mirrored / power.
            let (mut mirrored, mut power, mut rest) = (0_u128, 1_u128, sample);
            while rest > 0 {
                mirrored = mirrored * u128::from(base) + u128::from(rest % base);
                power *= u128::from(base);
                rest /= base;
            }
            let (exact, found) = (mirrored << 32, x * power);
            assert!(found <= exact, "base {base}, sample {sample}: too large");
            let lost = exact - found;
            assert!(
                lost < 32 * u128::from(base) * power,
                "base {base}, sample {sample}: too small"
            );
            assert!(base != 2 || lost == 0, "base 2 is exact");
            truncated += usize::from(lost > 0);
        }
    }
    assert!(
        truncated > 0,
        "nothing was truncated: the bound is not tested"
    );
}

#[test]
fn star_discrepancies_equal_published_values() {
    let star = |sampler: &Sampler| {
        let unit = |x: u32| f64::from(x) * 2.0_f64.powi(-32);
        let points: Vec<_> = points(sampler, 1024, [0, 1])
            .into_iter()
            .map(|p| p.map(unit))
            .collect();
        star_2d(&points).expect("points in the square")
    };
    let sobol = star(&sampler("sobol", "none"));
    let halton = star(&sampler("halton", "none"));
    assert!((sobol - 0.004_299_163_818_36).abs() < 1e-13, "{sobol}");
    // Truncated fractions move the supremum by less than 32 · 3 / 2^32.
    assert!((halton - 0.006_835_937_5).abs() < 3e-8, "{halton}");
    // Random points are far worse: the measure can tell.
    assert!(star(&sampler("pixel-hash", "none")) > 2.0 * halton);
}

#[test]
fn cranley_patterson_keeps_differences_and_shifts_each_pixel_and_dimension_on_its_own() {
    for sequence in ["halton", "sobol"] {
        let plain = sampler(sequence, "none");
        let moved = sampler(sequence, "cranley-patterson");
        let shift = |c: Coordinate| moved.sample_u32(c).wrapping_sub(plain.sample_u32(c));
        let mut shifts = Vec::new();
        for pixel in 0..64 {
            for dimension in 0..32 {
                let mut c = Coordinate {
                    pixel,
                    sample: 0,
                    dimension,
                    seed: 5,
                };
                let first = shift(c);
                for sample in [1, 2, 77, u32::MAX] {
                    c.sample = sample;
                    assert_eq!(shift(c), first, "{sequence} {c:?}");
                }
                shifts.push(first);
            }
        }
        let count = shifts.len();
        shifts.sort_unstable();
        shifts.dedup();
        assert_eq!(
            shifts.len(),
            count,
            "{sequence}: pixels or dimensions share a shift"
        );
    }
}
