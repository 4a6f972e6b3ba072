//! Effect of decorrelations on points, and the distribution of random numbers.

use super::*;

/// χ² of 64 equal bins; its mean is 63, and 130 is six standard deviations above it.
fn chi_squared(values: impl Iterator<Item = u32>) -> f64 {
    let mut bins = [0_u32; 64];
    let mut count = 0.0;
    for x in values {
        bins[(x >> 26) as usize] += 1;
        count += 1.0;
    }
    let expected = count / 64.0;
    bins.iter()
        .map(|&n| (f64::from(n) - expected).powi(2) / expected)
        .sum()
}

const ACCIDENT: f64 = 130.0;

fn over_pixels(sampler: &Sampler, sample: u32, dimension: u32) -> impl Iterator<Item = u32> {
    (0..1 << 16).map(move |pixel| {
        sampler.sample_u32(Coordinate {
            pixel,
            seed: 3,
            ..at(sample, dimension)
        })
    })
}

#[test]
fn numbers_are_uniform_over_pixels_where_a_scheme_promises_it() {
    let demand = demand(64, 4);
    let hash = |hash: &str| {
        let changes = [("hash", name(hash))];
        try_sampler(("pixel-hash", &changes), ("none", &[]), &demand).expect("a sampler")
    };
    let mut samplers = vec![hash("pcg"), hash("wang")];
    for (sequence, decorrelation) in [
        ("owen-sobol", "none"),
        ("sobol", "owen-hash"),
        ("sobol", "digital-shift"),
        ("pmj02", "digital-shift"),
        ("halton", "cranley-patterson"),
        ("rank1-lattice", "cranley-patterson"),
        ("halton", "index-offset"),
        ("sobol", "blue-noise"),
        ("jittered", "none"),
        ("sobol", "linear-scramble"),
        ("halton", "cranley-patterson-micro-jitter"),
    ] {
        samplers.push(sampler(sequence, decorrelation, &demand));
    }
    for sampler in &samplers {
        for (sample, dimension) in [(0, 0), (1, 1), (17, 2), (63, 3)] {
            let found = chi_squared(over_pixels(sampler, sample, dimension));
            assert!(
                found < ACCIDENT,
                "{} {sample} {dimension}: {found}",
                sampler.label()
            );
        }
    }
    // One point for all pixels is not uniform, nor is a rotated disc: negative controls.
    for (decorrelation, dimension) in [("none", 1), ("disc-rotation", 2)] {
        let sampler = sampler("halton", decorrelation, &demand);
        assert!(chi_squared(over_pixels(&sampler, 17, dimension)) > ACCIDENT);
    }
}

#[test]
fn two_numbers_of_a_pixel_are_independent_over_pixels() {
    let demand = demand(64, 4);
    for (sequence, decorrelation) in [
        ("pixel-hash", "none"),
        ("halton", "cranley-patterson"),
        ("sobol", "owen-hash"),
    ] {
        let sampler = sampler(sequence, decorrelation, &demand);
        let pairs = over_pixels(&sampler, 5, 0).zip(over_pixels(&sampler, 5, 1));
        let cells = pairs.map(|(x, y)| (x >> 29) << 29 | (y >> 29) << 26);
        assert!(chi_squared(cells) < ACCIDENT, "{}", sampler.label());
    }
    let sampler = sampler("pixel-hash", "none", &demand);
    let same = over_pixels(&sampler, 5, 0).map(|x| (x >> 29) << 29 | (x >> 29) << 26);
    assert!(chi_squared(same) > ACCIDENT, "the test can tell");
}

#[test]
fn the_trigonometric_hash_is_the_negative_control_it_is_meant_to_be() {
    // Two 8-bit numbers, over neighbouring pixels: the sine repeats its pattern.
    let changes = [("hash", name("trig"))];
    let sampler =
        try_sampler(("pixel-hash", &changes), ("none", &[]), &demand(4, 4)).expect("a sampler");
    let pairs = over_pixels(&sampler, 0, 0).zip(over_pixels(&sampler, 1, 0));
    let cells = pairs.map(|(x, y)| (x >> 29) << 29 | (y >> 29) << 26);
    println!("trig: chi squared of pairs {:.1}", chi_squared(cells));
    let one = chi_squared(over_pixels(&sampler, 0, 0));
    println!("trig: chi squared {one:.1}");
    assert!(one < 1000.0, "not even roughly uniform: {one}");
}

#[test]
fn micro_jitter_stays_within_its_amplitude_and_is_biased_only_where_it_stops_at_edges() {
    let demand = demand(64, 2);
    let mean = |edge: &str| {
        let changes = [("edge", name(edge)), ("k", ParamValue::Number(1.0))];
        let plain = sampler("halton", "none", &demand);
        let moved =
            try_sampler(("halton", &[]), ("micro-jitter", &changes), &demand).expect("a sampler");
        let mut sum = 0.0;
        for pixel in 0..4096 {
            for sample in 0..64 {
                let x = moved.sample_u32(Coordinate {
                    pixel,
                    ..at(sample, 1)
                });
                let way = x.wrapping_sub(plain.sample_u32(at(sample, 1))) as i32;
                assert!(
                    f64::from(way.unsigned_abs()) <= 2.0_f64.powi(32) / 8.0,
                    "{edge} {way}"
                );
                // A function with a peak at the edge detects points that accumulate there.
                sum += f64::from(x == u32::MAX || x == 0);
            }
        }
        sum / (4096.0 * 64.0)
    };
    // With μ = 1/8, a point at distance d < μ of an edge is clamped with probability (μ − d) / 2μ:
    // about μ / 4 of all points at each of two edges.
    let stopped = mean("clamp");
    assert!((stopped - 1.0 / 16.0).abs() < 0.01, "{stopped}");
    assert_eq!(mean("wrap"), 0.0);
}

#[test]
fn micro_jitter_with_few_samples_is_a_full_shift() {
    let few = sampler("halton", "micro-jitter", &demand(25, 2));
    assert!(chi_squared(over_pixels(&few, 3, 1)) < ACCIDENT);
    let many = sampler("halton", "micro-jitter", &demand(64, 2));
    assert!(chi_squared(over_pixels(&many, 3, 1)) > ACCIDENT);
}

#[test]
fn disc_rotation_turns_angles_and_keeps_radii() {
    let plain = sampler("sobol", "none", &demand(16, 4));
    let turned = sampler("sobol", "disc-rotation", &demand(16, 4));
    let shift = |sample, dimension| {
        let c = Coordinate {
            pixel: 5,
            ..at(sample, dimension)
        };
        turned.sample_u32(c).wrapping_sub(plain.sample_u32(c))
    };
    assert!((0..16).all(|i| shift(i, 2) == 0 && shift(i, 3) == shift(0, 3)));
    assert!(shift(0, 3) != 0 && shift(0, 1) != shift(0, 3));
}

#[test]
fn index_offset_takes_later_points_of_the_sequence() {
    let plain = sampler("halton", "none", &demand(16, 2));
    let offset = [("offsets", ParamValue::Integer(100))];
    let moved =
        try_sampler(("halton", &[]), ("index-offset", &offset), &demand(16, 2)).expect("a sampler");
    let draw =
        |s: &Sampler, pixel, i| [0, 1].map(|d| s.sample_u32(Coordinate { pixel, ..at(i, d) }));
    let mut offsets: Vec<u32> = (0..1000)
        .map(|pixel| {
            let found = (0..100)
                .find(|&u| (0..16).all(|i| draw(&moved, pixel, i) == draw(&plain, pixel, i + u)));
            found.expect("an offset below 100")
        })
        .collect();
    offsets.sort_unstable();
    offsets.dedup();
    assert!(offsets.len() > 90, "{} offsets", offsets.len());
}

#[test]
fn sample_seeding_makes_all_pixels_draw_the_same_and_seeds_still_count() {
    let shared = [("seeding", name("sample"))];
    let registry = SamplerRegistry::default();
    let has_seeding =
        |schema: &raystone::params::ParameterSchema| schema.iter().any(|p| p.name == "seeding");
    let mut made = Vec::new();
    for sequence in registry
        .sequences
        .iter()
        .filter(|s| has_seeding(&s.entry.schema))
    {
        made.push(try_sampler(
            (sequence.name(), &shared),
            ("none", &[]),
            &demand(16, 4),
        ));
    }
    for decorrelation in registry
        .decorrelations
        .iter()
        .filter(|d| has_seeding(&d.entry.schema))
    {
        made.push(try_sampler(
            ("sobol", &[]),
            (decorrelation.name(), &shared),
            &demand(16, 4),
        ));
    }
    assert!(made.len() >= 8, "{} entries with a seeding", made.len());
    for sampler in made {
        let sampler = sampler.unwrap_or_else(|e| panic!("{e}"));
        let draw = |pixel, seed| -> Vec<u32> {
            let one = |i| {
                sampler.sample_u32(Coordinate {
                    pixel,
                    seed,
                    ..at(i / 4, i % 4)
                })
            };
            (0..64_u32).map(one).collect()
        };
        assert_eq!(draw(0, 1), draw(12_345, 1), "{}", sampler.label());
        assert_ne!(draw(0, 1), draw(0, 2), "{}", sampler.label());
    }
    let apart = sampler("pixel-hash", "none", &demand(16, 4));
    let draw = |pixel| apart.sample_u32(Coordinate { pixel, ..at(0, 0) });
    assert_ne!(draw(0), draw(1));
}

#[test]
fn pixels_of_a_group_draw_the_same_and_neighbours_of_a_sparse_one_do_not() {
    let registry = SamplerRegistry::default();
    let names: Vec<&str> = (registry.decorrelations.iter())
        .filter(|d| d.entry.schema.iter().any(|p| p.name == "seeding"))
        .map(|d| d.name())
        .collect();
    assert!(names.len() >= 5, "{names:?}");
    let same_as_first = |seeding: &'static str, decorrelation: &str| -> Vec<[u32; 2]> {
        let seeded = [("seeding", name(seeding))];
        let made = try_sampler(("sobol", &[]), (decorrelation, &seeded), &demand(16, 4));
        let sampler = made.unwrap_or_else(|e| panic!("{e}"));
        let draw = |[x, y]: [u32; 2]| {
            let pixel = y * WIDTH + x;
            let one = |i| {
                sampler.sample_u32(Coordinate {
                    pixel,
                    ..at(i / 4, i % 4)
                })
            };
            (0..64_u32).map(one).collect::<Vec<u32>>()
        };
        // From a pixel in the second tile on.
        let first = draw([67, 66]);
        let places = (0..64).flat_map(|y| (0..64).map(move |x| [64 + x, 64 + y]));
        places.filter(|place| draw(*place) == first).collect()
    };
    let grid = |from: [u32; 2], step: usize| -> Vec<[u32; 2]> {
        let along = move |from: u32| (from..).step_by(step).take(8);
        along(from[1])
            .flat_map(|y| along(from[0]).map(move |x| [x, y]))
            .collect()
    };
    for decorrelation in names {
        assert_eq!(
            same_as_first("workgroup", decorrelation),
            grid([64, 64], 1),
            "{decorrelation}"
        );
        assert_eq!(
            same_as_first("sparse", decorrelation),
            grid([67, 66], 8),
            "{decorrelation}"
        );
    }
    let unknown = Demand {
        width: None,
        ..demand(16, 4)
    };
    let seeded = [("seeding", name("sparse"))];
    let made = try_sampler(("sobol", &[]), ("owen-hash", &seeded), &unknown);
    let reason = made.err().expect("a refusal").to_string();
    assert!(reason.contains("width"), "{reason}");
}

#[test]
fn the_dither_mask_has_every_step_once_and_little_power_at_low_frequencies() {
    let plain = sampler("sobol", "none", &demand(1, 1));
    let dithered = sampler("sobol", "blue-noise", &demand(1, 1));
    let white = sampler("sobol", "cranley-patterson", &demand(1, 1));
    let field = |s: &Sampler| -> Vec<u32> {
        let pixel = |i: u32| i % 64 + i / 64 * WIDTH;
        let zero = plain.sample_u32(at(0, 0));
        (0..64 * 64)
            .map(|i| {
                s.sample_u32(Coordinate {
                    pixel: pixel(i),
                    ..at(0, 0)
                })
                .wrapping_sub(zero)
            })
            .collect()
    };
    let mut steps = field(&dithered);
    steps.sort_unstable();
    assert!(steps.iter().enumerate().all(|(i, &x)| x >> 20 == i as u32));
    // Power of the means of blocks of 8×8 pixels.
    let power = |s: &Sampler| -> f64 {
        let field = field(s);
        let mean = |block: usize| -> f64 {
            let (x, y) = (block % 8 * 8, block / 8 * 8);
            (0..64)
                .map(|i| unit(field[(y + i / 8) * 64 + x + i % 8]))
                .sum::<f64>()
                / 64.0
        };
        (0..64).map(|block| (mean(block) - 0.5).powi(2)).sum()
    };
    let (blue, white) = (power(&dithered), power(&white));
    println!("power of block means: mask {blue:.2e}, white {white:.2e}");
    assert!(blue < 0.1 * white, "{blue} against {white}");
}

#[test]
fn cranley_patterson_keeps_differences_and_shifts_each_pixel_and_dimension_on_its_own() {
    for sequence in ["halton", "sobol"] {
        let plain = sampler(sequence, "none", &demand(4, 32));
        let moved = sampler(sequence, "cranley-patterson", &demand(4, 32));
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

/// Number of pairs of neighbouring words that occur twice; sequences restart in each of `runs`.
fn repeated_pairs(runs: impl Iterator<Item = Vec<u32>>) -> usize {
    let mut pairs: Vec<u64> = Vec::new();
    for run in runs {
        pairs.extend(
            run.windows(2)
                .map(|w| u64::from(w[0]) << 32 | u64::from(w[1])),
        );
    }
    pairs.sort_unstable();
    pairs.windows(2).filter(|w| w[0] == w[1]).count()
}

/// The samplers whose words are random in all 32 bits.
fn random_samplers() -> Vec<Sampler> {
    let demand = demand(64, 4);
    let hash = |hash: &str| {
        let changes = [("hash", name(hash))];
        try_sampler(("pixel-hash", &changes), ("none", &[]), &demand).expect("a sampler")
    };
    let others = [
        ("owen-sobol", "none"),
        ("sobol", "owen-hash"),
        ("sobol", "digital-shift"),
        ("halton", "cranley-patterson"),
        ("jittered", "none"),
        ("sobol", "linear-scramble"),
    ];
    let others = others.map(|(sequence, scheme)| sampler(sequence, scheme, &demand));
    [hash("pcg"), hash("wang")]
        .into_iter()
        .chain(others)
        .collect()
}

#[test]
fn no_seed_draws_a_shifted_run_of_another_over_pixels_dimensions_or_samples() {
    // With hash(pixel + hash(seed)), an expected 3.4 of these pairs would share a run of pixels.
    let seeds =
        (0..1800_u32).chain((0..900_u32).map(|i| (1 << 31) + 0x9e37_79b9_u32.wrapping_mul(i)));
    for sampler in random_samplers() {
        let run = |seed| {
            let word = |pixel| {
                sampler.sample_u32(Coordinate {
                    pixel,
                    seed,
                    ..at(1, 1)
                })
            };
            (0..2048).map(word).collect()
        };
        assert_eq!(
            repeated_pairs(seeds.clone().map(run)),
            0,
            "{}",
            sampler.label()
        );
    }
    // Within a seed pixels are independent keys, over their samples and over their dimensions.
    for sampler in &random_samplers()[..2] {
        let pixels = || (0..1_u32 << 14).map(|pixel| 1 + pixel * 3);
        let samples = |pixel| {
            let word = |i| {
                sampler.sample_u32(Coordinate {
                    pixel,
                    seed: 5,
                    ..at(i, 1)
                })
            };
            (0..128).map(word).collect()
        };
        assert_eq!(
            repeated_pairs(pixels().map(samples)),
            0,
            "{}",
            sampler.label()
        );
        let dimensions = |pixel| {
            let word = |d| {
                sampler.sample_u32(Coordinate {
                    pixel,
                    seed: 5,
                    ..at(1, d)
                })
            };
            (0..128).map(word).collect()
        };
        assert_eq!(
            repeated_pairs(pixels().map(dimensions)),
            0,
            "{}",
            sampler.label()
        );
    }
}

#[test]
fn seeds_that_differ_in_their_last_bit_draw_different_numbers() {
    for sampler in random_samplers() {
        for k in (0..4000_u32).chain((0..4000_u32).map(|i| i.wrapping_mul(0x85eb_ca6b) >> 1)) {
            let words = |seed| {
                (0..3).map(move |pixel| Coordinate {
                    pixel,
                    seed,
                    ..at(1, 1)
                })
            };
            let draw = |seed| -> Vec<u32> { words(seed).map(|c| sampler.sample_u32(c)).collect() };
            assert_ne!(draw(2 * k), draw(2 * k + 1), "{}: {k}", sampler.label());
        }
    }
}
