//! Strata, random matrices, and jitter of single samples.

use super::*;

/// Number of points in each of `columns` × `rows` cells.
fn counts(points: &[[u32; 2]], [columns, rows]: [u64; 2]) -> Vec<u32> {
    let cell = |x: u32, n: u64| (u64::from(x) * n) >> 32;
    let mut counts = vec![0; (columns * rows) as usize];
    for [x, y] in points {
        counts[(cell(*y, rows) * columns + cell(*x, columns)) as usize] += 1;
    }
    counts
}

#[test]
fn jittered_points_lie_one_in_each_stratum_of_every_pair_and_pixel() {
    for (count, strata) in [
        (1, [1, 1]),
        (2, [2, 1]),
        (3, [2, 2]),
        (8, [4, 2]),
        (10, [4, 3]),
        (64, [8, 8]),
        (1000, [40, 25]),
        (1021, [32, 32]),
    ] {
        let sampler = sampler("jittered", "none", &demand(count, 8));
        for pair in [[0, 1], [2, 3], [6, 7]] {
            for pixel in [0, 7, 20_000] {
                let found = counts(&points_of(&sampler, count, pair, pixel), strata);
                assert!(found.iter().all(|n| *n <= 1), "{count} {pair:?}: {found:?}");
            }
        }
        // Another pair visits its strata in another order: there is no stratification across pairs.
        if count == 64 {
            let crossed = counts(&points_of(&sampler, count, [0, 2], 5), strata);
            assert!(crossed.iter().any(|n| *n > 1), "the test can tell");
        }
    }
}

#[test]
fn where_strata_are_more_than_samples_each_is_hit_as_often_as_others_over_pixels() {
    let sampler = sampler("jittered", "none", &demand(10, 2));
    let all: Vec<[u32; 2]> = (0..6000)
        .flat_map(|pixel| points_of(&sampler, 10, [0, 1], pixel))
        .collect();
    let found = counts(&all, [4, 3]);
    // 5000 each; the standard deviation is below 30.
    assert!(found.iter().all(|n| n.abs_diff(5000) < 150), "{found:?}");
}

#[test]
fn a_linear_scramble_is_linear_but_for_its_shift_and_a_bit_moves_none_above_it() {
    let sampler = sampler("sobol", "linear-scramble", &demand(16, 4));
    let coordinate = Coordinate {
        pixel: 12,
        seed: 5,
        ..at(0, 3)
    };
    let scrambled = |x| {
        sampler
            .decorrelation
            .decorrelate(x, &sampler.table, coordinate)
    };
    let shift = scrambled(0);
    let matrix = |x: u32| scrambled(x) ^ shift;
    let mut rng = support::Pcg::new(3);
    for _ in 0..1000 {
        let [x, y] = [rng.next_u32(), rng.next_u32()];
        assert_eq!(matrix(x ^ y), matrix(x) ^ matrix(y));
    }
    let mut below = 0;
    for bit in 0..32 {
        let column = matrix(1 << bit);
        assert_eq!(column.ilog2(), bit, "the diagonal");
        below += column.count_ones() - 1;
    }
    // Half of the 496 bits below the diagonal, ± 6 standard deviations.
    assert!(below.abs_diff(248) < 67, "{below}");
    let other = sampler.decorrelation.decorrelate(
        0x8000_0000,
        &sampler.table,
        Coordinate {
            pixel: 13,
            ..coordinate
        },
    );
    assert_ne!(
        other,
        scrambled(0x8000_0000),
        "another pixel has another matrix"
    );
}

#[test]
fn jitter_of_samples_stays_within_its_amplitude_and_differs_from_sample_to_sample() {
    let demand = demand(64, 2);
    let k = ("k", ParamValue::Number(1.0));
    let per_sample = [k.clone(), ("per", name("sample"))];
    let made = |decorrelation, changes: &[_]| {
        try_sampler(("halton", &[]), (decorrelation, changes), &demand).expect("a sampler")
    };
    let by_sample = made("micro-jitter", &per_sample);
    let by_pixel = made("micro-jitter", std::slice::from_ref(&k));
    let composed = made("cranley-patterson-micro-jitter", std::slice::from_ref(&k));
    let [plain, shifted] = ["none", "cranley-patterson"].map(|name| made(name, &[]));
    for (jittered, around, varies) in [
        (&by_sample, &plain, true),
        (&by_pixel, &plain, false),
        (&composed, &shifted, true),
    ] {
        let mut ways: Vec<i32> = (0..64)
            .map(|sample| {
                let c = Coordinate {
                    pixel: 9,
                    ..at(sample, 1)
                };
                jittered.sample_u32(c).wrapping_sub(around.sample_u32(c)) as i32
            })
            .collect();
        // μ = 1/8.
        let farthest = ways.iter().map(|w| w.unsigned_abs()).max().unwrap_or(0);
        assert!(farthest <= 1 << 29, "{}: {farthest}", jittered.label());
        ways.sort_unstable();
        ways.dedup();
        assert_eq!(ways.len() > 32, varies, "{}", jittered.label());
    }
}

#[test]
fn what_is_said_of_new_samplers_is_so() {
    let registry = SamplerRegistry::default();
    let is_unbiased = |sequence: &str, decorrelation: &str| {
        let sequence = variant(&registry.sequence_entries(), sequence, &[]);
        let decorrelation = variant(&registry.decorrelation_entries(), decorrelation, &[]);
        registry.is_unbiased(&sequence, &decorrelation)
    };
    assert!(is_unbiased("jittered", "none") && is_unbiased("sobol", "linear-scramble"));
    assert!(is_unbiased("halton", "cranley-patterson-micro-jitter"));
    assert!(!is_unbiased("halton", "micro-jitter"));
    assert!(sampler("jittered", "none", &demand(8, 2)).by_count());
    for (sequence, decorrelation, says) in [
        ("halton", "linear-scramble", "base 2"),
        ("jittered", "cranley-patterson", "nothing to decorrelate"),
    ] {
        let refused = try_sampler((sequence, &[]), (decorrelation, &[]), &demand(8, 2));
        let message = refused.err().expect("it was accepted").to_string();
        assert!(message.contains(says), "{message}");
    }
}
