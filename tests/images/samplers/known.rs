//! Published first points, tables and discrepancies.

use super::*;
use crate::support::Pcg;
use raystone::discrepancy::star_2d;
use raystone::sampling::hash::pixel_number;
use raystone::sampling::primes::faure_permutation;

fn star(sampler: &Sampler, count: u32) -> f64 {
    let points: Vec<_> = points(sampler, count, [0, 1])
        .into_iter()
        .map(|p| p.map(unit))
        .collect();
    star_2d(&points).expect("points in the square")
}

/// A sequence in prime bases without permutations.
fn plain(sequence: &str, demand: &Demand) -> Sampler {
    let digits = [("digits", name("plain"))];
    try_sampler((sequence, &digits), ("none", &[]), demand).unwrap_or_else(|e| panic!("{e}"))
}

#[test]
fn first_points_are_the_published_ones() {
    let corput = sampler("van-der-corput", "none", &demand(8, 1));
    let found: Vec<f64> = (0..8).map(|i| unit(corput.sample_u32(at(i, 0)))).collect();
    assert_eq!(found, [0.0, 0.5, 0.25, 0.75, 0.125, 0.625, 0.375, 0.875]);

    // In Gray code order, as listed by other programs.
    let sobol = sampler("sobol", "none", &demand(8, 3));
    let listed = [
        [0.0, 0.0, 0.0],
        [0.5, 0.5, 0.5],
        [0.75, 0.25, 0.25],
        [0.25, 0.75, 0.75],
        [0.375, 0.375, 0.625],
        [0.875, 0.875, 0.125],
        [0.625, 0.125, 0.875],
        [0.125, 0.625, 0.375],
    ];
    for (i, expected) in listed.into_iter().enumerate() {
        let gray = (i ^ i >> 1) as u32;
        assert_eq!(
            [0, 1, 2].map(|d| unit(sobol.sample_u32(at(gray, d)))),
            expected,
            "{i}"
        );
    }

    let near = |found: u32, expected: f64| assert!((unit(found) - expected).abs() < 1e-7);
    let halton = plain("halton", &demand(8, 3));
    for (i, third, fifth) in [
        (1, 1.0 / 3.0, 0.2),
        (2, 2.0 / 3.0, 0.4),
        (5, 7.0 / 9.0, 1.0 / 25.0),
    ] {
        near(halton.sample_u32(at(i, 1)), third);
        near(halton.sample_u32(at(i, 2)), fifth);
    }
    let hammersley = plain("hammersley", &demand(10, 3));
    for i in 0..10 {
        near(hammersley.sample_u32(at(i, 0)), f64::from(i) / 10.0);
        assert_eq!(hammersley.sample_u32(at(i, 1)), i.reverse_bits());
        assert_eq!(hammersley.sample_u32(at(i, 2)), halton.sample_u32(at(i, 1)));
    }
    // Roberts: ½ + n (0.75487766624669276, 0.569840290998053265), n = 1, 2, …
    let r2 = sampler("r2", "none", &demand(8, 2));
    for n in 1..8 {
        for (dimension, step) in [(0, 0.754_877_666_246_692_8), (1, 0.569_840_290_998_053_3)] {
            near(
                r2.sample_u32(at(n - 1, dimension)),
                (0.5 + f64::from(n) * step).fract(),
            );
        }
    }
}

#[test]
fn hammersley_divides_exactly_at_every_number_of_samples() {
    let mut rng = Pcg::new(5);
    for count in [1, 2, 3, 7, 1000, 65_535, 65_536] {
        let sampler = sampler("hammersley", "none", &demand(count, 1));
        for i in (0..200).map(|_| rng.below(count)).chain([0, count - 1]) {
            let exact = (u64::from(i) << 32) / u64::from(count);
            assert_eq!(
                u64::from(sampler.sample_u32(at(i, 0))),
                exact,
                "{i} / {count}"
            );
        }
    }
}

#[test]
fn star_discrepancies_equal_published_values() {
    let random = star(&sampler("pixel-hash", "none", &demand(1024, 2)), 1024);
    for (sequence, expected, tolerance) in [
        ("sobol", 0.004_299_163_818_36, 1e-13),
        // Truncation moves a coordinate by less than 2^-32, and the supremum by less than 2^-31.
        ("halton", 0.006_835_937_5, 4.7e-10),
        ("hammersley", 0.004_665_374_76, 1e-11),
    ] {
        let found = star(&sampler(sequence, "none", &demand(1024, 2)), 1024);
        assert!((found - expected).abs() < tolerance, "{sequence}: {found}");
        // Random points are far worse: negative control.
        assert!(random > 2.0 * found);
    }
    for sequence in ["owen-sobol", "pmj02", "rank1-lattice", "r2"] {
        let found = star(&sampler(sequence, "none", &demand(1024, 2)), 1024);
        println!("{sequence}: D* of 1024 points {found:.6}, random {random:.6}");
        assert!(found < 0.01, "{sequence}: {found}");
    }
}

#[test]
fn owen_sobol_is_sobol_burley_to_the_bit_up_to_its_limit() {
    let owen = sampler("owen-sobol", "none", &demand(1 << 16, 256));
    let mut rng = Pcg::new(9);
    let mut coordinates: Vec<_> = (0..200_000)
        .map(|_| Coordinate {
            pixel: rng.below(1 << 20),
            sample: rng.below(1 << 16),
            dimension: rng.below(256),
            seed: rng.next_u32(),
        })
        .collect();
    coordinates.push(at(65_535, 255));
    // The crate makes its floats from the upper 23 bits.
    let bits = |c: &Coordinate| ((owen.sample_u32(*c) >> 9) as f32 * 2.0_f32.powi(-23)).to_bits();
    let burley = |c: &Coordinate, key| sobol_burley::sample(c.sample, c.dimension, key).to_bits();
    for c in &coordinates {
        assert_eq!(bits(c), burley(c, pixel_number(*c)), "{c:?}");
    }
    let other = coordinates
        .iter()
        .filter(|c| bits(c) == burley(c, pixel_number(**c) ^ 1));
    assert!(other.count() < 10, "another seed gives the same");
    let beyond = try_sampler(("owen-sobol", &[]), ("none", &[]), &demand(65_537, 2));
    assert!(
        beyond
            .err()
            .expect("beyond the limit")
            .to_string()
            .contains("65536")
    );
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
    // The crate packs three lengths of the file.
    for dimensions in [100, 1000, 21_201] {
        let sobol = sampler("sobol", "none", &demand(16, dimensions));
        let column = |d: usize| -> Vec<u32> {
            (0..32)
                .map(|bit| sobol.sample_u32(at(1 << bit, d as u32)))
                .collect()
        };
        assert!((0..32).all(|i| column(0)[i] == 1 << (31 - i)));
        let Some(file) = shared_table("joe-kuo/new-joe-kuo-6.21201") else {
            return;
        };
        let text = std::fs::read_to_string(file).expect("a readable table");
        let mut checked = 1;
        for line in text.lines().skip(1).take(dimensions as usize - 1) {
            let (dimension, expected) = direction_numbers(line);
            assert_eq!(column(dimension), expected, "dimension {dimension}");
            checked += 1;
        }
        assert_eq!(checked, dimensions);
    }
}

/// The exact radical inverse over a power of the base, truncated to a fraction of 2³².
fn exact_inverse(n: u32, base: u32, digits: &[u32]) -> u32 {
    let (mut mirrored, mut power, mut rest) = (0_u128, 1_u128, n);
    while rest > 0 {
        mirrored = mirrored * u128::from(base) + u128::from(digits[(rest % base) as usize]);
        power *= u128::from(base);
        rest /= base;
    }
    u32::try_from((mirrored << 32) / power).expect("a fraction")
}

fn indices() -> Vec<u32> {
    let mut rng = Pcg::new(7);
    let random = (0..1500).map(|i| rng.next_u32() >> (i % 32));
    let mut samples: Vec<u32> = (0..2000).chain(random).collect();
    samples.extend((0..32).flat_map(|bit| [1 << bit, (1 << bit) - 1, u32::MAX - bit]));
    samples
}

#[test]
fn halton_is_the_radical_inverse_to_the_last_bit_in_all_dimensions() {
    let samples = indices();
    for digits in ["plain", "faure", "random"] {
        let changes = [("digits", name(digits))];
        let demand = demand(16, 256);
        let halton = try_sampler(("halton", &changes), ("none", &[]), &demand).expect("halton");
        for dimension in 0..256 {
            let base = halton.table.sequence_word(2 * dimension);
            let first = halton.table.sequence_word(2 * dimension + 1);
            let permutation: Vec<u32> = match digits {
                "plain" => (0..base).collect(),
                _ => (0..base)
                    .map(|d| halton.table.sequence_word(first + d))
                    .collect(),
            };
            for &sample in &samples {
                assert_eq!(
                    halton.sample_u32(at(sample, dimension)),
                    exact_inverse(sample, base, &permutation),
                    "{digits}, base {base}, sample {sample}"
                );
            }
        }
    }
}

#[test]
fn van_der_corput_is_the_radical_inverse_to_the_last_bit_in_all_bases() {
    for base in [2, 3, 4, 6, 10, 16, 255, 256, 257, 1000, 1023, 1024] {
        let changes = [("base", ParamValue::Integer(base))];
        let corput = try_sampler(("van-der-corput", &changes), ("none", &[]), &demand(8, 1));
        let corput = corput.expect("van der Corput");
        let base = u32::try_from(base).expect("a base");
        let digits: Vec<u32> = (0..base).collect();
        for sample in indices() {
            let exact = exact_inverse(sample, base, &digits);
            assert_eq!(
                corput.sample_u32(at(sample, 0)),
                exact,
                "base {base}, sample {sample}"
            );
        }
    }
}

#[test]
fn permuted_digits_are_permutations_that_keep_zero_and_faure_s_are_the_published_ones() {
    if let Some(file) = shared_table("faure/faure_permutations_2_256.txt") {
        let text = std::fs::read_to_string(file).expect("a readable table");
        let mut checked = 0;
        for line in text.lines().filter(|line| !line.starts_with('#')) {
            let (base, digits) = line.split_once(':').expect("a base");
            let digits: Vec<u32> = digits
                .split_whitespace()
                .map(|d| d.parse().expect("a digit"))
                .collect();
            assert_eq!(
                faure_permutation(base.trim().parse().expect("a base")),
                digits,
                "{base}"
            );
            checked += 1;
        }
        assert_eq!(checked, 255);
    }
    let plain = plain("halton", &demand(16, 40));
    for digits in ["faure", "random"] {
        let changes = [("digits", name(digits))];
        let halton =
            try_sampler(("halton", &changes), ("none", &[]), &demand(16, 40)).expect("halton");
        for dimension in 0..40 {
            let base = plain.table.sequence_word(2 * dimension);
            let draw = |s: &Sampler, i| s.sample_u32(at(i, dimension));
            // The first `base` points are a permutation of the plain ones, beginning with 0.
            let set = |s: &Sampler| -> Vec<u32> { (0..base).map(|i| draw(s, i)).collect() };
            let (mut permuted, mut expected) = (set(&halton), set(&plain));
            assert_eq!(permuted[0], 0);
            assert!(
                base < 11 || permuted != expected,
                "{digits}, base {base}: nothing is permuted"
            );
            permuted.sort_unstable();
            expected.sort_unstable();
            assert_eq!(permuted, expected, "{digits}, base {base}");
        }
    }
}

#[test]
fn prefixes_of_the_lattice_are_lattices_that_hit_every_column_once() {
    let sampler = sampler("rank1-lattice", "none", &demand(1 << 16, 64));
    for m in [4, 10, 16] {
        let count = 1_u32 << m;
        for dimension in [0, 1, 7, 63] {
            let mut seen = vec![false; count as usize];
            for i in 0..count {
                let x = sampler.sample_u32(at(i, dimension));
                assert_eq!(x << m, 0, "a multiple of 1 / {count}");
                assert!(!std::mem::replace(
                    &mut seen[(x >> (32 - m)) as usize],
                    true
                ));
            }
        }
        let set: std::collections::BTreeSet<_> =
            points(&sampler, count, [0, 1]).into_iter().collect();
        let sum = |a: [u32; 2], b: [u32; 2]| [a[0].wrapping_add(b[0]), a[1].wrapping_add(b[1])];
        let first: Vec<_> = set.iter().take(50).copied().collect();
        assert!(
            first
                .iter()
                .all(|a| first.iter().all(|b| set.contains(&sum(*a, *b))))
        );
    }
    // Pairs stay far below random points, late ones from 2^10 points on: a lattice of N has at most
    // N / 4 distinct components (up to sign), so small ones repeat them.
    for (pair, levels) in [
        ([0, 1], [6, 8, 10, 12]),
        ([2, 3], [6, 8, 10, 12]),
        ([8, 9], [8, 10, 12, 14]),
        ([20, 21], [10, 11, 12, 14]),
    ] {
        for m in levels {
            let points = points(&sampler, 1 << m, pair);
            let points: Vec<_> = points.into_iter().map(|p| p.map(unit)).collect();
            let star = star_2d(&points).expect("points in the square");
            let random = 1.0 / f64::from(1_u32 << m).sqrt();
            println!("lattice {pair:?} N = 2^{m}: D* {star:.5}, of random about {random:.5}");
            assert!(star < 0.75 * random, "{pair:?} 2^{m}: {star}");
        }
    }
}
